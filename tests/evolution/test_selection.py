"""Selection: how often each individual becomes a parent, and who never does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp import testing as drawn
from evoexp.evolution.operators.operator import Selection
from evoexp.evolution.operators.selection import (
    DifferenceRoulette,
    FitnessRoulette,
    InverseRoulette,
    LinearRanking,
    Tournament,
    spin_roulette,
)
from evoexp.evolution.scaled_selection import choose_by_remainders, scale_costs

INF, NAN = np.inf, np.nan
COUNT = 40_000
FITNESS = FitnessRoulette(fitness_offset=4.0)
COSTS = st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=30).map(np.array)


@pytest.mark.parametrize(
    ("operator", "costs", "weights"),
    [
        (InverseRoulette(), [1.0, 4.0, 0.5, INF], [1.0, 0.25, 2.0, 0.0]),
        (InverseRoulette(), [3.0, 0.0, 1.0, -0.0, INF], [0.0, 1.0, 0.0, 1.0, 0.0]),
        (InverseRoulette(), [1.0, NAN], [1.0, 0.0]),
        (InverseRoulette(), [INF, INF], [1.0, 1.0]),  # nobody weighs anything
        (DifferenceRoulette(), [1.0, 4.0, 2.5, INF], [3.0, 0.0, 1.5, 0.0]),
        (DifferenceRoulette(), [2.0, INF, 2.0, NAN], [1.0, 0.0, 1.0, 0.0]),
        (DifferenceRoulette(), [INF, INF], [1.0, 1.0]),
        (FITNESS, [1.0, 3.5, 4.0, 9.0], [3.0, 0.5, 0.0, 0.0]),
        (FITNESS, [5.0, 9.0], [1.0, 1.0]),
        (Tournament(), [3.0, INF, 1.0, 2.0], [3.0, 1.0, 7.0, 5.0]),  # of 16 ordered draws
        (Tournament(), [INF, INF, INF], [1.0, 1.0, 1.0]),
        (Tournament(tournament_size=1), [3.0, INF, 1.0], [1.0, 1.0, 1.0]),
        (LinearRanking(rank_pressure=1.0), [4.0, 3.0, 1.0, INF], [1.0, 1.0, 1.0, 1.0]),
        (LinearRanking(rank_pressure=2.0), [4.0, 3.0, 1.0, 3.0], [0.0, 1.5, 3.0, 1.5]),
        (LinearRanking(rank_pressure=1.5), [5.0, 1.0, INF, INF], [7.0, 9.0, 4.0, 4.0]),
        (LinearRanking(rank_pressure=2.0), [7.0], [1.0]),
    ],
)
def test_parents_are_drawn_by_their_weights(
    operator: Selection, costs: list[float], weights: list[float]
) -> None:
    parents = drawn.selected(operator, np.random.default_rng(0), np.array(costs), COUNT)
    shares = np.bincount(parents, minlength=len(costs)) / COUNT
    assert shares == pytest.approx(np.array(weights) / sum(weights), abs=0.01)  # 4 standard errors
    assert not shares[np.array(weights) == 0.0].any()


@given(
    st.lists(st.just(0.0) | st.floats(1e-300, 1e300), min_size=1, max_size=20).map(np.array),
    st.integers(0, 2**32 - 1),
)
def test_roulette_never_draws_a_weight_of_zero(weights: np.ndarray, seed: int) -> None:
    chosen = np.full(50, -1)
    spin_roulette(weights, np.random.default_rng(seed).random(50), chosen)
    assert 0 <= chosen.min() <= chosen.max() < len(weights)
    assert (weights[chosen] > 0.0).all() or not weights.any()


def expected_copies(costs: np.ndarray, count: int) -> np.ndarray:
    expected = np.empty(len(costs))
    scale_costs(costs, count, 2.0, expected)
    return expected


@pytest.mark.parametrize(
    ("costs", "copies"),
    [
        ([INF, 3.0, NAN, 5.0], [0.0, 4.0, 0.0, 0.0]),
        ([0.1] * 5, [0.8] * 5),
        ([INF] * 5, [0.8] * 5),
    ],
)
def test_infeasible_individuals_expect_nothing_and_equal_ones_the_same(
    costs: list[float], copies: list[float]
) -> None:
    np.testing.assert_allclose(expected_copies(np.array(costs), 4), copies)


@given(COSTS, st.floats(-1e3, 1e3), st.integers(0, 60), st.integers(0, 2**32))
def test_copies_are_the_floor_of_what_is_expected_or_one_more(
    costs: np.ndarray, shift: float, count: int, seed: int
) -> None:
    costs = np.round(costs, 3)
    expected = expected_copies(costs, count)
    shifted = expected_copies(np.round(costs + np.round(shift, 3), 3), count)
    np.testing.assert_allclose(shifted, expected, atol=1e-6 * max(count, 1))
    uniforms = np.random.default_rng(seed).random(len(costs) + 1 + count)
    parents = np.empty(round(expected.sum()), dtype=np.int64)
    choose_by_remainders(uniforms, expected, np.empty(len(costs), dtype=np.int64), parents)
    counts = np.bincount(parents, minlength=len(costs))
    assert len(parents) == count
    assert (counts >= np.floor(expected - 1e-9)).all()
    assert (counts <= np.ceil(expected + 1e-9)).all()


def test_copies_are_unbiased() -> None:
    """The mean of 40000 counts, each of standard deviation ≤ 0.5: six standard errors are 0.015."""
    expected = np.array([0.9, 0.1, 0.5, 0.5, 1.3, 0.7, 2.2, 0.8])
    parents, order, counts = np.empty(7, dtype=np.int64), np.empty(8, dtype=np.int64), np.zeros(8)
    for uniforms in np.random.default_rng(3).random((40_000, 8 + 1 + 7)):
        choose_by_remainders(uniforms, expected, order, parents)
        counts += np.bincount(parents, minlength=8)
    np.testing.assert_allclose(counts / 40_000, expected, atol=0.015)
