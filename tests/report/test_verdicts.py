import math
import re

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.report.statistics import judging
from evoexp.report.statistics.comparisons import Comparison, adjusted, compare
from evoexp.report.statistics.inference import Proportion, fisher_exact, runs_for_effect
from evoexp.report.statistics.judging import CONTRADICTED, REPRODUCED, UNDECIDED, greater
from report_samples import hearing

LOW, HIGH = np.arange(12.0), np.arange(12.0) + 20.0


def judge_better(comparison: Comparison, significance: float = 0.05) -> str:
    return hearing("better", significance).better(comparison, "lower").verdict


@pytest.mark.parametrize(
    ("holds", "done", "planned", "verdict"),
    [
        (20, 20, 20, REPRODUCED),
        (19, 20, 20, CONTRADICTED),
        (0, 20, 20, CONTRADICTED),
        (3, 4, 20, CONTRADICTED),  # one counter-example is enough
        (4, 4, 20, UNDECIDED),  # but only all runs reproduce
        (0, 0, 20, UNDECIDED),
        (0, 0, 0, UNDECIDED),
    ],
)
def test_a_claim_about_every_run(holds: int, done: int, planned: int, verdict: str) -> None:
    assert hearing("every").every("", holds, done, planned).verdict == verdict


def test_a_claim_about_being_better() -> None:
    better, worse = (compare("cost", a, b, True, 0.95) for a, b in ((LOW, HIGH), (HIGH, LOW)))
    same = compare("cost", LOW, LOW, True, 0.95)
    assert judge_better(better) == REPRODUCED
    assert judge_better(worse) == CONTRADICTED
    assert judge_better(same) == UNDECIDED
    assert judge_better(better, 1e-9) == UNDECIDED


def test_a_comparison_knows_which_way_is_better() -> None:
    lower, higher = (compare("x", LOW, HIGH, way, 0.95) for way in (True, False))
    assert (lower.better.a12, higher.better.a12) == (1.0, 0.0)
    assert lower.median_difference == higher.median_difference == -20.0
    assert (lower.better.direction, higher.better.direction) == (1, -1)
    assert lower.better.p_value == higher.better.p_value
    assert lower.num_runs == "12"


def test_two_infinite_costs_do_not_differ() -> None:
    first, second = np.array([1.0, np.inf, np.inf]), np.array([2.0, np.inf, 3.0, np.inf])
    found = compare("cost", first, second[:3], True, 0.95)
    assert (found.median_difference, found.num_runs) == (np.inf, "3")
    found = compare("cost", first, second[[0, 1, 1, 1]], True, 0.95)
    assert (found.median_difference, found.num_runs) == (0.0, "3 and 4")


def pair(first: float, second: float) -> Comparison:
    """Return a comparison of lower-is-better values that differ by a constant."""
    return compare("x", LOW + first, LOW + second, True, 0.95)


BETTER, WORSE, EQUAL = pair(0.0, 20.0), pair(20.0, 0.0), pair(0.0, 0.0)


def test_a_comparison_says_who_is_better() -> None:
    assert [c.says(0.05) for c in (BETTER, WORSE, EQUAL)] == [1, -1, 0]
    assert BETTER.says(1e-9) == 0


@pytest.mark.parametrize(
    ("comparisons", "verdict"),
    [
        ([BETTER, BETTER], REPRODUCED),
        ([BETTER, EQUAL], UNDECIDED),
        ([BETTER, WORSE], CONTRADICTED),
        ([EQUAL], UNDECIDED),
    ],
)
def test_a_claim_about_being_better_than_each(comparisons: list[Comparison], verdict: str) -> None:
    claim = hearing("better than all").better_than_all("", comparisons)
    assert claim.verdict == verdict


@pytest.mark.parametrize(
    ("comparisons", "best_median", "verdict"),
    [
        ([BETTER, EQUAL], True, REPRODUCED),  # a neighbour may be as good
        ([BETTER, EQUAL], False, UNDECIDED),
        ([EQUAL, EQUAL], True, UNDECIDED),  # then none matters
        ([BETTER, WORSE], True, CONTRADICTED),
    ],
)
def test_a_claim_about_the_best_setting(
    comparisons: list[Comparison], best_median: bool, verdict: str
) -> None:
    assert hearing("best").best("", comparisons, best_median).verdict == verdict


def test_p_values_are_adjusted_over_all_comparisons() -> None:
    one, other = compare("a", LOW, HIGH, True, 0.95), compare("b", LOW, LOW, True, 0.95)
    first, second = adjusted([one, other])
    assert (first.p_adjusted, second.p_adjusted) == (2.0 * one.better.p_value, 1.0)


def test_unsolved_runs_are_the_worst_class_whatever_the_rest_cost() -> None:
    """Of runs that never get there it counts how many there are, not by how much others differ."""
    first = np.concatenate([np.full(16, 2.0), np.full(4, np.inf)]) + np.arange(20.0) / 100.0
    second = np.concatenate([np.full(4, 1.0), np.full(16, np.inf)]) + np.arange(20.0) / 100.0
    comparison = compare("cost", first, second, True, 0.95)
    assert judge_better(comparison) == REPRODUCED
    words = judging.evidence(comparison, "lower")
    assert words.startswith("lower in 72 % of all pairs of runs (A12 0.720 [")


values = st.one_of(st.integers(-3, 3).map(float), st.floats(-9.0, 9.0), st.just(np.inf))


@given(st.lists(st.tuples(values, values), min_size=1, max_size=40), st.booleans())
@settings(max_examples=200, deadline=None)
def test_no_verdict_goes_against_its_statistic(
    pairs: list[tuple[float, float]], lower_is_better: bool
) -> None:
    first, second = np.array(pairs).T
    one, other = (
        compare("x", a, b, lower_is_better, 0.95) for a, b in ((first, second), (second, first))
    )
    says = one.says(0.05)
    assert says == -other.says(0.05)
    assert says in (0, one.better.direction)
    assert (says != 0) == (one.better.p_value < 0.05)
    verdict = judge_better(one)
    never_worse = (first <= second).all() if lower_is_better else (first >= second).all()
    never_better = (first >= second).all() if lower_is_better else (first <= second).all()
    assert not (never_worse and verdict == CONTRADICTED)
    assert not (never_better and verdict == REPRODUCED)


@given(st.integers(0, 30), st.integers(0, 30), st.integers(0, 30), st.integers(0, 30))
def test_shares_are_told_apart_in_their_own_direction(a: int, b: int, c: int, d: int) -> None:
    one, two = Proportion(min(a, b), b), Proportion(min(c, d), d)
    p_value = fisher_exact(one, two)
    says = greater(one, two, p_value, 0.05)
    assert says == -greater(two, one, p_value, 0.05)
    if one.total and two.total:
        assert says in (0, int(np.sign(one.share - two.share)))
        assert (says != 0) == (p_value < 0.05)


def test_equal_shares_contradict_nothing() -> None:
    """Also where p comes from elsewhere: an adjusted one, of several tests."""
    half = Proportion(5, 10)
    assert hearing("greater").greater("", half, half, 0.01).verdict == UNDECIDED


def test_an_undecided_claim_says_how_many_runs_would_decide() -> None:
    """As many as are needed for a power of 0.8, tried on simulated studies of that size."""
    rng, shift = np.random.default_rng(1), 0.4
    first, second = np.sort(rng.normal(0.0, size=12)), np.sort(rng.normal(shift, size=12))
    claim = hearing("better").better(compare("x", first, second, True, 0.95), "lower")
    assert claim.verdict == UNDECIDED
    assert re.search(r"; about \d+0 runs of each would decide$", claim.evidence)
    truth = float(scipy.stats.norm.cdf(shift / math.sqrt(2.0)))
    needed = math.ceil(runs_for_effect(truth, 0.05))
    studies = [
        compare("x", *rng.normal([[0.0], [shift]], size=(2, needed)), True, 0.95)
        for _ in range(400)
    ]
    assert 0.74 < np.mean([study.says(0.05) == 1 for study in studies]) < 0.86


def test_equal_conditions_would_never_be_told_apart() -> None:
    claim = hearing("better").better(compare("x", LOW, LOW, True, 0.95), "lower")
    assert claim.evidence.endswith("; more than 10,000 runs of each would be needed to decide")
    decided = hearing("better").better(BETTER, "lower")
    assert "would" not in decided.evidence


def test_shares_say_how_many_runs_would_decide() -> None:
    one, two = Proportion(16, 20), Proportion(12, 20)
    claim = hearing("greater").greater("", one, two)
    assert claim.verdict == UNDECIDED and claim.evidence == "about 90 runs of each would decide"
    assert hearing("greater").greater("", Proportion(0, 0), two).evidence == ""
