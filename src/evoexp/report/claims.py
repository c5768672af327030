"""Verdicts on what a paper claims, computed from results; below the paper's budget nothing is judged."""

from typing import NamedTuple

import numpy as np

from evoexp.records import FloatArray
from evoexp.report.statistics import Effect, SignedRank, effect, holm, quantile, signed_rank

REPRODUCED, CONTRADICTED, INCONCLUSIVE, NOT_JUDGED = "reproduced", "contradicted", "inconclusive", "not judged"


class Claim(NamedTuple):
    """A claim, and what the results say of it.

    Attributes:
        text: The claim in our words.
        source: Where the paper makes it.
        evidence: The numbers.
        verdict: One of the four words above.
    """

    text: str
    source: str
    evidence: str
    verdict: str


class Comparison(NamedTuple):
    """One quantity of two conditions on their common seeds.

    Attributes:
        quantity: What is compared.
        num_seeds: Replicates that both have.
        median_difference: Of first minus second.
        test: Signed-rank test of the pairs.
        p_adjusted: By Holm over all quantities compared; equal to the plain one until `adjusted`.
        better: A12 of the first being better than the second.
    """

    quantity: str
    num_seeds: int
    median_difference: float
    test: SignedRank
    p_adjusted: float
    better: Effect


def judge_all(not_judged: str, holds: int, done: int, planned: int) -> str:
    """Judge a claim about every run.

    Args:
        not_judged: Why it is not to be judged; empty: judge it.
        holds: Finished runs in which it holds.
        done: Finished runs.
        planned: Runs that were planned.

    Returns:
        One counter-example contradicts; all planned runs are needed to reproduce.
    """
    if not_judged:
        return NOT_JUDGED
    if holds < done:
        return CONTRADICTED
    return REPRODUCED if 0 < planned <= done else INCONCLUSIVE


def judge_better(not_judged: str, comparison: Comparison | None, significance: float) -> str:
    """Judge a claim that the first condition of a comparison is better than the second.

    Args:
        not_judged: Why it is not to be judged; empty: judge it.
        comparison: None where there is nothing to compare.
        significance: Below this adjusted p-value a difference counts.
    """
    if not_judged:
        return NOT_JUDGED
    if comparison is None or comparison.p_adjusted >= significance:
        return INCONCLUSIVE
    if comparison.better.a12 == 0.5:
        return INCONCLUSIVE
    return REPRODUCED if comparison.better.a12 > 0.5 else CONTRADICTED


def compare(
    quantity: str, first: FloatArray, second: FloatArray, lower_is_better: bool, confidence: float, num_resamples: int
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
    test = signed_rank(first, second)
    sign = -1.0 if lower_is_better else 1.0
    better = effect(sign * first, sign * second, confidence, num_resamples)
    differences = np.zeros(len(first))
    np.subtract(first, second, out=differences, where=first != second)  # two infinite costs do not differ
    return Comparison(quantity, len(first), quantile(differences, 0.5), test, test.p_value, better)


def adjusted(comparisons: list[Comparison]) -> list[Comparison]:
    """Return comparisons with p-values adjusted by Holm over all of them."""
    p_values = holm([comparison.test.p_value for comparison in comparisons])
    return [c._replace(p_adjusted=p) for c, p in zip(comparisons, p_values, strict=True)]
