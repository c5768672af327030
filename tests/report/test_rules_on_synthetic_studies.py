"""The rules of verdicts on simulated studies whose truth is known.

A study is one experiment with its seeds. Over many studies an interval must hold the truth about as
often as its level says, and where nothing differs a rule must seldom say that something does.
"""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

from evoexp.records import FloatArray
from evoexp.report.statistics.comparisons import Comparison, adjusted, compare
from evoexp.report.statistics.inference import (
    Proportion,
    effect,
    effort_ratio,
    expected_interval,
    fisher_exact,
    holm,
    newcombe,
)
from evoexp.report.statistics.judging import CONTRADICTED, REPRODUCED, UNDECIDED
from matrix import examples, matrices_are_asked_for
from report_samples import hearing

STUDIES = 2000 if matrices_are_asked_for() else 200
LEVEL, SIGNIFICANCE = 0.95, 0.05
CHANCE = 0.0 if matrices_are_asked_for() else 0.04  # of 200 studies more may differ by chance
LOWEST = LEVEL - 0.02 - CHANCE  # a coverage that is still as nominal
MOST = SIGNIFICANCE + 0.02 + CHANCE  # false verdicts that are still as nominal
RESAMPLES = 400

Draw = Callable[[np.random.Generator, int], FloatArray]


def judge_better(comparison: Comparison) -> str:
    return hearing("better", SIGNIFICANCE).better(comparison, "lower").verdict


def coverage(holds: list[bool]) -> float:
    assert len(holds) == STUDIES
    return float(np.mean(holds))


@pytest.mark.parametrize(("share", "runs"), [(0.5, 20), (0.7, 20), (0.9, 50), (0.935, 1000)])
def test_wilsons_interval_holds_the_share(share: float, runs: int) -> None:
    rng = np.random.default_rng(runs)
    counts = rng.binomial(runs, share, STUDIES)
    intervals = {int(k): Proportion(int(k), runs).interval(LEVEL) for k in np.unique(counts)}
    assert coverage([intervals[k].low <= share <= intervals[k].high for k in counts]) >= LOWEST


@pytest.mark.parametrize(
    ("one", "two", "runs"), [(0.7, 0.7, 20), (0.9, 0.6, 30), (0.964, 0.935, 1000)]
)
def test_newcombes_interval_holds_the_difference(one: float, two: float, runs: int) -> None:
    rng = np.random.default_rng(7)
    found = {}
    for pair in zip(
        rng.binomial(runs, one, STUDIES), rng.binomial(runs, two, STUDIES), strict=True
    ):
        found.setdefault(pair, []).append(None)
    inside = []
    for (a, b), times in found.items():
        low, high = newcombe(Proportion(int(a), runs), Proportion(int(b), runs), LEVEL)
        inside += [low <= one - two <= high] * len(times)
    assert coverage(inside) >= LOWEST


@pytest.mark.parametrize(("runs", "others"), [(20, 20), (50, 20)])
@pytest.mark.parametrize(("shift", "wider"), [(0.0, 1.0), (1.0, 1.0), (2.5, 1.0), (0.5, 3.0)])
def test_the_interval_of_a12_holds_the_probability(
    runs: int, others: int, shift: float, wider: float
) -> None:
    rng, inside = np.random.default_rng(runs), []
    truth = float(stats.norm.cdf(shift / math.hypot(1.0, wider)))
    for _ in range(STUDIES):
        x, y = rng.normal(shift, size=runs), rng.normal(0.0, wider, others)
        low, high = effect(x, y, LEVEL).interval
        inside.append(low <= truth <= high)
    assert coverage(inside) >= LOWEST


@pytest.mark.parametrize(
    ("share", "runs"), [(0.9, 20), (0.98, 20), (0.3, 20), (0.1, 20), (0.6, 50)]
)
def test_the_interval_of_the_expected_effort_holds_it(share: float, runs: int) -> None:
    rng, inside = np.random.default_rng(runs), []
    truth = (share * 10.0 + (1.0 - share) * 30.0) / share
    for _ in range(STUDIES):
        solved = rng.random(runs) < share
        effort = np.where(solved, rng.gamma(5.0, 2.0, runs), 30.0)
        low, high = expected_interval(effort, solved, LEVEL, RESAMPLES)
        inside.append(low <= truth <= high)
    assert coverage(inside) >= LOWEST


def test_the_interval_of_a_ratio_of_efforts_holds_it() -> None:
    rng, inside, share, runs = np.random.default_rng(8), [], 0.8, 50
    for _ in range(STUDIES):
        ones, twos = rng.random(runs) < share, rng.random(runs) < share
        one = np.where(ones, rng.gamma(5.0, 4.0, runs), 60.0)
        two = np.where(twos, rng.gamma(5.0, 2.0, runs), 30.0)
        low, high = effort_ratio((one, ones), (two, twos), LEVEL, RESAMPLES)
        inside.append(low <= 2.0 <= high)
    assert coverage(inside) >= LOWEST


def smooth(rng: np.random.Generator, size: int) -> FloatArray:
    return rng.gamma(3.0, size=size)


def tied(rng: np.random.Generator, size: int) -> FloatArray:
    return np.round(rng.gamma(2.0, size=size))


def censored(rng: np.random.Generator, size: int) -> FloatArray:
    return np.where(rng.random(size) < 0.3, np.inf, np.round(rng.gamma(2.0, size=size), 1))


@pytest.mark.parametrize(
    ("draw", "runs"),
    examples(itertools.product([smooth, tied, censored], [10, 20]), lambda case: case[1] == 20),
)
def test_where_nothing_differs_better_is_seldom_said(draw: Draw, runs: int) -> None:
    rng, said = np.random.default_rng(runs), []
    for _ in range(STUDIES):
        found = compare("cost", draw(rng, runs), draw(rng, runs), True, LEVEL)
        said.append(judge_better(found) != UNDECIDED)
    assert coverage(said) <= MOST


def test_where_something_differs_better_is_said_and_never_the_wrong_way() -> None:
    rng, said = np.random.default_rng(1), []
    for _ in range(STUDIES):
        x, y = rng.normal(0.0, size=20), rng.normal(1.2, size=20)
        said.append(judge_better(compare("cost", x, y, True, LEVEL)))
    assert said.count(REPRODUCED) > 0.85 * STUDIES
    assert said.count(CONTRADICTED) <= 0.001 * STUDIES


def test_of_six_equal_settings_none_is_said_to_be_better_or_best() -> None:
    rng, better, best = np.random.default_rng(2), [], []
    for _ in range(STUDIES):
        own, *others = (smooth(rng, 20) for _ in range(6))
        rows = adjusted([compare("cost", own, other, True, LEVEL) for other in others])
        median = bool(np.median(own) <= min(np.median(other) for other in others))
        better.append(hearing("better than all").better_than_all("", rows).verdict != UNDECIDED)
        best.append(hearing("best").best("", rows, median).verdict != UNDECIDED)
    assert coverage(better) <= MOST
    assert coverage(best) <= MOST


@pytest.mark.parametrize(("share", "runs"), [(0.5, 20), (0.9, 50), (0.97, 1000)])
def test_of_equal_shares_none_is_said_to_be_greater(share: float, runs: int) -> None:
    rng, verdicts = np.random.default_rng(runs), {}
    said = []
    for pair in rng.binomial(runs, share, (STUDIES, 2)).tolist():
        one, two = (Proportion(k, runs) for k in pair)
        key = one, two
        verdicts[key] = verdicts.get(key) or hearing("greater").greater("", one, two).verdict
        said.append(verdicts[key] != UNDECIDED)
    assert coverage(said) <= MOST


def test_of_four_true_percentages_none_is_said_to_be_wrong() -> None:
    """Fig. 3 of Lavoie & Boudreau: four printed shares, Fisher's tests adjusted by Holm."""
    rng, known, wrong = np.random.default_rng(3), {}, []
    truths = (0.95, 0.998, 0.991, 0.999)
    for _ in range(STUDIES):
        p_values = []
        for truth in truths:
            pair = tuple(int(k) for k in rng.binomial(1000, truth, 2))
            if pair not in known:
                known[pair] = fisher_exact(*(Proportion(k, 1000) for k in pair))
            p_values.append(known[pair])
        wrong.append(min(holm(p_values)) < SIGNIFICANCE)
    assert coverage(wrong) <= MOST
