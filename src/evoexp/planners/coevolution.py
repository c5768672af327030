"""Co-evolving populations, one per robot (Curkovic, Jerbic & Stipancic 2013).

An individual is a path of one robot: K configurations of two absolute link angles between start and goal, which are
given. What it is worth depends on all individuals of the other robots' populations. The answer is a team: one
individual of every population, free of collision with each other. Nothing here knows how many robots there are.

A population is an array (robots, 2 K, individuals) [rad]: the angles of configuration 1, of configuration 2, …. A
solution is flat: robot by robot, configuration by configuration, link by link (robots × (K + 2) × 2) [deg], start and
goal included.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import ClassVar, NamedTuple

import numpy as np

from evoexp.collision.link_collision import LinkCollision, LinkCrossings
from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError
from evoexp.evolution.coevolution_settings import CoevolutionSettings
from evoexp.evolution.crossover import cross_single_point, num_single_point_uniforms
from evoexp.evolution.hall_of_fame import Hall, best_team, update_hall
from evoexp.evolution.mutation import decayed_rate, mutate_allele, num_allele_uniforms
from evoexp.evolution.pareto import pareto_front
from evoexp.evolution.selection import difference_weights, elites, inverse_weights, spin_roulette
from evoexp.evolution.statistics import cost_statistics
from evoexp.numerics import DEGREE
from evoexp.objectives.motion_criteria import MotionCriteria, measure_motions
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray, Generation
from evoexp.robots.assembly import Assembly, Robot
from evoexp.scenarios.link_motion import LinkMotion
from evoexp.validation import Component, Count

HALF_TURN = DEGREE * 180.0  # genes live in [0, π)


class Problem(NamedTuple):
    """What `prepare` made of robots and scenario.

    Attributes:
        assembly: The robots, built.
        collision: The paper's collision model on them.
        start: (robots, 2) absolute link angles [rad].
        goal: (robots, 2) [rad].
        moving: (robots,) false for robots that stand still.
        scene: The bodies themselves, for the exact verdict on a motion.
        security_margin: Clearance that the task requires [length unit].
    """

    assembly: Assembly
    collision: LinkCollision
    start: FloatArray
    goal: FloatArray
    moving: np.ndarray
    scene: Scene
    security_margin: float


class Evaluated(NamedTuple):
    """Populations evaluated all against all.

    Attributes:
        costs: (robots, individuals) C1 + C2 + C3 + C4, weighted.
        criteria: (robots, 4, individuals) C1 … C4.
        own: (robots, individuals) C2 + C3 + C4, weighted.
        collisions: (pairs of robots, individuals, individuals) colliding configurations.
        blocked: (robots, individuals) configurations that collide with obstacles.
    """

    costs: FloatArray
    criteria: FloatArray
    own: FloatArray
    collisions: np.ndarray
    blocked: np.ndarray

    @property
    def teamable(self) -> FloatArray:
        """(robots, individuals) own cost; inf for those that collide with an obstacle."""
        return np.where(self.blocked > 0, np.inf, self.own)


class Judgement(NamedTuple):
    """Individuals of the first robot, each with its cheapest collision-free team.

    Attributes:
        cost: (individuals,) own costs of that team summed; inf if there is none.
        evaluated: The populations.
        collision_queries: Configurations judged for it.
    """

    cost: FloatArray
    evaluated: Evaluated
    collision_queries: int

    @property
    def feasible(self) -> np.ndarray:
        """(individuals,) whether each has a collision-free team."""
        return np.isfinite(self.cost)

    def named_terms(self, individual: int) -> dict[str, float]:
        """Return the criteria of an individual's team by name."""
        return _terms(self.evaluated, _team_of(self.evaluated, individual))


class Coevolution(Component):
    """The co-evolutionary algorithm of Curkovic et al., sections 2 and 3; methods I–VIII are settings of it.

    Attributes:
        num_configurations: K; a chromosome has L = 2 K genes.
        ga: Populations, generations, rates, hall of fame.
        objective: Weights of C1 … C4.
        collision: Links as lines, or their envelopes.
    """

    component: ClassVar[str] = "coevolution"

    num_configurations: Count
    ga: CoevolutionSettings
    objective: MotionCriteria
    collision: LinkCrossings

    def prepare(self, robot: Robot, scenario: LinkMotion) -> Problem:
        """Build the robots and check that start and goal fit them and are free of collision.

        Raises:
            SettingError: If they are not.
        """
        assembly = robot.build()
        collision = self.collision.bind(assembly, scenario.obstacles)
        if len(collision.arms) < 2:
            raise SettingError("robot", "two robots or more, which evolve together", len(collision.arms))
        bases, lengths = (np.array([arm[k] for arm in collision.arms]) for k in range(2))
        start, goal = (DEGREE * ends for ends in scenario.ends(bases, lengths))
        moving = np.array([r not in scenario.stationary for r in range(len(collision.arms))])
        bodies = scene(assembly, scenario.obstacles)
        problem = Problem(assembly, collision, start, goal, moving, bodies, scenario.security_margin)
        for name, posture in (("q_start", start), ("q_goal", goal)):
            if contact := collision.contact(posture):
                given = (posture / DEGREE).round(9).tolist()
                raise SettingError(f"scenario.{name}", f"free of collision ({contact})", given)
        return problem

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the initial populations, then one generation after the other (Fig. 2)."""
        ga, record = self.ga, _Record(self, problem)
        populations = self.sample(problem, rng, ga.population_size)
        hall, waiting = Hall.empty(len(problem.start)), 0
        found = self.evaluated(problem, populations)
        yield record.generation(0, populations, found)
        for index in range(1, ga.num_generations + 1):
            hall = self._renewed(populations, found, hall)
            waiting = 0 if record.feasible else waiting + 1
            if ga.restart_after is not None and waiting >= ga.restart_after:
                # "If no convergence has occurred, …, the algorithm generates new populations" (section 3).
                populations, waiting = self.sample(problem, rng, ga.population_size), 0
                hall = Hall.empty(len(problem.start))
            else:
                populations = self._bred(rng, problem, populations, found, hall, index)
                hall = hall.moved(ga.population_size - hall.num_teams)
            found = self.evaluated(problem, populations)
            yield record.generation(index, populations, found)

    def _renewed(self, populations: FloatArray, found: Evaluated, hall: Hall) -> Hall:
        """Return the hall of fame: members of the Pareto fronts with their best collaborators."""
        depth = self.ga.num_hall_teams
        if not depth:
            return hall
        fronts = np.array([pareto_front(criteria) for criteria in found.criteria])
        _drop_copies(populations, fronts, hall)
        memory, frozen = self.ga.hall_memory, self.ga.hall_frozen
        return update_hall(found.collisions, found.teamable, fronts, hall, depth, memory, frozen)

    def _bred(
        self,
        rng: np.random.Generator,
        problem: Problem,
        populations: FloatArray,
        found: Evaluated,
        hall: Hall,
        index: int,
    ) -> FloatArray:
        """Return the next populations: offspring, then elites, then the members of the hall, unchanged."""
        ga, bred = self.ga, populations.copy()
        rate = decayed_rate(ga.mutation_rate, ga.mutation_decay, index, ga.num_generations)
        size = ga.population_size
        count = size - ga.num_elites - hall.num_teams
        weigh = inverse_weights if ga.selection == "inverse" else difference_weights
        weights, parents = np.empty(size), np.empty(count, dtype=np.int64)
        for robot in np.flatnonzero(problem.moving):
            weigh(found.costs[robot], weights)
            uniforms = rng.random(count + num_single_point_uniforms(count // 2) + num_allele_uniforms(count))
            spin_roulette(weights, uniforms[:count], parents)
            genes, last = bred[robot], count + num_single_point_uniforms(count // 2)
            cross_single_point(uniforms[count:last], populations[robot], parents, ga.crossover_rate, genes)
            symmetric = ga.mutation_direction == "symmetric"
            mutate_allele(uniforms[last:], genes, count, rate, DEGREE * ga.mutation_step, HALF_TURN, symmetric)
            kept = [*elites(found.costs[robot], ga.num_elites), *hall.teams[:, robot]]
            genes[:, count:] = populations[robot][:, kept]
        return bred

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
        """Return populations of uniform genes, (robots, 2 K, count); robots that stand still keep their posture."""
        genes = HALF_TURN * rng.random((len(problem.start), 2 * self.num_configurations, count))
        for robot in np.flatnonzero(~problem.moving):
            genes[robot] = np.tile(problem.start[robot], self.num_configurations)[:, None]
        return genes

    def evaluated(self, problem: Problem, populations: FloatArray) -> Evaluated:
        """Evaluate populations (robots, 2 K, individuals), everybody against everybody of the other robots (Eq. 4)."""
        collision, robots, count = problem.collision, len(populations), populations.shape[2]
        criteria, own = np.empty((robots, 4, count)), np.empty((robots, count))
        blocked, lines = np.zeros((robots, count), dtype=np.int64), []
        for r in range(robots):
            path = np.empty((self.num_configurations + 2, 2, count))
            path[0], path[-1] = problem.start[r][:, None], problem.goal[r][:, None]
            path[1:-1] = populations[r].reshape(self.num_configurations, 2, count)
            measure_motions(path, collision.arms[r].points(path), self.objective.own_weights, criteria[r, 1:], own[r])
            lines.append(collision.outlines(r, path[1:-1], problem.start[r], problem.goal[r]))
            blocked[r] = collision.with_obstacles(r, lines[r])
        hits, sums = [], blocked * count  # an obstacle is in the way whoever the collaborator is
        for a, b in combinations(range(robots), 2):
            crossings = collision.between(a, lines[a], b, lines[b])
            hits.append(crossings.counts)
            sums[a] += crossings.sums_1
            sums[b] += crossings.sums_2
        criteria[:, 0] = sums
        return Evaluated(self.objective.collision_weight * sums + own, criteria, own, np.array(hits), blocked)

    def cost(self, problem: Problem, population: FloatArray) -> Judgement:
        """Judge the individuals of the first robot, each by its cheapest collision-free team."""
        found = self.evaluated(problem, population)
        count, costs = population.shape[2], np.empty(population.shape[2])
        for i in range(count):
            costs[i] = _cost_of(found, _team_of(found, i))
        return Judgement(costs, found, self.queries(problem, count))

    def queries(self, problem: Problem, count: int) -> int:
        """Return the configurations that evaluating populations of `count` asks for."""
        robots, substeps = len(problem.start), self.collision.collision_substeps
        tested = (self.num_configurations + 1) * substeps - 1
        return robots * (robots - 1) // 2 * count * count * tested

    def solution(self, problem: Problem, population: FloatArray, individual: int) -> FloatArray:
        """Return the team of an individual of the first robot as a flat solution."""
        return self.team_solution(problem, population, _team_of(self.evaluated(problem, population), individual))

    def team_solution(self, problem: Problem, population: FloatArray, team: np.ndarray) -> FloatArray:
        """Return one individual of every population as a flat solution."""
        parts = []
        for r, individual in enumerate(team):
            path = [problem.start[r], population[r, :, individual], problem.goal[r]]
            parts.append(np.concatenate(path) / DEGREE)
        return np.concatenate(parts)

    def motion(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the joint-space motion of a solution: straight from configuration to configuration, in equal times."""
        paths = DEGREE * self._paths(problem, solution)
        relative = paths.copy()
        relative[:, :, 1] -= paths[:, :, 0]  # the models' joints turn against the link before
        return Motion(np.ascontiguousarray(relative.transpose(1, 0, 2).reshape(paths.shape[1], -1)))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return the criteria C1 … C4 of every robot of one team; C1 against the team's other robots only.

        Raises:
            ValueError: If the solution has another size than robots × (K + 2) × 2.
        """
        paths = DEGREE * self._paths(problem, solution)
        ends = problem._replace(start=paths[:, 0], goal=paths[:, -1])
        genes = np.ascontiguousarray(paths[:, 1:-1].reshape(len(paths), -1, 1))
        found = self.evaluated(ends, genes)
        return _terms(found, np.zeros(len(paths), dtype=np.int64))

    def shape(self, problem: Problem) -> tuple[tuple[int, int], ...]:
        """Return the documented shape of a solution: per robot, (K + 2, 2)."""
        return ((self.num_configurations + 2, 2),) * len(problem.start)

    def _paths(self, problem: Problem, solution: FloatArray) -> FloatArray:
        shape = (len(problem.start), self.num_configurations + 2, 2)
        if solution.shape != (int(np.prod(shape)),):
            raise ValueError(f"a solution has {int(np.prod(shape))} values, was {solution.shape}")
        return solution.reshape(shape)


class _Record:
    """The best team so far, and the records of generations that carry it."""

    def __init__(self, planner: Coevolution, problem: Problem) -> None:
        self.planner, self.problem = planner, problem
        self.cost, self.solution = np.inf, np.empty(0)
        self.terms: dict[str, float] = {}
        self.evaluations = self.queries = 0

    @property
    def feasible(self) -> bool:
        """Whether a collision-free team was found."""
        return bool(np.isfinite(self.cost))

    def generation(self, index: int, populations: FloatArray, found: Evaluated) -> Generation:
        """Update the best team and return the generation's record."""
        planner, (robots, _, count) = self.planner, populations.shape
        self.evaluations += robots * count
        self.queries += planner.queries(self.problem, count)
        best = best_team(found.collisions, found.teamable)
        if best.cost < self.cost or index == 0:
            self.cost = best.cost
            team = best.individuals if best.found else np.array([int(np.argmin(costs)) for costs in found.costs])
            self.solution = planner.team_solution(self.problem, populations, team)
            self.terms = planner.evaluate(self.problem, self.solution)
        statistics = cost_statistics(found.costs.ravel())
        return Generation(
            index=index,
            best=self.solution,
            best_cost=self.cost,
            best_cost_in_generation=best.cost,
            mean_cost=statistics.mean,
            std_cost=statistics.std,
            num_feasible=_num_feasible(found),
            evaluations=self.evaluations,
            collision_queries=self.queries,
            solved=self.feasible,
            terms=self.terms,
            costs=found.costs,
            population=populations,
        )


def _drop_copies(populations: FloatArray, fronts: np.ndarray, hall: Hall) -> None:
    """Take copies of other members, and of the hall's, off the fronts: they would fill the hall with one pair."""
    for robot, genes in enumerate(populations):
        known = {genes[:, member].tobytes() for member in hall.teams[:, robot]}
        for member in np.flatnonzero(fronts[robot]):
            genome = genes[:, member].tobytes()
            fronts[robot, member] = genome not in known
            known.add(genome)


def _num_feasible(found: Evaluated) -> int:
    """Return how many individuals of the first robot have a collision-free partner in every other population."""
    robots = len(found.own)
    free = found.blocked[0] == 0
    for other in range(1, robots):  # pairs (0, 1), (0, 2), … come first
        usable = found.blocked[other] == 0
        free &= ((found.collisions[other - 1] == 0) & usable).any(axis=1)
    return int(np.count_nonzero(free))


def _team_of(found: Evaluated, individual: int) -> np.ndarray:
    """Return the cheapest collision-free team with an individual of the first robot; else one with few collisions."""
    own = found.teamable.copy()
    alone = own[0, individual]
    own[0] = np.inf
    own[0, individual] = alone
    best = best_team(found.collisions, own)
    if best.found:
        return best.individuals
    team = np.zeros(len(own), dtype=np.int64)
    team[0] = individual
    for other in range(1, len(own)):
        team[other] = int(np.argmin(found.collisions[other - 1, individual]))
    return team


def _cost_of(found: Evaluated, team: np.ndarray) -> float:
    """Return the summed own cost of a team, inf if it collides."""
    if _team_collisions(found, team) > 0:
        return np.inf
    return float(sum(found.own[r, i] for r, i in enumerate(team)))


def _team_collisions(found: Evaluated, team: np.ndarray) -> int:
    """Return the colliding configurations within a team and with obstacles."""
    pairs = enumerate(combinations(range(len(team)), 2))
    hits = sum(int(found.collisions[pair, team[a], team[b]]) for pair, (a, b) in pairs)
    return hits + sum(int(found.blocked[r, i]) for r, i in enumerate(team))


def _terms(found: Evaluated, team: np.ndarray) -> dict[str, float]:
    """Return a team's terms by name."""
    robots, met = len(team), np.array([found.blocked[r, team[r]] for r in range(len(team))])
    for pair, (a, b) in enumerate(combinations(range(robots), 2)):
        met[[a, b]] += found.collisions[pair, team[a], team[b]]
    terms = {
        "team_cost": float(sum(found.own[r, i] for r, i in enumerate(team))),
        "team_collisions": float(_team_collisions(found, team)),
    }
    for r, individual in enumerate(team):
        _, path, rotation, evenness = found.criteria[r, :, individual]
        terms[f"collisions_robot_{r + 1}"] = float(met[r])
        terms[f"tip_path_robot_{r + 1}"] = float(path)
        terms[f"rotation_robot_{r + 1}_rad"] = float(rotation)
        terms[f"tip_unevenness_robot_{r + 1}"] = float(evenness)
    return terms
