"""Point-to-point motion of a redundant planar arm among ellipses (Lavoie & Boudreau 2001).

The motion has two sub-paths, straight in joint space: from the start to a posture A whose tip is
near the via point (SP1), from A to a posture B whose tip is near the goal and inside the box (SP2).
A genetic algorithm searches A; if it is successful, a second one searches B; both are repeated
until both are successful, up to `num_attempts` times.

A population is an array (joints, individuals) [rad] of end postures of one sub-path, or (joints ×
bits, individuals). A solution is flat: three postures (start, A, B) × joints [rad].

The best so far is a whole plan. Only the second search has plans; a plan costs its objective of SP2
(Eq. 4), and the plan of the lowest cost over all generations and attempts is the best so far. Until
there is a plan of finite cost, the best posture A of any attempt so far takes its place, as a plan
that stays there, at the cost inf. The individuals of SP1 cost their objective of SP1; the best plan
in a generation of SP1 costs inf.
"""

from collections.abc import Generator, Iterator
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from evoexp.collision.models.link_ellipses import LinkEllipses
from evoexp.errors import SettingError
from evoexp.numeric.vectors import LANES
from evoexp.objectives.reaching import Reaching
from evoexp.paths.motion import Motion
from evoexp.planners.departures import joint_names, of_limits, of_place
from evoexp.planners.planner import COPIES, Candidate, Keeper, PlannerDefaults, num_values
from evoexp.planners.proofs import Acceptance, Proofs
from evoexp.planners.reaching_tasks import Problem, reaching_problem
from evoexp.planners.redundant_ga import kernels
from evoexp.planners.redundant_ga.kernels import RESULTS, Judging
from evoexp.planners.redundant_ga.settings import BinaryGenetic, RealGenetic, SelectiveSettings
from evoexp.planners.redundant_ga.sub_path import BestEnd, Search
from evoexp.records import BoolArray, FloatArray, Generation
from evoexp.robots.assembly import Robot
from evoexp.scenarios.pick_and_place import PickAndPlace
from evoexp.validation import Component, Count, Positive

TERMS = (
    ("of", ""),
    ("position_error", ""),
    ("joint_displacement", "_rad"),
)  # of each sub-path, with unit
CONTACT = ("position", "obstacle", "link", "swept")  # the fields of `link_ellipses.Contact`


class Judgement(NamedTuple):
    """Judged plans.

    Attributes:
        cost: (individuals,) objective of SP2; inf where SP1 is not successful.
        accepted: (individuals,) whether both sub-paths are successful.
        terms: Of every sub-path cost, position error and joint displacement, (2, 3, individuals).
        collision_queries: Configurations judged.
    """

    cost: FloatArray
    accepted: BoolArray
    terms: FloatArray
    collision_queries: int

    @property
    def feasible(self) -> BoolArray:
        """(individuals,) whether the paper's own rules accept each plan."""
        return self.accepted

    def named_terms(self, individual: int) -> dict[str, float]:
        """Return the terms of one plan by name."""
        return named_terms(self.terms[:, :, individual])


class RedundantGa(PlannerDefaults, Component):
    """The algorithm of Lavoie & Boudreau, sections 3 to 5.

    Random search takes the generations and evaluations of one search, those of `ga`; sequential
    search goes through the same attempts and searches as the algorithm.

    Attributes:
        num_attempts: How often SP1 and SP2 are searched at most.
        stop_cost_sp1: The search of SP1 ends where the objective is smaller.
        stop_cost_sp2: The same of SP2.
        success: A sub-path is successful below its stopping cost (`threshold`), or if its cost is
            `finite`.
        ga: Population, generations, operators.
        objective: Weights of Eq. 4.
        collision: Positions and chords that are tested.
        acceptance: Which ends of sub-paths may be the best one: those that the model accepts, or
            those of them whose sub-path the exact certifier proves; one that is refuted costs inf.
    """

    component: ClassVar[str] = "redundant_ga"
    goal_is_region: ClassVar[bool] = True

    num_attempts: Count
    stop_cost_sp1: Positive
    stop_cost_sp2: Positive
    success: Literal["threshold", "finite"]
    ga: SelectiveSettings
    objective: Reaching
    collision: LinkEllipses
    acceptance: Acceptance = "model"

    def prepare(self, robot: Robot, scenario: PickAndPlace) -> Problem:
        """Build the robot and check that the start fits it and is free of collision.

        Raises:
            SettingError: If it is not, or the robot has no joint limits to draw postures from.
        """
        if not isinstance(self.ga, RealGenetic | BinaryGenetic):
            raise SettingError("ga", "a real_genetic or a binary_genetic", self.ga.component)
        return reaching_problem(robot, scenario, self.collision)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the generations of all searches; their indices go on counting."""
        return self.search_in_turn(problem, rng, Search)

    def search_in_turn(
        self, problem: Problem, rng: np.random.Generator, kind: type[Search]
    ) -> Iterator[Generation]:
        """Yield the generations of SP1 and SP2 in turn, until both are successful.

        Args:
            problem: The prepared task.
            rng: Source of all random numbers.
            kind: What searches a sub-path: the genetic algorithm, or a control in its place.
        """
        plans, proofs = _Plans(self, problem), None
        if self.answers_are_proven:
            proofs = Proofs(self, problem)
        for _ in range(self.num_attempts):
            plans.attempts += 1
            search = self._new(kind, problem, (), proofs)
            via = yield from self._search(search, rng, plans, 0)
            if self.successful(0, via.cost):
                plans.via = via
                search = self._new(kind, problem, (via.posture,), proofs)
                goal = yield from self._search(search, rng, plans, 1)
                if self.successful(1, goal.cost):
                    return

    def _new(
        self,
        kind: type[Search],
        problem: Problem,
        via: tuple[FloatArray, ...],
        proofs: Proofs | None,
    ) -> Search:
        """Return the search of SP1, or of SP2 behind a posture A."""
        start = (problem.start, *via)

        def is_proven(end: FloatArray) -> bool:
            assert proofs is not None
            return proofs.is_proven(np.concatenate([*start, *[end] * (3 - len(start))]))

        judging, accepts = self._judging(problem, len(via)), is_proven if proofs else None
        return kind(self.ga, problem.joint_limits, judging, start[-1], accepts)

    def _search(
        self, search: Search, rng: np.random.Generator, plans: "_Plans", path: int
    ) -> Generator[Generation, None, BestEnd]:
        """Search the end of one sub-path (0: SP1, 1: SP2); yield generations, return the best."""
        search.begin(rng)
        yield plans.record(search, path, self.ga.population_size)
        for index in range(self.ga.num_generations):
            if search.best.cost < self._stop_costs[path]:
                break
            search.advance(rng, index)
            yield plans.record(search, path, self.ga.num_offspring)
        return search.best

    @property
    def _stop_costs(self) -> tuple[float, float]:
        return self.stop_cost_sp1, self.stop_cost_sp2

    def successful(self, path: int, cost: Any) -> Any:
        """Return whether costs of a sub-path (0: SP1, 1: SP2) are a success."""
        return cost < (self._stop_costs[path] if self.success == "threshold" else np.inf)

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
        """Return postures A and B, uniform within the joint limits, (2, joints, count)."""
        low, high = problem.joint_limits.T
        postures = rng.random((2, len(low), count))
        postures *= (high - low)[:, None]
        postures += low[:, None]
        return postures

    def cost(self, problem: Problem, population: FloatArray) -> Judgement:
        """Judge pairs of postures A and B (2, joints, individuals): what random search draws.

        A pair costs as much as its SP2 if its SP1 is successful, else inf, like a finished plan of
        the algorithm. It is one evaluation of random search and takes two of the objective.
        """
        starts = np.broadcast_to(problem.start[:, None], population.shape[1:])
        terms = np.array(
            [self._judge(problem, 0, starts, population[0]), self._judge(problem, 1, *population)]
        )
        cost = np.where(self.successful(0, terms[0, 0]), terms[1, 0], np.inf)
        if self.answers_are_proven:
            Proofs(self, problem).settle(cost, lambda k: self.solution(problem, population, k))
        queries = 2 * problem.collision.queries * population.shape[2]
        return Judgement(cost, np.asarray(self.successful(1, cost)), terms, queries)

    def _judge(
        self, problem: Problem, path: int, starts: FloatArray, ends: FloatArray
    ) -> FloatArray:
        """Return cost, position error and joint displacement of sub-paths, (3, individuals)."""
        count = starts.shape[1]
        lanes, results = np.arange(count + LANES), np.empty((RESULTS, count))
        starts, ends = np.ascontiguousarray(starts), np.ascontiguousarray(ends)
        hit = np.zeros(count, dtype=np.bool_)
        kernels.judge(starts, ends, lanes, count, self._judging(problem, path), results, hit)
        return results

    def _judging(self, problem: Problem, path: int) -> Judging:
        """Return collision model and objective of a sub-path."""
        collision = problem.collision
        return Judging(
            collision.arm,
            collision.ellipses,
            collision.path,
            problem.targets[path],
            problem.boxes[path],
            self.objective.weights,
        )

    def solution(self, problem: Problem, population: FloatArray, individual: int) -> FloatArray:
        """Return a pair of postures A and B as a flat solution."""
        return np.concatenate([problem.start, *population[:, :, individual]])

    def motion(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the motion of a solution: start, A, B, straight in joint space, in equal times."""
        return Motion(np.ascontiguousarray(self._postures(problem, solution)))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return the terms of both sub-paths, and the first contact of each.

        Positions, links and obstacles are counted from 1; 0: the sub-path is free.

        Raises:
            ValueError: If the solution has another size than 3 × joints.
        """
        postures = self._postures(problem, solution)
        named = named_terms(self.judge_plan(problem, solution))
        for k in range(2):
            contact = problem.collision.contact(*postures[k : k + 2]) or (0, 0, 0, False)
            for name, value in zip(CONTACT, contact, strict=True):
                named[f"contact_{name}_sp{k + 1}"] = float(value)
        return named

    def departures(self, problem: Problem, solution: FloatArray) -> list[str]:
        """Compare the start with the task's, and all postures with the joint limits."""
        postures = self._postures(problem, solution)
        names = joint_names(len(problem.start))
        return [
            *of_place("the start", postures[0], problem.start, "rad"),
            *of_limits(names, postures.T, problem.joint_limits, "rad"),
        ]

    def judge_plan(self, problem: Problem, solution: FloatArray) -> FloatArray:
        """Return cost, position error and joint displacement of both sub-paths, (2, 3)."""
        ends = self._postures(problem, solution)[:, :, None]
        return np.array([self._judge(problem, k, *ends[k : k + 2])[:, 0] for k in range(2)])

    def memory(self, problem: Problem) -> int:
        """Return the memory of the postures of a search, coded in bits if they are."""
        ga = self.ga
        coded = 2 * ga.bits_per_gene if isinstance(ga, BinaryGenetic) else 0
        return 8 * (COPIES + coded) * num_values(self.shape(problem)) * ga.population_size

    def shape(self, problem: Problem) -> tuple[tuple[int], ...]:
        """Return the documented shape of a solution: three postures of (joints,)."""
        return ((len(problem.start),),) * 3

    def _postures(self, problem: Problem, solution: FloatArray) -> FloatArray:
        num = len(problem.start)
        if solution.shape != (3 * num,):
            raise ValueError(f"a solution has {3 * num} values, was {solution.shape}")
        return solution.reshape(3, num)


class _Plans:
    """The best plan so far, and the records of generations.

    Attributes:
        attempts: Attempts so far.
        via: The posture A that SP2 starts from.
    """

    def __init__(self, planner: RedundantGa, problem: Problem) -> None:
        self._planner, self._problem, self._keeper = planner, problem, Keeper()
        self.attempts, self.via = 0, BestEnd(np.inf, problem.start, np.empty(0))
        self._via_cost = np.inf  # of the posture A that takes the place of a plan

    def record(self, search: Search, path: int, count: int) -> Generation:
        """Improve the best plan by a population of which `count` are new; return its record."""
        best, keeper = search.best, self._keeper
        if path == 0:
            self._improve_via(best)
        elif best.cost < keeper.cost:
            terms = named_terms(np.array([self.via.terms, best.terms]))
            self._keep(best.cost, self.via.posture, best.posture, terms)
        found = keeper.record(
            search.statistics,
            search.costs[None, :],
            search.genomes,
            lowest=np.inf if path == 0 else float(search.costs[search.statistics.best]),
            num_feasible=search.num_finite,
            evaluations=count,
            collision_queries=count * self._problem.collision.queries,
        )
        counted = {"attempts": float(self.attempts), "sub_path": path + 1.0}
        return found._replace(terms=found.terms | counted)

    def _improve_via(self, best: BestEnd) -> None:
        """Without a plan of finite cost, keep the best posture A as a plan that stays there."""
        keeper = self._keeper
        if keeper.index < 0 or (keeper.cost == np.inf and best.cost < self._via_cost):
            self._via_cost = best.cost
            plan = np.concatenate([self._problem.start, best.posture, best.posture])
            terms = named_terms(self._planner.judge_plan(self._problem, plan))
            self._keep(np.inf, best.posture, best.posture, terms)

    def _keep(
        self, cost: float, via: FloatArray, goal: FloatArray, terms: dict[str, float]
    ) -> None:
        plan = np.concatenate([self._problem.start, via, goal])
        self._keeper.keep(cost, Candidate(plan, terms, bool(self._planner.successful(1, cost))))


def named_terms(terms: FloatArray) -> dict[str, float]:
    """Return cost, position error and joint displacement of both sub-paths (2, 3) by name."""
    names = (f"{name}_sp{path}{unit}" for path in (1, 2) for name, unit in TERMS)
    return dict(zip(names, terms.ravel().tolist(), strict=True))
