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

from evoexp.collision.planar.link_ellipses import LinkEllipses
from evoexp.errors import SettingError
from evoexp.objectives.reaching import Reaching
from evoexp.paths.motion import Motion
from evoexp.planners.answers import in_shape, of_postures
from evoexp.planners.planner import COPIES, JudgementArrays, PlannerDefaults, num_values
from evoexp.planners.proofs import Acceptance, Proofs
from evoexp.planners.reaching_tasks import Problem, reaching_problem
from evoexp.planners.redundant_ga.kernels import Judging, judge_paths
from evoexp.planners.redundant_ga.sub_path import (
    TERMS,
    BinaryGenetic,
    RealGenetic,
    Search,
    SelectiveSettings,
)
from evoexp.records import Block, FloatArray
from evoexp.robots.assembly import Robot
from evoexp.scenarios.pick_and_place import PickAndPlace
from evoexp.validation import Component, Count, Positive

CONTACT = ("position", "obstacle", "link", "swept")  # the fields of `link_ellipses.Contact`


class RedundantGa(PlannerDefaults, Component):
    """The algorithm of Lavoie & Boudreau, sections 3 to 5."""

    component: ClassVar[str] = "redundant_ga"
    goal_is_region: ClassVar[bool] = True

    num_attempts: Count  # how often SP1 and SP2 are searched at most
    stop_cost_sp1: Positive  # the search of SP1 ends where the objective is smaller
    stop_cost_sp2: Positive  # the same of SP2
    # A sub-path is successful below its stopping cost (`threshold`), or if its cost is
    # `finite`
    success: Literal["threshold", "finite"]
    ga: SelectiveSettings  # population, generations, operators
    objective: Reaching  # weights of Eq. 4
    collision: LinkEllipses  # positions and chords that are tested
    # which ends of sub-paths may be the best one: those that the model accepts, or those of
    # them whose sub-path the exact certifier proves; one that is refuted costs inf
    acceptance: Acceptance = "model"

    def prepare(self, robot: Robot, scenario: PickAndPlace) -> Problem:
        """Build the robot and check that the start fits it and is free of collision."""
        if not isinstance(self.ga, RealGenetic | BinaryGenetic):
            raise SettingError("ga", "a real_genetic or a binary_genetic", self.ga.component)
        return reaching_problem(robot, scenario, self.collision)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the generations of all searches; their indices go on counting."""
        return self.search_in_turn(problem, rng, Search)

    def search_in_turn(
        self, problem: Problem, rng: np.random.Generator, kind: type[Search]
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
        named = dict(zip(TERMS, (*via, *goal), strict=True))
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
        named = dict(zip(TERMS, terms.ravel().tolist(), strict=True))
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
        coded = 2 * ga.bits_per_gene if isinstance(ga, BinaryGenetic) else 0
        return 8 * (COPIES + coded) * num_values(self.shape(problem)) * ga.population_size

    def shape(self, problem: Problem) -> tuple[tuple[int], ...]:
        """Return the documented shape of a solution: three postures of (joints,)."""
        return ((len(problem.start),),) * 3

    def _postures(self, problem: Problem, solution: FloatArray) -> FloatArray:
        return in_shape(solution, 3, len(problem.start))
