"""Verdicts on the claims of papers, computed from results."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evoexp.records import FloatArray
from evoexp.report.proportions import Proportion, fisher_exact
from evoexp.report.statistics import (
    Effect,
    RankSum,
    SignedRank,
    effect,
    holm,
    quantile,
    rank_sum,
    signed_rank,
)

REPRODUCED, CONTRADICTED, INCONCLUSIVE, NOT_JUDGED = (
    "reproduced",
    "contradicted",
    "inconclusive",
    "not judged",
)


class Claim(NamedTuple):
    """A claim of a paper with our evidence and verdict."""

    text: str  # the claim in our words
    source: str  # where the paper makes it
    evidence: str  # the numbers
    verdict: str  # one of the four words above
    name: str = ""  # of the claim among the paper's
    rule: str = ""  # when it is reproduced, and when contradicted
    n: str = ""  # runs, pairs of runs, or whatever was counted


class Comparison(NamedTuple):
    """One quantity of two conditions on their common seeds."""

    quantity: str  # its name, or that of the pair in a table of one quantity
    num_seeds: int  # replicates that both have
    median_difference: float  # of first minus second
    # Signed-rank test of the pairs; positive ranks are those of the first being better
    test: SignedRank
    # Its p-value by Holm over all quantities compared; equal to the plain one until `adjusted`
    p_adjusted: float
    unpaired: RankSum  # the same values tested as independent samples
    unpaired_adjusted: float  # its p-value by Holm, a family of its own
    better: Effect  # a12 of the first being better than the second

    def says(self, significance: float) -> int:
        """Return 1 if the first is significantly better, −1 if significantly worse, else 0.

        Significance and direction are those of one statistic, the signed ranks: A12 and medians may
        point the other way.
        """
        return self.test.direction if self.p_adjusted < significance else 0


def judged(holds: bool | None) -> str:
    """Return the verdict on a claim that holds, or does not; None: nobody can say."""
    return {True: REPRODUCED, False: CONTRADICTED, None: INCONCLUSIVE}[holds]


def judge_all(holds: int, done: int, planned: int) -> str:
    """Judge a claim about every run.

    Returns:
        One counter-example contradicts; all planned runs are needed to reproduce.
    """
    if holds < done:
        return CONTRADICTED
    return REPRODUCED if 0 < planned <= done else INCONCLUSIVE


def judge_better(comparison: Comparison | None, significance: float) -> str:
    """Judge a claim that the first condition of a comparison is better than the second.

    Args:
        comparison: None where there is nothing to compare.
        significance: Below this adjusted p-value a difference counts.
    """
    if comparison is None:
        return INCONCLUSIVE
    return {1: REPRODUCED, -1: CONTRADICTED}.get(comparison.says(significance), INCONCLUSIVE)


def judge_better_than_all(comparisons: Sequence[Comparison], significance: float) -> str:
    """Judge a claim that a condition is better than each of several others.

    Returns:
        Contradicted by one that is significantly better, reproduced if all are significantly worse.
    """
    found = [comparison.says(significance) for comparison in comparisons]
    if -1 in found:
        return CONTRADICTED
    return REPRODUCED if found and 0 not in found else INCONCLUSIVE


def judge_best(comparisons: Sequence[Comparison], best_median: bool, significance: float) -> str:
    """Judge a claim that one of several settings is the best.

    Args:
        comparisons: Of that setting with each other one.
        best_median: Whether no other setting has a better median.
        significance: Below this adjusted p-value a difference counts.

    Returns:
        Contradicted by one that is significantly better; reproduced if it has the best median and
        one other setting at least is significantly worse: neighbours of a best setting are about as
        good, so not all need be.
    """
    found = [comparison.says(significance) for comparison in comparisons]
    if -1 in found:
        return CONTRADICTED
    return REPRODUCED if best_median and 1 in found else INCONCLUSIVE


def compare(
    quantity: str,
    first: FloatArray,
    second: FloatArray,
    lower_is_better: bool,
    confidence: float,
    num_resamples: int,
) -> Comparison:
    """Compare a quantity of two conditions, seed by seed.

    Args:
        quantity: Its name.
        first: (seeds,) without NaN.
        second: (seeds,) of the same seeds.
        lower_is_better: Which of two values is better.
        confidence: Level of the interval.
        num_resamples: Of the bootstrap.
    """
    sign = -1.0 if lower_is_better else 1.0
    test, unpaired = signed_rank(sign * first, sign * second), rank_sum(first, second)
    better = effect(sign * first, sign * second, confidence, num_resamples)
    differences = np.zeros(len(first))  # two infinite costs do not differ
    np.subtract(first, second, out=differences, where=first != second)
    median = quantile(differences, 0.5)
    return Comparison(
        quantity, len(first), median, test, test.p_value, unpaired, unpaired.p_value, better
    )


def adjusted(comparisons: list[Comparison]) -> list[Comparison]:
    """Return comparisons with p-values adjusted by Holm; either test is a family of its own."""
    paired = holm([comparison.test.p_value for comparison in comparisons])
    unpaired = holm([comparison.unpaired.p_value for comparison in comparisons])
    found = zip(comparisons, paired, unpaired, strict=True)
    return [c._replace(p_adjusted=p, unpaired_adjusted=q) for c, p, q in found]


def judge_greater(
    one: Proportion,
    two: Proportion,
    significance: float,
    p_adjusted: float | None = None,
) -> str:
    """Judge a claim that a proportion is greater than another proportion, by Fisher's exact test.

    Args:
        one: Said to be greater.
        two: Of other runs.
        significance: Below this two-sided p-value a difference counts.
        p_adjusted: That of the test where it is one of several; None: it stands alone.
    """
    p_value = fisher_exact(one, two) if p_adjusted is None else p_adjusted
    says = greater(one, two, p_value, significance)
    return {1: REPRODUCED, -1: CONTRADICTED}.get(says, INCONCLUSIVE)


def greater(one: Proportion, two: Proportion, p_value: float, significance: float) -> int:
    """Return 1 if a proportion is significantly greater than another, −1 if smaller, else 0.

    Args:
        one: Of some runs.
        two: Of other runs.
        p_value: Of Fisher's exact test, adjusted where it is one of several.
        significance: Below this p-value a difference counts.
    """
    if not one.total or not two.total or p_value >= significance:
        return 0
    return int(one.share > two.share) - int(one.share < two.share)
