"""Statistics over replicates, whose unit is the seed.

Replicates of two conditions with one index share a seed. Costs may be infinite (infeasible);
medians, ranks and effect sizes are defined all the same, and nothing here takes a mean.
"""

import functools
import math
from collections.abc import Sequence
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from evoexp.records import FloatArray

EXACT_PAIRS = 200  # up to here the signed-rank distribution is computed, beyond it approximated
EXACT_VALUES = 100  # of both samples together: the same of the rank-sum distribution
BOOTSTRAP_SEED = 20_250_419  # of the report's own generator; any fixed number


class Interval(NamedTuple):
    """An interval; `low` ≤ `high`."""

    low: float
    high: float


class Spread(NamedTuple):
    """Median and quartiles of some values.

    Attributes:
        median: NaN without values.
        lower: First quartile.
        upper: Third quartile.
        num_values: Values that are not NaN.
    """

    median: float
    lower: float
    upper: float
    num_values: int


class SignedRank(NamedTuple):
    """Wilcoxon's signed-rank test of paired values.

    Attributes:
        num_pairs: Pairs that differ; equal ones say nothing.
        positive_ranks: W+, the sum of ranks of the positive differences.
        p_value: Two-sided.
    """

    num_pairs: int
    positive_ranks: float
    p_value: float


class RankSum(NamedTuple):
    """Mann and Whitney's test of two independent samples.

    Attributes:
        u: Pairs (x, y) with x > y, and half of those with x = y.
        p_value: Two-sided.
    """

    u: float
    p_value: float


class Effect(NamedTuple):
    """Vargha and Delaney's A12 = P(x > y) + P(x = y) / 2, with a bootstrap interval."""

    a12: float
    interval: Interval


def quantile(values: FloatArray, share: float) -> float:
    """Return a quantile by linear interpolation of order statistics.

    Args:
        values: (n,); NaN is ignored, ±inf is a value.
        share: In [0, 1].
    """
    ordered = np.sort(values[~np.isnan(values)])
    if not len(ordered):
        return math.nan
    position = share * (len(ordered) - 1)
    below = math.floor(position)
    low, high = float(ordered[below]), float(ordered[min(below + 1, len(ordered) - 1)])
    fraction = position - below
    return low if fraction == 0.0 or low == high else low + fraction * (high - low)


def spread(values: FloatArray) -> Spread:
    """Return median and quartiles of values (n,)."""
    median, lower, upper = (quantile(values, share) for share in (0.5, 0.25, 0.75))
    return Spread(median, lower, upper, int(np.count_nonzero(~np.isnan(values))))


def wilson(successes: int, trials: int, confidence: float) -> Interval:
    """Return Wilson's score interval of a proportion; [0, 1] without trials."""
    if trials == 0:
        return Interval(0.0, 1.0)
    z = NormalDist().inv_cdf(0.5 + confidence / 2.0)
    p, n = successes / trials, trials
    center = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return Interval(
        0.0 if successes == 0 else max(0.0, center - half),
        1.0 if successes == n else min(1.0, center + half),
    )


def signed_rank(x: FloatArray, y: FloatArray) -> SignedRank:
    """Test whether paired values differ (Wilcoxon 1945); ties share their mean rank.

    Args:
        x: (pairs,); infinite values are compared as such, equal pairs are left out.
        y: (pairs,).
    """
    differing = x != y
    difference = x[differing] - y[differing]
    ranks = _doubled_midranks(np.abs(difference))
    doubled = int(ranks[difference > 0.0].sum())
    if len(ranks) <= EXACT_PAIRS:
        p_value = _exact_p(_sign_probabilities(ranks), doubled)
    else:  # ties are accounted for by the ranks themselves
        variance = float((ranks.astype(np.float64) ** 2).sum()) / 4.0
        p_value = _normal_p(doubled - ranks.sum() / 2.0, variance)
    return SignedRank(len(ranks), doubled / 2.0, p_value)


def rank_sum(x: FloatArray, y: FloatArray) -> RankSum:
    """Test whether two samples differ (Mann and Whitney 1947); ties share their mean rank.

    Args:
        x: (n,); infinite values are compared as such.
        y: (m,).
    """
    size, ranks = len(x), _doubled_midranks(np.concatenate([x, y]))
    doubled, total = int(ranks[:size].sum()), len(ranks)
    if total <= EXACT_VALUES:
        p_value = _exact_p(_ways_to_choose(ranks, size), doubled, math.comb(total, size))
    else:  # ties are accounted for by the ranks themselves
        mean, spread_of_ranks = float(ranks.mean()), float(np.mean((ranks - ranks.mean()) ** 2))
        variance = size * (total - size) / (total - 1) * spread_of_ranks
        p_value = _normal_p(doubled - size * mean, variance)
    return RankSum((doubled - size * (size + 1)) / 2.0, p_value)


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p-values adjusted by Holm's step-down method, in the given order."""
    adjusted, running = [0.0] * len(p_values), 0.0
    for step, k in enumerate(sorted(range(len(p_values)), key=lambda k: p_values[k])):
        running = max(running, min(1.0, (len(p_values) - step) * p_values[k]))
        adjusted[k] = running
    return adjusted


def vargha_delaney(x: FloatArray, y: FloatArray) -> float:
    """Return A12 = P(x > y) + P(x = y) / 2 of values (n,) and (m,); NaN if either is empty."""
    if not len(x) or not len(y):
        return math.nan
    greater, equal = x[:, None] > y, x[:, None] == y
    return float((np.count_nonzero(greater) + 0.5 * np.count_nonzero(equal)) / greater.size)


def effect(x: FloatArray, y: FloatArray, confidence: float, num_resamples: int) -> Effect:
    """Return A12 of paired values with a percentile interval over resampled pairs.

    Args:
        x: (pairs,).
        y: (pairs,).
        confidence: Level of the interval.
        num_resamples: Of the bootstrap.
    """
    if not len(x):
        return Effect(math.nan, Interval(math.nan, math.nan))
    wins = (x[:, None] > y) + 0.5 * (x[:, None] == y)  # (pairs, pairs)
    weights = _weights(len(x), num_resamples)
    # multiples of 1/2 are exact in any order
    resampled = ((weights @ wins) * weights).sum(axis=1) / len(x) ** 2
    return Effect(vargha_delaney(x, y), _percentiles(resampled, confidence))


def expected_effort(effort: FloatArray, solved: np.ndarray) -> float:
    """Return the expected running time (Hansen et al. 2009): all effort over all successes.

    Args:
        effort: (runs,) of every run, failed ones included.
        solved: (runs,) whether it succeeded.

    Returns:
        The cost of a success if failed runs are started again; inf if there is none.
    """
    having = int(np.count_nonzero(solved))
    return float(np.sum(effort)) / having if having else math.inf


def expected_interval(
    effort: FloatArray, solved: np.ndarray, confidence: float, num_resamples: int
) -> Interval:
    """Return the percentile interval of the expected running time over resampled runs.

    Args:
        effort: (runs,).
        solved: (runs,).
        confidence: Level of the interval.
        num_resamples: Of the bootstrap.
    """
    return _percentiles(
        _resampled_effort(_weights(len(effort), num_resamples), effort, solved), confidence
    )


def effort_ratio(
    one: tuple[FloatArray, np.ndarray],
    two: tuple[FloatArray, np.ndarray],
    confidence: float,
    num_resamples: int,
) -> Interval:
    """Return the percentile interval of the ratio of two expected running times, one over two.

    Both are of the same seeds. Resamples in which neither succeeds are left out; if none is left,
    the interval is [0, inf].

    Args:
        one: Effort and success of every run, (runs,) each.
        two: The same of other runs with the same seeds.
        confidence: Level of the interval.
        num_resamples: Of the bootstrap.
    """
    weights = _weights(len(one[0]), num_resamples)
    above, below = (_resampled_effort(weights, *given) for given in (one, two))
    known = np.isfinite(above) | np.isfinite(below)
    if not known.any():
        return Interval(0.0, math.inf)
    ratios = np.full(int(np.count_nonzero(known)), math.inf)
    np.divide(above[known], below[known], out=ratios, where=np.isfinite(above[known]))
    return _percentiles(ratios, confidence)


@functools.lru_cache(maxsize=8)
def _weights(size: int, num_resamples: int) -> np.ndarray:
    """Return how often each of `size` runs is drawn, (resamples, size)."""
    rng = np.random.Generator(np.random.PCG64(BOOTSTRAP_SEED))
    return np.array(
        [np.bincount(rng.integers(0, size, size), minlength=size) for _ in range(num_resamples)]
    )


def _resampled_effort(weights: np.ndarray, effort: FloatArray, solved: np.ndarray) -> FloatArray:
    spent, having = (weights * effort).sum(axis=1), (weights * solved).sum(axis=1)
    found = np.full(len(weights), math.inf)
    np.divide(spent, having, out=found, where=having > 0)
    return found


def _percentiles(values: FloatArray, confidence: float) -> Interval:
    tail = 0.5 * (1.0 - confidence)
    return Interval(quantile(values, tail), quantile(values, 1.0 - tail))


def _doubled_midranks(values: FloatArray) -> np.ndarray:
    """Return twice the ranks of values (n,), whole numbers also where ties share a mean rank."""
    _, group, counts = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(counts)
    return np.asarray((2 * last - counts + 1)[group])


def _sign_probabilities(ranks: np.ndarray) -> np.ndarray:
    """Return the probability of each sum of positive ranks over all signs, (greatest sum + 1,)."""
    probability = np.zeros(int(ranks.sum()) + 1)
    probability[0] = 1.0
    for rank in ranks:
        shifted = np.zeros_like(probability)
        shifted[rank:] = probability[: len(probability) - rank]
        probability = 0.5 * (probability + shifted)
    return probability


def _ways_to_choose(ranks: np.ndarray, size: int) -> np.ndarray:
    """Return in how many ways `size` of the ranks have each sum, (greatest sum + 1,)."""
    choices = np.zeros((size + 1, int(ranks.sum()) + 1))  # (ranks chosen, sum)
    choices[0, 0] = 1.0
    for k, rank in enumerate(ranks):
        for chosen in range(min(k + 1, size), 0, -1):
            choices[chosen, rank:] += choices[chosen - 1, : choices.shape[1] - rank]
    return np.asarray(choices[size])


def _exact_p(weights: np.ndarray, doubled: int, total: int = 1) -> float:
    """Return the two-sided p of an observed sum.

    Args:
        weights: Of each sum: its probability, or the number of ways that lead to it.
        doubled: The observed sum of doubled ranks.
        total: Sum of the weights.
    """
    below, above = math.fsum(weights[: doubled + 1]), math.fsum(weights[doubled:])
    return min(1.0, 2.0 * min(below, above) / total)


def _normal_p(deviation: float, variance: float) -> float:
    """Return the probability that a normal deviate is as far from its mean."""
    # erfc keeps the far tail, where a distribution function rounds to 1
    return math.erfc(abs(deviation) / math.sqrt(2.0 * variance)) if variance else 1.0
