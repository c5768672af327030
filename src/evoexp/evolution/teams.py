"""Teams of co-evolving populations: the cheapest one, and the hall of fame (Curkovic et al. 2013).

A team has one individual of every population; for two populations it is a pair. Its key is
(collisions within the team, sum of its members' own costs): lower is better. Nothing is random and
every tie is settled by an order: the next hall takes candidates by key; among equals the present
hall's own come first, in their order, then the new ones in the order of `gather_teams`, then the
best team of all.

Arrays that all functions of teams share, for P ≥ 2 populations of N individuals:

- collisions  # (pairs of populations, N, N) integers, pairs in the order (0, 1), (0, 2), …, (1,
  2), …: how often individual i of the first population of a pair collides with individual j of the
  second.
- own  # (P, N) cost of an individual whoever its collaborators are; inf is allowed, NaN is not.
  Summed in the order of the populations.
- front  # (P, N) bool: the non-dominated individuals of each population.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import kernel
from evoexp.records import BoolArray, FloatArray, IntArray

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
    """
    num, count = own.shape
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


class Hall(NamedTuple):
    """The teams that are kept, best first unless some stay for another reason than their key."""

    teams: IntArray  # (teams, P) index of the member in each population
    ages: IntArray  # (teams,) generations since each team entered
    num_teams: IntArray  # (1,) how many teams there are at present; there is room for more


class HallRules(NamedTuple):
    """Which teams a hall takes."""

    # A team that entered more than this many generations ago is taken only where no new team can
    # be; the same team formed again is not new. 0: no such rule.
    memory: int
    # whether the hall's teams stay, and new ones only fill free places. Overrides `memory`.
    frozen: bool
    exclusive: BoolArray  # (P,) whether an individual of a population may be in one team only


@kernel
def rate_team(collisions: CollisionCounts, own: FloatArray, team: IntArray) -> tuple[int, float]:
    """Return the key of a team (P,): collisions within it, and the sum of its own costs."""
    num, hits, cost = len(team), 0, 0.0
    for p in range(num):
        cost += own[p, team[p]]
        for other in range(p):
            hits += collisions[pair_index(num, other, p), team[other], team[p]]
    return hits, cost


@kernel
def choose_collaborator(
    collisions: CollisionCounts, team: IntArray, seed: int, population: int, order: IntArray
) -> int:
    """Return the individual of a population with the fewest collisions with a team (P,).

    The team is known of population `seed`, that of the member it is formed around, and of all
    before this one. `order` (N,) are the individuals, the cheapest first; the first of equals is
    chosen.
    """
    num, chosen, fewest = len(team), order[0], -1
    for k in range(len(order)):
        candidate, hits = order[k], 0
        for q in range(population):
            hits += collisions[pair_index(num, q, population), team[q], candidate]
        if seed > population:
            hits += collisions[pair_index(num, population, seed), candidate, team[seed]]
        if fewest < 0 or hits < fewest:
            chosen, fewest = candidate, hits
        if hits == 0:
            break
    return int(chosen)


@kernel
def gather_teams(
    collisions: CollisionCounts,  # (pairs, N, N)
    own: FloatArray,  # (P, N)
    front: BoolArray,  # (P, N) the non-dominated individuals
    # (≥ members of the fronts, P) written in the order of the members that teams were formed
    # around: population by population, index by index
    teams: IntArray,
) -> int:
    """Give every member of a front its best collaborators; return how many teams there are.

    They are chosen population by population, in order of index: the fewest collisions with all who
    are in the team already, then the lowest own cost, then the lowest index. A team may come up
    several times.
    """
    (num, count), order, filled = own.shape, sort_by_cost(own), 0
    for p in range(num):
        for i in range(count):
            if not front[p, i]:
                continue
            team = teams[filled]
            team[p] = i
            for other in range(num):
                if other != p:
                    team[other] = choose_collaborator(collisions, team, p, other, order[other])
            filled += 1
    return filled


@kernel
def renew_hall(
    collisions: CollisionCounts,  # (pairs, N, N); keys of old teams are computed anew
    own: FloatArray,  # (P, N)
    front: BoolArray,  # (P, N) the non-dominated individuals
    hall: Hall,  # rewritten
    # (P,) the best team of all, offered to the hall even if none of its members is on a front; −1:
    # none is offered
    best: IntArray,
    rules: HallRules,  # which teams the hall takes
) -> None:
    """Choose the next hall: the best of its teams and of those formed around the fronts."""
    num_teams = hall.num_teams[0]
    # candidates: the hall's own teams, one per member of a front, the best of all
    most = num_teams + np.count_nonzero(front) + (1 if best[0] >= 0 else 0)
    pool = np.empty((most, len(own)), dtype=np.int64)
    ages, ranks = np.zeros(most, dtype=np.int64), np.zeros(most, dtype=np.int64)
    hits, costs = np.empty(most, dtype=np.int64), np.empty(most)
    for k in range(num_teams):
        pool[k], ages[k] = hall.teams[k], hall.ages[k] + 1
        if rules.frozen:
            ranks[k] = k - num_teams  # before all new ones, in the order they have
        elif 0 < rules.memory < ages[k]:
            ranks[k] = 1  # behind all new ones
    gather_teams(collisions, own, front, pool[num_teams:])
    if best[0] >= 0:
        pool[most - 1] = best
    for k in range(most):
        hits[k], costs[k] = rate_team(collisions, own, pool[k])
    # those that can still be taken, in order: a team of the hall formed again is not new
    left, num_left = np.empty(most, dtype=np.int64), 0
    for k in range(most):
        left[num_left] = k
        num_left += 0 if k >= num_teams and is_among(pool[k], hall.teams, num_teams) else 1
    # the best by rank and key, again and again; whoever shares a member with it is out
    held = 0
    while held < len(hall.teams) and num_left > 0:
        taken = left[0]
        for k in left[1:num_left]:
            if (ranks[k], hits[k], costs[k]) < (ranks[taken], hits[taken], costs[taken]):
                taken = k
        hall.teams[held], hall.ages[held] = pool[taken], ages[taken]
        num_left = drop_rivals(pool, hall.teams[held], rules.exclusive, left, num_left)
        held += 1
    hall.num_teams[0] = held


@kernel
def is_among(team: IntArray, teams: IntArray, num_teams: int) -> bool:
    """Return whether a team (P,) is one of the first `num_teams` of teams (≥ num_teams, P)."""
    for k in range(num_teams):
        same = True
        for p in range(len(team)):
            same &= team[p] == teams[k, p]
        if same:
            return True
    return False


@kernel
def drop_rivals(
    pool: IntArray, team: IntArray, exclusive: BoolArray, left: IntArray, num_left: int
) -> int:
    """Remove candidates that share a member with a team (P,) from `left`; return how many stay.

    In populations that are not exclusive members may be shared.
    """
    kept = 0
    for c in range(num_left):
        shares = False
        for p in range(len(team)):
            shares |= exclusive[p] and pool[left[c], p] == team[p]
        left[kept] = left[c]
        kept += 0 if shares else 1
    return kept
