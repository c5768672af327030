"""Generations that kernels compute some at a time, while they are yielded one by one.

Between kernels that take some ten microseconds, calling them would be a third of the time.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from evoexp.evolution.scaled_settings import ScaledGenetic
from evoexp.numeric.random_stream import Draws
from evoexp.records import FloatArray, Generation

# what kernels note of a generation: index of the best, mean and deviation of costs, how many are
# feasible
RECORD = 4


class Found(NamedTuple):
    """An individual as it is recorded, see `records.Generation`."""

    best: FloatArray
    terms: dict[str, float]
    solved: bool


class Stretches(ABC):
    """The generations of one run.

    The last ones are kept, generation g at place g modulo `num_places`.

    Attributes:
        num_places: As many as are computed at a time, and the one they go on from.
        records: (places, RECORD).
        costs: (places, individuals).
    """

    costs: FloatArray

    def __init__(self, ga: ScaledGenetic, stretch: int, block: int) -> None:
        """Begin a run.

        Args:
            ga: Its settings.
            stretch: Generations that are computed at a time, at most.
            block: Uniform numbers that are drawn at once, at least.
        """
        self.num_places = min(stretch, ga.num_generations) + 1
        self.records = np.empty((self.num_places, RECORD))
        self._ga, self._known, self._draws = ga, -1, Draws(block)

    def generations(self, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the initial population, then every generation."""
        ga, best_cost, found = self._ga, np.inf, Found(np.empty(0), {}, False)
        for index in range(ga.num_generations + 1):
            place = self._place(index, rng)
            individual, mean, std, num_feasible = self.records[place].tolist()
            costs = self.costs[place]
            lowest = float(costs[int(individual)])
            if lowest < best_cost:
                best_cost, found = lowest, self.found(place, int(individual))
            yield Generation(
                index=index,
                best=found.best,
                best_cost=best_cost,
                best_cost_in_generation=lowest,
                mean_cost=mean,
                std_cost=std,
                num_feasible=int(num_feasible),
                evaluations=ga.population_size + index * ga.num_offspring,
                collision_queries=0,
                solved=found.solved,
                terms=found.terms,
                costs=costs,
                population=self.population(place, index == ga.num_generations),
            )

    def _place(self, index: int, rng: np.random.Generator) -> int:
        """Return the place of a generation.

        Computing it and some that follow it first if need be.
        """
        if index == 0:
            self.begin(rng)
            self._known = 0
        elif index > self._known:
            last = min(self._known + self.num_places - 1, self._ga.num_generations)
            while (known := self.go_on(self._draws.block, self._known, last)) < last:
                self._known = known
                self._draws.extend(rng)
            self._known = last
        return index % self.num_places

    @abstractmethod
    def begin(self, rng: np.random.Generator) -> None:
        """Draw and judge the initial population, at place 0."""

    @abstractmethod
    def go_on(self, draws: tuple[np.ndarray, np.ndarray], first: int, last: int) -> int:
        """Compute the generations after `first` up to `last`.

        Return the one reached, as far as the draws suffice.
        """

    @abstractmethod
    def found(self, place: int, individual: int) -> Found:
        """Return what is recorded of an individual."""

    @abstractmethod
    def population(self, place: int, is_last: bool) -> np.ndarray:
        """Return the population at a place.

        Of the last generation, which is hashed, nothing but its individuals.
        """
