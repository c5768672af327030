"""Multi-arm motion as strings of via-points (Rana & Zalzala 1995).

An individual is one string per arm: N + 1 configurations from start to goal; the i-th via-points of
all arms belong to the same instant. Configuration space is in degrees, angles are not wrapped.
The number of arms, their joints, and whether they move in a plane or in space matter to the
collision model only.

A population is an array (nq, N + 1, individuals), individuals innermost. A solution is flat: arm by
arm, instant by instant, joint by joint (arms × (N + 1) × joints) [deg], start and goal included.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from evoexp.collision.bodies.covered_bodies import CoveredBodies, CoveredCollision
from evoexp.collision.bodies.touching_spheres import TouchingSpheres
from evoexp.errors import SettingError
from evoexp.evolution.operators.operator import GeneticSettings, Operators
from evoexp.evolution.operators.selection import FitnessRoulette
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.motion_criteria import StringFitness
from evoexp.paths.motion import Motion
from evoexp.planners.answers import Acceptance, Proofs, in_shape
from evoexp.planners.arm_tasks import ArmDefaults, ArmTask, arm_problem
from evoexp.planners.planner import COPIES, JudgementArrays, num_values
from evoexp.planners.via_point_ga.string_operators import NewTrajectories, StringCrossover
from evoexp.planners.via_point_ga.strings import Problem, Search, Strings, settle, smooth
from evoexp.records import Block, FloatArray
from evoexp.robots.assembly import Robot
from evoexp.validation import Component, Count, LayoutCount, NonNegativeCount, Positive, Rate

SAMPLES = tuple(2**k for k in range(3, 11))  # per segment, that the redistribution can take
SAMPLES_BETWEEN = 100  # configurations per segment where a clearance between via-points is sampled


class ViaPointGa(ArmDefaults, Component):
    """The evolutionary algorithm of Rana & Zalzala, sections 3 and 4 (Tables 1 and 3)."""

    is_real_coded: ClassVar[bool] = True

    num_via_points: LayoutCount  # N; instants 1 … N are judged, 0 is the start, N the goal
    walk_step: Positive  # step length of a new trajectory, in units of its straight distance over N
    # largest random turn of a step away from the direction of the goal [deg]
    max_turn: Annotated[float, Field(ge=0.0, le=180.0)]
    num_new_trajectories: NonNegativeCount  # offspring replaced by new trajectories per generation
    crossover_distance: Positive  # strings are crossed only where they are closer than this [deg]
    relaxation_step: Rate  # delta of Eqs. 8, 9
    # whether via-points are redistributed evenly along a spline (off: an ablation)
    redistribution: bool
    spline_end: Literal["natural", "clamped"]  # end condition of that spline
    samples_per_segment: Count  # samples of its arc length between two via-points
    ga: GeneticSettings  # population, generations, elites, rates
    objective: StringFitness  # weights of Eq. 7
    # the touching circles or spheres, or covers of the bodies
    collision: TouchingSpheres | CoveredBodies
    # how the double cross-over of section 3.4b is read: `tails` exchanges what follows the
    # site in every arm's path; `segment` exchanges what lies between the two sites of the
    # whole string: the end of the first path and the beginning of the second
    crossover_reading: Literal["tails", "segment"] = "tails"
    # which motions are an answer: all that the collision model accepts at the instants it tests
    # (`model`), or only motions that the exact certifier also proves free of contact between
    # all instants (`certified`), or free by the task's margins (`margin`). A refuted string
    # counts as colliding at one instant more
    acceptance: Acceptance = "model"

    def _check(self) -> None:
        must = f"one of {', '.join(map(str, SAMPLES))}"
        self.demand("samples_per_segment", self.samples_per_segment in SAMPLES, must)

    @property
    def operators(self) -> Operators:
        """The paper's operators (section 3.4 a, b, d), where `ga` names no others."""
        ga = self.ga
        return Operators(
            ga.selection or FitnessRoulette(fitness_offset=self.objective.fitness_offset),
            ga.crossover
            or StringCrossover(
                crossover_distance=self.crossover_distance,
                exchanges_segment=self.crossover_reading == "segment",
            ),
            ga.mutation
            or NewTrajectories(
                num_new_trajectories=self.num_new_trajectories,
                walk_step=self.walk_step,
                max_turn=self.max_turn,
            ),
        )

    def prepare(self, robot: Robot, scenario: ArmTask) -> Problem:
        """Build the robot and check that start and goal fit it and are free of collision."""
        if self.num_new_trajectories > self.ga.num_offspring:
            must = f"at most the offspring of a generation ({self.ga.num_offspring})"
            raise SettingError("planner.num_new_trajectories", must, self.num_new_trajectories)
        return Problem(**vars(arm_problem(robot, scenario, self.collision)))

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the initial population, then one generation after the other."""
        return Search(self, problem).blocks(rng)

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
        """Return new trajectories as in the initial population, (nq, N + 1, count)."""
        return Strings(self, problem).drawn(rng, count)[:, :, :count]

    def cost(self, problem: Problem, population: FloatArray) -> JudgementArrays:
        """Judge a population (nq, N + 1, individuals); if so asked, its cheapest ones by proof."""
        strings = Strings(self, problem)
        padded = strings.padded(population)
        judged = strings.judge(padded, population.shape[2])
        if self.answers_are_proven:
            hits = judged.terms["collisions"]
            settle(Proofs(self, problem), padded, judged.cost, hits)
            judged = judged._replace(feasible=hits == 0.0)
        return judged

    def bounds(self, problem: Problem) -> tuple[FloatArray, FloatArray]:
        """Return the least and the greatest value of an individual's numbers, each (nq, N + 1)."""
        strings, shape = Strings(self, problem), (len(problem.start), self.num_via_points + 1)
        low, high = (np.broadcast_to(limit[:, None], shape) for limit in strings.settings.limits.T)
        return low, high

    def improve(
        self, problem: Problem, population: FloatArray, rng: np.random.Generator
    ) -> FloatArray:
        """Return a population (nq, N + 1, individuals), redistributed and relaxed once more.

        Section 3.4 (c) as every offspring goes through it; nothing is drawn.
        """
        strings, count = Strings(self, problem), population.shape[2]
        improved = strings.padded(population)
        smooth(improved, count, strings.settings)
        return improved[:, :, :count]

    def solution(self, problem: Problem, population: FloatArray, individual: int) -> FloatArray:
        """Return one individual of a population as a flat solution."""
        own = population[:, :, individual]
        return np.concatenate([own[a:b].T.ravel() for a, b in problem.arm_slices])

    def motion(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the joint-space motion of a solution: straight, via-points in equal times."""
        return Motion(np.ascontiguousarray(DEGREE * self.path(problem, solution)))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return the named terms of a solution, and its clearances at and between via-points."""
        strings = np.ascontiguousarray(self.path(problem, solution).T)
        judged = self.cost(problem, strings[:, :, None])
        terms = judged.named_terms(0) | {"fitness": float(self.objective.fitness(judged.cost)[0])}
        squares = (problem.goal - problem.start) ** 2
        straight = sum(float(np.sqrt(np.sum(squares[a:b]))) for a, b in problem.arm_slices)
        if straight > 0.0:
            lengths = [value for name, value in terms.items() if name.startswith("length_arm_")]
            terms["path_length_ratio"] = float(np.sum(lengths)) / straight
        # least distances as in Fig. 7: of circle centres, to those of another arm and to an
        # obstacle's surface; of covered bodies the clearances of covers
        at = problem.collision.clearance(strings)
        between = problem.collision.clearance(sampled(strings, SAMPLES_BETWEEN))
        is_covered = isinstance(problem.collision, CoveredCollision)
        radius = 0.0 if is_covered else problem.sphere_radius
        for name, via, dense, own in (
            ("arm", at.between_arms, between.between_arms, 2.0 * radius),
            ("obstacle", at.to_obstacles, between.to_obstacles, radius),
        ):
            if np.isfinite(via).any():
                terms[f"{name}_distance_at_via_points"] = float(np.min(via)) + own
                terms[f"{name}_distance_between_sampled"] = float(np.min(dense)) + own
        return terms

    def cost_of_terms(self, terms: Mapping[str, float]) -> float:
        """Return the cost that gives the fitness (Eq. 7)."""
        return self.objective.fitness_offset - terms["fitness"]

    def memory(self, problem: Problem) -> int:
        """Return the memory of populations, and of the configurations tested between via-points."""
        between = 2 * (self.collision.collision_substeps - 1)
        values = (COPIES + between) * num_values(self.shape(problem))
        return 8 * self.ga.population_size * values

    def shape(self, problem: Problem) -> tuple[tuple[int, int], ...]:
        """Return the documented shape of a solution: per arm, (N + 1, joints)."""
        return tuple((self.num_via_points + 1, int(b - a)) for a, b in problem.arm_slices)

    def path(self, problem: Problem, solution: FloatArray) -> FloatArray:
        """Return the strings of a flat solution, (N + 1, nq) [deg]."""
        own, points = in_shape(solution, len(problem.start) * (self.num_via_points + 1)), []
        for size, joints in self.shape(problem):
            points.append(own[: size * joints].reshape(size, joints))
            own = own[size * joints :]
        return np.hstack(points)


def sampled(strings: FloatArray, samples: int) -> FloatArray:
    """Return configurations (nq, N · samples + 1) on the segments of strings (nq, N + 1)."""
    before, after = strings[:, :-1, None], strings[:, 1:, None]
    inside = before + np.arange(1, samples + 1) / samples * (after - before)
    inside[:, :, -1] = strings[:, 1:]
    return np.hstack([strings[:, :1], inside.reshape(len(strings), -1)])
