"""Generations that are computed several per call of a kernel; yielded one by one, or together.

With kernels that take some ten microseconds per generation, a call for each would be a third of the
time, and a record of each another third.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from evoexp.evolution.cost_statistics import CostStatistics
from evoexp.evolution.genetic_settings import ScaledGenetic
from evoexp.evolution.scaled_selection import SelectionMemory
from evoexp.numeric.generator_state import state_reader
from evoexp.numeric.random_stream import DrawnAhead, DrawnByNeed, Draws
from evoexp.planners.gathering import Clock, Gathered, Run
from evoexp.planners.planner import Candidate, Keeper
from evoexp.records import FloatArray, Generation, IntArray, Stretch

SUMMARY = 4  # of a generation: index of the best, mean and deviation of costs, number of feasible


class Sizes(Protocol):
    """How many individuals, and how often."""

    @property
    def population_size(self) -> int:
        """Individuals that are evaluated at first."""

    @property
    def num_offspring(self) -> int:
        """Individuals that are evaluated in every other generation."""

    @property
    def num_generations(self) -> int:
        """Generations after the initial one."""


def stretch_of(most: int, size: int, cached: int) -> int:
    """Return how many generations are best computed in one call of a kernel.

    Args:
        most: Behind so many, the call itself takes no time any more.
        size: Memory of a generation [B].
        cached: Memory beyond which generations would push each other out of the caches [B].
    """
    return max(1, min(most, cached // max(1, size)))


class Stretches(ABC):
    """The generations of one run; generation g is at place g modulo `num_places`.

    Attributes:
        num_places: Generations computed per call, and the one before them.
        summaries: (places, SUMMARY).
        costs: (places, …, individuals).
        drawn: Numbers of the generations, where they are drawn ahead: the generator follows.
    """

    costs: FloatArray
    drawn: DrawnAhead | DrawnByNeed | None = None

    def __init__(self, ga: Sizes, stretch: int) -> None:
        """Begin a run.

        Args:
            ga: Its settings.
            stretch: Generations computed per call, at most.
        """
        self.num_places = min(stretch, ga.num_generations) + 1
        self.summaries = np.empty((self.num_places, SUMMARY))
        self._ga, self._known = ga, 0

    def generations(self, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the initial population, then every generation."""
        ga, keeper, index = self._ga, Keeper(), 0
        self.begin(rng)
        evaluated, last = ga.population_size, ga.num_generations
        while True:
            place = index % self.num_places
            if index > 0 and self.drawn is not None:
                self.drawn.follow()
            yield self.record(keeper, place, evaluated, index == last)
            if index == last:
                return
            if index == self._known:
                self._known = min(index + self.num_places - 1, last)
                self.go_on(rng, index, self._known)
            index, evaluated = index + 1, ga.num_offspring

    def run(self, rng: np.random.Generator) -> Run:
        """Return the generations, for a search that keeps what costs least of each."""
        return Run(partial(self.generations, rng), partial(self.stretches, rng))

    def stretches(self, rng: np.random.Generator, read_clock: Clock) -> Iterator[Stretch]:
        """Yield the initial population, then every other generation; see `Run.stretches`."""
        self.begin(rng)
        gathered, index, last = Gathered(), 0, self._ga.num_generations
        self._gather(gathered, 0, 0, [state_reader(rng.bit_generator)()], read_clock())
        while index < last:
            first, index = index, min(index + self.num_places - 1, last)
            self.go_on(rng, first, index)
            self._gather(gathered, first + 1, index, self.follow(rng, first, index), read_clock())
            if gathered.is_full and index < last:
                yield gathered.stretch(None)
        place = last % self.num_places
        yield gathered.stretch(self.population(place, True), self.criteria(place))

    def follow(self, rng: np.random.Generator, first: int, last: int) -> list[bytes]:
        """Let the generator follow from one generation to another.

        Returns:
            Its state behind each of those after the first, as it is recorded.
        """
        assert self.drawn is not None, "a search that draws otherwise writes its own `follow`"
        return self.drawn.follow_all(last - first)

    def _gather(
        self, gathered: Gathered, first: int, last: int, states: list[bytes], time: float
    ) -> None:
        """Keep the best of some generations, and gather what is recorded of each of them."""
        keeper, places = gathered.keeper, np.arange(first, last + 1) % self.num_places
        lowest = self.lowest(places).tolist()
        for k, cost in enumerate(lowest):
            if keeper.improves(cost):
                keeper.keep(cost, self.best(places.item(k)))
                gathered.stand(k)
            keeper.index += 1
        _, means, deviations, num_feasible = self.summaries[places].T.tolist()
        gathered.lowest += lowest
        gathered.means += means
        gathered.deviations += deviations
        gathered.num_feasible += map(int, num_feasible)
        evaluations, queries = self.counts(first)
        steps = range(1, len(lowest) + 1)
        gathered.evaluations += [keeper.evaluations + evaluations * k for k in steps]
        gathered.collision_queries += [keeper.collision_queries + queries * k for k in steps]
        keeper.evaluations += evaluations * len(lowest)
        keeper.collision_queries += queries * len(lowest)
        gathered.add_costs(self.costs[places])
        gathered.states += states
        gathered.times += [time] * len(states)

    def criteria(self, place: int) -> FloatArray | None:
        """Return the criteria of the last generation, if its front is recorded."""
        return None

    @abstractmethod
    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial population, at place 0."""

    @abstractmethod
    def go_on(self, rng: np.random.Generator, first: int, last: int) -> None:
        """Compute the generations that follow one, up to another."""

    @abstractmethod
    def record(self, keeper: Keeper, place: int, evaluated: int, is_last: bool) -> Generation:
        """Keep the best of a generation if it is better than all before, and return its record.

        Args:
            keeper: Of the run.
            place: Of the generation.
            evaluated: Individuals of it that are new.
            is_last: Whether it ends the run.
        """

    @abstractmethod
    def lowest(self, places: IntArray) -> FloatArray:
        """Return the lowest cost of each of the generations at some places."""

    @abstractmethod
    def best(self, place: int) -> Candidate:
        """Return the solution that has the lowest cost of a generation."""

    @abstractmethod
    def counts(self, index: int) -> tuple[int, int]:
        """Return evaluations and configurations asked for of a generation, 0 the initial one."""

    @abstractmethod
    def population(self, place: int, is_last: bool) -> NDArray[Any]:
        """Return the population at a place; that of the last generation is hashed."""


class IndividualStretches(Stretches):
    """Generations whose best is one individual.

    Attributes:
        queries_each: Configurations that judging an individual asks for.
    """

    queries_each = 0

    def lowest(self, places: IntArray) -> FloatArray:
        """Return the cost of the best individual of each generation."""
        individuals = self.summaries[places, 0].astype(np.int64)
        return np.asarray(self.costs[places, individuals])

    def best(self, place: int) -> Candidate:
        """Return the best individual of a generation."""
        return self.candidate(place, int(self.summaries[place, 0]))

    def counts(self, index: int) -> tuple[int, int]:
        """Return the individuals that are evaluated, and configurations for each of them."""
        count = self._ga.num_offspring if index else self._ga.population_size
        return count, count * self.queries_each

    def keep(self, keeper: Keeper, place: int) -> None:
        """Keep the best individual of a generation if it is better than all before."""
        lowest = self.costs.item(place, int(self.summaries[place, 0]))
        if keeper.improves(lowest):
            keeper.keep(lowest, self.best(place))

    def record(self, keeper: Keeper, place: int, evaluated: int, is_last: bool) -> Generation:
        """Keep the best individual, and return the record of its generation; see `Stretches`."""
        self.keep(keeper, place)
        best, mean, std, num_feasible = self.summaries[place].tolist()
        individual, costs = int(best), self.costs[place]
        return keeper.record(
            CostStatistics(individual, mean, std),
            costs,
            self.population(place, is_last),
            lowest=costs.item(individual),
            num_feasible=int(num_feasible),
            evaluations=evaluated,
            collision_queries=evaluated * self.queries_each,
        )

    @abstractmethod
    def candidate(self, place: int, individual: int) -> Candidate:
        """Return an individual as it is recorded."""


class BlockStretches(IndividualStretches):
    """Generations that take numbers of blocks, each drawn when the last one is used up.

    A generation is recorded with the generator as it is behind the last one of its round: a round
    is computed per call where generations are yielded one by one, and several rounds where they are
    recorded together.
    """

    def __init__(self, ga: Sizes, stretch: int, round_size: int, block: int) -> None:
        """Begin a run.

        Args:
            ga: Its settings.
            stretch: Generations computed per call, at most: whole rounds.
            round_size: Generations of a round. They enter the digest.
            block: Uniform numbers drawn at once, at least.
        """
        super().__init__(ga, stretch)
        self._round, self._draws = round_size, Draws(block)
        # Of the generator, where generations are recorded together: its state behind the round
        # recorded last; states further ahead, each with the generation that was reached without.
        self._state, self._ahead = b"", deque[tuple[int, bytes]]()
        self._read_state: Callable[[], bytes] | None = None

    def stretches(self, rng: np.random.Generator, read_clock: Clock) -> Iterator[Stretch]:
        """Yield the generations, and note the generator's states; see `Run.stretches`."""
        self._read_state = state_reader(rng.bit_generator)
        return super().stretches(rng, read_clock)

    def draw_for(self, rng: np.random.Generator, reached: int) -> None:
        """Draw more numbers where those that are left do not suffice.

        Args:
            rng: The generator.
            reached: The last generation that is complete.
        """
        read = self._read_state
        if read is None:
            self._draws.extend(rng)
            return
        self._state = self._state or read()
        self._draws.extend(rng)
        self._ahead.append((reached, read()))

    def follow(self, rng: np.random.Generator, first: int, last: int) -> list[bytes]:
        """Return the generator's states as they are recorded; it is already ahead."""
        found: list[bytes] = []
        assert self._read_state is not None, "generations are recorded together"
        self._state = self._state or self._read_state()
        for begin in range(first, last, self._round):
            end = min(begin + self._round, last)
            while self._ahead and self._ahead[0][0] < end:
                _, self._state = self._ahead.popleft()
            found += [self._state] * (end - begin)
        return found


class ScaledStretches(BlockStretches):
    """Generations whose parents are chosen as in `scaled_selection`, by blocks of draws.

    Attributes:
        chosen: Memory of the selection.
        arguments: All that `evolve` takes behind the draws and the first and the last generation.
    """

    arguments: tuple[Any, ...]

    def __init__(
        self,
        ga: ScaledGenetic,
        evolve: Callable[..., int],
        stretch: int,
        round_size: int,
        block: int,
    ) -> None:
        """Begin a run.

        Args:
            ga: Its settings.
            evolve: Kernel that computes the generations after one up to another, as far as the
                draws suffice, and returns the last generation that was computed.
            stretch: See `BlockStretches`, as for the others.
            round_size: Generations of a round.
            block: Uniform numbers drawn at once, at least.
        """
        super().__init__(ga, stretch, round_size, block)
        self.chosen = SelectionMemory.of(ga.num_offspring, ga.num_elites, ga.population_size)
        self._evolve = evolve

    def go_on(self, rng: np.random.Generator, first: int, last: int) -> None:
        """Compute generations; draw more numbers whenever they do not suffice."""
        arguments = self.arguments
        while (first := self._evolve(self._draws.block, first, last, *arguments)) < last:
            self.draw_for(rng, first)


def run_of(
    search: Callable[[int], IndividualStretches], rng: np.random.Generator, each: int, together: int
) -> Run:
    """Return a run that computes more generations per call where they are recorded together.

    Args:
        search: Begins the search that computes so many generations per call.
        rng: The generator.
        each: Generations per call where they are yielded one by one.
        together: Where they are recorded together.
    """
    return Run(
        lambda: search(each).generations(rng),
        lambda read_clock: search(together).stretches(rng, read_clock),
    )
