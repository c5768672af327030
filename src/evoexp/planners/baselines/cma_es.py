"""CMA-ES (Hansen & Ostermeier 2001) on a planner's own coding and cost, by the package cmaes."""

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np

from evoexp.planners.baselines.real_vectors import RealVectorControl, real_vectors
from evoexp.planners.planner import Keeper, Reproducibility
from evoexp.records import Block, FloatArray
from evoexp.validation import Positive

SEEDS = 2**32  # of numpy's older generators


class CmaEs(RealVectorControl):
    """Adapts mean and covariance of a normal distribution of individuals to what costs least.

    It begins with mean and covariance of individuals drawn as the planner draws its own first ones,
    so that steps are as smooth as those are. With `improves` each individual goes through one pass
    of the planner's local operator before it is judged, as the planner's own offspring do; what is
    told to CMA-ES is the vector before it. A generation has as many individuals as a later one of
    the planner. Where all steps have become too small to matter, or numbers leave those that can be
    judged, it starts anew.

    Linear algebra of the package makes the last bits those of an environment.

    Attributes:
        sigma: First standard deviation, in those of the drawn individuals [-].
        improves: Whether individuals go through the planner's local operator before judgement.
        planner: The planner whose coding, cost and budget are used.
    """

    component: ClassVar[str] = "cma_es"
    reproducibility: ClassVar[Reproducibility] = "environment"
    matrices: ClassVar[int] = 12  # the covariance, its parts, and those of an update

    sigma: Positive
    improves: bool

    def evolve(self, problem: Any, rng: np.random.Generator) -> Iterator[Block]:
        """Yield one generation after the other, of one distribution or of several in turn."""
        from cmaes import CMA

        planner, keeper = self.planner, Keeper()
        start = real_vectors(planner, problem, planner.sample(problem, rng, self.num_drawn))
        optimizer: CMA | None = None
        for index in range(planner.num_generations + 1):
            count = self.num_evaluations(index)
            if optimizer is None or optimizer.should_stop():
                optimizer = CMA(
                    mean=start.mean.copy(),
                    sigma=self.sigma * start.deviation,
                    cov=start.covariance.copy(),
                    seed=int(rng.integers(SEEDS)),
                    population_size=count,
                )
            vectors = np.array([optimizer.ask() for _ in range(count)])
            population = self._improved(problem, start.population(vectors), rng)
            judged = planner.cost(problem, population)
            ranked = np.where(np.isfinite(judged.cost), judged.cost, np.finfo(float).max)
            optimizer.tell(list(zip(vectors, ranked.tolist(), strict=True)))
            yield keeper.record_judged(planner, problem, population, judged)

    def num_evaluations(self, index: int) -> int:
        """Return the planner's evaluations of a later generation, at least five."""
        return max(5, self.planner.num_evaluations(max(1, index)))

    def _improved(
        self, problem: Any, population: FloatArray, rng: np.random.Generator
    ) -> FloatArray:
        """Return a population after one pass of the local operator, where there is one."""
        improved = self.planner.improve(problem, population, rng) if self.improves else None
        return population if improved is None else improved
