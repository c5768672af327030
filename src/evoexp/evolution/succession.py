"""Statistics of costs, by ordered sums with the same bits everywhere; Pareto front and elites."""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import BoolArray, FloatArray, IntArray


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


@kernel
def choose_elites(costs: FloatArray, chosen: IntArray) -> None:
    """Write the indices of the lowest costs, best first; among equals the lower index wins.

    By insertion: a later equal cost stays behind.
    """
    count, filled = len(chosen), 0
    for k in range(len(costs)):
        if filled == count and (count == 0 or not costs[k] < costs[chosen[count - 1]]):
            continue
        place = filled if filled < count else count - 1
        while place > 0 and costs[k] < costs[chosen[place - 1]]:
            chosen[place] = chosen[place - 1]
            place -= 1
        chosen[place] = k
        filled = min(filled + 1, count)


@kernel
def copy_members(population: FloatArray, members: IntArray, out: FloatArray, first: int) -> None:
    """Copy some individuals of a population (rows, individuals) to places from `first` on."""
    for row in range(len(out)):
        for k in range(len(members)):
            out[row, first + k] = population[row, members[k]]


@kernel
def pareto_front(criteria: FloatArray) -> BoolArray:
    """Mark the individuals (individuals,) that are not dominated (Curkovic et al. 2013, section 3).

    One dominates another if it is no worse in every criterion (criteria, individuals), all
    minimised, and better in at least one. Exact ties are all kept. An individual with a NaN neither
    dominates nor is on the front. ValueError: there is no criterion.

    Dominance is transitive, so only those not dominated so far are compared with all. Four criteria
    per pass stay in registers; where fewer are left, the last is repeated, which changes nothing.
    """
    if len(criteria) == 0:
        raise ValueError("criteria are (criteria, individuals), one at least")
    count = criteria.shape[1]
    last = len(criteria) - 1
    dominated = np.zeros(count, dtype=np.int64)
    # on i beside j: bit 0 better in some criterion, bit 1 worse in some
    verdicts = np.empty(count, dtype=np.int64)
    # a NaN keeps an individual off the front
    for m in range(last + 1):
        for i in range(count):
            dominated[i] |= 1 if criteria[m, i] != criteria[m, i] else 0
    for j in range(count):
        if dominated[j] != 0:
            continue
        verdicts[:] = 0
        for m in range(0, last + 1, 4):
            a, b = criteria[m], criteria[min(m + 1, last)]
            c, d = criteria[min(m + 2, last)], criteria[min(m + 3, last)]
            p, q, r, s = a[j], b[j], c[j], d[j]
            for i in range(count):
                better = (a[i] < p) | (b[i] < q) | (c[i] < r) | (d[i] < s)
                worse = (a[i] > p) | (b[i] > q) | (c[i] > r) | (d[i] > s)
                verdicts[i] |= (1 if better else 0) | (2 if worse else 0)
        for i in range(count):
            dominated[i] |= 1 if verdicts[i] == 2 else 0
    return np.asarray(dominated == 0)
