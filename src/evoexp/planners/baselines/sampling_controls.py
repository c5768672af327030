"""Controls that draw individuals as a planner does, without evolution: at random, multi-start."""

import itertools
from typing import Any, ClassVar

import numpy as np

from evoexp.errors import SettingError
from evoexp.planners.planner import Populations, WrappedPlanner
from evoexp.validation import Count


class RandomSearch(WrappedPlanner):
    """Draws individuals as the wrapped planner draws its first ones, as many as it evaluates."""

    component: ClassVar[str] = "random_search"

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield one generation of new samples after the other."""
        for index in itertools.count():
            yield self.planner.sample(problem, rng, self.planner.num_evaluations(index))


class MultiStart(WrappedPlanner):
    """Draws a population, applies the planner's local operator again and again, and starts anew.

    The first generation of a start holds fresh samples; each of the next `num_sweeps` generations
    the same individuals after one more pass of the planner's `improve`. A generation evaluates as
    many as the planner would in it: where that falls, the last are left out; where it rises, fresh
    samples join.
    """

    component: ClassVar[str] = "multi_start"

    num_sweeps: Count  # passes of the local operator per start

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem."""
        problem = super().prepare(robot, scenario)
        rng = np.random.Generator(np.random.PCG64(0))  # of a trial whose result is thrown away
        sample = self.planner.sample(problem, rng, 1)
        if self.planner.improve(problem, sample, rng) is None:
            must = f"left out: {self.planner.component} has no local operator to be repeated"
            raise SettingError("control", must, self.component)
        return problem

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield one start after the other: fresh samples, then their sweeps."""
        planner, population = self.planner, np.empty(0)
        for index in itertools.count():
            count, improved = planner.num_evaluations(index), None
            if index % (self.num_sweeps + 1):
                improved = planner.improve(problem, population[..., :count], rng)
                missing = count - population.shape[-1]
            if improved is None:
                population = planner.sample(problem, rng, count)
            elif missing > 0:
                fresh = planner.sample(problem, rng, missing)
                population = np.concatenate([improved, fresh], axis=-1)
            else:
                population = improved
            yield population
