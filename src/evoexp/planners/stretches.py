"""Generations that kernels compute some at a time, while they are yielded one by one.

Between kernels that take some ten microseconds, calling them would be a third of the time.
"""

from abc import ABC, abstractmethod

import numpy as np

from evoexp.draws import Draws


class Stretches(ABC):
    """The generations of one run; the last ones are kept, generation g at place g modulo `num_places`.

    Attributes:
        num_places: As many as are computed at a time, and the one they go on from.
    """

    def __init__(self, num_generations: int, stretch: int, block: int) -> None:
        """Begin a run.

        Args:
            num_generations: After the initial one.
            stretch: Generations that are computed at a time, at most.
            block: Uniform numbers that are drawn at once, at least.
        """
        self.num_places = min(stretch, num_generations) + 1
        self._num_generations, self._known, self._draws = num_generations, -1, Draws(block)

    def place(self, index: int, rng: np.random.Generator) -> int:
        """Return the place of a generation, computing it and some that follow it first if need be.

        Generations are asked for in their order; what stands at a place holds until the next one is.
        """
        if index == 0:
            self.begin(rng)
            self._known = 0
        elif index > self._known:
            last = min(self._known + self.num_places - 1, self._num_generations)
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
        """Compute the generations after `first` up to `last`; return the one reached, as far as the draws suffice."""
