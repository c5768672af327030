"""Statistics over replicates, whose unit is the seed.

Replicates of two conditions with one index share a seed. Costs may be infinite (infeasible);
medians, ranks and effect sizes are defined all the same, and nothing here takes a mean.
"""

import functools
import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from evoexp.records import FloatArray

EXACT_PAIRS = 200  # up to here the signed-rank distribution is exact, beyond it approximated
EXACT_VALUES = 100  # of both samples together: the same of the rank-sum distribution
MOST_CHOSEN = 9  # tied values of both samples that are all permuted: at most 126 ways
MOST_AT_ONCE = 50_000  # weights of resamples that are worked on at a time
BOOTSTRAP_SEED = 20_250_419  # of the report's own generator; any fixed number


class Interval(NamedTuple):
    """An interval; `low` ≤ `high`."""

    low: float
    high: float


class Spread(NamedTuple):
    """Median and quartiles of some values."""

    median: float  # NaN without values
    lower: float  # first quartile
    upper: float  # third quartile
    num_values: int  # values that are not NaN


class SignedRank(NamedTuple):
    """Wilcoxon's signed-rank test of paired values."""

    num_pairs: int  # pairs that differ; equal ones say nothing
    positive_ranks: float  # W+, the sum of ranks of the positive differences
    p_value: float  # two-sided

    @property
    def share(self) -> float:
        """W+ over the sum of all ranks, in [0, 1]; 1/2 without a difference."""
        return 2.0 * self.positive_ranks / (self.num_pairs * (self.num_pairs + 1) or 1)

    @property
    def direction(self) -> int:
        """1 if ranks of positive differences prevail, −1 if those of negative ones do, else 0."""
        twice, total = 4.0 * self.positive_ranks, self.num_pairs * (self.num_pairs + 1)
        return int(twice > total) - int(twice < total)


class Proportion(NamedTuple):
    """A count of runs that have a property."""

    having: int  # runs that have it
    total: int  # all runs

    def __str__(self) -> str:
        """Return the count in words: "3 of 20"."""
        return f"{self.having} of {self.total}"

    @property
    def share(self) -> float:
        """In [0, 1]; NaN without runs."""
        return self.having / self.total if self.total else math.nan

    def interval(self, confidence: float) -> Interval:
        """Return Wilson's score interval; [0, 1] without runs."""
        if not self.total:
            return Interval(0.0, 1.0)
        found = stats.binomtest(self.having, self.total).proportion_ci(confidence, method="wilson")
        return Interval(float(found.low), float(found.high))

    def with_interval(self, confidence: float, decimals: int = 0) -> str:
        """Return the proportion and its interval in words: "964 of 1000 = 96.4 % [95.1, 97.4]"."""
        if not self.total:
            return "0 of 0"
        share, low, high = (
            f"{100 * value:.{decimals}f}" for value in (self.share, *self.interval(confidence))
        )
        return f"{self.having} of {self.total} = {share} % [{low}, {high}]"


class RankSum(NamedTuple):
    """Mann and Whitney's test of two independent samples."""

    u: float  # pairs (x, y) with x > y, and half of those with x = y
    p_value: float  # two-sided


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
    return float(quantiles(values[None], (share,))[0, 0])


def quantiles(values: FloatArray, shares: Sequence[float]) -> FloatArray:
    """Return the same quantiles as `quantile` of each row.

    Args:
        values: (rows, n); NaN is ignored, ±inf is a value.
        shares: In [0, 1].

    Returns:
        (shares, rows); NaN where a row has no values.
    """
    found = np.full((len(shares), len(values)), np.nan)
    if values.shape[1] == 0:
        return found
    ordered, rows = np.sort(values, axis=1), np.arange(len(values))  # NaN comes last
    last = np.count_nonzero(~np.isnan(values), axis=1) - 1
    for own, share in zip(found, shares, strict=True):
        position = share * np.maximum(last, 0)
        below = np.floor(position).astype(np.int64)
        low, high = (ordered[rows, np.minimum(k, np.maximum(last, 0))] for k in (below, below + 1))
        fraction = position - below
        between = (fraction != 0.0) & (low != high) & (last >= 0)
        own[last >= 0] = low[last >= 0]
        with np.errstate(invalid="ignore"):  # NaN lies between −inf and inf
            own[between] += fraction[between] * (high[between] - low[between])
    return found


def spread(values: FloatArray) -> Spread:
    """Return median and quartiles of values (n,)."""
    median, lower, upper = (quantile(values, share) for share in (0.5, 0.25, 0.75))
    return Spread(median, lower, upper, int(np.count_nonzero(~np.isnan(values))))


def signed_rank(x: FloatArray, y: FloatArray) -> SignedRank:
    """Test whether paired values (pairs,) differ (Wilcoxon 1945); ties share their mean rank.

    Infinite values are compared as such, equal pairs are left out. The p-value is the same for
    (y, x): it is summed over the lower tail, which W+ of one order and W− of the other share.
    """
    differing = x != y
    difference = x[differing] - y[differing]
    if not len(difference):
        return SignedRank(0, 0.0, 1.0)
    ranks = stats.rankdata(np.abs(difference))
    positive, negative = (float(ranks[sign * difference > 0.0].sum()) for sign in (1.0, -1.0))
    if len(difference) > EXACT_PAIRS:
        method: Any = "asymptotic"  # scipy's stubs do not know it with every other argument
        p_value = float(stats.wilcoxon(difference, method=method, correction=True).pvalue)
    else:
        p_value = min(1.0, 2.0 * _lower_tail(ranks, min(positive, negative)))
    return SignedRank(len(difference), positive, p_value)


def _lower_tail(ranks: FloatArray, limit: float) -> float:
    """Return the probability that ranks with random signs give a W+ up to a limit.

    The exact distribution, built rank by rank: sums of positive numbers alone, so that no digit is
    lost however small they are. All numbers are multiples of 1/2.
    """
    share = np.zeros(int(2.0 * limit) + 1)  # by twice the sum
    share[0] = 1.0
    for rank in np.rint(2.0 * ranks).astype(np.int64):
        more = np.zeros_like(share)
        more[rank:] = share[: max(len(share) - rank, 0)]
        share = 0.5 * (share + more)
    return float(share.sum())


def rank_sum(x: FloatArray, y: FloatArray) -> RankSum:
    """Test whether two samples (n,) and (m,) differ (Mann and Whitney 1947).

    Ties share their mean rank, infinite values are compared as such.
    """
    values = np.concatenate([x, y])
    if not len(x) or not len(y) or (values == values[0]).all():
        return RankSum(0.5 * len(x) * len(y), 1.0)
    if len(np.unique(values)) == len(values) <= EXACT_VALUES:
        found = stats.mannwhitneyu(x, y, method="exact")
    elif len(values) <= MOST_CHOSEN:  # with ties: every choice of the first sample's ranks
        ranks, size = stats.rankdata(values), len(x)
        observed = float(ranks[:size].sum())
        sums = np.array([sum(chosen) for chosen in itertools.combinations(ranks, size)])
        p_value = 2.0 * min(float(np.mean(sums <= observed)), float(np.mean(sums >= observed)))
        return RankSum(observed - 0.5 * size * (size + 1), min(1.0, p_value))
    else:  # corrected for ties and continuity
        found = stats.mannwhitneyu(x, y, method="asymptotic")
    return RankSum(float(found.statistic), float(found.pvalue))


def newcombe(one: Proportion, two: Proportion, confidence: float) -> Interval:
    """Return an interval of the difference `one` − `two` (Newcombe 1998, method 10).

    Where one of them has no runs it is [−1, 1].
    """
    if not one.total or not two.total:
        return Interval(-1.0, 1.0)
    (low_one, high_one), (low_two, high_two) = one.interval(confidence), two.interval(confidence)
    difference = one.share - two.share
    below = math.sqrt((one.share - low_one) ** 2 + (high_two - two.share) ** 2)
    above = math.sqrt((high_one - one.share) ** 2 + (two.share - low_two) ** 2)
    return Interval(difference - below, difference + above)


def fisher_exact(one: Proportion, two: Proportion) -> float:
    """Return the two-sided p of Fisher's exact test: all tables at most as likely as this one."""
    table = np.array([[each.having, each.total - each.having] for each in (one, two)])
    return float(stats.fisher_exact(table).pvalue)


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
    below, up_to = _ranks(x, y)
    return float(0.5 * (int(below.sum()) + int(up_to.sum())) / (len(x) * len(y)))


def _ranks(x: FloatArray, y: FloatArray) -> tuple[np.ndarray, np.ndarray]:
    """Return how many of y (m,) lie below each of x (n,), and how many up to it; none of a NaN."""
    ordered, known = np.sort(y), ~np.isnan(x)
    below, up_to = (np.searchsorted(ordered, x, side) for side in ("left", "right"))
    return np.where(known, below, 0), np.where(known, up_to, 0)


def effect(x: FloatArray, y: FloatArray, confidence: float, num_resamples: int) -> Effect:
    """Return A12 of paired values (pairs,) with a percentile interval over resampled pairs."""
    if not len(x):
        return Effect(math.nan, Interval(math.nan, math.nan))
    (below, up_to), order = _ranks(x, y), np.argsort(y, kind="stable")
    weights = _weights(len(x), num_resamples)
    resampled = np.empty(num_resamples)
    some = max(1, MOST_AT_ONCE // len(x))  # resamples at a time
    passed = np.zeros((some, len(x) + 1))  # pairs of a resample whose y is among the k lowest
    for k in range(0, num_resamples, some):
        own = weights[k : k + some]
        here = passed[: len(own)]
        np.cumsum(own[:, order], axis=1, out=here[:, 1:])
        # multiples of 1/2 are exact in any order
        resampled[k : k + some] = 0.5 * np.sum(own * (here[:, below] + here[:, up_to]), axis=1)
    return Effect(vargha_delaney(x, y), percentiles(resampled / len(x) ** 2, confidence))


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
    """Return a bootstrap interval of the expected running time of runs (runs,).

    Without a success it has no upper end.
    """
    low, high = percentiles(_resampled_effort(effort, solved, num_resamples), confidence)
    return Interval(low, high if solved.any() else math.inf)


def effort_ratio(
    one: tuple[FloatArray, np.ndarray],
    two: tuple[FloatArray, np.ndarray],
    confidence: float,
    num_resamples: int,
) -> Interval:
    """Return the percentile interval of the ratio of two expected running times, one over two.

    Both are effort and success of every run, (runs,) each, of the same seeds. If neither has a
    success, the interval is [0, inf].
    """
    (effort_one, solved_one), (effort_two, solved_two) = one, two
    if not solved_one.any() or not solved_two.any():
        if solved_one.any() == solved_two.any():
            return Interval(0.0, math.inf)
        ratio = 0.0 if solved_one.any() else math.inf
        return Interval(ratio, ratio)
    above = _resampled_effort(effort_one, solved_one, num_resamples)
    below = _resampled_effort(effort_two, solved_two, num_resamples, stream=1)
    return percentiles(above / below, confidence)


@functools.lru_cache(maxsize=8)
def _weights(size: int, num_resamples: int) -> np.ndarray:
    """Return how often each of `size` runs is drawn, (resamples, size)."""
    rng = np.random.Generator(np.random.PCG64(BOOTSTRAP_SEED))
    weights = np.empty((num_resamples, size), dtype=np.uint16 if size < 2**16 else np.int32)
    for own in weights:
        own[:] = np.bincount(rng.integers(0, size, size), minlength=size)
    return weights


def forget_resamples() -> None:
    """Free the resamples that comparisons share: of thousands of runs they take tens of MB."""
    _weights.cache_clear()


def _resampled_effort(
    effort: FloatArray, solved: np.ndarray, num_resamples: int, stream: int = 0
) -> FloatArray:
    """Return resampled expected running times, (resamples,).

    A Bayesian bootstrap (Rubin 1981): every run has a random weight, the same in all conditions of
    these seeds. Half a success and half a failure that nobody saw are added (Jeffreys' prior of the
    share), as without them few failures, or none, would say too much. They cost the mean of their
    kind; a kind that was never seen costs nothing as a success, and twice the dearest run as a
    failure. Their weights are drawn from a stream of their own in each condition of a comparison.
    """
    won = np.asarray(solved, dtype=bool)
    of_success = float(effort[won].mean()) if won.any() else 0.0
    of_failure = float(effort[~won].mean()) if not won.all() else 2.0 * float(effort.max())
    weights = _random_weights(len(effort), num_resamples, 1.0, 0)
    success, failure = _random_weights(2, num_resamples, 0.5, 1 + stream).T
    spent = weights @ effort + success * of_success + failure * of_failure
    return np.asarray(spent / (weights @ won.astype(np.float64) + success))


@functools.lru_cache(maxsize=8)
def _random_weights(size: int, num_resamples: int, shape: float, stream: int) -> FloatArray:
    """Return gamma-distributed weights, (resamples, size)."""
    rng = np.random.Generator(np.random.PCG64([BOOTSTRAP_SEED, stream]))
    return rng.gamma(shape, size=(num_resamples, size))


def percentiles(values: FloatArray, confidence: float) -> Interval:
    """Return the interval between the percentiles that leave out the rest on both sides."""
    tail = 0.5 * (1.0 - confidence)
    return Interval(quantile(values, tail), quantile(values, 1.0 - tail))
