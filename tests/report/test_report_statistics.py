import math

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.report.pages import markdown
from evoexp.report.statistics.inference import (
    Proportion,
    effect,
    effort_ratio,
    expected_effort,
    expected_interval,
    holm,
    quantile,
    quantiles,
    spread,
    vargha_delaney,
)

FLOATS = st.floats(-1e3, 1e3)


@given(st.lists(FLOATS, min_size=1, max_size=30), st.floats(0.0, 1.0))
def test_quantiles_are_those_of_numpy(values: list[float], share: float) -> None:
    assert quantile(np.array(values), share) == pytest.approx(np.quantile(values, share), abs=1e-9)


ROW = st.lists(
    st.sampled_from([-np.inf, -2.5, -1.0, 0.0, 0.1, 3.0, np.inf, np.nan]), min_size=6, max_size=6
)


@given(st.lists(ROW, min_size=1, max_size=5))
def test_quantiles_of_rows_are_those_of_each_row(rows: list[list[float]]) -> None:
    values, shares = np.array(rows), (0.0, 0.25, 0.3, 0.5, 1.0)
    expected = [[quantile(row, share) for row in values] for share in shares]
    np.testing.assert_array_equal(quantiles(values, shares), expected)


def test_quantiles_of_infinite_and_missing_values() -> None:
    values = np.array([1.0, np.nan, 3.0, np.inf, np.inf])
    assert spread(values) == (math.inf, 2.5, math.inf, 4)
    assert quantile(np.array([np.inf, 1.0]), 0.0) == 1.0
    assert spread(np.array([np.inf, np.inf]))[:3] == (math.inf,) * 3
    assert math.isnan(spread(np.array([np.nan])).median)
    assert spread(np.array([np.nan])).num_values == 0


@pytest.mark.parametrize(
    ("successes", "trials"), [(0, 20), (1, 7), (13, 20), (20, 20), (998, 1000)]
)
@pytest.mark.parametrize("confidence", [0.9, 0.95, 0.99])
def test_wilson_is_that_of_scipy(successes: int, trials: int, confidence: float) -> None:
    expected = scipy.stats.binomtest(successes, trials).proportion_ci(confidence, method="wilson")
    found = Proportion(successes, trials).interval(confidence)
    assert found == pytest.approx((expected.low, expected.high), abs=1e-9)


def test_wilson_without_trials_knows_nothing() -> None:
    assert Proportion(0, 0).interval(0.95) == (0.0, 1.0)


def test_holm_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.5, 0.9]) == pytest.approx([1.0, 1.0])
    assert holm([]) == []


def test_a12_by_hand_and_by_the_u_statistic_of_scipy() -> None:
    assert vargha_delaney(np.array([1.0, 2.0, 3.0]), np.array([2.0, 2.0])) == pytest.approx(
        (2 * 0.5 + 2) / 6
    )
    rng = np.random.default_rng(1)
    x, y = np.round(rng.normal(size=17), 1), np.round(rng.normal(0.5, size=23), 1)
    assert vargha_delaney(x, y) == pytest.approx(
        scipy.stats.mannwhitneyu(x, y).statistic / (17 * 23)
    )
    assert math.isnan(vargha_delaney(x, np.empty(0)))


VALUES = st.sampled_from([-np.inf, -1.5, 0.0, 0.5, 0.5, 2.0, 7.0, np.inf])
SAMPLE = st.lists(VALUES, min_size=1, max_size=30)


@given(SAMPLE, SAMPLE)
@settings(deadline=None)
def test_the_effect_is_that_of_all_pairs_counted_one_by_one(
    first: list[float], second: list[float]
) -> None:
    x, y = np.array(first), np.array(second)
    wins = (x[:, None] > y) + 0.5 * (x[:, None] == y)
    found, other = effect(x, y, 0.95), effect(y, x, 0.95)
    assert found.a12 == wins.sum() / wins.size == pytest.approx(1.0 - other.a12)
    assert 0.0 <= found.interval.low <= found.a12 <= found.interval.high <= 1.0
    assert found.interval == pytest.approx((1.0 - other.interval.high, 1.0 - other.interval.low))
    assert found.p_value == pytest.approx(other.p_value)
    assert found.direction == -other.direction


@pytest.mark.parametrize(("n", "m"), [(10, 10), (20, 60), (200, 200)])
def test_the_effect_is_tested_by_brunner_and_munzel(n: int, m: int) -> None:
    rng = np.random.default_rng(n)
    x, y = rng.normal(size=n), np.round(rng.normal(0.4, 3.0, size=m), 1)
    y[: m // 5] = np.inf  # never solved
    expected = scipy.stats.brunnermunzel(x, y).pvalue
    assert effect(x, y, 0.95).p_value == pytest.approx(expected, rel=1e-9)


def test_few_values_are_tested_by_mann_and_whitney() -> None:
    x, y = np.array([1.0, 4.0, 6.0]), np.array([2.0, 3.0, 7.0, 8.0])
    assert effect(x, y, 0.95).p_value == scipy.stats.mannwhitneyu(x, y, method="exact").pvalue


@pytest.mark.parametrize(("n", "m"), [(1, 1), (5, 5), (60, 40)])
def test_effect_of_separated_samples(n: int, m: int) -> None:
    x, y = np.arange(float(n)) + 100.0, np.arange(float(m))
    above, below = effect(x, y, 0.95), effect(y, x, 0.95)
    assert (above.a12, above.interval.high, below.a12, below.interval.low) == (1.0, 1.0, 0.0, 0.0)
    assert above.interval.low == pytest.approx(1.0 - below.interval.high)
    assert above.interval.low < 1.0
    exact = scipy.stats.mannwhitneyu(x, y, method="exact").pvalue
    assert above.p_value == below.p_value == pytest.approx(exact, rel=1e-9)
    assert markdown.p_value(above.p_value) not in ("0", "0.0e+00")


@pytest.mark.parametrize("shift", [0.1, 1e4])
def test_thousands_of_runs_are_compared(shift: float) -> None:
    x = np.arange(3000.0)
    assert 0.0 < effect(x + shift, x, 0.95).p_value <= 1.0


def test_no_effect_is_clearer_than_that_of_separated_samples() -> None:
    x, y = np.arange(20.0) + 19.5, np.arange(20.0)
    x[0] = 18.5  # below one of the others
    assert effect(x, y, 0.95).p_value == effect(x + 20.0, y, 0.95).p_value


def test_effect_of_equal_and_of_no_values() -> None:
    same = effect(np.ones(30), np.ones(20), 0.95)
    assert (same.a12, same.p_value, same.direction) == (0.5, 1.0, 0)
    assert same.interval.low < 0.5 < same.interval.high
    assert math.isnan(effect(np.empty(0), np.ones(3), 0.95).a12)


def test_expected_effort_counts_what_failures_spent() -> None:
    effort, solved = np.array([10.0, 20.0, 30.0, 40.0]), np.array([True, False, True, False])
    assert expected_effort(effort, solved) == 50.0
    assert expected_effort(effort, ~(solved | ~solved)) == np.inf
    low, high = expected_interval(effort, solved, 0.95, 500)
    assert low < 50.0 < high


def test_ratio_of_efforts_on_common_seeds() -> None:
    effort = np.linspace(1.0, 10.0, 30)
    every = np.ones(30, dtype=bool)
    solved = np.arange(30) % 4 > 0
    low, high = effort_ratio((2.0 * effort, solved), (effort, solved), 0.95, 2000)
    assert 1.7 < low < 2.0 < high < 2.4, "seed by seed twice as much"
    others = np.random.default_rng(1).permutation(30)
    loose = effort_ratio((2.0 * effort, solved), (effort[others], solved[others]), 0.95, 2000)
    assert loose.high - loose.low > 1.5 * (high - low), "of other seeds it is less certain"
    assert effort_ratio((effort, every), (effort, ~every), 0.95, 300) == (0.0, 0.0)
    assert effort_ratio((effort, ~every), (effort, every), 0.95, 300) == (np.inf, np.inf)
    assert effort_ratio((effort, ~every), (effort, ~every), 0.95, 300) == (0.0, np.inf)
