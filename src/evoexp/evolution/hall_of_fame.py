"""The hall of fame of co-evolving populations: the best teams of collaborators (Curkovic et al.

2013, section 3).

A team has one individual of every population; for two populations it is a pair. Its key is
(collisions within the team, sum of its members' own costs): lower is better. Nothing is random and
every tie is settled by an order.

Arrays that all functions share, for P ≥ 2 populations of N individuals:

- collisions  # (pairs of populations, ≥ N, ≥ N) integers, pairs in the order (0, 1), (0, 2), …, (1,
  2), …: how often individual i of the first population of a pair collides with individual j of the
  second.
- own  # (P, ≥ N) what an individual costs whoever its collaborators are; inf is allowed, NaN is
  not. Summed in the order of the populations.
- front  # (P, ≥ N) bool: the non-dominated individuals of each population.
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray


class Teams(NamedTuple):
    """Teams and their keys.

    Attributes:
        teams: (teams, P) index of the member in each population.
        collisions: (teams,) colliding configurations within each team.
        costs: (teams,) sum of the members' own costs.
    """

    teams: np.ndarray
    collisions: np.ndarray
    costs: FloatArray


class Hall(NamedTuple):
    """The teams that are kept, best first unless some are kept for another reason than their key.

    Attributes:
        teams: (teams, P) index of the member in each population.
        ages: (teams,) generations since each team entered.
        collisions: (teams,) colliding configurations within each team.
        costs: (teams,) sum of the members' own costs.
    """

    teams: np.ndarray
    ages: np.ndarray
    collisions: np.ndarray
    costs: FloatArray

    @classmethod
    def empty(cls, num_populations: int) -> "Hall":
        """Return a hall without teams."""
        none = np.empty(0, dtype=np.int64)
        return cls(np.empty((0, num_populations), dtype=np.int64), none, none.copy(), np.empty(0))

    @property
    def num_teams(self) -> int:
        """How many teams there are."""
        return len(self.teams)

    def moved(self, first: int) -> "Hall":
        """Return the hall as it lies in the next populations.

        In each of them the k-th team's member at first + k.
        """
        teams = np.empty_like(self.teams)
        teams[:] = np.arange(first, first + self.num_teams)[:, np.newaxis]
        return self._replace(teams=teams)


class BestTeam(NamedTuple):
    """The cheapest team without a collision.

    Attributes:
        individuals: (P,) index of the member in each population; −1 if there is no such team.
        cost: Sum of the members' own costs; inf if there is no such team.
    """

    individuals: np.ndarray
    cost: float

    @property
    def found(self) -> bool:
        """Whether there is such a team."""
        return bool(self.cost < np.inf)


def form_teams(collisions: np.ndarray, own: FloatArray, front: np.ndarray) -> Teams:
    """Give every member of a front its best collaborators.

    They are chosen population by population, in order of index: the fewest collisions with all who
    are in the team already, then the lowest own cost, then the lowest index.

    Returns:
        The teams in the order of the members they were formed around: population by population,
        index by index. A team may come up several times.

    Raises:
        ValueError: If the shapes contradict each other.
    """
    _check(collisions, own, front.shape)
    most = int(np.count_nonzero(front))
    formed = Teams(
        np.empty((most, len(own)), dtype=np.int64), np.empty(most, dtype=np.int64), np.empty(most)
    )
    gather_teams(collisions, own, front, own.shape[1], *formed)
    return formed


def update_hall(
    collisions: np.ndarray,
    own: FloatArray,
    front: np.ndarray,
    hall: Hall,
    depth: int,
    memory: int | None = None,
    frozen: bool = False,
) -> Hall:
    """Choose the next hall: the best of its teams and of those formed around the fronts.

    Candidates are taken by key; among equals the hall's own come first, in their order, then the
    new ones in the order of `form_teams`. Nobody is in two teams. Keys of old teams are computed
    anew from the arrays given.

    Args:
        collisions: See the module.
        own: See the module.
        front: See the module.
        hall: The present one, its members' places in the present populations.
        depth: Most teams that it holds.
        memory: A team that entered more than this many generations ago is taken only where no new
            team can be; the same team formed again is not new. None: no such rule.
        frozen: Whether the hall's teams stay, and new ones only fill what is free. Overrides
            `memory`.

    Returns:
        The next hall, at most `depth` teams, ages counted on; its members' places are in the
        present populations.

    Raises:
        ValueError: If the shapes contradict each other or the hall is larger than `depth`.
    """
    _check(collisions, own, front.shape)
    if hall.teams.shape[1] != len(own) or hall.num_teams > depth:
        raise ValueError(
            f"a hall of {hall.teams.shape} is not one of at most {depth} teams of {len(own)}"
        )
    teams, ages = np.empty((depth, len(own)), dtype=np.int64), np.empty(depth, dtype=np.int64)
    teams[: hall.num_teams], ages[: hall.num_teams] = hall.teams, hall.ages
    hits, costs = np.empty(depth, dtype=np.int64), np.empty(depth)
    count, limit = own.shape[1], memory or 0
    held = renew_hall(
        collisions, own, front, count, teams, ages, hall.num_teams, limit, frozen, hits, costs
    )
    return Hall(teams[:held], ages[:held], hits[:held], costs[:held])


def best_team(collisions: np.ndarray, own: FloatArray) -> BestTeam:
    """Search all teams without a collision for the lowest sum of own costs; exact.

    Of teams with the same sum, the one whose indices come first in lexicographic order, population
    0 leading. A team of infinite cost is none.

    Raises:
        ValueError: If the shapes contradict each other.
    """
    _check(collisions, own, own.shape)
    team = np.empty(len(own), dtype=np.int64)
    cost = find_best_team(collisions, own, own.shape[1], team)
    return BestTeam(team, float(cost))


def _check(collisions: np.ndarray, own: FloatArray, front_shape: tuple[int, ...]) -> None:
    num, count = own.shape
    enough = collisions.ndim == 3 and min(collisions.shape[1:]) >= count
    if num < 2 or front_shape != own.shape or not enough or len(collisions) != num * (num - 1) // 2:
        raise ValueError(
            f"collisions {collisions.shape}, costs {own.shape} and front {front_shape} do not match"
        )


@kernel
def pair_index(num, first, second):  # type: ignore[no-untyped-def]
    """Return where populations first < second of `num` stand in the order (0, 1), (0, 2), …, (1.

    2), ….
    """
    return first * (2 * num - first - 1) // 2 + second - first - 1


@kernel
def rate_team(collisions, own, team):  # type: ignore[no-untyped-def]
    """Return the key of a team (P,).

    Collisions within it, and the sum of its members' own costs.
    """
    num, hits, cost = len(team), 0, 0.0
    for p in range(num):
        cost += own[p, team[p]]
        for other in range(p):
            hits += collisions[pair_index(num, other, p), team[other], team[p]]
    return hits, cost


@kernel
def sort_by_cost(own, count):  # type: ignore[no-untyped-def]
    """Return (P, N) the individuals of each population by own cost, equal ones by index."""
    order = np.empty((len(own), count), dtype=np.int64)
    for p in range(len(own)):
        order[p] = np.argsort(own[p, :count], kind="mergesort")  # stable
    return order


@kernel
def choose_collaborator(collisions, team, seed, population, order):  # type: ignore[no-untyped-def]
    """Return who of a population, tried in `order`.

    N,), has the fewest collisions with those already in a team (P,.

    These are the member of population `seed` and those of all populations before this one.
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
    return chosen


@kernel
def gather_teams(collisions, own, front, count, teams, team_collisions, team_costs):  # type: ignore[no-untyped-def]
    """The kernel of `form_teams`, for other kernels, on the first `count` individuals.

    Writes teams (≥ members of fronts, P), team_collisions and team_costs (≥ members of fronts,);
    returns how many.
    """
    num, filled = len(own), 0
    order = sort_by_cost(own, count)
    for p in range(num):
        for i in range(count):
            if not front[p, i]:
                continue
            team = teams[filled]
            team[p] = i
            for other in range(num):
                if other != p:
                    team[other] = choose_collaborator(collisions, team, p, other, order[other])
            team_collisions[filled], team_costs[filled] = rate_team(collisions, own, team)
            filled += 1
    return filled


@kernel
def renew_hall(  # type: ignore[no-untyped-def]
    collisions,
    own,
    front,
    count,
    teams,
    ages,
    num_teams,
    memory,
    frozen,
    team_collisions,
    team_costs,
):
    """The kernel of `update_hall`, for other kernels, on the first `count` individuals.

    Teams (depth, P) and ages (depth,) are read up to `num_teams` and rewritten; team_collisions and
    team_costs (depth,) are written. A `memory` of 0 is no rule. Returns how many teams the hall
    holds then.
    """
    most = num_teams
    for p in range(len(own)):
        for i in range(count):
            most += 1 if front[p, i] else 0
    pool, pool_ages = np.empty((most, len(own)), dtype=np.int64), np.zeros(most, dtype=np.int64)
    ranks, hits, costs = (
        np.zeros(most, dtype=np.int64),
        np.empty(most, dtype=np.int64),
        np.empty(most),
    )
    for k in range(num_teams):
        pool[k], pool_ages[k] = teams[k], ages[k] + 1
        hits[k], costs[k] = rate_team(collisions, own, pool[k])
        if frozen:
            ranks[k] = k - num_teams  # before all new ones, in the order they have
        elif 0 < memory < pool_ages[k]:
            ranks[k] = 1  # behind all new ones
    gather_teams(
        collisions, own, front, count, pool[num_teams:], hits[num_teams:], costs[num_teams:]
    )
    left = np.empty(most, dtype=np.int64)  # candidates that can still be taken, in order
    num_left = 0
    for k in range(most):
        known = k >= num_teams and is_among(pool[k], teams, num_teams)
        left[num_left] = k
        num_left += 0 if known else 1
    held = 0
    while held < len(teams) and num_left > 0:
        best = left[0]
        for c in range(1, num_left):
            k = left[c]
            if (ranks[k], hits[k], costs[k]) < (ranks[best], hits[best], costs[best]):
                best = k
        teams[held], ages[held] = pool[best], pool_ages[best]
        team_collisions[held], team_costs[held] = hits[best], costs[best]
        num_left = drop_rivals(pool, teams[held], left, num_left)
        held += 1
    return held


@kernel
def is_among(team, teams, num_teams):  # type: ignore[no-untyped-def]
    """Return whether a team (P,) is one of the first `num_teams` of teams (≥ num_teams, P)."""
    for k in range(num_teams):
        same = True
        for p in range(len(team)):
            same &= team[p] == teams[k, p]
        if same:
            return True
    return False


@kernel
def drop_rivals(pool, team, left, num_left):  # type: ignore[no-untyped-def]
    """Remove from left (≥ num_left,) what shares a member with a team (P,), in order.

    Return how many are left.
    """
    kept = 0
    for c in range(num_left):
        shares = False
        for p in range(len(team)):
            shares |= pool[left[c], p] == team[p]
        left[kept] = left[c]
        kept += 0 if shares else 1
    return kept


@kernel
def find_best_team(collisions, own, count, team):  # type: ignore[no-untyped-def]
    """The kernel of `best_team`, for kernels, on the first `count` individuals.

    Writes team (P,), returns cost.
    """
    return (
        find_best_pair(collisions, own, count, team)
        if len(own) == 2
        else search_teams(collisions, own, count, team)
    )


@kernel
def find_best_pair(collisions, own, count, team):  # type: ignore[no-untyped-def]
    """`find_best_team` of two populations.

    The cheapest free partner of all of the second, four candidates at a time.

    Rounding is monotone: the lowest sum of an individual is the sum with its cheapest partner.
    """
    table, first, second = collisions[0], own[0], own[1]
    least, last = np.full(count, np.inf), count - 1
    for i in range(0, count, 4):
        k, m, n = min(i + 1, last), min(i + 2, last), min(i + 3, last)
        rows = table[i], table[k], table[m], table[n]
        a, b, c, d = first[i], first[k], first[m], first[n]
        for j in range(count):
            p, q = a if rows[0][j] == 0 else np.inf, b if rows[1][j] == 0 else np.inf
            r, s = c if rows[2][j] == 0 else np.inf, d if rows[3][j] == 0 else np.inf
            p, r, known = q if q < p else p, s if s < r else r, least[j]
            p = r if r < p else p
            least[j] = p if p < known else known
    best = np.inf
    for j in range(count):
        best = min(best, least[j] + second[j])
    team[:] = -1
    if best < np.inf:
        team[0] = count
        for j in range(count):
            if least[j] + second[j] == best:
                for i in range(team[0]):  # the first of all with this sum
                    if table[i, j] == 0 and first[i] + second[j] == best:
                        team[0], team[1] = i, j
                        break
    return best


@kernel
def search_teams(collisions, own, count, team):  # type: ignore[no-untyped-def]
    """`find_best_team` of any number of populations.

    Depth first, cheapest individuals first, with bounds.

    Bounds are summed in the order of the populations like the costs themselves, so rounding cannot
    make one too high. Where a bound only equals the best cost, a branch is worth it if its indices
    come first in lexicographic order.
    """
    num, order = len(own), sort_by_cost(own, count)
    ranks, trial, partial = np.zeros(num, dtype=np.int64), np.full(num, -1), np.zeros(num + 1)
    team[:] = -1
    best, level = np.inf, 0
    while level >= 0:
        exhausted = ranks[level] == count
        if not exhausted:
            trial[level] = order[level, ranks[level]]
            partial[level + 1] = partial[level] + own[level, trial[level]]
            bound = partial[level + 1]
            for p in range(level + 1, num):
                bound += own[p, order[p, 0]]
            exhausted = bound > best
        if exhausted:
            level -= 1
        elif (bound < best or comes_first(trial, team, level)) and fits(collisions, trial, level):
            if level < num - 1:
                level += 1
                ranks[level] = 0
                continue
            best = bound
            team[:] = trial
        if level >= 0:
            ranks[level] += 1
    return best


@kernel
def comes_first(trial, team, level):  # type: ignore[no-untyped-def]
    """Return whether trial (P,), known up to `level`.

    Can still come before a team (P,) in lexicographic order.
    """
    for p in range(level + 1):
        if trial[p] != team[p]:
            return trial[p] < team[p]
    return level < len(team) - 1


@kernel
def fits(collisions, trial, level):  # type: ignore[no-untyped-def]
    """Return whether the member of trial (P,) at `level` collides with none of those before it."""
    free = True
    for p in range(level):
        free &= collisions[pair_index(len(trial), p, level), trial[p], trial[level]] == 0
    return free
