"""Random search: the best of as many samples as a planner evaluates, without any evolution."""

from collections.abc import Iterator
from functools import partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from evoexp.evolution.cost_statistics import cost_statistics
from evoexp.planners.gathering import Run, Scored
from evoexp.planners.planner import Candidate, Judgement, Keeper
from evoexp.planners.wrapped_planner import WrappedPlanner
from evoexp.records import BoolArray, Generation


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
        if self.answers_are_proven:
            return self._proven(problem, rng)
        random_run = getattr(self.planner, "random_run", None)  # planners of others may lack it
        if random_run is not None:
            own: Iterator[Generation] | None = random_run(problem, rng)
            if own is not None:
                return own
        return Run.of(partial(self._scored, problem, rng), rng)

    def _proven(self, problem: Any, rng: np.random.Generator) -> Iterator[Generation]:
        keeper = Keeper()
        for population, judged in self._judged(problem, rng):
            yield keeper.record_judged(self.planner, problem, population, judged)

    def _scored(self, problem: Any, rng: np.random.Generator) -> Iterator[Scored]:
        for index, (population, judged) in enumerate(self._judged(problem, rng)):
            feasible = judged.feasible

            def candidate(
                k: int,
                population: NDArray[Any] = population,
                judged: Judgement = judged,
                feasible: BoolArray = feasible,
            ) -> Candidate:
                solution = self.planner.solution(problem, population, k)
                return Candidate(solution, judged.named_terms(k), bool(feasible[k]))

            yield Scored(
                cost_statistics(judged.cost),
                judged.cost,
                population,
                candidate,
                int(np.count_nonzero(feasible)),
                len(judged.cost),
                judged.collision_queries,
                index == self.planner.num_generations,
            )

    def _judged(
        self, problem: Any, rng: np.random.Generator
    ) -> Iterator[tuple[NDArray[Any], Judgement]]:
        """Yield samples and their judgements."""
        planner = self.planner
        for index in range(planner.num_generations + 1):
            population = planner.sample(problem, rng, planner.num_evaluations(index))
            yield population, planner.cost(problem, population)
