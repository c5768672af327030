import itertools
import math

import numpy as np
import pytest
import scipy
from hypothesis import given, settings
from hypothesis import strategies as st

from evoexp.report.pages import markdown
from evoexp.report.statistics.inference import (
    EXACT_PAIRS,
    EXACT_VALUES,
    Interval,
    Proportion,
    _weights,
    effect,
    effort_ratio,
    expected_effort,
    expected_interval,
    forget_resamples,
    holm,
    percentiles,
    quantile,
    quantiles,
    rank_sum,
    signed_rank,
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


@pytest.mark.parametrize("size", [1, 5, 12, 40])
def test_signed_rank_without_ties_is_the_exact_test_of_scipy(size: int) -> None:
    rng = np.random.default_rng(size)
    x, y = rng.normal(size=size), rng.normal(0.4, size=size)
    expected = scipy.stats.wilcoxon(x, y, method="exact")
    found = signed_rank(x, y)
    assert found.num_pairs == size
    assert (
        min(found.positive_ranks, size * (size + 1) / 2 - found.positive_ranks)
        == expected.statistic
    )
    assert found.p_value == pytest.approx(expected.pvalue, rel=1e-12)


def test_signed_rank_with_ties_counts_all_assignments_of_signs() -> None:
    difference = np.array([1.0, -1.0, 2.0, 2.0, 2.0, -3.0, 5.0, 0.0])
    ranks = scipy.stats.rankdata(np.abs(difference[:7]))
    observed = ranks[difference[:7] > 0].sum()
    sums = np.array(
        [ranks[np.array(signs)].sum() for signs in itertools.product([False, True], repeat=7)]
    )
    expected = min(1.0, 2.0 * min(np.mean(sums <= observed), np.mean(sums >= observed)))
    found = signed_rank(difference, np.zeros(8))
    assert (found.num_pairs, found.positive_ranks) == (7, observed)
    assert found.p_value == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("size", [12, 20, 60])
def test_signed_rank_of_many_tied_pairs_is_near_the_share_of_random_signs(size: int) -> None:
    rng = np.random.default_rng(3)
    difference = np.round(rng.normal(0.35, size=size), 1)
    ranks = scipy.stats.rankdata(np.abs(difference[difference != 0.0]))
    observed = ranks[difference[difference != 0.0] > 0].sum()
    sums = (rng.random((200_000, len(ranks))) < 0.5) @ ranks
    expected = min(1.0, 2.0 * min(np.mean(sums <= observed), np.mean(sums >= observed)))
    assert signed_rank(difference, np.zeros(size)).p_value == pytest.approx(expected, abs=0.015)


def test_signed_rank_beyond_the_exact_distribution_agrees_with_it() -> None:
    rng = np.random.default_rng(4)
    x, y = rng.normal(size=EXACT_PAIRS + 20), rng.normal(0.15, size=EXACT_PAIRS + 20)
    exact = scipy.stats.wilcoxon(x, y, method="exact").pvalue
    assert signed_rank(x, y).p_value == pytest.approx(exact, rel=0.02)


@pytest.mark.parametrize("size", [60, EXACT_PAIRS, EXACT_PAIRS + 50])
def test_the_farthest_signed_ranks_have_a_p_value_in_either_order(size: int) -> None:
    x = np.arange(1.0, size + 1.0)
    one, other = signed_rank(x, -x), signed_rank(-x, x)
    assert one.p_value == other.p_value > 0.0
    assert (one.direction, other.direction, one.share, other.share) == (1, -1, 1.0, 0.0)
    if size <= EXACT_PAIRS:
        assert one.p_value == 2.0 * 0.5**size
    assert markdown.p_value(one.p_value) not in ("0", "0.0e+00")


@given(st.lists(st.sampled_from([-9.0, -2.0, -1.0, 0.0, 1.0, 2.0, 5.0, np.inf]), max_size=11))
@settings(max_examples=100)
def test_signed_rank_is_that_of_all_signs_counted(differences: list[float]) -> None:
    """With and without ties, infinities and zeros: whole numbers, counted one by one."""
    x, y = np.array(differences), np.zeros(len(differences))
    differing = x[x != 0.0]
    twice = np.rint(2.0 * scipy.stats.rankdata(np.abs(differing))).astype(int).tolist()
    positive = sum(rank for rank, value in zip(twice, differing, strict=True) if value > 0.0)
    least = min(positive, sum(twice) - positive)
    sums = [
        sum(itertools.compress(twice, signs))
        for signs in itertools.product((0, 1), repeat=len(twice))
    ]
    expected = min(1.0, 2.0 * sum(total <= least for total in sums) / len(sums))
    found = signed_rank(x, y)
    assert found.p_value == pytest.approx(expected, rel=1e-12)
    assert signed_rank(y, x).p_value == found.p_value
    assert found.direction == -signed_rank(y, x).direction == np.sign(2 * positive - sum(twice))


@given(
    st.lists(st.sampled_from([0.0, 1.0, 2.0, 5.0, 7.5, np.inf]), min_size=1, max_size=60),
    st.integers(1, 59),
)
@settings(max_examples=100, deadline=None)
def test_rank_sum_is_the_same_in_either_order(drawn: list[float], size: int) -> None:
    x, y = np.array(drawn[:size]), np.array(drawn[size:])
    one, other = rank_sum(x, y), rank_sum(y, x)
    assert one.p_value == pytest.approx(other.p_value, rel=1e-9)
    assert one.u + other.u == len(x) * len(y)


def test_the_farthest_rank_sum_has_a_p_value_in_either_order() -> None:
    for size in (50, 400):
        x = np.arange(1.0, size + 1.0)
        one, other = rank_sum(x, -x), rank_sum(-x, x)
        assert one.p_value == other.p_value > 0.0


def test_equal_pairs_say_nothing_also_where_both_are_infinite() -> None:
    x = np.array([1.0, np.inf, np.inf])
    assert signed_rank(x, x) == (0, 0.0, 1.0)
    assert signed_rank(x, np.array([1.0, np.inf, 5.0])) == (1, 1.0, 1.0)
    assert signed_rank(np.empty(0), np.empty(0)).p_value == 1.0


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


def test_effect_has_the_bootstrap_interval_of_its_pairs() -> None:
    rng = np.random.default_rng(2)
    x, y = rng.normal(0.5, size=30), rng.normal(size=30)
    first = effect(x, y, 0.95, 400)
    np.random.default_rng(99).random(10)
    assert effect(x, y, 0.95, 400) == first
    assert first.interval.low < first.a12 < first.interval.high
    # Resampled by hand: the estimate of every resample of pairs, as the definition says.
    own = np.random.Generator(np.random.PCG64(7))
    picks = (own.integers(0, 30, 30) for _ in range(2000))
    estimates = [vargha_delaney(x[pick], y[pick]) for pick in picks]
    expected = Interval(*np.quantile(estimates, [0.025, 0.975]))
    assert first.interval == pytest.approx(
        expected, abs=0.03
    )  # two bootstraps of 400 and 2000 resamples


VALUES = st.sampled_from([-np.inf, -1.5, 0.0, 0.5, 0.5, 2.0, 7.0, np.inf, np.nan])


@given(st.lists(st.tuples(VALUES, VALUES), min_size=1, max_size=30), st.integers(1, 12))
def test_the_effect_is_that_of_all_pairs_counted_one_by_one(
    pairs: list[tuple[float, float]], num_resamples: int
) -> None:
    x, y = np.array(pairs).T
    wins = (x[:, None] > y) + 0.5 * (x[:, None] == y)
    weights = _weights(len(x), num_resamples)
    resampled = ((weights @ wins) * weights).sum(axis=1) / len(x) ** 2
    found = effect(x, y, 0.9, num_resamples)
    assert found.a12 == wins.sum() / wins.size
    assert found.interval == percentiles(resampled, 0.9)
    assert vargha_delaney(x, y[: len(y) // 2 + 1]) == wins[:, : len(y) // 2 + 1].mean()


def test_the_effect_of_many_pairs_is_computed_in_blocks() -> None:
    rng = np.random.default_rng(6)
    x, y = rng.integers(0, 40, size=(2, 700)).astype(float)
    wins = (x[:, None] > y) + 0.5 * (x[:, None] == y)
    weights = _weights(700, 150)
    resampled = ((weights @ wins) * weights).sum(axis=1) / 700**2
    assert effect(x, y, 0.9, 150).interval == percentiles(resampled, 0.9)


@pytest.mark.parametrize(("size", "bytes_each"), [(3000, 2), (70_000, 4)])
def test_resamples_hold_every_run_that_is_drawn(size: int, bytes_each: int) -> None:
    weights = _weights(size, 3)
    assert weights.sum(axis=1).tolist() == [size] * 3
    assert weights.itemsize == bytes_each
    forget_resamples()
    assert _weights.cache_info().currsize == 0


def test_effect_of_separated_and_of_no_values() -> None:
    assert effect(np.arange(5.0) + 10.0, np.arange(5.0), 0.95, 50) == (1.0, (1.0, 1.0))
    assert math.isnan(effect(np.empty(0), np.empty(0), 0.95, 50).a12)


@pytest.mark.parametrize(("n", "m"), [(1, 1), (5, 7), (20, 20), (30, 12)])
def test_rank_sum_without_ties_is_the_exact_test_of_scipy(n: int, m: int) -> None:
    rng = np.random.default_rng(n)
    x, y = rng.normal(size=n), rng.normal(0.6, size=m)
    expected = scipy.stats.mannwhitneyu(x, y, method="exact")
    found = rank_sum(x, y)
    assert found.u == expected.statistic
    assert found.p_value == pytest.approx(expected.pvalue, rel=1e-12)


def test_rank_sum_with_ties_counts_all_choices_of_ranks() -> None:
    x, y = np.array([1.0, 1.0, 2.0, np.inf]), np.array([1.0, 2.0, 3.0, np.inf, np.inf])
    ranks = scipy.stats.rankdata(np.concatenate([x, y]))
    observed = ranks[:4].sum()
    sums = np.array([sum(chosen) for chosen in itertools.combinations(ranks, 4)])
    expected = min(1.0, 2.0 * min(np.mean(sums <= observed), np.mean(sums >= observed)))
    found = rank_sum(x, y)
    assert found.u == observed - 10.0
    assert found.p_value == pytest.approx(expected, rel=1e-12)


def test_rank_sum_of_many_tied_values_is_near_the_share_of_random_choices() -> None:
    rng = np.random.default_rng(5)
    x, y = np.round(rng.normal(size=15), 1), np.round(rng.normal(0.5, size=25), 1)
    ranks = scipy.stats.rankdata(np.concatenate([x, y]))
    observed = ranks[:15].sum()
    sums = np.array([rng.permutation(ranks)[:15].sum() for _ in range(20_000)])
    expected = 2.0 * min(np.mean(sums <= observed), np.mean(sums >= observed))
    assert rank_sum(x, y).p_value == pytest.approx(expected, abs=0.015)


def test_rank_sum_beyond_the_exact_distribution_agrees_with_it() -> None:
    rng = np.random.default_rng(6)
    x, y = rng.normal(size=70), rng.normal(0.3, size=EXACT_VALUES - 50)
    exact = scipy.stats.mannwhitneyu(x, y, method="exact").pvalue
    assert rank_sum(x, y).p_value == pytest.approx(exact, rel=0.02)


def test_rank_sum_of_equal_and_of_no_values_says_nothing() -> None:
    assert rank_sum(np.ones(4), np.ones(6)) == (12.0, 1.0)
    assert rank_sum(np.ones(80), np.ones(80)).p_value == 1.0
    assert rank_sum(np.empty(0), np.ones(3)) == (0.0, 1.0)


def test_a12_is_the_rank_sums_share_of_pairs() -> None:
    rng = np.random.default_rng(6)
    x, y = np.round(rng.normal(size=12), 1), np.round(rng.normal(size=12), 1)
    assert vargha_delaney(x, y) == pytest.approx(rank_sum(x, y).u / 144)


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
