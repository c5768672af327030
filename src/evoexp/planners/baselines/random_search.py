"""Random search: the best of as many samples as a planner evaluates, without any evolution."""

from collections.abc import Iterator
from functools import partial
from typing import Any, ClassVar

import numpy as np

from evoexp.planners.planner import Keeper, PlannerDefaults
from evoexp.planners.wrapped_planner import WrappedPlanner
from evoexp.records import Generation


class RandomSearch(WrappedPlanner):
    """Draws every individual as the wrapped planner draws its initial population.

    A generation draws as many individuals as the planner would evaluate in it, so that both are
    equal in evaluations at every generation.

    Attributes:
        planner: The planner whose sampling, cost and budget are used.
    """

    component: ClassVar[str] = "random_search"

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield one generation of new samples after the other."""
        planner, keeper = self.planner, Keeper()
        # a planner of others may write everything itself
        judged_samples = getattr(planner, "judged_samples", None)
        if judged_samples is None:
            judged_samples = partial(PlannerDefaults.judged_samples, planner)
        draw = judged_samples(problem, rng)
        for index in range(planner.num_generations + 1):
            population, judged = draw(planner.num_evaluations(index))
            yield keeper.record_judged(planner, problem, population, judged)
