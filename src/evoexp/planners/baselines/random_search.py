"""Random search: the best of as many samples as a planner evaluates, without any evolution."""

import itertools
from typing import Any, ClassVar

import numpy as np

from evoexp.planners.planner import Populations, WrappedPlanner


class RandomSearch(WrappedPlanner):
    """Draws individuals as the wrapped planner draws its first ones, as many as it evaluates."""

    component: ClassVar[str] = "random_search"

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield one generation of new samples after the other."""
        for index in itertools.count():
            yield self.planner.sample(problem, rng, self.planner.num_evaluations(index))
