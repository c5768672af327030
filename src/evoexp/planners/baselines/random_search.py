"""Random search: the best of as many samples as a planner evaluates, without any evolution."""

from collections.abc import Iterator
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from evoexp.planners.planner import judged_samples
from evoexp.planners.wrapped_planner import WrappedPlanner
from evoexp.records import Block


@runtime_checkable
class DrawsBlocks(Protocol):
    """A planner whose kernels draw many generations of samples per call."""

    def random_blocks(self, problem: Any, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the generations of `judged_samples`, in blocks."""


class RandomSearch(WrappedPlanner):
    """Draws every individual as the wrapped planner draws its initial population.

    A generation draws as many individuals as the planner would evaluate in it, so that both are
    equal in evaluations at every generation.

    Attributes:
        planner: The planner whose sampling, cost and budget are used.
    """

    component: ClassVar[str] = "random_search"

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Block]:
        """Yield one generation of new samples after the other."""
        planner = self.planner
        if isinstance(planner, DrawsBlocks):
            return planner.random_blocks(problem, rng)
        return judged_samples(planner, problem, rng)
