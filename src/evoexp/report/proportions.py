"""Two proportions of independent runs: how far apart they are, and whether they differ."""

import math
from typing import NamedTuple

import numpy as np
from scipy import stats

from evoexp.report.statistics import Interval, wilson


class Proportion(NamedTuple):
    """A count of runs that have a property."""

    having: int  # runs that have it
    total: int  # all runs

    @property
    def share(self) -> float:
        """In [0, 1]; NaN without runs."""
        return self.having / self.total if self.total else math.nan

    def interval(self, confidence: float) -> Interval:
        """Return Wilson's score interval."""
        return wilson(self.having, self.total, confidence)

    def with_interval(self, confidence: float, decimals: int = 0) -> str:
        """Return the proportion and its interval in words: "964 of 1000 = 96.4 % [95.1, 97.4]"."""
        if not self.total:
            return "0 of 0"
        share, low, high = (
            f"{100 * value:.{decimals}f}" for value in (self.share, *self.interval(confidence))
        )
        return f"{self.having} of {self.total} = {share} % [{low}, {high}]"


def newcombe(one: Proportion, two: Proportion, confidence: float) -> Interval:
    """Return an interval of the difference `one` − `two` (Newcombe 1998, method 10).

    Args:
        one: Of some runs; without any the interval is [−1, 1].
        two: Of other runs.
        confidence: Level of the interval.
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
