"""The cheapest collision-free team of co-evolving populations, exactly.

A team has one individual of every population; for two populations it is a pair. Nothing is random
and every tie is settled by an order.

Arrays that all functions of teams share, for P ≥ 2 populations of N individuals:

- collisions  # (pairs of populations, N, N) integers, pairs in the order (0, 1), (0, 2), …, (1,
  2), …: how often individual i of the first population of a pair collides with individual j of the
  second.
- own  # (P, N) cost of an individual whoever its collaborators are; inf is allowed, NaN is not.
  Summed in the order of the populations.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray

CollisionCounts = NDArray[np.integer[Any]]  # short integers, where they are many


class BestTeam(NamedTuple):
    """The cheapest team without a collision."""

    # (P,) index of the member in each population; −1 if there is no such team
    individuals: IntArray
    cost: float  # sum of the members' own costs; inf if there is no such team

    @property
    def found(self) -> bool:
        """Whether there is such a team."""
        return bool(self.cost < np.inf)


@kernel
def pair_index(num: int, first: int, second: int) -> int:
    """Return the place of populations first < second of `num` in the order of pairs."""
    return first * (2 * num - first - 1) // 2 + second - first - 1


@kernel
def sort_by_cost(own: FloatArray) -> IntArray:
    """Return (P, N) the individuals of each population by own cost, equal ones by index."""
    order = np.empty(own.shape, dtype=np.int64)
    for p in range(len(own)):
        order[p] = np.argsort(own[p], kind="mergesort")  # stable
    return order


@kernel
def best_team(collisions: CollisionCounts, own: FloatArray) -> BestTeam:
    """Search all teams without a collision for the lowest sum of own costs; exact.

    Of teams with the same sum, the one whose indices come first in lexicographic order, population
    0 leading. A team of infinite cost is none.

    Depth first, the cheapest first, with bounds. These are summed in the order of the populations
    like the costs themselves, so rounding cannot make one too high. Where a bound only equals the
    best cost, a branch is worth it if its indices come first in lexicographic order.

    Raises:
        ValueError: If the shapes contradict each other.
    """
    num, count = own.shape
    if num < 2 or collisions.shape != (num * (num - 1) // 2, count, count):
        raise ValueError("collisions and costs do not match")
    order, team = sort_by_cost(own), np.full(num, -1)
    ranks, trial, partial = np.zeros(num, dtype=np.int64), np.full(num, -1), np.zeros(num + 1)
    best, level = np.inf, 0
    while level >= 0:
        # the next individual of this level, and the least cost that a team with it can have
        exhausted = ranks[level] == count
        if not exhausted:
            trial[level] = order[level, ranks[level]]
            partial[level + 1] = partial[level] + own[level, trial[level]]
            bound = partial[level + 1]
            for p in range(level + 1, num):
                bound += own[p, order[p, 0]]
            exhausted = bound > best
        # of equal costs the first in lexicographic order, as far as the trial is known
        p = 0
        while p < level and trial[p] == team[p]:
            p += 1
        comes_first = trial[p] < team[p] if trial[p] != team[p] else level < num - 1
        # back, deeper, or a better team
        if exhausted:
            level -= 1
        elif (bound < best or comes_first) and fits(collisions, trial, level):
            if level < num - 1:
                level += 1
                ranks[level] = 0
                continue
            best = bound
            team[:] = trial
        if level >= 0:
            ranks[level] += 1
    return BestTeam(team, best)


@kernel
def fits(collisions: CollisionCounts, trial: IntArray, level: int) -> bool:
    """Return whether the member of trial (P,) at `level` collides with none of those before it."""
    free = True
    for p in range(level):
        free &= collisions[pair_index(len(trial), p, level), trial[p], trial[level]] == 0
    return free
