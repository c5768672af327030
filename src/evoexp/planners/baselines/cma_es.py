"""CMA-ES (Hansen & Ostermeier 2001) on a planner's own coding and cost, by the package cmaes."""

import itertools
from typing import Any, ClassVar

import numpy as np

from evoexp.planners.baselines.real_vectors import RealVectorControl, real_vectors
from evoexp.planners.planner import Populations, Reproducibility
from evoexp.validation import Positive

SEEDS = 2**32  # of numpy's older generators


class CmaEs(RealVectorControl):
    """Adapts mean and covariance of a normal distribution of individuals to what costs least.

    It begins with those of individuals drawn as the planner draws its own first ones. With
    `improves` each individual goes through one pass of the planner's local operator before it is
    judged; what is told to CMA-ES is the vector before it. Where all steps have become too small to
    matter, or numbers leave those that can be judged, it starts anew. Linear algebra makes the last
    bits those of an environment.
    """

    component: ClassVar[str] = "cma_es"
    reproducibility: ClassVar[Reproducibility] = "environment"
    matrices: ClassVar[int] = 12  # the covariance, its parts, and those of an update

    fewest: ClassVar[int] = 5

    sigma: Positive  # first standard deviation, in those of the drawn individuals [-]
    improves: bool  # whether individuals go through the planner's local operator before judgement

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield one generation after the other, of one distribution or of several in turn."""
        from cmaes import CMA

        planner = self.planner
        vectors = real_vectors(planner, problem, planner.sample(problem, rng, self.num_drawn))
        start = vectors.distribution()
        optimizer: CMA | None = None
        for index in itertools.count():
            count = self.num_evaluations(index)
            if optimizer is None or optimizer.should_stop():
                optimizer = CMA(
                    mean=start.mean.copy(),
                    sigma=self.sigma * start.deviation,
                    cov=start.covariance.copy(),
                    seed=int(rng.integers(SEEDS)),
                    population_size=count,
                )
            asked = np.array([optimizer.ask() for _ in range(count)])
            population = vectors.population(asked)
            improved = planner.improve(problem, population, rng) if self.improves else None
            judged = yield population if improved is None else improved
            ranked = np.where(np.isfinite(judged.cost), judged.cost, np.finfo(float).max)
            optimizer.tell(list(zip(asked, ranked.tolist(), strict=True)))
