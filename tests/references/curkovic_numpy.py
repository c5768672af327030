"""The planner of Curkovic et al. 2013 in numpy and plain Python: slow, obvious, without a kernel.

Written from the paper and from `coevolution`'s documented choices. It takes its uniform numbers in
the order in which `coevolution` takes them. A population is an array (genes, individuals) [rad]:
two absolute link angles per configuration.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from references.link_crossings_numpy import counts_of_populations, squared_distance

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Curkovic:
    """Scene and settings; those of `coevolution` and its parts have the same names."""

    start: Array  # (robots, 2) absolute link angles [rad]
    goal: Array  # (robots, 2) [rad]
    moving: NDArray[np.bool_]  # (robots,) false for robots that stand still
    bases: Array  # (robots, 2) [length unit]
    link_lengths: Array  # (robots, 2) [length unit]
    discs: list[tuple[float, float, float]]  # centre x, y and radius of every obstacle
    chromosome_length: int
    population_size: int
    num_generations: int
    crossover_rate: float
    mutation_rate: float
    mutation_decay: float
    mutation_step: float
    mutation_direction: str
    selection: str
    num_elites: int
    num_hall_teams: int
    hall_memory: int | None
    hall_frozen: bool
    hall_distinct: str
    hall_members: str
    restart_after: int | None
    collision_weight: float
    path_weight: float
    rotation_weight: float
    evenness_weight: float
    collision_substeps: int


@dataclass
class Judged:
    """Populations, everybody tried with everybody of the other robots."""

    criteria: Array  # (robots, 4, individuals) C1 … C4
    costs: Array  # (robots, individuals)
    own: Array  # (robots, individuals) cost without C1; inf for those that hit an obstacle
    hits: dict[tuple[int, int], Integers]  # robots → (individuals, individuals) configurations
    blocked: Integers  # (robots, individuals) configurations that hit an obstacle

    def key(self, team: tuple[int, ...]) -> tuple[int, float]:
        """Return a team's collisions and its cost: lower is better."""
        met = sum(int(table[team[a], team[b]]) for (a, b), table in self.hits.items())
        cost = 0.0
        for robot, member in enumerate(team):
            cost += float(self.own[robot, member])
        return met, cost


@dataclass
class Member:
    """A team in the hall of fame: one individual of every population, and the team's age."""

    team: tuple[int, ...]
    age: int = 0
    rank: int = 0


class Generation(NamedTuple):
    """One generation."""

    populations: Array  # (robots, genes, individuals)
    judged: Judged
    best_cost: float  # of a collision-free team; inf: there is none
    best_team: tuple[int, ...] | None  # that team, the first of equal ones
    num_feasible: int  # of the first robot, with a collision-free partner in every other population
    restarted: bool  # whether the populations were drawn afresh


def from_condition(condition: Any, **changes: Any) -> Curkovic:
    """Return the scene and settings of a condition of `coevolution`, with changes."""
    planner, problem = condition.prepare()
    parts = (planner, planner.ga, planner.objective, planner.collision)
    obstacles = condition.scenario.obstacles
    assert not any(arm.is_enveloped for arm in problem.collision.arms)
    assert all(o.shape == "sphere" for o in obstacles), "the reference is for links among discs"
    names = {f.name for f in fields(Curkovic)}
    settings = {name: getattr(part, name) for part in parts for name in names & {*dir(part)}}
    scene: dict[str, Any] = {
        "start": problem.start,
        "goal": problem.goal,
        "moving": problem.moving,
        "bases": np.array([arm.base for arm in problem.collision.arms]),
        "link_lengths": np.array([arm.lengths for arm in problem.collision.arms]),
        "discs": [(*map(float, o.center[:2]), float(o.radius)) for o in obstacles],
    }
    return Curkovic(**(settings | scene | changes))


def evolve(c: Curkovic, rng: np.random.Generator) -> Iterator[Generation]:
    """Yield the initial populations, then one generation after the other."""
    hall: list[Member] = []
    generation = judged_generation(c, drawn(c, rng), False)
    found, waiting = generation.best_cost < np.inf, 0
    yield generation
    for index in range(1, c.num_generations + 1):
        hall = renewed_hall(c, generation, hall)
        waiting = 0 if found else waiting + 1
        restarted = c.restart_after is not None and waiting >= c.restart_after
        if restarted:
            hall, waiting, populations = [], 0, drawn(c, rng)
        else:
            populations = bred(c, rng, generation, hall, index)
        for k, member in enumerate(hall):
            member.team = (c.population_size - len(hall) + k,) * len(c.start)
        generation = judged_generation(c, populations, restarted)
        found |= generation.best_cost < np.inf
        yield generation


def drawn(c: Curkovic, rng: np.random.Generator) -> Array:
    """Return uniform genes in [0, π); a robot that stands still keeps its posture."""
    genes = np.pi * rng.random((len(c.start), c.chromosome_length, c.population_size))
    for robot in np.flatnonzero(~c.moving):
        genes[robot] = np.tile(c.start[robot], c.chromosome_length // 2)[:, None]
    return genes


def judged_generation(c: Curkovic, populations: Array, restarted: bool) -> Generation:
    """Judge populations and search their teams."""
    judged = judge(c, populations)
    robots, count = judged.own.shape
    free = {pair: table == 0 for pair, table in judged.hits.items()}
    # the cheapest free team: sums of own costs in the order of the robots, over all teams
    sums = judged.own[0].reshape(count, *[1] * (robots - 1))
    for r in range(1, robots):
        sums = sums + judged.own[r].reshape([count if k == r else 1 for k in range(robots)])
    for (a, b), table in free.items():
        shape = [count if k in (a, b) else 1 for k in range(robots)]
        sums = np.where(table.reshape(shape), sums, np.inf)
    usable = judged.blocked == 0
    feasible = usable[0].copy()
    for other in range(1, robots):
        feasible &= (free[0, other] & usable[other]).any(axis=1)
    best, num_feasible = float(sums.min()), int(feasible.sum())
    team = tuple(map(int, np.unravel_index(int(sums.argmin()), sums.shape)))
    found = team if best < np.inf else None
    return Generation(populations, judged, best, found, num_feasible, restarted)


def judge(c: Curkovic, populations: Array) -> Judged:
    """Return C1 … C4 (Eqs. 4–8) of everybody against everybody of the other robots."""
    robots, _, count = populations.shape
    criteria, blocked = np.zeros((robots, 4, count)), np.zeros((robots, count), dtype=np.int64)
    tested = []
    for r in range(robots):
        path = np.empty((c.chromosome_length // 2 + 2, 2, count))  # start, genes, goal
        path[0], path[-1] = c.start[r][:, None], c.goal[r][:, None]
        path[1:-1] = populations[r].reshape(-1, 2, count)
        tips = points(c, r, path)[:, 2:]
        steps = np.sqrt((np.diff(tips, axis=0) ** 2).sum(axis=1))
        criteria[r, 1] = steps.sum(axis=0)
        criteria[r, 2] = np.abs(np.diff(path, axis=0)).sum(axis=(0, 1))
        criteria[r, 3] = steps.max(axis=0) - steps.min(axis=0)
        tested.append(points(c, r, between(path, c.collision_substeps)))
        blocked[r] = in_discs(c, r, tested[r])
    hits = {}
    for a, b in itertools.combinations(range(robots), 2):
        hits[a, b] = counts_of_populations(c.bases[a], tested[a], c.bases[b], tested[b])
        criteria[a, 0] += hits[a, b].sum(axis=1)
        criteria[b, 0] += hits[a, b].sum(axis=0)
    criteria[:, 0] += blocked * count  # an obstacle is met whoever the collaborator is
    weights = np.array([c.path_weight, c.rotation_weight, c.evenness_weight])
    own = (weights[:, None] * criteria[:, 1:]).sum(axis=1)
    costs = c.collision_weight * criteria[:, 0] + own
    return Judged(criteria, costs, np.where(blocked > 0, np.inf, own), hits, blocked)


def points(c: Curkovic, robot: int, path: Array) -> Array:
    """Return elbow x, y and tip x, y of a path (configurations, 2, individuals) of angles."""
    base, lengths = c.bases[robot][:, None], c.link_lengths[robot]
    turns = np.round(path / (0.5 * np.pi))  # quarters; of whole ones sine and cosine are integers
    whole, odd = path == turns * (0.5 * np.pi), turns % 2 == 1
    cosines = np.where(whole & odd, 0.0, np.cos(path))
    sines = np.where(whole & ~odd, 0.0, np.sin(path))
    arms = np.stack([cosines, sines], axis=2)  # (configurations, link, x | y, …)
    elbow = base + lengths[0] * arms[:, 0]
    return np.concatenate([elbow, elbow + lengths[1] * arms[:, 1]], axis=1)


def between(path: Array, substeps: int) -> Array:
    """Return the configurations tested: `substeps` per segment, without start and goal."""
    found = []
    for before, after in itertools.pairwise(path):
        found += [before + k / substeps * (after - before) for k in range(1, substeps + 1)]
    return np.array(found[:-1])


def in_discs(c: Curkovic, robot: int, tested: Array) -> Integers:
    """Count the configurations in which a link meets a disc."""
    met = np.zeros((len(tested), tested.shape[2]), dtype=bool)
    for k, now in enumerate(tested):
        base = np.broadcast_to(c.bases[robot][:, None], now[:2].shape)
        for x, y, radius in c.discs:
            for first, second in ((base, now[:2]), (now[:2], now[2:])):
                met[k] |= squared_distance(first, second, np.array([[x], [y]])) <= radius**2
    return met.sum(axis=0)


def bred(
    c: Curkovic, rng: np.random.Generator, generation: Generation, hall: list[Member], index: int
) -> Array:
    """Return the next populations: offspring, then elites, then the hall's members."""
    copied = copied_members(c, generation, hall)
    most = c.population_size - c.num_elites - min(map(len, copied))
    uniforms = rng.random((int(c.moving.sum()), most + 2 * (most // 2) + 3 * most))
    rate = c.mutation_rate - c.mutation_decay * index / c.num_generations  # Eq. 10
    populations, rows = generation.populations.copy(), iter(uniforms)
    for r in np.flatnonzero(c.moving):
        draws, before, costs = next(rows), generation.populations[r], generation.judged.costs[r]
        count = c.population_size - c.num_elites - len(copied[r])
        parents = roulette(c, costs, draws[:count])
        offspring = before[:, parents]
        crossover(c, draws[count : count + 2 * (count // 2)].reshape(-1, 2), offspring)
        rest = draws[count + 2 * (count // 2) :][: 3 * count]
        mutation(c, rest.reshape(-1, 3), offspring, rate)
        elites = before[:, np.argsort(costs, kind="stable")[: c.num_elites]]
        populations[r] = np.concatenate([offspring, elites, before[:, copied[r]]], axis=1)
    return populations


def copied_members(c: Curkovic, generation: Generation, hall: list[Member]) -> list[list[int]]:
    """Return for each robot the individuals that are copied: the hall's, or the cheapest front."""
    if c.hall_members == "pairs":
        return [[member.team[r] for member in hall] for r in range(len(c.start))]
    fronts: list[list[int]] = [[] for _ in c.start]
    for r, i in front_members(generation, [], by_genome=c.hall_distinct == "genome"):
        fronts[r].append(i)
    return [
        sorted(own, key=lambda i: float(costs[i]))[: c.num_hall_teams]
        for own, costs in zip(fronts, generation.judged.costs, strict=True)
    ]


def roulette(c: Curkovic, costs: Array, uniforms: Array) -> Integers:
    """Draw parents in proportion to the inverse of costs, or to their distance to the highest."""
    ends = np.cumsum(1.0 / costs if c.selection == "inverse" else costs.max() - costs)
    drawn = [np.flatnonzero(ends > u * ends[-1])[0] for u in uniforms]
    return np.array(drawn, dtype=np.int64)


def crossover(c: Curkovic, uniforms: Array, offspring: Array) -> None:
    """Exchange the genes of neighbours from one site on, in place."""
    length = len(offspring)
    for pair, (decision, place) in enumerate(uniforms):
        if decision < c.crossover_rate:
            site = 1 + int(place * (length - 1))
            pair_of = offspring[site:, 2 * pair : 2 * pair + 2]
            pair_of[:] = pair_of[:, ::-1].copy()


def mutation(c: Curkovic, uniforms: Array, offspring: Array, rate: float) -> None:
    """Change one allele of some offspring (Eq. 9), in place, unless it leaves [0, π)."""
    step = np.deg2rad(c.mutation_step)
    for k, (decision, place, amount) in enumerate(uniforms):
        gene = int(place * len(offspring))
        one_sided = c.mutation_direction == "one_sided"
        change = step * (1.0 - amount) if one_sided else step * (2.0 * amount - 1.0)
        if decision < rate and 0.0 <= offspring[gene, k] + change < np.pi:
            offspring[gene, k] += change


def renewed_hall(c: Curkovic, generation: Generation, hall: list[Member]) -> list[Member]:
    """Return the best teams of the hall and around the fronts; no genome, or index, is in two."""
    if not c.num_hall_teams or c.hall_members == "front":
        return []
    judged, by_genome = generation.judged, c.hall_distinct == "genome"
    for k, member in enumerate(hall):
        member.age += 1
        old = c.hall_memory is not None and member.age > c.hall_memory
        member.rank = k - len(hall) if c.hall_frozen else int(old)
    seeds = front_members(generation, [member.team for member in hall], by_genome)
    teams = [formed(judged, r, i) for r, i in seeds]
    if by_genome and generation.best_team is not None:
        teams.append(generation.best_team)
    known = {names(generation, member.team, by_genome) for member in hall}
    new = [Member(team) for team in teams if names(generation, team, by_genome) not in known]
    candidates = sorted(hall + new, key=lambda each: (each.rank, judged.key(each.team)))  # stable
    exclusive = [r for r in range(len(c.start)) if c.moving[r] or not by_genome]
    taken, chosen = set[tuple[int, bytes | int]](), list[Member]()
    for candidate in candidates:
        own = names(generation, candidate.team, by_genome)
        members = {(r, own[r]) for r in exclusive}
        if not members & taken and len(chosen) < c.num_hall_teams:
            chosen.append(candidate)
            taken |= members
    return chosen


def names(generation: Generation, team: tuple[int, ...], by_genome: bool) -> tuple[Any, ...]:
    """Return the genome, or the index, of every member of a team."""
    genomes = (generation.populations[r, :, i].tobytes() for r, i in enumerate(team))
    return tuple(genomes) if by_genome else team


def front_members(
    generation: Generation, hall: list[tuple[int, ...]], by_genome: bool
) -> Iterator[tuple[int, int]]:
    """Yield robot and individual of every front, one of several copies only."""
    # with distinct genomes members of the hall are on the fronts in any case, else never
    for r, criteria in enumerate(generation.judged.criteria):
        genomes = [genome.tobytes() for genome in generation.populations[r].T]
        in_hall = {genomes[team[r]] for team in hall}
        seen = set[bytes]() if by_genome else set(in_hall)
        for i, own in enumerate(criteria.T):
            excess = own - criteria.T  # of this individual over every other
            dominated = ((excess >= 0.0).all(axis=1) & (excess > 0.0).any(axis=1)).any()
            offered = by_genome and genomes[i] in in_hall
            if genomes[i] not in seen and (offered or not dominated):
                seen.add(genomes[i])
                yield r, i


def formed(judged: Judged, robot: int, individual: int) -> tuple[int, ...]:
    """Return the team of an individual: who collides least with it and costs least, in turn."""
    team = {robot: individual}
    for other in range(len(judged.own)):
        if other != robot:
            met = np.zeros(judged.own.shape[1], dtype=np.int64)
            for r, member in team.items():
                table = judged.hits[min(r, other), max(r, other)]
                met += table[member] if r < other else table[:, member]
            team[other] = min(range(len(met)), key=lambda k: (met[k], judged.own[other, k]))
    return tuple(team[r] for r in range(len(judged.own)))
