"""Multi-start improvement: the planner's own local operator from many starts, without evolution."""

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np

from evoexp.errors import SettingError
from evoexp.planners.planner import Keeper
from evoexp.planners.wrapped_planner import WrappedPlanner
from evoexp.records import Block, FloatArray
from evoexp.validation import Count


class MultiStart(WrappedPlanner):
    """Draws a population, applies the planner's local operator again and again, and starts anew.

    The first generation of a start holds fresh samples; each of the next `num_sweeps` generations
    holds the same individuals after one more pass of the planner's `improve`. Nothing is selected,
    crossed or mutated. A generation evaluates as many individuals as the planner would evaluate in
    it, so that both are equal in evaluations at every generation: where that number falls, the last
    individuals are left out; where it rises, fresh samples join.

    Attributes:
        num_sweeps: Passes of the local operator per start.
        planner: The planner whose sampling, local operator, cost and budget are used.
    """

    component: ClassVar[str] = "multi_start"

    num_sweeps: Count

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem.

        Raises:
            SettingError: If the planner has no local operator.
        """
        problem = super().prepare(robot, scenario)
        rng = np.random.Generator(np.random.PCG64(0))  # of a trial whose result is thrown away
        sample = self.planner.sample(problem, rng, 1)
        if self.planner.improve(problem, sample, rng) is None:
            must = f"left out: {self.planner.component} has no local operator to be repeated"
            raise SettingError("control", must, self.component)
        return problem

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Block]:
        """Yield one start after the other: fresh samples, then their sweeps."""
        planner, keeper = self.planner, Keeper()
        population: FloatArray | None = None
        for index in range(planner.num_generations + 1):
            count = planner.num_evaluations(index)
            if population is None or index % (self.num_sweeps + 1) == 0:
                population = planner.sample(problem, rng, count)
            else:
                population = self._swept(problem, population, rng, count)
            judged = planner.cost(problem, population)
            yield keeper.record_judged(planner, problem, population, judged)

    def _swept(
        self, problem: Any, population: FloatArray, rng: np.random.Generator, count: int
    ) -> FloatArray:
        """Return the first `count` individuals after one more sweep, fresh ones where they lack."""
        improved = self.planner.improve(problem, population[..., :count], rng)
        assert improved is not None, "prepare refuses planners without a local operator"
        missing = count - improved.shape[-1]
        if missing <= 0:
            return improved
        fresh = self.planner.sample(problem, rng, missing)
        return np.concatenate([improved, fresh], axis=-1)
