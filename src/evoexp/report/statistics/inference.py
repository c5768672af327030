"""Statistics over replicates, which are independent samples of their conditions.

Costs may be infinite (infeasible); medians, ranks and effect sizes are defined all the same, and
nothing here takes a mean.
"""

import functools
import math
import sys
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from scipy import optimize, special, stats

from evoexp.records import FloatArray

POWER = 0.8  # [-] of a test whose runs are planned
LEAST_FOR_T = 10  # runs of each sample from which Brunner and Munzel's t distribution holds
SMALLEST_SHARE = 1e-9  # of pairs of runs; no samples are so large
BOOTSTRAP_SEED = 20_250_419  # of the report's own generators; any fixed number


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


class Effect(NamedTuple):
    """Vargha and Delaney's A12 = P(x > y) + P(x = y) / 2 of two independent samples, tested."""

    a12: float
    interval: Interval
    p_value: float  # two-sided, of A12 = 1/2

    @property
    def direction(self) -> int:
        """1 if the first sample tends to be greater, −1 if smaller, else 0."""
        return int(self.a12 > 0.5) - int(self.a12 < 0.5)


def quantile(values: FloatArray, share: float) -> float:
    """Return a quantile of values (n,), see `quantiles`."""
    return float(quantiles(values[None], (share,))[0, 0])


def quantiles(values: FloatArray, shares: Sequence[float]) -> FloatArray:
    """Return quantiles of each row (rows, n) by interpolating order statistics, (shares, rows).

    NaN is ignored, ±inf is a value; NaN where a row has no values.
    """
    if values.shape[1] == 0:
        return np.full((len(shares), len(values)), np.nan)
    ordered = np.sort(values, axis=1)  # NaN comes last
    last = np.maximum(np.count_nonzero(~np.isnan(values), axis=1) - 1, 0)
    position = np.outer(shares, last)
    low, high = (
        np.take_along_axis(ordered, ends(position).astype(np.int64).T, axis=1).T
        for ends in (np.floor, np.ceil)
    )
    with np.errstate(invalid="ignore"):  # NaN lies between −inf and inf
        between = low + (position - np.floor(position)) * (high - low)
    return np.where(low == high, low, between)


def spread(values: FloatArray) -> Spread:
    """Return median and quartiles of values (n,)."""
    median, lower, upper = quantiles(values[None], (0.5, 0.25, 0.75))[:, 0].tolist()
    return Spread(median, lower, upper, int(np.count_nonzero(~np.isnan(values))))


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


def fisher_family(pairs: Iterable[tuple[Proportion, Proportion]]) -> list[float]:
    """Return the p-values of Fisher's exact tests of several pairs, adjusted by Holm over them."""
    return holm([fisher_exact(*pair) for pair in pairs])


def runs_for_effect(a12: float, significance: float) -> float:
    """Return the runs of each sample that show this A12 with the usual power (Noether 1987)."""
    beyond = float(stats.norm.isf(0.5 * significance) + stats.norm.ppf(POWER))
    return 0.5 * beyond**2 / (3.0 * (a12 - 0.5) ** 2) if a12 != 0.5 else math.inf


def runs_for_shares(one: Proportion, two: Proportion, significance: float) -> float:
    """Return the runs of each that show this difference of shares with the usual power.

    As many as there are at least; inf if the shares are equal.
    """
    p, q = one.share, two.share
    if p == q:
        return math.inf
    both = 0.5 * (p + q)
    beyond = stats.norm.isf(0.5 * significance) * math.sqrt(2.0 * both * (1.0 - both))
    missed = stats.norm.ppf(POWER) * math.sqrt(p * (1.0 - p) + q * (1.0 - q))
    needed = float((beyond + missed) ** 2) / (p - q) ** 2
    return max(needed, max(one.total, two.total) + 1.0)


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p-values adjusted by Holm's step-down method, in the given order."""
    adjusted, running = [0.0] * len(p_values), 0.0
    for step, k in enumerate(sorted(range(len(p_values)), key=lambda k: p_values[k])):
        running = max(running, min(1.0, (len(p_values) - step) * p_values[k]))
        adjusted[k] = running
    return adjusted


def _placements(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return how many of y (m,) lie below each of x (n,); equal ones count half."""
    ordered = np.sort(y)
    below, up_to = (np.searchsorted(ordered, x, side) for side in ("left", "right"))
    return np.asarray(0.5 * (below + up_to))


def effect(x: FloatArray, y: FloatArray, confidence: float) -> Effect:
    """Compare two samples (n,) and (m,) of at least one value, without NaN (Brunner, Munzel 2000).

    Values are ranked: an infinite one, of a run that never got there, is the worst and no more.
    Small samples are tested by Mann and Whitney, and separated ones, in which every x lies on one
    side of every y, by the number of ways to choose the first; these have Newcombe's interval, as
    their placements do not vary.
    """
    n, m = len(x), len(y)
    a12 = float(np.sum(_placements(x, y)) / (n * m))  # halves add without rounding
    # squared standard errors of A12, from the places of either sample in the other
    errors = [
        float(np.var(_placements(a, b), ddof=1)) / (len(a) * len(b) ** 2) if len(a) > 1 else 0.0
        for a, b in ((x, y), (y, x))
    ]
    # separated samples: two of all ways to choose the first one's ranks; of thousands of runs there
    # are more ways than a float can count, so here is their logarithm, the same in either order
    ways = math.lgamma(n + m + 1) - (math.lgamma(n + 1) + math.lgamma(m + 1))
    least_p = min(1.0, max(2.0 * math.exp(-ways), sys.float_info.min))
    if min(n, m) == 1 or sum(errors) == 0.0:
        p_value = least_p if a12 in (0.0, 1.0) else 1.0
        return Effect(a12, _newcombe_interval(a12, n, m, confidence), p_value)
    error = math.sqrt(sum(errors))
    degrees = sum(errors) ** 2 / (errors[0] ** 2 / (n - 1) + errors[1] ** 2 / (m - 1))
    # symmetric in log(a12 / (1 - a12)): near 0 and 1 the plain interval holds A12 too seldom
    half = special.stdtrit(degrees, 0.5 + 0.5 * confidence) * error / (a12 * (1.0 - a12))
    low, high = special.expit(special.logit(a12) + half * np.array([-1.0, 1.0]))
    if min(n, m) < LEAST_FOR_T:
        p_value = float(stats.mannwhitneyu(x, y).pvalue)
    else:
        p_value = 2.0 * float(special.stdtr(degrees, -abs(a12 - 0.5) / error))
    return Effect(a12, Interval(float(low), float(high)), max(p_value, least_p))


def _newcombe_interval(a12: float, n: int, m: int, confidence: float) -> Interval:
    """Return an interval of A12 that has a width for separated samples, too.

    Newcombe 2006, method 5: all values whose own standard error reaches to A12.
    """
    z, more = float(stats.norm.ppf(0.5 + 0.5 * confidence)), 0.5 * (n + m) - 1.0

    def excess(value: float) -> float:
        shape = (1.0 - value) / (2.0 - value) + value / (1.0 + value)
        variance = value * (1.0 - value) * (1.0 + more * shape) / (n * m)
        return abs(value - a12) - z * math.sqrt(variance)

    # where the standard error is not 0
    inside = min(max(a12, SMALLEST_SHARE), 1.0 - SMALLEST_SHARE)
    low = optimize.brentq(excess, 0.0, inside) if a12 > 0.0 else 0.0
    high = optimize.brentq(excess, inside, 1.0) if a12 < 1.0 else 1.0
    return Interval(float(low), float(high))


def expected_effort(effort: FloatArray, solved: np.ndarray) -> float:
    """Return the expected running time of runs (runs,), see Hansen et al. 2009; inf: no success.

    All effort over all successes is the cost of one if failed runs are started again.
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
