"""The records that are written: the only schema of logs and tables.

Records are flat. Quantities carry their unit in the name (`cpu_s`) unless the unit belongs to the
scene, which then names it (`length_unit`). Costs are minimised; `inf` means infeasible or not
evaluated.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain, repeat
from operator import sub
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]  # of the shape that a comment or docstring gives
IntArray = NDArray[np.int64]  # of the shape that a comment or docstring gives
BoolArray = NDArray[np.bool_]


# column of a `Block` → field of a `Generation`
COLUMNS = {"lowest": "best_cost_in_generation", "means": "mean_cost", "deviations": "std_cost"}
COLUMNS |= {name: name for name in ("num_feasible", "evaluations", "collision_queries")}
# fields of a summary that no two runs of a replicate share [s]
TIMES = ("certificate_s", "cpu_s", "wall_s")


class Generation(NamedTuple):
    """One generation of one replicate: a row of a `Block`, as tests and guests see it.

    `costs` and `population` are views into the planner's memory, valid until the next generation is
    requested. They are hashed into the digest and not recorded. `best` is never changed: a better
    solution is another array.
    """

    index: int  # type: ignore[assignment]  # 0 is the initial population
    best: FloatArray  # flat solution, best so far
    best_cost: float  # best so far
    best_cost_in_generation: float  # lowest cost of its individuals
    mean_cost: float  # over the finite costs of this generation
    std_cost: float  # over the finite costs of this generation, population standard deviation
    num_feasible: int  # individuals of this generation that the planner's own model accepts
    evaluations: int  # asked for by the algorithm since the start, skipped ones included
    collision_queries: int  # configurations judged since the start
    solved: bool  # whether the planner's own model accepts the best so far
    terms: dict[str, float]  # the paper's own terms of the best so far; written as term_<name>
    # (individuals,), with a leading axis for co-evolving populations, whose best cost is a team's
    costs: FloatArray
    population: NDArray[Any]  # any shape
    # (populations, criteria, individuals), of generations whose front is recorded
    criteria: FloatArray | None = None
    # of the last generation: why the planner ends, if not because its generations are used up
    stop_reason: str = ""
    arrays: Mapping[str, NDArray[Any]] | None = None  # of references: attached as <name>.npy
    state: bytes = b""  # of the generator behind it; empty: where the generator is now


class Best(NamedTuple):
    """The best solution so far, from a generation of a block until the block's next best."""

    place: int  # of this generation in its block
    solution: FloatArray  # flat, never changed
    cost: float  # of this solution
    terms: dict[str, float]  # the paper's own terms of it, never changed
    solved: bool  # whether the planner's own model accepts it


class Block(NamedTuple):
    """Generations in a row, as a planner yields them: the fields of `Generation` as columns.

    Costs and populations are views into the planner's memory, valid until the next block.
    """

    first: int  # index of the first generation
    bests: Sequence[Best]  # the first one is at place 0
    lowest: Sequence[float]  # least cost of each generation
    means: Sequence[float]  # of the finite costs of each generation
    deviations: Sequence[float]  # population standard deviations of the same
    num_feasible: Sequence[int]  # individuals of each that the planner's own model accepts
    evaluations: Sequence[int]  # since the start, up to each
    collision_queries: Sequence[int]  # configurations judged since the start, up to each
    costs: FloatArray  # (generations, …, individuals)
    # shows the population at a place of the block; empty where the planner has it no longer
    population: Callable[[int], NDArray[Any]]
    # of the generator behind each generation; None: where it is now
    states: Sequence[bytes] | None = None
    criteria: FloatArray | None = None  # of the last generation, see `Generation`
    stop_reason: str = ""  # of the last generation, see `Generation`
    arrays: Mapping[str, NDArray[Any]] | None = None  # of the last generation, see `Generation`

    @classmethod
    def of(cls, generation: Generation) -> "Block":
        """Return a block of one generation."""
        g = generation
        return cls(
            first=g.index,
            bests=[Best(0, g.best, g.best_cost, dict(g.terms), g.solved)],
            **{column: [getattr(g, name)] for column, name in COLUMNS.items()},
            costs=g.costs[None],
            population=lambda place: g.population,
            states=[g.state] if g.state else None,
            criteria=g.criteria,
            stop_reason=g.stop_reason,
            arrays=g.arrays,
        )

    @property
    def num_generations(self) -> int:
        """Number of generations."""
        return len(self.lowest)

    @property
    def best(self) -> FloatArray:
        """The best solution so far, after the last generation."""
        return self.bests[-1].solution

    @property
    def best_of_each(self) -> list[Best]:
        """The best so far after each generation."""
        places = [best.place for best in self.bests[1:]]
        repeats = map(sub, [*places, self.num_generations], [0, *places])
        return [*chain.from_iterable(map(repeat, self.bests, repeats))]

    def head(self, count: int) -> "Block":
        """Return the first `count` generations, after the next one was requested.

        If all populations share one array, it then holds the next one.
        """
        population = self.population(count - 1) if count else np.empty(0)
        self.population(count)
        return self._replace(
            bests=[best for best in self.bests if best.place < count],
            **{column: getattr(self, column)[:count] for column in (*COLUMNS, "costs")},
            population=lambda place: population,
            states=None if self.states is None else self.states[:count],
            criteria=None,
            stop_reason="",
            arrays=None,
        )

    def generations(self) -> Iterator[Generation]:
        """Yield the generations one by one, each valid until the next one is requested."""
        last = self.num_generations - 1
        for k, best in enumerate(self.best_of_each):
            yield Generation(
                index=self.first + k,
                best=best.solution,
                best_cost=best.cost,
                **{name: getattr(self, column)[k] for column, name in COLUMNS.items()},
                solved=best.solved,
                terms=best.terms,
                costs=self.costs[k],
                population=self.population(k),
                criteria=self.criteria if k == last else None,
                stop_reason=self.stop_reason if k == last else "",
                arrays=self.arrays if k == last else None,
                state=b"" if self.states is None else self.states[k],
            )


def blocks(evolution: Iterable[Block | Generation]) -> Iterator[Block]:
    """Yield the blocks of an evolution; a guest's single generation is a block of one."""
    for each in evolution:
        yield each if isinstance(each, Block) else Block.of(each)


def generations(evolution: Iterable[Block | Generation]) -> Iterator[Generation]:
    """Yield the generations of an evolution one by one."""
    for block in blocks(evolution):
        yield from block.generations()


class GenerationRow(NamedTuple):
    """One generation as it is read back from a log, with its link of the chain."""

    index: int  # type: ignore[assignment]  # 0 is the initial population
    best_cost: float  # best so far
    best_cost_in_generation: float  # lowest cost of its individuals
    mean_cost: float  # over the finite costs of this generation
    std_cost: float  # over the same, population standard deviation
    num_feasible: int  # individuals of this generation that the planner's own model accepts
    evaluations: int  # since the start
    collision_queries: int  # configurations judged since the start
    solved: bool  # whether the planner's own model accepts the best so far
    terms: dict[str, float]  # the paper's own terms of the best so far; columns term_<name>
    chain: str  # 32 hex digits: xxh3-128 over everything up to and including this generation


class SolutionRow(NamedTuple):
    """The best solution so far, logged whenever it improves and at the end."""

    generation: int  # in which it was found, or the last one
    cost: float  # of this solution
    values: FloatArray  # flat, in the planner's documented shape


class FrontRow(NamedTuple):
    """Criteria of one population in one generation, from which its front follows."""

    generation: int  # its index
    population: int  # its index among co-evolving populations
    criteria: FloatArray  # (individuals, criteria), all minimised


class ReplicateSummary(NamedTuple):
    """The one row that a finished or failed replicate leaves in `summary.parquet`."""

    condition: str  # 64 hex digits
    replicate: int  # its index
    status: str  # "done" | "failed"
    stop_reason: str  # why the planner ended; for a failed replicate the error in one line
    num_generations: int  # generations after the initial one
    best_cost: float  # of the best solution; inf: infeasible
    first_feasible_generation: int | None  # None: no generation has a feasible individual
    evaluations: int  # asked for by the algorithm, skipped ones included
    collision_queries: int  # configurations that the algorithm asked for
    solved: bool  # by the paper's own collision model
    # by the exact certifier, over the whole motion; None: undecided, or there is no motion
    certified: bool | None
    certified_margin: bool | None  # the same for the clearance that the scenario requires
    # [length_unit] least distance of the bodies over the motion; 0 in contact, NaN without motion
    clearance: float
    clearance_at: float | None  # [instant] where the bodies are that close
    clearance_pair: str  # which bodies
    refuted_at: float | None  # [instant] of the first contact
    refuted_pair: str  # the bodies that touch
    length_unit: str  # of every clearance and length below
    terms: dict[str, float]  # the paper's own terms of the best; columns term_<name>
    digest: str  # 32 hex digits: the end of the chain
    certificate_queries: int  # exact distances that the certifier asked for
    certificate_s: float  # CPU time of the certifier [s], part of cpu_s
    cpu_s: float  # CPU time of the replicate [s]
    wall_s: float  # its time by the clock [s]
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
