"""Statistics against scipy, printed numbers, counts by hand, and simulated studies."""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st

from evoexp.report.pages import markdown
from evoexp.report.statistics.inference import (
    Interval,
    Proportion,
    effect,
    effort_ratio,
    expected_effort,
    expected_interval,
    fisher_exact,
    holm,
    newcombe,
    quantile,
    quantiles,
    spread,
)
from matrix import matrices_are_asked_for

FLOATS = st.floats(-1e3, 1e3)
ROW = st.lists(
    st.sampled_from([-np.inf, -2.5, -1.0, 0.0, 0.1, 3.0, np.inf, np.nan]), min_size=6, max_size=6
)


@given(st.lists(FLOATS, min_size=1, max_size=30), st.floats(0.0, 1.0))
def test_quantiles_are_those_of_numpy(values: list[float], share: float) -> None:
    assert quantile(np.array(values), share) == pytest.approx(np.quantile(values, share), abs=1e-9)


@given(st.lists(ROW, min_size=1, max_size=5))
def test_quantiles_of_rows_are_those_of_each_row(rows: list[list[float]]) -> None:
    values, shares = np.array(rows), (0.0, 0.25, 0.3, 0.5, 1.0)
    expected = [[quantile(row, share) for row in values] for share in shares]
    np.testing.assert_array_equal(quantiles(values, shares), expected)


def test_quantiles_of_infinite_and_missing_values() -> None:
    assert spread(np.array([1.0, np.nan, 3.0, np.inf, np.inf])) == (math.inf, 2.5, math.inf, 4)
    assert quantile(np.array([np.inf, 1.0]), 0.0) == 1.0
    assert spread(np.array([np.inf, np.inf]))[:3] == (math.inf,) * 3
    missing = spread(np.array([np.nan]))
    assert math.isnan(missing.median) and missing.num_values == 0


@pytest.mark.parametrize(
    ("one", "two", "low", "high"),
    [  # Newcombe 1998, Table II, method 10
        (Proportion(56, 70), Proportion(48, 80), 0.0524, 0.3339),
        (Proportion(9, 10), Proportion(3, 10), 0.1705, 0.8090),
        (Proportion(6, 7), Proportion(2, 7), 0.0582, 0.8062),
        (Proportion(5, 56), Proportion(0, 29), -0.0381, 0.1926),
        (Proportion(10, 10), Proportion(0, 10), 0.6075, 1.0),
    ],
)
def test_differences_are_newcombes(
    one: Proportion, two: Proportion, low: float, high: float
) -> None:
    assert newcombe(one, two, 0.95) == pytest.approx((low, high), abs=5e-5)
    assert newcombe(two, one, 0.95) == pytest.approx((-high, -low), abs=5e-5)


def test_without_runs_every_share_and_difference_is_possible() -> None:
    none, some = Proportion(0, 0), Proportion(3, 4)
    assert math.isnan(none.share) and some.share == 0.75
    assert none.interval(0.95) == (0.0, 1.0)
    assert newcombe(none, some, 0.95) == newcombe(some, none, 0.95) == Interval(-1.0, 1.0)
    assert fisher_exact(none, some) == 1.0


def test_fishers_test_sums_all_tables_that_are_at_most_as_likely() -> None:
    rng = np.random.default_rng(4)
    for _ in range(60):
        n, m = (int(size) for size in rng.integers(1, 60, 2))
        one, two = Proportion(int(rng.integers(0, n + 1)), n), Proportion(int(rng.integers(m)), m)
        count = one.having + two.having
        ways = [math.comb(n, k) * math.comb(m, count - k) for k in range(min(count, n) + 1)]
        as_likely = sum(way for way in ways if way <= ways[one.having])
        expected = as_likely / math.comb(n + m, count)
        assert fisher_exact(one, two) == pytest.approx(expected, rel=1e-9)


def test_holm_by_hand() -> None:
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.5, 0.9]) == pytest.approx([1.0, 1.0])
    assert holm([]) == []


SAMPLE = st.lists(
    st.sampled_from([-np.inf, -1.5, 0.0, 0.5, 0.5, 2.0, 7.0, np.inf]), min_size=1, max_size=30
)


@given(SAMPLE, SAMPLE)
def test_the_effect_is_that_of_all_pairs_counted_one_by_one(
    first: list[float], second: list[float]
) -> None:
    x, y = np.array(first), np.array(second)
    wins = (x[:, None] > y) + 0.5 * (x[:, None] == y)
    found, other = effect(x, y, 0.95), effect(y, x, 0.95)
    assert found.a12 == wins.sum() / wins.size
    assert found.a12 == pytest.approx(1.0 - other.a12)
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
    assert 1.0 > above.interval.low == pytest.approx(1.0 - below.interval.high)
    exact = scipy.stats.mannwhitneyu(x, y, method="exact").pvalue
    assert above.p_value == below.p_value == pytest.approx(exact, rel=1e-9)
    assert markdown.p_value(above.p_value) not in ("0", "0.0e+00")


@pytest.mark.parametrize("shift", [0.1, 1e4])
def test_thousands_of_runs_are_compared(shift: float) -> None:
    x = np.arange(3000.0)
    assert 0.0 < effect(x + shift, x, 0.95).p_value <= 1.0


def test_effect_of_equal_values() -> None:
    same = effect(np.ones(30), np.ones(20), 0.95)
    assert (same.a12, same.p_value, same.direction) == (0.5, 1.0, 0)
    assert same.interval.low < 0.5 < same.interval.high


def test_expected_effort_counts_what_failures_spent() -> None:
    effort, solved = np.array([10.0, 20.0, 30.0, 40.0]), np.array([True, False, True, False])
    assert expected_effort(effort, solved) == 50.0
    assert expected_effort(effort, np.zeros(4, dtype=bool)) == np.inf


def test_ratio_of_efforts_on_common_seeds() -> None:
    effort, solved = np.linspace(1.0, 10.0, 30), np.arange(30) % 4 > 0
    every, none = np.ones(30, dtype=bool), np.zeros(30, dtype=bool)
    low, high = effort_ratio((2.0 * effort, solved), (effort, solved), 0.95, 2000)
    assert 1.7 < low < 2.0 < high < 2.4, "seed by seed twice as much"
    others = np.random.default_rng(1).permutation(30)
    loose = effort_ratio((2.0 * effort, solved), (effort[others], solved[others]), 0.95, 2000)
    assert loose.high - loose.low > 1.5 * (high - low), "of other seeds it is less certain"
    for one, two, expected in (
        (every, none, (0.0, 0.0)),
        (none, every, (np.inf, np.inf)),
        (none, none, (0.0, np.inf)),
    ):
        assert effort_ratio((effort, one), (effort, two), 0.95, 300) == expected


# Over many simulated studies an interval must hold the truth about as often as its level says.
STUDIES = 2000 if matrices_are_asked_for() else 200
LOWEST = 0.93 if matrices_are_asked_for() else 0.89  # of 200 studies more may differ by chance
Study = Callable[[np.random.Generator], tuple[float, Interval]]  # truth and interval of a study


def shifted(runs: int, others: int, shift: float, wider: float) -> Study:
    def study(rng: np.random.Generator) -> tuple[float, Interval]:
        x, y = rng.normal(shift, size=runs), rng.normal(0.0, wider, others)
        truth = scipy.stats.norm.cdf(shift / math.hypot(1.0, wider))
        return truth, effect(x, y, 0.95).interval

    return study


def runs_of_effort(
    rng: np.random.Generator, runs: int, share: float, factor: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return efforts of 10 on average where a run is solved, else of 30; and which are solved."""
    solved = rng.random(runs) < share
    return factor * np.where(solved, rng.gamma(5.0, 2.0, runs), 30.0), solved


def spent(share: float, runs: int) -> Study:
    truth = (share * 10.0 + (1.0 - share) * 30.0) / share
    return lambda rng: (truth, expected_interval(*runs_of_effort(rng, runs, share), 0.95, 400))


def doubled(rng: np.random.Generator) -> tuple[float, Interval]:
    one, two = runs_of_effort(rng, 50, 0.8, 2.0), runs_of_effort(rng, 50, 0.8)
    return 2.0, effort_ratio(one, two, 0.95, 400)


SHIFTS = [(0.0, 1.0), (1.0, 1.0), (2.5, 1.0), (0.5, 3.0)]
SHARES = [(0.9, 20), (0.98, 20), (0.3, 20), (0.1, 20), (0.6, 50)]


@pytest.mark.parametrize(
    "study",
    [
        *(shifted(runs, 20, *each) for runs, each in itertools.product((20, 50), SHIFTS)),
        *itertools.starmap(spent, SHARES),
        doubled,
    ],
)
def test_an_interval_holds_the_truth_as_often_as_it_says(study: Study) -> None:
    rng = np.random.default_rng(8)
    studies = [study(rng) for _ in range(STUDIES)]
    assert np.mean([low <= truth <= high for truth, (low, high) in studies]) >= LOWEST
