"""What a generation's costs say.

Kept in one pass of ordered sums, so that the numbers are the same everywhere.
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray


class CostStatistics(NamedTuple):
    """Of the costs of one generation.

    Attributes:
        best: Index of the lowest cost, the first among equals.
        mean: Over the finite costs; NaN if there are none.
        std: Over the finite costs, population standard deviation; NaN if there are none.
    """

    best: int
    mean: float
    std: float


def cost_statistics(costs: FloatArray) -> CostStatistics:
    """Return best, mean and standard deviation of costs (individuals,)."""
    return CostStatistics(*summarise(costs))


@kernel
def summarise(costs):  # type: ignore[no-untyped-def]
    """The kernel of `cost_statistics`, for other kernels."""
    best, count, total = 0, 0, 0.0
    for k in range(len(costs)):
        if costs[k] < costs[best]:
            best = k
        if np.isfinite(costs[k]):
            count += 1
            total += costs[k]
    if count == 0:
        return best, np.nan, np.nan
    mean = total / count
    squares = 0.0
    for k in range(len(costs)):
        if np.isfinite(costs[k]):
            squares += (costs[k] - mean) * (costs[k] - mean)
    return best, mean, np.sqrt(squares / count)
