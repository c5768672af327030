"""Multi-arm motion as strings of via-points (Rana & Zalzala 1995).

An individual is one string per arm: N + 1 configurations from start to goal; the i-th via-points of
all arms belong to the same instant. Configuration space is in degrees, angles are not wrapped.
Nothing here knows how many arms there are, how many joints they have, or whether they move in a
plane or in space: that is the collision model's business.

A population is an array (nq, N + 1, individuals), individuals innermost. A solution is flat: arm by
arm, instant by instant, joint by joint (arms × (N + 1) × joints) [deg], start and goal included.
"""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from evoexp.collision.models.touching_spheres import Clearance, SphereCollision, TouchingSpheres
from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError
from evoexp.evolution import crossover
from evoexp.evolution.cost_statistics import CostStatistics, cost_statistics
from evoexp.evolution.genetic_settings import GeneticSettings
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.string_fitness import StringFitness, StringTerms
from evoexp.paths.interpolation import interpolate_linear
from evoexp.paths.motion import Motion
from evoexp.paths.walk import num_uniforms, walk
from evoexp.paths.workspace import Redistribution, prepare_redistribution
from evoexp.planners.planner import PlannerDefaults
from evoexp.planners.via_point_ga import kernels
from evoexp.records import FloatArray, Generation
from evoexp.robots.assembly import Assembly, Robot
from evoexp.scenarios.arm_motion import ArmMotion
from evoexp.validation import Component, Count, NonNegativeCount, Positive, Rate

SAMPLES = tuple(
    2**k for k in range(3, 11)
)  # of the speed per segment that the redistribution can take
LANES = 8  # individuals are padded to whole vectors
SAMPLES_BETWEEN = 100  # configurations per segment where a clearance between via-points is sampled


class Problem(NamedTuple):
    """What `prepare` made of robot and scenario.

    Attributes:
        assembly: The robot, built.
        collision: The paper's collision model on it.
        start: (nq,) [deg].
        goal: (nq,) [deg].
        spline: Factor and memory of the redistribution; for one thread at a time.
        scene: The bodies themselves, for the exact verdict on a motion.
        security_margin: Clearance that the task requires [length unit].
    """

    assembly: Assembly
    collision: SphereCollision
    start: FloatArray
    goal: FloatArray
    spline: Redistribution
    scene: Scene
    security_margin: float

    @property
    def arm_slices(self) -> np.ndarray:
        """(arms, 2) rows of each arm."""
        return self.assembly.arm_slices


class Judgement(NamedTuple):
    """A population judged.

    Attributes:
        cost: (individuals,) lower is better.
        terms: Of Eq. 7.
        collision_queries: Configurations judged for it.
    """

    cost: FloatArray
    terms: StringTerms
    collision_queries: int

    @property
    def feasible(self) -> np.ndarray:
        """(individuals,) whether each is free of collision at every instant tested."""
        return np.asarray(self.terms.collisions[: len(self.cost)] == 0.0)

    def named_terms(self, individual: int) -> dict[str, float]:
        """Return the terms of one individual by name: C1 … of Eqs. 2–6."""
        lengths, unevenness, collisions, _ = self.terms
        named = {f"length_arm_{a + 1}_deg": float(row[individual]) for a, row in enumerate(lengths)}
        named |= {
            f"unevenness_arm_{a + 1}_deg": float(row[individual])
            for a, row in enumerate(unevenness)
        }
        return named | {"collisions": float(collisions[individual])}


class ViaPointGa(PlannerDefaults, Component):
    """The evolutionary algorithm of Rana & Zalzala, sections 3 and 4.

    Attributes:
        num_via_points: N; instants 1 … N are judged, 0 is the start, N the goal.
        walk_step: Step length of a new trajectory, in units of its straight distance over N.
        max_turn: Largest random turn of a step away from the direction of the goal [deg].
        num_new_trajectories: Offspring replaced by new trajectories per generation.
        crossover_distance: Strings are crossed only where they are closer than this [deg].
        relaxation_step: delta of Eqs. 8, 9.
        redistribution: Whether via-points are redistributed evenly along a spline (off: an
            ablation).
        spline_end: End condition of that spline.
        samples_per_segment: Samples of its arc length between two via-points.
        ga: Population, generations, elites, rates.
        objective: Weights of Eq. 7.
        collision: The touching circles or spheres.
    """

    component: ClassVar[str] = "via_point_ga"

    num_via_points: Count
    walk_step: Positive
    max_turn: Annotated[float, Field(ge=0.0, le=180.0)]
    num_new_trajectories: NonNegativeCount
    crossover_distance: Positive
    relaxation_step: Rate
    redistribution: bool
    spline_end: Literal["natural", "clamped"]
    samples_per_segment: Count
    ga: GeneticSettings
    objective: StringFitness
    collision: TouchingSpheres

    @model_validator(mode="after")
    def _samples_halve(self) -> Self:
        count = self.samples_per_segment
        if count not in SAMPLES:
            raise SettingError(
                "samples_per_segment", f"one of {', '.join(map(str, SAMPLES))}", count
            )
        return self

    def prepare(self, robot: Robot, scenario: ArmMotion) -> Problem:
        """Build the robot and check that start and goal fit it and are free of collision.

        Raises:
            SettingError: If they do not, or if more new trajectories are asked for than there are
                offspring.
        """
        if self.num_new_trajectories > self.ga.num_offspring:
            must = f"at most the offspring of a generation ({self.ga.num_offspring})"
            raise SettingError("planner.num_new_trajectories", must, self.num_new_trajectories)
        assembly = robot.build()
        start, goal = scenario.ends(assembly.arm_slices)
        collision = self.collision.bind(assembly, scenario.obstacles)
        for name, q in (("q_start", start), ("q_goal", goal)):
            clearance = collision.clearance(q[:, None])
            if clearance.least[0] < 0.0:
                what = "two arms" if clearance.between_arms[0] < 0.0 else "an arm and an obstacle"
                must = (
                    f"free of collision ({what} overlap by {-clearance.least[0]:.3g} "
                    f"{scenario.length_unit})"
                )
                raise SettingError(
                    f"scenario.{name}", must, [list(arm) for arm in getattr(scenario, name)]
                )
        joints = int(np.max(assembly.arm_slices[:, 1] - assembly.arm_slices[:, 0]))
        spline = prepare_redistribution(
            self.num_via_points, joints, self.spline_end, self.samples_per_segment
        )
        bodies = scene(assembly, collision.obstacles)
        return Problem(assembly, collision, start, goal, spline, bodies, scenario.security_margin)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the initial population, then one generation after the other."""
        ga = self.ga
        strings = _Strings(self, problem)
        population = strings.empty(ga.population_size)
        strings.new_trajectories(rng, population, np.arange(ga.population_size))
        strings.smooth(population, ga.population_size)
        judged = strings.judge(population, ga.population_size)
        costs, collisions = judged.cost.copy(), judged.terms.collisions[: ga.population_size].copy()
        found = _Found(cost_statistics(costs), int(np.count_nonzero(collisions == 0.0)))
        evaluations, queries = ga.population_size, judged.collision_queries
        best = _Best(strings)
        yield best.generation(0, population, judged, costs, found, evaluations, queries)

        offspring = strings.empty(ga.num_offspring)
        judged = strings.unjudged(offspring, ga.num_offspring)
        elites = np.empty(ga.num_elites, dtype=np.int64)
        memory = (population, costs, collisions, offspring, tuple(judged.terms), elites)
        for index in range(1, ga.num_generations + 1):
            found = strings.advance(rng, memory)  # section 3.4 (a)–(d); the elites stay, untouched
            evaluations += ga.num_offspring
            queries += judged.collision_queries
            yield best.generation(index, population, judged, costs, found, evaluations, queries)

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
        """Return new trajectories as in the initial population, (nq, N + 1, count)."""
        strings = _Strings(self, problem)
        population = strings.empty(count)
        strings.new_trajectories(rng, population, np.arange(count))
        strings.smooth(population, count)
        return population[:, :, :count]

    def cost(self, problem: Problem, population: FloatArray) -> Judgement:
        """Judge a population (nq, N + 1, individuals)."""
        count = population.shape[2]
        strings = _Strings(self, problem)
        padded = strings.empty(count)
        padded[:, :, :count] = population
        return strings.judge(padded, count)

    def solution(self, problem: Problem, population: FloatArray, individual: int) -> FloatArray:
        """Return one individual of a population as a flat solution."""
        return np.concatenate(
            [population[a:b, :, individual].T.ravel() for a, b in problem.arm_slices]
        )

    def motion(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the joint-space motion of a solution.

        From via-point to via-point in equal times, straight.
        """
        return Motion(np.ascontiguousarray(DEGREE * self._strings_of(problem, solution).T))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return the named terms of a solution, its clearances at and between via-points included.

        Raises:
            ValueError: If the solution has another size than arms × (N + 1) × joints.
        """
        strings = self._strings_of(problem, solution)
        judged = self.cost(problem, strings[:, :, None])
        terms = judged.named_terms(0) | {"fitness": float(self.objective.fitness(judged.cost)[0])}
        squares = (problem.goal - problem.start) ** 2
        straight = sum(float(np.sqrt(np.sum(squares[a:b]))) for a, b in problem.arm_slices)
        if straight > 0.0:
            terms["path_length_ratio"] = float(np.sum(judged.terms.lengths[:, 0])) / straight
        at = problem.collision.clearance(strings)
        between = problem.collision.clearance(sampled(strings, SAMPLES_BETWEEN))
        return terms | _least_distances(problem, at, between)

    def shape(self, problem: Problem) -> tuple[tuple[int, int], ...]:
        """Return the documented shape of a solution: per arm, (N + 1, joints)."""
        return tuple((self.num_via_points + 1, int(b - a)) for a, b in problem.arm_slices)

    def _strings_of(self, problem: Problem, solution: FloatArray) -> FloatArray:
        """Return a flat solution as strings (nq, N + 1)."""
        sizes = [rows * joints for rows, joints in self.shape(problem)]
        if solution.shape != (sum(sizes),):
            raise ValueError(f"a solution has {sum(sizes)} values, was {solution.shape}")
        parts = np.split(solution, np.cumsum(sizes)[:-1])
        return np.vstack(
            [p.reshape(shape).T for p, shape in zip(parts, self.shape(problem), strict=True)]
        )


class _Found(NamedTuple):
    """What a generation's costs and collisions say."""

    costs: CostStatistics
    num_feasible: int


class _Strings:
    """The population-wide steps of one planner on one problem.

    With their settings as kernels take them.
    """

    def __init__(self, planner: ViaPointGa, problem: Problem) -> None:
        self.planner, self.problem, ga, spline = planner, problem, planner.ga, problem.spline
        self.num_arms, self.nq = len(problem.arm_slices), len(problem.start)
        self.max_turn = DEGREE * planner.max_turn
        self.num_uniforms = num_uniforms(problem.arm_slices, planner.num_via_points)
        pairs = crossover.num_uniforms(self.num_arms, ga.num_offspring // 2)
        self.draws = (ga.num_offspring, pairs, planner.num_new_trajectories)
        self.num_drawn = sum(self.draws) + planner.num_new_trajectories * (1 + self.num_uniforms)
        rates = (
            ga.crossover_rate,
            planner.crossover_distance,
            ga.mutation_rate,
            planner.walk_step,
            self.max_turn,
        )
        self.breeding = (planner.objective.fitness_offset, *rates, problem.start, problem.goal)
        factor = (spline.samples_per_segment, spline.pivots, spline.floats, spline.integers)
        self.smoothing = (planner.redistribution, *factor, planner.relaxation_step)
        self.judging = (
            planner.collision.collision_substeps,
            planner.objective.weights,
            problem.collision.tables,
        )

    def empty(self, count: int) -> FloatArray:
        """Return memory for strings, padded to whole vectors and holding zeros."""
        lanes = max(LANES, -(-count // LANES) * LANES)
        return np.zeros((self.nq, self.planner.num_via_points + 1, lanes))

    def new_trajectories(
        self, rng: np.random.Generator, population: FloatArray, lanes: np.ndarray
    ) -> None:
        """Write random walks from start to goal into some lanes (section 3.3)."""
        problem, step = self.problem, self.planner.walk_step
        uniforms = rng.random((len(lanes), self.num_uniforms))
        walk(
            population,
            lanes,
            uniforms,
            problem.start,
            problem.goal,
            problem.arm_slices,
            step,
            self.max_turn,
        )

    def smooth(self, population: FloatArray, count: int) -> None:
        """Redistribute and relax the first `count` strings."""
        kernels.smooth(population, count, self.problem.arm_slices, self.smoothing)

    def judge(self, population: FloatArray, count: int) -> Judgement:
        """Return cost and terms of the first `count` strings.

        The arrays of terms keep the padding.
        """
        judged = self.unjudged(population, count)
        kernels.judge(population, self.problem.arm_slices, self.judging, tuple(judged.terms))
        return judged

    def unjudged(self, population: FloatArray, count: int) -> Judgement:
        """Return memory for a judgement."""
        lanes = population.shape[2]
        lengths, unevenness = np.empty((2, self.num_arms, lanes))
        terms = StringTerms(lengths, unevenness, np.empty(lanes), np.empty(count))
        return Judgement(terms.cost, terms, self.planner.num_via_points * self.judging[0] * count)

    def advance(self, rng: np.random.Generator, memory: tuple[Any, ...]) -> _Found:
        """Replace the population in `memory` by the next one.

        Offspring and their terms are there afterwards.
        """
        uniforms = rng.random(self.num_drawn)
        settings = (self.breeding, self.smoothing, self.judging)
        *found, feasible = kernels.advance(
            uniforms, self.draws, self.problem.arm_slices, *settings, memory
        )
        return _Found(CostStatistics(*found), feasible)


class _Best:
    """The best solution so far, and the records of generations that carry it."""

    def __init__(self, strings: _Strings) -> None:
        self.strings = strings
        self.cost = np.inf
        self.solution: FloatArray | None = None
        self.terms: dict[str, float] = {}

    def generation(
        self,
        index: int,
        population: FloatArray,
        judged: Judgement,
        costs: FloatArray,
        found: _Found,
        evaluations: int,
        queries: int,
    ) -> Generation:
        """Update the best by a judged population and return the generation's record."""
        k, mean, std = found.costs
        cost = float(costs[k])
        if cost < self.cost or self.solution is None:
            self.cost = cost
            self.solution = self.strings.planner.solution(self.strings.problem, population, k)
            self.terms = judged.named_terms(k)
        return Generation(
            index=index,
            best=self.solution,
            best_cost=self.cost,
            best_cost_in_generation=cost,
            mean_cost=mean,
            std_cost=std,
            num_feasible=found.num_feasible,
            evaluations=evaluations,
            collision_queries=queries,
            solved=self.terms["collisions"] == 0.0,
            terms=self.terms,
            costs=costs,
            population=population,
        )


def sampled(strings: FloatArray, samples: int) -> FloatArray:
    """Return configurations along straight segments, the via-points included.

    (nq, N · samples + 1).
    """
    inside = interpolate_linear(np.repeat(strings[:, :, None], LANES, axis=2), samples)[..., 0]
    return np.hstack([strings[:, :1], inside.reshape(len(strings), -1)])


def _least_distances(problem: Problem, at: Clearance, between: Clearance) -> dict[str, float]:
    """Least distances of circle centres, as in the paper's Fig.

    7: to another arm's, and to an obstacle's surface.
    """
    radius = problem.collision.radius
    distances = {}
    if np.isfinite(at.between_arms).any():
        distances["arm_distance_at_via_points"] = float(np.min(at.between_arms)) + 2.0 * radius
        distances["arm_distance_between_sampled"] = (
            float(np.min(between.between_arms)) + 2.0 * radius
        )
    if np.isfinite(at.to_obstacles).any():
        distances["obstacle_distance_at_via_points"] = float(np.min(at.to_obstacles)) + radius
        distances["obstacle_distance_between_sampled"] = (
            float(np.min(between.to_obstacles)) + radius
        )
    return distances
