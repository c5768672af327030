"""The records that are written: the only schema of logs and tables.

Records are flat. Quantities carry their unit in the name (`cpu_s`) unless the unit belongs to the
scene, which then names it (`length_unit`). Costs are minimised; `inf` means infeasible or not
evaluated.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


# fields of a summary that no two runs of a replicate share [s]
TIMES = ("certificate_s", "cpu_s", "wall_s")


class Generation(NamedTuple):
    """One generation of one replicate, as a planner yields it.

    `costs` and `population` are views into the planner's memory: valid until the next generation is
    asked for, hashed into the digest and not recorded. `best` is never changed: a better one is
    another array.
    """

    index: int  # type: ignore[assignment]  # 0 is the initial population
    best: FloatArray  # flat solution, best so far
    best_cost: float  # best so far
    best_cost_in_generation: float
    mean_cost: float  # over the finite costs of this generation
    std_cost: float  # over the finite costs of this generation, population standard deviation
    num_feasible: int  # individuals of this generation that the planner's own model accepts
    evaluations: int  # asked for by the algorithm since the start, skipped ones included
    collision_queries: int  # configurations judged since the start
    solved: bool  # whether the planner's own model accepts the best so far
    terms: dict[str, float]  # the paper's own terms of the best so far; written as term_<name>
    # (individuals,), with a leading axis for co-evolving populations, whose best cost is a team's
    costs: FloatArray
    population: FloatArray  # any shape
    # (populations, criteria, individuals), of generations whose front is recorded
    criteria: FloatArray | None = None
    # of the last generation: why the planner ends, if not because its generations are used up
    stop_reason: str = ""
    arrays: Mapping[str, NDArray[Any]] | None = None  # of references: attached as <name>.npy


class Standing(NamedTuple):
    """The best solution from a generation of a stretch on, up to the next standing."""

    place: int  # of this generation in its stretch
    best: FloatArray  # flat solution, never changed
    cost: float
    terms: dict[str, float]  # never changed
    solved: bool


class Stretch(NamedTuple):
    """Generations in a row: `Generation`, field by field."""

    first: int  # index of the first generation
    standings: list[Standing]  # the first one is at place 0
    lowest: list[float]  # of each generation; see `Generation.best_cost_in_generation`
    means: list[float]
    deviations: list[float]
    num_feasible: list[int]
    evaluations: list[int]
    collision_queries: list[int]
    costs: list[FloatArray]  # (generations, …, individuals) of some generations after the other
    states: list[bytes]  # of the generator, behind each generation
    times: list[float]  # [s] when each generation was there
    population: NDArray[Any] | None  # of the last generation, if it ends the run
    criteria: FloatArray | None = None  # likewise, if its front is recorded

    def copied(self) -> "Stretch":
        """Return the same without views of the planner's memory."""
        population, criteria = (
            None if array is None else array.copy() for array in (self.population, self.criteria)
        )
        return self._replace(population=population, criteria=criteria)

    def last(self) -> Generation:
        """Return the last generation; without a population unless it ends the run."""
        standing, population = self.standings[-1], self.population
        return Generation(
            self.first + len(self.lowest) - 1,
            standing.best,
            standing.cost,
            self.lowest[-1],
            self.means[-1],
            self.deviations[-1],
            self.num_feasible[-1],
            self.evaluations[-1],
            self.collision_queries[-1],
            standing.solved,
            standing.terms,
            self.costs[-1][-1],
            np.empty(0) if population is None else population,
            self.criteria,
        )


class GenerationRow(NamedTuple):
    """One generation as it is read back from a log, with its link of the chain."""

    index: int  # type: ignore[assignment]  # a tuple has a method of this name
    best_cost: float
    best_cost_in_generation: float
    mean_cost: float
    std_cost: float
    num_feasible: int
    evaluations: int
    collision_queries: int
    solved: bool
    terms: dict[str, float]
    chain: str  # 32 hex digits: xxh3-128 over everything up to and including this generation


class SolutionRow(NamedTuple):
    """The best solution so far, logged whenever it improves and at the end."""

    generation: int
    cost: float
    values: FloatArray  # flat


class FrontRow(NamedTuple):
    """Criteria of one population in one generation; a front holds those that no other dominates."""

    generation: int
    population: int
    criteria: FloatArray  # (individuals, criteria), all minimised


class ReplicateSummary(NamedTuple):
    """The one row that a finished or failed replicate leaves in `summary.parquet`."""

    condition: str  # 64 hex digits
    replicate: int
    status: str  # "done" | "failed"
    stop_reason: str  # why the planner ended; for a failed replicate the error in one line
    num_generations: int  # generations after the initial one
    best_cost: float
    first_feasible_generation: int | None
    evaluations: int
    collision_queries: int
    solved: bool  # by the paper's own collision model
    # by the exact certifier, over the whole motion; None: undecided, or there is no motion
    certified: bool | None
    certified_margin: bool | None  # the same of the clearance that the scenario requires
    # [length_unit] least distance of the bodies over the motion; 0 in contact, NaN without motion
    clearance: float
    clearance_at: float | None  # [instant] where the bodies are that close
    clearance_pair: str  # which bodies
    refuted_at: float | None  # [instant] of the first contact
    refuted_pair: str  # the bodies that touch
    length_unit: str  # of every clearance and length below
    terms: dict[str, float]  # written as term_<name>
    digest: str  # 32 hex digits: the end of the chain
    certificate_queries: int  # exact distances that the certifier asked for
    certificate_s: float  # its CPU time, part of cpu_s
    cpu_s: float
    wall_s: float
    allowed_contacts: str = ""  # pairs of bodies that may touch somewhere in the motion
    # [length_unit] their greatest depth; 0 where they never touch, None without such pairs
    penetration: float | None = None
    penetration_pair: str = ""  # which pair


def flatten(record: Any) -> dict[str, Any]:
    """Return a record as one flat dict; its `terms` become `term_<name>`."""
    row: dict[str, Any] = record._asdict()
    terms = row.pop("terms", {})
    row.update({f"term_{name}": value for name, value in terms.items()})
    return row
