"""Iterated local search on a planner's own coding, cost and local operator, without evolution."""

import itertools
import math
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from evoexp.numeric.elementary import exp
from evoexp.planners.baselines.real_vectors import RealVectorControl, real_vectors
from evoexp.planners.planner import Populations
from evoexp.validation import Count, Positive


class IteratedLocalSearch(RealVectorControl):
    """Improves the best of the first population, each on its own (Lourenço, Martin & Stützle 2003).

    A step adds the difference of two individuals that the planner drew at first, so that it is as
    smooth as they are, times a factor whose logarithm is uniform. With `improves` the planner's
    local operator, if it has one, is applied once. An individual of a chain is replaced by the
    cheapest of its trials in a generation unless that costs more. Chains exchange nothing.
    """

    component: ClassVar[str] = "iterated_local_search"
    matrices: ClassVar[int] = 0

    num_chains: Count  # individuals that are improved side by side
    improves: bool  # whether trials go through the planner's local operator before judgement
    sigma: Positive  # largest step, in those between drawn individuals over √2 [-]
    least: Annotated[float, Field(gt=0.0, le=1.0)]  # smallest step, as a share of the largest [-]

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield the first population, then the trials of all chains in turn."""
        planner = self.planner
        vectors = real_vectors(planner, problem, planner.sample(problem, rng, self.num_drawn))
        population = planner.sample(problem, rng, planner.num_evaluations(0))
        judged = yield population
        order = np.argsort(judged.cost, kind="stable")[: self.num_chains]
        chains, costs = population[..., order][vectors.changes].T, judged.cost[order]
        for index in itertools.count(1):
            count = self.num_evaluations(index)
            one, other = rng.integers(self.num_drawn, size=(2, count))
            logarithms = math.log(self.least) * rng.random(count)
            sizes = self.sigma / math.sqrt(2.0) * np.array([exp(x) for x in logarithms.tolist()])
            steps = sizes * (vectors.drawn[:, one] - vectors.drawn[:, other])
            of = np.arange(count) % len(chains)
            population = vectors.population(chains[of] + steps.T)
            improved = planner.improve(problem, population, rng) if self.improves else None
            population = population if improved is None else improved
            judged = yield population
            for chain in range(min(count, len(chains))):
                trials = np.flatnonzero(of == chain)
                best = trials[np.argmin(judged.cost[trials])]
                if judged.cost[best] <= costs[chain]:
                    costs[chain] = judged.cost[best]
                    chains[chain] = population[..., best][vectors.changes]
