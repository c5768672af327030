"""Selection: how often each individual becomes a parent, and who never does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp import testing as drawn
from evoexp.evolution.operators import selection
from evoexp.evolution.operators.operator import Selection
from evoexp.evolution.succession import scale_costs

INF, NAN = np.inf, np.nan
COUNT = 40_000
FITNESS = selection.FitnessRoulette(fitness_offset=4.0)


@pytest.mark.parametrize(
    ("operator", "costs", "weights"),
    [
        (selection.InverseRoulette(), [1.0, 4.0, 0.5, INF], [1.0, 0.25, 2.0, 0.0]),
        (selection.InverseRoulette(), [3.0, 0.0, 1.0, -0.0, INF], [0.0, 1.0, 0.0, 1.0, 0.0]),
        (selection.InverseRoulette(), [1.0, NAN], [1.0, 0.0]),
        (selection.InverseRoulette(), [INF, INF], [1.0, 1.0]),  # nobody weighs anything
        (selection.DifferenceRoulette(), [1.0, 4.0, 2.5, INF], [3.0, 0.0, 1.5, 0.0]),
        (selection.DifferenceRoulette(), [2.0, INF, 2.0, NAN], [1.0, 0.0, 1.0, 0.0]),
        (selection.DifferenceRoulette(), [INF, INF], [1.0, 1.0]),
        (FITNESS, [1.0, 3.5, 4.0, 9.0], [3.0, 0.5, 0.0, 0.0]),
        (FITNESS, [5.0, 9.0], [1.0, 1.0]),
        (selection.Tournament(), [3.0, INF, 1.0, 2.0], [3.0, 1.0, 7.0, 5.0]),  # of 16 ordered draws
        (selection.Tournament(), [INF, INF, INF], [1.0, 1.0, 1.0]),
        (selection.Tournament(tournament_size=1), [3.0, INF, 1.0], [1.0, 1.0, 1.0]),
        (selection.LinearRanking(rank_pressure=1.0), [4.0, 3.0, 1.0, INF], [1.0, 1.0, 1.0, 1.0]),
        (selection.LinearRanking(rank_pressure=2.0), [4.0, 3.0, 1.0, 3.0], [0.0, 1.5, 3.0, 1.5]),
        (selection.LinearRanking(rank_pressure=1.5), [5.0, 1.0, INF, INF], [7.0, 9.0, 4.0, 4.0]),
        (selection.LinearRanking(rank_pressure=2.0), [7.0], [1.0]),
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
    selection.spin_roulette(weights, np.random.default_rng(seed).random(50), chosen)
    assert 0 <= chosen.min() <= chosen.max() < len(weights)
    assert (weights[chosen] > 0.0).all() or not weights.any()


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
    expected = np.empty(len(costs))
    scale_costs(np.array(costs), 4, 2.0, expected)
    np.testing.assert_allclose(expected, copies)
