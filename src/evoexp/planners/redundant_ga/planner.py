"""Point-to-point motion of a redundant planar arm among ellipses (Lavoie & Boudreau 2001).

The motion has two sub-paths, straight in joint space: from the start to a posture A whose tip is
near the via point (SP1), from A to a posture B whose tip is near the goal and inside the box (SP2).
A genetic algorithm searches A; if it is successful, a second one searches B; both are repeated
until both are successful, up to `num_attempts` times.

A population is an array (joints, individuals) [rad] of end postures of one sub-path, or (joints ×
bits, individuals). A solution is flat: three postures (start, A, B) × joints [rad].

The best so far is a whole plan, which costs its objective of SP2 (Eq. 4). Until there is a plan of
finite cost, the best posture A so far takes its place, as a plan that stays there, at the cost inf.
"""

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import field_validator

from evoexp.collision.planar.link_ellipses import LinkEllipses
from evoexp.errors import SettingError
from evoexp.numeric.compilation import kernel
from evoexp.numeric.generator_state import state_bytes
from evoexp.paths.motion import Motion
from evoexp.planners.answers import Acceptance, Proofs, in_shape, of_postures
from evoexp.planners.planner import (
    COPIES,
    JudgementArrays,
    PlannerDefaults,
    WrappedPlanner,
    num_values,
)
from evoexp.planners.reaching_tasks import Problem, reaching_problem
from evoexp.planners.redundant_ga import kernels, sub_path
from evoexp.planners.redundant_ga.kernels import Judging, judge_paths
from evoexp.records import Block, FloatArray
from evoexp.robots.assembly import Robot
from evoexp.robots.planar_ends import PlanarArm, bring_tip_to
from evoexp.scenarios.motion_tasks import PickAndPlace
from evoexp.validation import Component, Count, NonNegative, Positive

CONTACT = ("position", "obstacle", "link", "swept")  # the fields of `link_ellipses.Contact`


class Reaching(Component):
    """Weights of Eq. 4 without its collisions: position error and turning."""

    position_weight: NonNegative  # w1, of the distance between tip and target [1/length unit]
    displacement_weight: NonNegative  # w2, of the Euclidean distance between the postures [1/rad]

    @property
    def weights(self) -> tuple[float, float]:
        """As the kernel takes them."""
        return self.position_weight, self.displacement_weight


class RedundantGa(PlannerDefaults, Component):
    """The algorithm of Lavoie & Boudreau, sections 3 to 5."""

    goal_is_region: ClassVar[bool] = True

    num_attempts: Count  # how often SP1 and SP2 are searched at most
    stop_cost_sp1: Positive  # the search of SP1 ends where the objective is smaller
    stop_cost_sp2: Positive  # the search of SP2 ends where the objective is smaller
    # A sub-path is successful below its stopping cost (`threshold`), or if its cost is
    # `finite`
    success: Literal["threshold", "finite"]
    ga: sub_path.SelectiveSettings  # population, generations, operators
    objective: Reaching  # weights of Eq. 4
    collision: LinkEllipses  # positions and chords that are tested
    # which ends of sub-paths may be the best one: all that the model accepts, or only ends
    # whose sub-path the exact certifier also proves; a refuted end costs inf
    acceptance: Acceptance = "model"

    def prepare(self, robot: Robot, scenario: PickAndPlace) -> Problem:
        """Build the robot and check that the start fits it and is free of collision."""
        if not isinstance(self.ga, sub_path.RealGenetic | sub_path.BinaryGenetic):
            raise SettingError("ga", "a real_genetic or a binary_genetic", self.ga.component)
        return reaching_problem(robot, scenario, self.collision)

    def evolve(
        self,
        problem: Problem,
        rng: np.random.Generator,
        kind: type[sub_path.Search] = sub_path.Search,
    ) -> Iterator[Block]:
        """Yield the generations of SP1 and SP2 in turn, until both are successful."""
        search = kind(self, problem, rng)
        for _ in range(self.num_attempts):
            via = yield from search.sub_path(problem.start)
            if self.successful(0, via.cost):
                goal = yield from search.sub_path(problem.start, via.posture)
                if self.successful(1, goal.cost):
                    return

    @property
    def stop_costs(self) -> tuple[float, float]:
        """Costs of SP1 and SP2 below which their searches end."""
        return self.stop_cost_sp1, self.stop_cost_sp2

    def successful(self, path: int, cost: Any) -> Any:
        """Return whether costs of a sub-path (0: SP1, 1: SP2) are a success."""
        return cost < (self.stop_costs[path] if self.success == "threshold" else np.inf)

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
        """Return postures A and B, uniform within the joint limits, (2, joints, count)."""
        low, high = problem.joint_limits.T
        return np.asarray(low[:, None] + (high - low)[:, None] * rng.random((2, len(low), count)))

    def cost(self, problem: Problem, population: FloatArray) -> JudgementArrays:
        """Judge pairs of postures A and B (2, joints, individuals): what random search draws.

        A pair costs as much as its SP2 if its SP1 is successful, else inf, like a finished plan of
        the algorithm. It is one evaluation of random search and takes two of the objective.
        """
        starts = np.repeat(problem.start[:, None], population.shape[2], axis=1)
        first, second = np.ascontiguousarray(population)
        via = judge_paths(starts, first, self.judging(problem, 0))
        goal = judge_paths(first, second, self.judging(problem, 1))
        named = dict(zip(sub_path.TERMS, (*via, *goal), strict=True))
        cost = np.where(self.successful(0, named["of_sp1"]), named["of_sp2"], np.inf)
        if self.answers_are_proven:
            Proofs(self, problem).settle(cost, lambda k: self.solution(problem, population, k))
        queries = 2 * problem.collision.queries * population.shape[2]
        return JudgementArrays(cost, np.asarray(self.successful(1, cost)), queries, named)

    def judging(self, problem: Problem, path: int) -> Judging:
        """Return collision model and objective of a sub-path (0: SP1, 1: SP2)."""
        own, (target, box) = problem.collision, (problem.targets[path], problem.boxes[path])
        return Judging(own.arm, own.ellipses, own.path, target, box, self.objective.weights)

    def solution(self, problem: Problem, population: FloatArray, individual: int) -> FloatArray:
        """Return a pair of postures A and B as a flat solution."""
        return np.concatenate([problem.start, *population[:, :, individual]])

    def motion(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the motion of a solution: start, A, B, straight in joint space, in equal times."""
        return Motion(self._postures(problem, solution))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return the terms of both sub-paths, and the first contact of each.

        Positions, links and obstacles are counted from 1; 0: the sub-path is free.
        """
        postures = self._postures(problem, solution)
        terms = self.judge_plan(problem, solution)
        named = dict(zip(sub_path.TERMS, terms.ravel().tolist(), strict=True))
        for k in range(2):
            contact = problem.collision.contact(*postures[k : k + 2]) or (0, 0, 0, False)
            for name, value in zip(CONTACT, contact, strict=True):
                named[f"contact_{name}_sp{k + 1}"] = float(value)
        return named

    def cost_of_terms(self, terms: Mapping[str, float]) -> float:
        """Return the cost of the second sub-path."""
        return terms["of_sp2"]

    def departures(self, problem: Problem, solution: FloatArray) -> list[str]:
        """Compare the start with the task's, and all postures with the joint limits."""
        return of_postures(self._postures(problem, solution), problem.start, problem.joint_limits)

    def judge_plan(self, problem: Problem, solution: FloatArray) -> FloatArray:
        """Return cost, position error and joint displacement of both sub-paths, (2, 3)."""
        start, via, goal = self._postures(problem, solution)[:, :, None].copy()
        first = judge_paths(start, via, self.judging(problem, 0))
        second = judge_paths(via, goal, self.judging(problem, 1))
        return np.array([first[:, 0], second[:, 0]])

    def memory(self, problem: Problem) -> int:
        """Return the memory of the postures of a search, coded in bits if they are."""
        ga = self.ga
        coded = 2 * ga.bits_per_gene if isinstance(ga, sub_path.BinaryGenetic) else 0
        return 8 * (COPIES + coded) * num_values(self.shape(problem)) * ga.population_size

    def shape(self, problem: Problem) -> tuple[tuple[int], ...]:
        """Return the documented shape of a solution: three postures of (joints,)."""
        return ((len(problem.start),),) * 3

    def _postures(self, problem: Problem, solution: FloatArray) -> FloatArray:
        return in_shape(solution, 3, len(problem.start))


class SequentialSearch(WrappedPlanner):
    """Searches SP1, then SP2, by uniform draws; everything but the operators is as in the planner.

    Every generation is drawn anew, and the best individual drawn so far ends the sub-path. (Random
    search draws both sub-paths at once and must succeed in both with one draw.)
    """

    search: ClassVar[type[sub_path.DrawnSearch]] = sub_path.DrawnSearch

    planner: RedundantGa  # the planner whose loop, sampling and budget are used

    @field_validator("planner", mode="before")
    @classmethod
    def _planner_fits(cls, planner: Any) -> Any:
        if isinstance(planner, Component) and not isinstance(planner, RedundantGa):
            must = f"redundant_ga, whose sub-paths {cls.component} draws"
            raise SettingError("planner", must, planner.component)
        return planner

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the generations of all draws; their indices go on counting."""
        return self.planner.evolve(problem, rng, self.search)


@kernel
def bring_tips_to(ends: FloatArray, target: FloatArray, limits: FloatArray, arm: PlanarArm) -> None:
    """Bring the tips of postures (joints, individuals) [rad] to a place; see `bring_tip_to`."""
    q = np.empty(len(ends))
    for k in range(ends.shape[1]):
        q[:] = ends[:, k]
        bring_tip_to(q, target, limits, arm)
        ends[:, k] = q


class DescendingSearch(sub_path.DrawnSearch):
    """Draws postures between the start p of the sub-path and uniform ones, and moves their tips."""

    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial population; see `Search`."""
        self._descend(rng.random(self._num_genes * self._ga.population_size), 0)
        self.states = [state_bytes(rng.bit_generator)]
        self.end = super(sub_path.DrawnSearch, self)._best_end(0)

    def advance(self, uniforms: FloatArray, normals: FloatArray, first: int) -> int:
        """Compute one generation; see `Search`."""
        self.costs = self.costs[:, :, : self._ga.num_offspring]
        self._descend(uniforms[0], (first + 1) % self.num_places)
        return first + 1

    def _descend(self, uniforms: FloatArray, place: int) -> None:
        """Write and judge p + s (r − p) after the descent, s = 0 … 1, r by (joints · count,)."""
        begin, judging, count = self._postures[-1], self._sub_path.judging, self.costs.shape[2]
        limits, shares = self._problem.joint_limits, np.linspace(0.0, 1.0, count)
        low, high = limits.T[:, :, None]
        drawn = low + (high - low) * uniforms.reshape(len(low), count)
        ends = (1.0 - shares) * begin[:, None] + shares * drawn
        bring_tips_to(ends, judging.target, limits, judging.arm)
        costs = kernels.judge_paths(self._sub_path.starts[:, :count].copy(), ends, judging)
        self._tables[place, :, :count] = np.concatenate([ends, costs])
        self._summarise(place)


class InverseKinematics(SequentialSearch):
    """Searches SP1, then SP2, by damped least squares from many postures; one may be enough.

    An evaluation is a posture that is judged, wherever its descent ended. The steps of the descent
    count as none: compare CPU time, too. The paper compares its algorithm by way of others with the
    pseudoinverse method (section 6); damped least squares of Nakamura & Hanafusa 1986 stand for it.
    """

    search: ClassVar[type[sub_path.DrawnSearch]] = DescendingSearch

    def prepare(self, robot: Robot, scenario: PickAndPlace) -> Any:
        """Prepare the planner's problem; a SettingError refuses genes that are no joint angles."""
        if not isinstance(self.planner.ga, sub_path.RealGenetic):
            must = "a real_genetic, whose genes are joint angles"
            raise SettingError("ga", must, self.planner.ga.component)
        return super().prepare(robot, scenario)
