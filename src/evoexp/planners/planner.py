"""The planner's protocol: every obligation of a planner, and the one keeper of what it found.

A planner is a component whose fields are its settings. It never logs, draws, sleeps, reads the
clock or a file; its randomness is an argument. `PlannerDefaults` answers what most planners need
not answer for themselves; everything else a planner writes itself. `evoexp.testing` checks it all.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any, ClassVar, Literal, NamedTuple, Protocol, runtime_checkable

import numpy as np

from evoexp.collision.scene import Part, Scene
from evoexp.evolution.cost_statistics import CostStatistics
from evoexp.paths.motion import Motion
from evoexp.records import FloatArray, Generation

Reproducibility = Literal["bits", "environment"]
Shape = tuple[Any, ...]  # of a solution: one tuple per part; a leading ... stands for any number


class Judgement(Protocol):
    """A population, judged."""

    @property
    def cost(self) -> FloatArray:
        """(individuals,) lower is better; inf: infeasible."""

    @property
    def feasible(self) -> np.ndarray:
        """(individuals,) whether the planner's own model accepts each."""

    @property
    def collision_queries(self) -> int:
        """Configurations that were asked for, whatever the kernels skipped."""

    def named_terms(self, individual: int) -> dict[str, float]:
        """Return the paper's own terms of one individual."""


class Listing(NamedTuple):
    """A table with one row per configuration of a solution.

    Attributes:
        names: Of its columns.
        rows: Their values.
    """

    names: list[str]
    rows: list[list[Any]]


@runtime_checkable
class Planner(Protocol):
    """All that a planner offers; `problem` is whatever its own `prepare` returned.

    Attributes:
        component: The registered name; a guest's begins with the name of its distribution.
        revision: Raised whenever the same settings give other results than before.
        reproducibility: `bits`: the same seed gives the same bits on every machine; `environment`:
            on machines with the same libraries and processor only (`reproduce` then compares
            numbers, to 1e-9, where the environment differs).
        is_reference: Whether it is a truth that needs no seed, and so has one replicate.
    """

    component: ClassVar[str]
    revision: ClassVar[int]
    reproducibility: ClassVar[Reproducibility]
    is_reference: ClassVar[bool]

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Build the robot, check the scenario against it, return the problem.

        The types of both parameters say which robots and scenarios are taken.

        Raises:
            SettingError: If robot, scenario and settings contradict each other.
        """

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the initial population, then one `Generation` per generation."""

    def sample(self, problem: Any, rng: np.random.Generator, count: int) -> FloatArray:
        """Return `count` individuals as the initial population draws them, individuals last."""

    def cost(self, problem: Any, population: FloatArray) -> Judgement:
        """Judge a population as `sample` returns it."""

    def improve(
        self, problem: Any, population: FloatArray, rng: np.random.Generator
    ) -> FloatArray | None:
        """Return a population after one pass of the planner's local operator, evolution left out.

        Controls repeat it at equal evaluations; None: the planner has no such operator.
        """

    def num_evaluations(self, index: int) -> int:
        """Return how many individuals generation `index` (0: the initial one) evaluates."""

    @property
    def num_generations(self) -> int:
        """Generations after the initial one, at most."""

    def solution(self, problem: Any, population: FloatArray, individual: int) -> FloatArray:
        """Return one individual of a population as a flat solution."""

    def motion(self, problem: Any, solution: FloatArray) -> Motion | None:
        """Return the joint-space motion of a solution; None where the answer is no motion."""

    def parts(self, problem: Any, motion: Motion) -> Sequence[Part]:
        """Return the pieces of a motion, each with the bodies that the exact verdict judges.

        Of most problems the whole motion is one; empty where there is nothing to judge by.
        """

    def evaluate(self, problem: Any, solution: FloatArray) -> dict[str, float]:
        """Return the named terms of a solution, `evoexp evaluate` prints them.

        Raises:
            ValueError: If the solution has not the documented shape.
        """

    def shape(self, problem: Any) -> Shape:
        """Return the documented shape of a solution, part by part."""

    def listing(self, problem: Any, solution: FloatArray) -> Listing | None:
        """Return a table with one row per configuration; None: there is none."""

    def notes(self, problem: Any) -> Sequence[str]:
        """Return remarks on settings and problem, one per line, for `show` and the report."""


class PlannerDefaults:
    """Answers of a planner that has nothing special to answer; to be inherited beside `Component`.

    The problem then has the attributes `scene` (a `Scene`, or None) and the planner a field `ga`
    with `population_size`, `num_offspring` and `num_generations`.
    """

    reproducibility: ClassVar[Reproducibility] = "bits"
    is_reference: ClassVar[bool] = False

    def improve(
        self, problem: Any, population: FloatArray, rng: np.random.Generator
    ) -> FloatArray | None:
        """Return None: there is no local operator."""
        return None

    def num_evaluations(self, index: int) -> int:
        """Return the size of the population at first, then the number of offspring."""
        ga: Any = getattr(self, "ga")  # noqa: B009  # a field of the planner
        return int(ga.num_offspring if index else ga.population_size)

    @property
    def num_generations(self) -> int:
        """Return the generations of the planner's `ga`."""
        ga: Any = getattr(self, "ga")  # noqa: B009
        return int(ga.num_generations)

    def parts(self, problem: Any, motion: Motion) -> Sequence[Part]:
        """Return the whole motion with the problem's scene."""
        bodies: Scene | None = problem.scene
        return () if bodies is None else (Part(bodies, 0, motion.num_segments),)

    def listing(self, problem: Any, solution: FloatArray) -> Listing | None:
        """Return None: there is no table."""
        return None

    def notes(self, problem: Any) -> Sequence[str]:
        """Return no remarks."""
        return ()


class Candidate(NamedTuple):
    """A solution as it is recorded.

    Attributes:
        solution: Flat; never changed afterwards.
        terms: The paper's own terms of it.
        solved: Whether the planner's own model accepts it.
    """

    solution: FloatArray
    terms: dict[str, float]
    solved: bool


class Keeper:
    """Keeps the best solution so far and the counts, and makes the records of generations.

    Attributes:
        index: Of the last generation recorded; −1 before the first.
        cost: Least cost so far.
        best: The solution of that cost.
        evaluations: Asked for by the algorithm so far.
        collision_queries: Configurations asked for so far.
    """

    def __init__(self) -> None:
        """Begin with nothing found."""
        self.index, self.cost = -1, np.inf
        self.best = Candidate(np.empty(0), {}, False)
        self.evaluations = self.collision_queries = 0

    def offer(self, cost: float, candidate: Callable[[], Candidate]) -> None:
        """Take over a candidate if it is strictly better, or the first one; else do not make it."""
        if cost < self.cost or not self.best.solution.size:
            self.cost, self.best = cost, candidate()

    def record(
        self,
        statistics: CostStatistics,
        costs: FloatArray,
        population: FloatArray,
        *,
        num_feasible: int,
        evaluations: int,
        collision_queries: int,
        **fields: Any,
    ) -> Generation:
        """Return the record of the next generation.

        Args:
            statistics: Of its costs.
            costs: (individuals,); see `Generation`.
            population: Any shape.
            num_feasible: Individuals that the planner's own model accepts.
            evaluations: That this generation took.
            collision_queries: That this generation took.
            fields: Of `Generation`, that are not what the keeper would say.
        """
        self.index += 1
        self.evaluations += evaluations
        self.collision_queries += collision_queries
        told: dict[str, Any] = {
            "best": self.best.solution,
            "best_cost": self.cost,
            "best_cost_in_generation": float(costs[statistics.best]) if costs.ndim == 1 else np.nan,
            "solved": self.best.solved,
            "terms": self.best.terms,
        }
        return Generation(
            index=self.index,
            mean_cost=statistics.mean,
            std_cost=statistics.std,
            num_feasible=num_feasible,
            evaluations=self.evaluations,
            collision_queries=self.collision_queries,
            costs=costs,
            population=population,
            **(told | fields),
        )
