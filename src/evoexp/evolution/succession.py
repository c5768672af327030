"""Statistics of costs, Pareto front, elites, and selection by scaled costs; sums are ordered.

Stochastic remainder sampling: every individual first becomes a parent as often as the whole part of
its expected number says. For the places left, the remainders are added up once, in random order; an
individual that brings the sum past u, u + 1, u + 2, … gets a place, where u is one uniform number:
at most one, with exactly the probability of its remainder. Goldberg's scan, which tosses a coin per
remainder until the places are full, is biased against individuals that come late, and against small
remainders.
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.numeric.random_stream import Block, draw_many, used_up
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
    dominates nor is on the front.

    Dominance is transitive, so only those not dominated so far are compared with all. Four criteria
    per pass stay in registers; where fewer are left, the last is repeated, which changes nothing.
    """
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


@kernel
def choose_parents(
    draws: Block, costs: FloatArray, multiple: float, num_elites: int
) -> tuple[IntArray, IntArray]:
    """Return parents by linear scaling and stochastic remainders, and the elites, as indices.

    `multiple`: copies that the best one expects, in units of the mean. There are as many parents as
    individuals that are no elites; if the draws are used up, they are not chosen.
    """
    elites, parents = np.empty(num_elites, np.int64), np.empty(len(costs) - num_elites, np.int64)
    expected = np.empty(len(costs))
    choose_elites(costs, elites)
    scale_costs(costs, len(parents), multiple, expected)
    uniforms = draw_many(draws, len(costs) + 1 + len(parents))
    if not used_up(draws):
        choose_by_remainders(uniforms, expected, parents)
    return parents, elites


@kernel
def scale_costs(costs: FloatArray, count: int, multiple: float, expected: FloatArray) -> None:
    """Write the expected numbers of copies by linear scaling (Chen & Zalzala 1995, Eqs. 5, 16).

    The paper, after Goldberg (1989), scales a fitness f = C_m − C to f' = a f + b, whose mean is
    that of f and whose maximum is `multiple` times the mean; negative values are set to 0. An
    individual then expects f' / mean(f') = 1 + (multiple − 1) (mean(C) − C) / (mean(C) − min(C))
    copies, whatever C_m is. Setting negative values to 0 raises the mean, and all values are
    divided by it.

    Individuals whose cost is not finite expect no copy and are left out of the mean; those of equal
    finite cost expect equally many; without any finite cost all do. The sum is `count`, but for
    rounding.
    """
    # mean and least of the finite costs
    num, finite, total, least = len(costs), 0, 0.0, np.inf
    for k in range(num):
        if np.isfinite(costs[k]):
            finite += 1
            total += costs[k]
            least = min(least, costs[k])
    mean = total / max(finite, 1)
    spread = mean - least
    # copies in units of the mean, none below 0
    total = 0.0
    for k in range(num):
        if finite == 0:
            copies = 1.0
        elif not np.isfinite(costs[k]):
            copies = 0.0
        elif spread > 0.0:
            copies = max(1.0 + (multiple - 1.0) * ((mean - costs[k]) / spread), 0.0)
        else:  # all are equal, but for rounding of the mean
            copies = 1.0
        expected[k] = copies
        total += copies
    # as many in all as parents are wanted
    for k in range(num):
        expected[k] = expected[k] * (count / total)


@kernel
def choose_by_remainders(
    uniforms: FloatArray,  # (individuals + 1 + parents,) in [0, 1)
    expected: FloatArray,  # (individuals,) ≥ 0, adding up to the number of parents but for rounding
    # (parents,) written, in random order: neighbours are a random pairing; k occurs ⌊expected[k]⌋
    # times or once more
    parents: IntArray,
) -> None:
    """Choose parents without replacement (Chen & Zalzala 1995, sections 2.3 and 3.2)."""
    num, count, filled = len(expected), len(parents), 0
    order = np.empty(num, dtype=np.int64)  # of the scan; negative where placed
    # whole parts
    for k in range(num):
        order[k] = k
        # A number that should be whole may be rounded down; a thousandth of 1e-9 is no remainder.
        for _ in range(int(expected[k] + 1e-12)):
            if filled < count:
                parents[filled] = k
                filled += 1
    # a random order of the individuals (Fisher–Yates), and the sum of the remainders
    total = 0.0
    for k in range(num):
        other = k + min(int(uniforms[k] * (num - k)), num - k - 1)
        order[k], order[other] = order[other], order[k]
        total += _remainder(expected[order[k]])
    # the places left, by one scan
    scale = (count - filled) / total if total > 0.0 else 0.0  # 1 but for rounding
    pointer, scanned = uniforms[num], 0.0
    for k in range(num):
        chosen = order[k]
        scanned += scale * _remainder(expected[chosen])
        if scanned > pointer and filled < count:
            parents[filled] = chosen
            order[k] = -1
            filled += 1
            pointer += 1.0
    # places that rounding left
    for k in range(num):
        if (
            filled < count
            and order[k] >= 0
            and (_remainder(expected[order[k]]) > 0.0 or total == 0.0)
        ):
            parents[filled] = order[k]
            filled += 1
    # parents in random order
    for k in range(count):
        other = k + min(int(uniforms[num + 1 + k] * (count - k)), count - k - 1)
        parents[k], parents[other] = parents[other], parents[k]


@kernel
def _remainder(expected: float) -> float:
    """Return the part of a number that is not whole, 0 below 1e-12."""
    return max(expected - int(expected + 1e-12), 0.0)
