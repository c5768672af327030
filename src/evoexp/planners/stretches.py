"""Generations that are computed several per call of a kernel, and yielded one by one.

With kernels that take some ten microseconds per generation, a call for each would be a third of the
time.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evoexp.evolution.cost_statistics import CostStatistics
from evoexp.evolution.genetic_settings import ScaledGenetic
from evoexp.evolution.scaled_selection import SelectionMemory
from evoexp.numeric.random_stream import Draws
from evoexp.planners.planner import Candidate, Keeper
from evoexp.records import FloatArray, Generation

SUMMARY = 4  # of a generation: index of the best, mean and deviation of costs, number of feasible


class Stretches(ABC):
    """The generations of one run; generation g is at place g modulo `num_places`.

    Attributes:
        num_places: Generations computed per call, and the one before them.
        summaries: (places, SUMMARY).
        costs: (places, individuals).
        chosen: Memory of the selection.
        arguments: All that `evolve` takes behind the draws and the first and the last generation.
    """

    costs: FloatArray
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
        self.num_places = min(stretch, ga.num_generations) + 1
        self.summaries = np.empty((self.num_places, SUMMARY))
        self.chosen = SelectionMemory.of(ga.num_offspring, ga.num_elites, ga.population_size)
        self._ga, self._evolve, self._known, self._draws = ga, evolve, -1, Draws(block)

    def generations(self, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the initial population, then every generation."""
        ga, keeper = self._ga, Keeper()
        for index in range(ga.num_generations + 1):
            place = self._place(index, rng)
            best, mean, std, num_feasible = self.summaries[place].tolist()
            individual, costs = int(best), self.costs[place]
            lowest = float(costs[individual])
            if keeper.improves(lowest):
                keeper.keep(lowest, self.candidate(place, individual))
            yield keeper.record(
                CostStatistics(individual, mean, std),
                costs,
                self.population(place, index == ga.num_generations),
                lowest=lowest,
                num_feasible=int(num_feasible),
                evaluations=ga.num_offspring if index else ga.population_size,
                collision_queries=0,
            )

    def _place(self, index: int, rng: np.random.Generator) -> int:
        """Return the place of a generation; it is computed if need be, with some that follow it."""
        if index == 0:
            self.begin(rng)
            self._known = 0
        elif index > self._known:
            last = min(self._known + self.num_places - 1, self._ga.num_generations)
            arguments = self.arguments
            while (known := self._evolve(self._draws.block, self._known, last, *arguments)) < last:
                self._known = known
                self._draws.extend(rng)
            self._known = last
        return index % self.num_places

    @abstractmethod
    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial population, at place 0."""

    @abstractmethod
    def candidate(self, place: int, individual: int) -> Candidate:
        """Return an individual as it is recorded."""

    @abstractmethod
    def population(self, place: int, is_last: bool) -> NDArray[Any]:
        """Return the population at a place, and the last population, which is hashed, unpadded."""
