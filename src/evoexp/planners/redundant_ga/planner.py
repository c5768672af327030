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

from collections.abc import Generator, Iterator, Mapping
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
from evoexp.planners.redundant_ga.settings import BinaryGenetic, RealGenetic, SelectiveSettings
from evoexp.planners.redundant_ga.sub_path import BestEnd, RunMemory, Search
from evoexp.planners.redundant_ga.sub_path_costs import RESULTS, Judging, judge_paths
from evoexp.records import Block, BoolArray, FloatArray
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
    """Judged plans."""

    cost: FloatArray  # (individuals,) objective of SP2; inf where SP1 is not successful
    accepted: BoolArray  # (individuals,) whether both sub-paths are successful
    # of every sub-path cost, position error and joint displacement, (2, 3, individuals)
    terms: FloatArray
    collision_queries: int  # configurations judged

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
    """

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
        """Build the robot and check that the start fits it and is free of collision.

        Raises:
            SettingError: If it is not, or the robot has no joint limits to draw postures from.
        """
        if not isinstance(self.ga, RealGenetic | BinaryGenetic):
            raise SettingError("ga", "a real_genetic or a binary_genetic", self.ga.component)
        return reaching_problem(robot, scenario, self.collision)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the generations of all searches; their indices go on counting."""
        return self.search_in_turn(problem, rng, Search)

    def search_in_turn(
        self, problem: Problem, rng: np.random.Generator, kind: type[Search]
    ) -> Iterator[Block]:
        """Yield the generations of SP1 and SP2 in turn, until both are successful.

        Args:
            problem: The prepared task.
            rng: Source of all random numbers.
            kind: What searches a sub-path: the genetic algorithm, or a control in its place.
        """
        judgings = tuple(self._judging(problem, path) for path in range(2))
        plans, proofs = _Plans(self, problem, judgings), None
        memory = RunMemory(self.ga, problem.joint_limits, rng)
        if self.answers_are_proven:
            proofs = Proofs(self, problem)

        def search_from(*start: FloatArray) -> Search:
            """Return the search of SP1, or of SP2 behind a posture A."""

            def is_proven(end: FloatArray) -> bool:
                assert proofs is not None
                return proofs.is_proven(np.concatenate([*start, *[end] * (3 - len(start))]))

            path = len(start) - 1
            stop_cost, accepts = self._stop_costs[path], is_proven if proofs else None
            return kind(memory, judgings[path], start[-1], stop_cost, accepts)

        for _ in range(self.num_attempts):
            plans.begin_attempt()
            via = yield from self._search(search_from(problem.start), plans, 0)
            if self.successful(0, via.cost):
                plans.via = via
                search = search_from(problem.start, via.posture)
                goal = yield from self._search(search, plans, 1)
                if self.successful(1, goal.cost):
                    return

    def _search(
        self, search: Search, plans: "_Plans", path: int
    ) -> Generator[Block, None, BestEnd]:
        """Search the end of one sub-path (0: SP1, 1: SP2); yield generations, return the best."""
        search.begin()
        plans.begin(path)
        yield plans.record(search, self.ga.population_size)
        for index in range(self.ga.num_generations):
            if search.lowest < self._stop_costs[path]:
                break
            search.advance(index)
            yield plans.record(search, self.ga.num_offspring)
        return search.best()

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
        return _judge(self._judging(problem, path), starts, ends)

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

    def cost_of_terms(self, terms: Mapping[str, float]) -> float:
        """Return the cost of the second sub-path."""
        return terms["of_sp2"]

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
        via: The posture A that SP2 starts from.
    """

    def __init__(self, planner: RedundantGa, problem: Problem, judgings: Any) -> None:
        self._planner, self._problem, self._keeper = planner, problem, Keeper()
        self._judgings, self._queries = judgings, problem.collision.queries
        self._attempts, self._path = 0, 0
        self.via = BestEnd(np.inf, problem.start, np.empty(0))
        self._via_cost = np.inf  # of the posture A that takes the place of a plan

    def begin_attempt(self) -> None:
        """Count an attempt."""
        self._attempts += 1

    def begin(self, path: int) -> None:
        """Begin with a sub-path (0: SP1, 1: SP2)."""
        self._path, keeper = path, self._keeper
        keeper.best = keeper.best._replace(terms=keeper.best.terms | self._counts)

    @property
    def _counts(self) -> dict[str, float]:
        return {"attempts": float(self._attempts), "sub_path": self._path + 1.0}

    def record(self, search: Search, count: int) -> Block:
        """Improve the best plan by a population of which `count` are new; return its record."""
        keeper, path, costs = self._keeper, self._path, search.costs
        if path == 0:
            self._improve_via(search)
        elif search.lowest < keeper.cost:
            best = search.best()
            terms = named_terms(np.array([self.via.terms, best.terms]))
            self._keep(best.cost, self.via.posture, best.posture, terms)
        return keeper.record(
            search.statistics,
            costs[None, :],
            search.genomes,
            lowest=np.inf if path == 0 else costs.item(search.statistics.best),
            num_feasible=search.num_finite,
            evaluations=count,
            collision_queries=count * self._queries,
        )

    def _improve_via(self, search: Search) -> None:
        """Without a plan of finite cost, keep the best posture A as a plan that stays there."""
        keeper = self._keeper
        if keeper.index < 0 or (keeper.cost == np.inf and search.lowest < self._via_cost):
            best = search.best()
            self._via_cost, start, end = best.cost, self._problem.start[:, None], best.posture
            ends = (start, end[:, None]), (end[:, None], end[:, None])
            pairs = zip(self._judgings, ends, strict=True)
            terms = np.array([_judge(judging, *pair)[:, 0] for judging, pair in pairs])
            self._keep(np.inf, end, end, named_terms(terms))

    def _keep(
        self, cost: float, via: FloatArray, goal: FloatArray, terms: dict[str, float]
    ) -> None:
        plan = np.concatenate([self._problem.start, via, goal])
        solved = bool(self._planner.successful(1, cost))
        self._keeper.keep(cost, Candidate(plan, terms | self._counts, solved))


def _judge(judging: Judging, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Return cost, position error and joint displacement of sub-paths, (3, individuals).

    Args:
        judging: Collision model and objective.
        starts: (joints, individuals) [rad].
        ends: (joints, individuals) [rad].
    """
    count = starts.shape[1]
    lanes, results = np.arange(count + LANES), np.empty((RESULTS, count))
    starts, ends = np.ascontiguousarray(starts), np.ascontiguousarray(ends)
    hit = np.zeros(count, dtype=np.bool_)
    judge_paths(starts, ends, lanes, count, judging, results, hit)
    return results


def named_terms(terms: FloatArray) -> dict[str, float]:
    """Return cost, position error and joint displacement of both sub-paths (2, 3) by name."""
    names = (f"{name}_sp{path}{unit}" for path in (1, 2) for name, unit in TERMS)
    return dict(zip(names, terms.ravel().tolist(), strict=True))
