"""Random search: the best of as many samples as a planner evaluates, without any evolution."""

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np

from evoexp.planners.planner import judged_samples
from evoexp.planners.wrapped_planner import WrappedPlanner
from evoexp.records import Block


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
        return judged_samples(self.planner, problem, rng)
