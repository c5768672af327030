"""Generations that are recorded many at a time: gathered column by column.

Records of their own, and a log that takes one after the other, would be a third of the time of
kernels that take ten microseconds per generation.
"""

from collections.abc import Callable, Generator, Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.evolution.cost_statistics import CostStatistics
from evoexp.numeric.generator_state import state_reader
from evoexp.planners.planner import Candidate, Keeper
from evoexp.records import FloatArray, Generation, Standing, Stretch

Clock = Callable[[], float]
TOGETHER = 128  # generations that are recorded together, at least,
ENOUGH = 1 << 22  # [B] or as many as have costs of so much memory


class Scored(NamedTuple):
    """A generation that is computed and not yet recorded.

    Attributes:
        statistics: Of its costs.
        costs: (individuals,) valid until the next generation, like the population.
        population: See `Generation`.
        candidate: Makes a candidate of an individual.
        num_feasible: Individuals that the planner's own model accepts.
        evaluations: Of this generation.
        collision_queries: Configurations that this generation asked for.
        is_last: Whether it ends the run.
    """

    statistics: CostStatistics
    costs: FloatArray
    population: NDArray[Any]
    candidate: Callable[[int], Candidate]
    num_feasible: int
    evaluations: int
    collision_queries: int
    is_last: bool


class Gathered:
    """Generations that are gathered into a stretch; see `Stretch`, field by field.

    Attributes:
        keeper: Of the run.
        first: Index of the first generation.
    """

    def __init__(self) -> None:
        self.keeper, self.first = Keeper(), 0
        self._begin()

    def _begin(self) -> None:
        self.standings: list[Standing] = []
        self.lowest: list[float] = []
        self.means: list[float] = []
        self.deviations: list[float] = []
        self.num_feasible: list[int] = []
        self.evaluations: list[int] = []
        self.collision_queries: list[int] = []
        self.costs: list[FloatArray] = []
        self.states: list[bytes] = []
        self.times: list[float] = []
        self._size = 0  # [B] of the costs

    def stand(self, place: int) -> None:
        """Note what the keeper keeps as the best from a place behind those gathered on."""
        (solution, terms, solved), cost = self.keeper.best, self.keeper.cost
        place += len(self.lowest)
        if self.standings and self.standings[-1].place == place:
            self.standings.pop()
        self.standings.append(Standing(place, solution, cost, terms, solved))

    def add(self, scored: Scored, state: bytes, time: float) -> None:
        """Keep the best of a generation, count it and gather it.

        Args:
            scored: The generation.
            state: Of the generator behind it.
            time: When it was there [s].
        """
        keeper, statistics = self.keeper, scored.statistics
        lowest = float(scored.costs[statistics.best])
        if keeper.improves(lowest):
            keeper.keep(lowest, scored.candidate(statistics.best))
            self.stand(0)
        keeper.index += 1
        keeper.evaluations += scored.evaluations
        keeper.collision_queries += scored.collision_queries
        self.lowest.append(lowest)
        self.means.append(statistics.mean)
        self.deviations.append(statistics.std)
        self.num_feasible.append(scored.num_feasible)
        self.evaluations.append(keeper.evaluations)
        self.collision_queries.append(keeper.collision_queries)
        self.add_costs(scored.costs[None].copy())
        self.states.append(state)
        self.times.append(time)

    @property
    def is_full(self) -> bool:
        """Whether there are enough generations to record them."""
        return len(self.lowest) >= TOGETHER or self._size >= ENOUGH

    def add_costs(self, costs: FloatArray) -> None:
        """Gather the costs of some generations, (generations, individuals), nobody else's."""
        self.costs.append(costs)
        self._size += costs.nbytes

    def stretch(
        self, population: NDArray[Any] | None, criteria: FloatArray | None = None
    ) -> Stretch:
        """Return the generations gathered, the last one with its population; begin anew."""
        found = Stretch(
            self.first,
            self.standings,
            self.lowest,
            self.means,
            self.deviations,
            self.num_feasible,
            self.evaluations,
            self.collision_queries,
            self.costs,
            self.states,
            self.times,
            population,
            criteria,
        )
        self.first += len(self.lowest)
        self._begin()
        self.stand(0)
        return found


class Run(Iterator[Generation]):
    """The generations of a run: one by one as an iterator, or by `stretches`, not both."""

    def __init__(
        self,
        generations: Callable[[], Iterator[Generation]],
        stretches: Callable[[Clock], Iterator[Stretch]],
    ) -> None:
        """Take the two functions that begin it.

        Args:
            generations: Yields them one by one.
            stretches: Yields them many at a time, see the method.
        """
        self._begin, self._stretches = generations, stretches
        self._each: Iterator[Generation] | None = None

    def __iter__(self) -> Iterator[Generation]:
        if self._each is None:
            self._each = self._begin()
        return self._each

    def __next__(self) -> Generation:
        return next(iter(self))

    def close(self) -> None:
        """End the run, as a generator's `close` does."""
        each, self._each = self._each, iter(())
        if isinstance(each, Generator):
            each.close()

    def stretches(self, read_clock: Clock) -> Iterator[Stretch]:
        """Yield the initial population, then every other generation, several together.

        Args:
            read_clock: What it returns behind each call of a kernel is in `Stretch.times`.
        """
        return self._stretches(read_clock)

    @classmethod
    def of(cls, scored: Callable[[], Iterator[Scored]], rng: np.random.Generator) -> "Run":
        """Return the run of generations that are computed one after the other.

        Args:
            scored: Begins them.
            rng: The generator that they draw from, a PCG64 where they are recorded together.
        """
        return cls(lambda: _one_by_one(scored()), partial(_together, scored, rng))


def _one_by_one(scored: Iterator[Scored]) -> Iterator[Generation]:
    """Yield the records of generations."""
    keeper = Keeper()
    for each in scored:
        lowest = float(each.costs[each.statistics.best])
        if keeper.improves(lowest):
            keeper.keep(lowest, each.candidate(each.statistics.best))
        yield keeper.record(
            each.statistics,
            each.costs,
            each.population,
            lowest=lowest,
            num_feasible=each.num_feasible,
            evaluations=each.evaluations,
            collision_queries=each.collision_queries,
        )


def _together(
    scored: Callable[[], Iterator[Scored]], rng: np.random.Generator, read_clock: Clock
) -> Iterator[Stretch]:
    """Yield the same generations, many at a time."""
    gathered, read_state = Gathered(), state_reader(rng.bit_generator)
    for each in scored():
        gathered.add(each, read_state(), read_clock())
        if each.is_last:
            yield gathered.stretch(each.population)
        elif gathered.is_full:
            yield gathered.stretch(None)
