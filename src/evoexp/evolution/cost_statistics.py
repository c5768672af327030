"""Best, mean and deviation of a generation's costs, by ordered sums: the same bits everywhere."""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import BoolArray, FloatArray


class CostStatistics(NamedTuple):
    """Statistics of the costs of one generation; NaN without a finite cost."""

    best: int  # index of the lowest cost, the first among equals
    mean: float  # over the finite costs
    std: float  # over the finite costs, of the population


@kernel
def cost_statistics(costs: FloatArray) -> CostStatistics:
    """Return best, mean and standard deviation of costs (individuals,)."""
    # the best, and the sum of the finite costs
    best, count, total = 0, 0, 0.0
    for k in range(len(costs)):
        if costs[k] < costs[best]:
            best = k
        if np.isfinite(costs[k]):
            count += 1
            total += costs[k]
    if count == 0:
        return CostStatistics(best, np.nan, np.nan)
    # the deviation, by squares of differences to the mean
    mean = total / count
    squares = 0.0
    for k in range(len(costs)):
        if np.isfinite(costs[k]):
            squares += (costs[k] - mean) * (costs[k] - mean)
    return CostStatistics(best, mean, np.sqrt(squares / count))


@kernel
def summarise(costs: FloatArray, feasible: BoolArray, out: FloatArray) -> None:
    """Write index of the best, mean and deviation of the costs, and how many are feasible (4,)."""
    out[0], out[1], out[2] = cost_statistics(costs)
    out[3] = np.count_nonzero(feasible)
