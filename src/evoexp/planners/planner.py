"""A planner's obligations, its usual answers, and the one keeper of the best solution so far.

A planner is a component whose fields are its settings. It never logs, draws, sleeps, reads the
clock or a file; its randomness is an argument. `Planner` lists the members that every planner
writes, `PlannerDefaults` has the answers of most planners. `evoexp.testing` checks all obligations.
"""

import math
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.scene import Part
from evoexp.evolution.succession import cost_statistics
from evoexp.paths.motion import Motion
from evoexp.planners.answers import CoverShape, Listing
from evoexp.planners.answers import JudgementArrays as JudgementArrays
from evoexp.planners.answers import Shape as Shape
from evoexp.planners.answers import num_values as num_values
from evoexp.records import Best, Block, BoolArray, FloatArray
from evoexp.validation import Component

Reproducibility = Literal["bits", "environment"]
Populations = Generator[FloatArray, JudgementArrays, None]
# Copies of a population that a run of most planners holds: parents, offspring, paths between them.
COPIES = 5


class Planner(Protocol):
    """Members that a planner writes itself; `problem` is the value that its `prepare` returned."""

    # the registered name; a guest's begins with the name of its distribution
    component: ClassVar[str]
    revision: ClassVar[int]  # raised whenever the same settings give other results than before

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Build the robot, check the scenario against it, return the problem.

        The annotations of both parameters name the types of robots and scenarios that fit.

        Raises:
            SettingError: If robot, scenario and settings contradict each other.
        """

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the initial population, then all generations, one or several per `Block`."""

    def sample(self, problem: Any, rng: np.random.Generator, count: int) -> FloatArray:
        """Draw `count` individuals as the initial population is drawn; they are the last axis.

        Raises:
            SettingError: If the planner has several populations, one after the other.
        """

    def cost(self, problem: Any, population: FloatArray) -> JudgementArrays:
        """Judge a population as `sample` returns it."""

    def solution(self, problem: Any, population: FloatArray, individual: int) -> FloatArray:
        """Return one individual of a population as a flat solution."""

    def motion(self, problem: Any, solution: FloatArray) -> Motion | None:
        """Return the joint-space motion of a solution; None where the answer is no motion."""

    def evaluate(self, problem: Any, solution: FloatArray) -> dict[str, float]:
        """Return the named terms of a solution, as `evoexp evaluate` prints them.

        Raises:
            ValueError: If the solution has not the documented shape.
        """

    def shape(self, problem: Any) -> Shape:
        """Return the documented shape of a solution, part by part."""


class PlannerDefaults:
    """The usual answers of a planner, to be inherited before `Component`.

    They need a planner with a field `ga` that has `population_size`, `num_offspring` and
    `num_generations`, and a problem with a `scene` (None: nothing to judge by) and a
    `security_margin`.
    """

    # `bits`: the same seed gives the same bits on every machine; `environment`: only on
    # machines with the same libraries and processor (`reproduce` then compares numbers, to
    # 1e-9, where the environment differs)
    reproducibility: ClassVar[Reproducibility] = "bits"
    # whether it is a truth that needs no seed, and so has one replicate
    is_reference: ClassVar[bool] = False
    # whether `cost` takes any real numbers within its `bounds` where those of `sample` differ
    is_real_coded: ClassVar[bool] = False
    # whether a solution that is not `solved` may miss the goal, which `departures` do not tell
    goal_is_region: ClassVar[bool] = False

    if TYPE_CHECKING:
        ga: Any  # has `population_size`, `num_offspring` and `num_generations`
        shape: ClassVar[Callable[..., Shape]]

    @property
    def answers_are_proven(self) -> bool:
        """Whether the search accepts proven answers only: see its field `acceptance`, if any."""
        return getattr(self, "acceptance", "model") != "model"

    @property
    def num_generations(self) -> int:
        """Generations after the initial one, at most."""
        return int(self.ga.num_generations)

    def num_evaluations(self, index: int) -> int:
        """Return how many individuals of a population generation `index` evaluates, 0 the initial.

        A planner that starts anew after a failed attempt says so of each attempt. The last
        generation of a planner that ends by itself (`stop_reason`) may evaluate fewer.
        """
        return int(self.ga.num_offspring if index else self.ga.population_size)

    def improve(
        self, problem: Any, population: FloatArray, rng: np.random.Generator
    ) -> FloatArray | None:
        """Return a population after one pass of the planner's local operator, without evolution.

        Controls repeat it at equal evaluations. `population` itself stays as it is.

        Returns:
            Like `sample`; None if the planner has no such operator.
        """
        return None

    def parts(self, problem: Any, motion: Motion) -> Sequence[Part]:
        """Return the pieces of a motion in the order of time, each with its exact bodies.

        Most motions are one piece; without pieces there is nothing to judge by.
        """
        bodies = problem.scene
        return () if bodies is None else (Part(bodies, 0, motion.num_segments),)

    def security_margin(self, problem: Any) -> float:
        """Return the clearance that the task requires [length unit of the scene]."""
        return float(problem.security_margin)

    def cost_of_terms(self, terms: Mapping[str, float]) -> float:
        """Return the recorded cost of a solution, given its terms as `evaluate` names them.

        NaN if they do not determine it. `verify` compares it with a finite stored cost.
        """
        return terms.get("cost", math.nan)

    def departures(self, problem: Any, solution: FloatArray) -> Sequence[str]:
        """Return the reasons why a solution does not solve the task, each in a phrase.

        For example another start, a joint beyond its limits or a forbidden move. Collisions do not
        belong here (`parts` are judged for them), nor a goal that a search only comes near to.
        """
        return ()

    def memory(self, problem: Any) -> int:
        """Return an estimate of the memory that a run takes beyond that of its problem [B].

        It need not be exact, but must grow with populations, paths and generations as the memory
        does: a run that needs more memory than there is does not start.
        """
        individuals = max(self.num_evaluations(0), self.num_evaluations(1))
        return 8 * COPIES * num_values(self.shape(problem)) * individuals

    def prior_queries(self, problem: Any) -> int:
        """Return the number of configurations that the task itself, as a map, calls free or not.

        Comparisons add them to the queries of a run: another planner must query them one by one.
        """
        return 0

    def listing(self, problem: Any, solution: FloatArray) -> Listing | None:
        """Return a table with one row per configuration; None if the planner has none."""
        return None

    def notes(self, problem: Any) -> Sequence[str]:
        """Return remarks on settings and problem, one per line, for `show` and the report."""
        return ()

    def covers(self, problem: Any) -> Sequence[CoverShape]:
        """Return the spheres and capsules that the search tests in place of the robot's bodies.

        They are drawn beside the bodies. A search that tests other shapes, or the bodies
        themselves, returns none.
        """
        return ()


# all members that a planner must have, by name
MEMBERS = {
    name: getattr(kind, name, None)
    for kind in (Planner, PlannerDefaults)
    for name in {**kind.__annotations__, **vars(kind)}
    if name[0] != "_"
}


class Candidate(NamedTuple):
    """A solution as it is recorded."""

    solution: FloatArray  # flat; never changed afterwards
    terms: dict[str, float]  # the paper's own terms of it
    solved: bool  # whether the planner's own model accepts it


class Keeper:
    """Keeps the best solution so far and the counts, and makes blocks of generations."""

    __slots__ = ("_tried", "best", "collision_queries", "cost", "evaluations", "index")

    def __init__(self) -> None:
        self.index = -1  # of the last recorded generation
        self.cost = self._tried = np.inf  # least cost so far, and of what is not proven
        self.best = Candidate(np.empty(0), {}, False)  # the solution of that cost
        self.evaluations = self.collision_queries = 0  # so far

    def improves(self, cost: float) -> bool:
        """Return whether to keep a cost: it is lower than the best, or the first."""
        return cost < self.cost or self.index < 0

    def keep(self, cost: float, best: Candidate) -> None:
        """Keep a solution and its cost as the best so far."""
        self.cost, self.best = cost, best

    @property
    def standing(self) -> Best:
        """The best so far, as a block begins with it."""
        solution, terms, solved = self.best
        return Best(0, solution, self.cost, terms, solved)

    def keep_proven(
        self, costs: FloatArray, proven: BoolArray, candidate: Callable[[int, bool], Candidate]
    ) -> None:
        """Keep the cheapest proven individual; before there is one, the cheapest, at cost inf.

        Args:
            costs: (individuals,).
            proven: (individuals,) whether each is; what costs more than a proven one may be open.
            candidate: Makes a candidate of an individual, solved or not.
        """
        k, cheapest = int(np.argmin(np.where(proven, costs, np.inf))), int(np.argmin(costs))
        if proven[k] and costs[k] < self.cost:
            self.keep(float(costs[k]), candidate(k, True))
        elif not self.best.solved and (costs[cheapest] < self._tried or self.index < 0):
            self._tried = float(costs[cheapest])
            self.keep(np.inf, candidate(cheapest, False))

    def record_judged(
        self,
        planner: Any,  # makes a solution of the best individual
        problem: Any,
        population: FloatArray,  # individuals last, all of them new in this generation
        judgement: JudgementArrays,  # of this population
    ) -> Block:
        """Keep the best individual of a generation if it improves, and return a block of it."""
        feasible, k = judgement.feasible, cost_statistics(judgement.cost).best
        lowest = float(judgement.cost[k])

        def candidate(k: int, solved: bool) -> Candidate:
            solution = planner.solution(problem, population, k)
            return Candidate(solution, judgement.named_terms(k), solved)

        if planner.answers_are_proven:
            self.keep_proven(judgement.cost, feasible, candidate)
        elif self.improves(lowest):
            self.keep(lowest, candidate(k, bool(feasible[k])))
        num_feasible, queries = int(np.count_nonzero(feasible)), judgement.collision_queries
        return self.record(judgement.cost, population, queries, num_feasible=num_feasible)

    def record(
        self,
        judged: FloatArray,  # (individuals,) costs
        population: NDArray[Any],  # any shape
        collision_queries: int,  # configurations that this generation asked for
        *,
        num_feasible: int | None = None,  # for the planner's own model; None: all of a finite cost
        evaluations: int | None = None,  # of this generation; None: one per individual
        **differing: Any,  # fields of the block that do not follow from the above
    ) -> Block:
        """Count a generation and return a block of it."""
        best, mean, deviation = cost_statistics(judged)
        feasible = int(np.isfinite(judged).sum()) if num_feasible is None else num_feasible
        self.index += 1
        self.evaluations += len(judged) if evaluations is None else evaluations
        self.collision_queries += collision_queries
        columns = [judged.item(best)], [mean], [deviation], [feasible], [self.evaluations]
        totals, shown = [self.collision_queries], (judged[None], lambda place: population)
        block = Block(self.index, [self.standing], *columns, totals, *shown)
        return block._replace(**differing) if differing else block


class WrappedPlanner(PlannerDefaults, Component, is_base=True):
    """Answers as the wrapped planner does; controls write `populations`, references `evolve`."""

    planner: Any  # the planner that it stands beside; `Condition` checks that it is one

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem."""
        return self.planner.prepare(robot, scenario)

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Block]:
        """Yield a control's populations, judged as the wrapped planner judges its own."""
        keeper, judged, populations = Keeper(), None, self.populations(problem, rng)
        for _ in range(self.planner.num_generations + 1):
            population = next(populations) if judged is None else populations.send(judged)
            judged = self.planner.cost(problem, population)
            yield keeper.record_judged(self.planner, problem, population, judged)

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield the populations of a control; each is sent back judged."""
        raise NotImplementedError


def _as_wrapped(name: str) -> Any:
    if callable(MEMBERS[name]):
        return lambda self, *arguments: getattr(self.planner, name)(*arguments)
    return property(lambda self: getattr(self.planner, name))


_OWN = {"component", "revision", "reproducibility", "is_reference", "is_real_coded", "improve"}
for _name in MEMBERS.keys() - vars(WrappedPlanner).keys() - _OWN:
    setattr(WrappedPlanner, _name, _as_wrapped(_name))
