"""Stochastic trajectory optimisation on a planner's own coding and cost, in the manner of STOMP."""

import itertools
import math
from typing import Any, ClassVar

import numpy as np

from evoexp.numeric.elementary import exp, standard_normal
from evoexp.numeric.ordered_sums import matrix_product
from evoexp.planners.baselines.real_vectors import (
    RealVectorControl,
    real_vectors,
    transposed_root,
)
from evoexp.planners.planner import Populations
from evoexp.records import FloatArray
from evoexp.validation import Count, Positive, Rate


class Stomp(RealVectorControl):
    """Moves one trajectory by the weighted mean of noisy ones (Kalakrishnan et al. 2011).

    Noise has the covariance of the individuals that the planner draws at first. Unlike in STOMP a
    cost is that of a whole trajectory, so that all its via-points share one weight: exp(−h (S − min
    S) / (max S − min S)) (their Eq. 11). The trajectory that results is judged as the first of the
    next generation. Noise shrinks by a factor per generation; without a better trajectory for
    `patience` generations the search starts anew from an individual that the planner draws.
    """

    component: ClassVar[str] = "stomp"
    matrices: ClassVar[int] = 4  # the covariance, its root, and those of its factorisation

    sigma: Positive  # standard deviation of the first noise, in those of the drawn individuals [-]
    shrinkage: Rate  # share of the noise that is left after a generation [-]
    sensitivity: Positive  # h, the weight's decay from the least cost to the largest [-]
    patience: Count  # generations without a better trajectory until it starts anew

    def populations(self, problem: Any, rng: np.random.Generator) -> Populations:
        """Yield one generation of noisy trajectories after the other, the middle one first."""
        planner = self.planner
        vectors = real_vectors(planner, problem, planner.sample(problem, rng, self.num_drawn))
        start = vectors.distribution()
        root, scale = transposed_root(start.covariance), start.deviation
        middle, sigma, least, idle = start.mean, self.sigma, np.inf, 0
        for index in itertools.count():
            if idle > self.patience:
                middle = planner.sample(problem, rng, 1)[vectors.changes][:, 0]
                sigma, least, idle = self.sigma, np.inf, 0
            normals = standard_normal(rng, (self.num_evaluations(index), len(middle)))
            normals[0] = 0.0
            noise = matrix_product(sigma * scale * normals, root)
            judged = yield vectors.population(middle + noise)
            idle = 0 if judged.cost.min() < least else idle + 1
            least = min(least, float(judged.cost.min()))
            middle = middle + matrix_product(self.weights(judged.cost), noise)
            sigma *= self.shrinkage

    def weights(self, costs: FloatArray) -> FloatArray:
        """Return weights of trajectories by their costs, of sum 1; 0: infeasible."""
        finite = np.isfinite(costs)
        if not finite.any():
            return np.full(len(costs), 1.0 / len(costs))
        low, high = costs[finite].min(), costs[finite].max()
        decay = self.sensitivity / (high - low) if high > low else 0.0
        found = [exp(-decay * (c - low)) if math.isfinite(c) else 0.0 for c in costs.tolist()]
        return np.array(found) / sum(found)
