"""Generations that are computed several per call of a kernel, and yielded one by one.

With kernels that take some ten microseconds per generation, a call for each would be a third of the
time.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from evoexp.evolution.cost_statistics import CostStatistics
from evoexp.evolution.genetic_settings import ScaledGenetic
from evoexp.evolution.scaled_selection import SelectionMemory
from evoexp.numeric.random_stream import DrawnAhead, DrawnByNeed, Draws
from evoexp.planners.planner import Candidate, Keeper
from evoexp.records import FloatArray, Generation

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


class Stretches(ABC):
    """The generations of one run; generation g is at place g modulo `num_places`.

    Attributes:
        num_places: Generations computed per call, and the one before them.
        summaries: (places, SUMMARY).
        costs: (places, individuals).
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


class IndividualStretches(Stretches):
    """Generations whose best is one individual.

    Attributes:
        queries_each: Configurations that judging an individual asks for.
    """

    queries_each = 0

    def keep(self, keeper: Keeper, place: int) -> None:
        """Keep the best individual of a generation if it is better than all before."""
        individual = int(self.summaries[place, 0])
        lowest = self.costs.item(place, individual)
        if keeper.improves(lowest):
            keeper.keep(lowest, self.candidate(place, individual))

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

    @abstractmethod
    def population(self, place: int, is_last: bool) -> NDArray[Any]:
        """Return the population at a place; that of the last generation is hashed."""


class ScaledStretches(IndividualStretches):
    """Generations whose parents are chosen as in `scaled_selection`, by blocks of draws.

    Attributes:
        chosen: Memory of the selection.
        arguments: All that `evolve` takes behind the draws and the first and the last generation.
    """

    arguments: tuple[Any, ...]

    def __init__(
        self, ga: ScaledGenetic, evolve: Callable[..., int], stretch: int, block: int
    ) -> None:
        """Begin a run.

        Args:
            ga: Its settings.
            evolve: Kernel that computes the generations after one up to another, as far as the
                draws suffice, and returns the last generation that was computed.
            stretch: Generations computed per call, at most.
            block: Uniform numbers drawn at once, at least.
        """
        super().__init__(ga, stretch)
        self.chosen = SelectionMemory.of(ga.num_offspring, ga.num_elites, ga.population_size)
        self._evolve, self._draws = evolve, Draws(block)

    def go_on(self, rng: np.random.Generator, first: int, last: int) -> None:
        """Compute generations; draw more numbers whenever they do not suffice."""
        arguments = self.arguments
        while (first := self._evolve(self._draws.block, first, last, *arguments)) < last:
            self._draws.extend(rng)
