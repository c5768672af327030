"""Weights on the roulette wheel that come from costs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.evolution.selection import difference_weights, inverse_weights
from evolution.drawn_parents import roulette

costs_with_inf = st.lists(st.floats(0.0, 1e300) | st.just(np.inf), min_size=1, max_size=30)


def inverse(costs: list[float]) -> np.ndarray:
    out = np.full(len(costs), -1.0)
    inverse_weights(np.array(costs), out)
    return out


def difference(costs: list[float]) -> np.ndarray:
    out = np.full(len(costs), -1.0)
    difference_weights(np.array(costs), out)
    return out


def test_inverse_weights() -> None:
    assert inverse([1.0, 4.0, 0.5, np.inf]).tolist() == [1.0, 0.25, 2.0, 0.0]
    assert inverse([3.0, 0.0, 1.0, -0.0, np.inf]).tolist() == [0.0, 1.0, 0.0, 1.0, 0.0]
    assert inverse([1.0, np.nan]).tolist() == [1.0, 0.0]
    assert inverse([np.inf, np.inf]).tolist() == [0.0, 0.0]


def test_difference_weights() -> None:
    assert difference([1.0, 4.0, 2.5, np.inf]).tolist() == [3.0, 0.0, 1.5, 0.0]
    assert difference([2.0, np.inf, 2.0, np.nan]).tolist() == [1.0, 0.0, 1.0, 0.0]
    assert difference([np.inf, np.inf]).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("weigh", [inverse, difference])
@given(costs=costs_with_inf)
def test_lower_costs_never_weigh_less_and_the_wheel_turns(
    weigh: object, costs: list[float]
) -> None:
    weights = weigh(costs)  # type: ignore[operator]
    order = np.argsort(costs, kind="stable")
    assert np.all(np.diff(weights[order]) <= 0.0)
    assert np.all(weights >= 0.0)
    assert np.isfinite(weights.sum())
    assert np.all(weights[np.isinf(costs)] == 0.0)
    if np.any(np.isfinite(costs)):
        chosen = roulette(np.random.default_rng(0), weights, 50)
        assert np.all(np.isfinite(np.array(costs)[chosen]))


def test_inverse_weights_draw_as_the_paper_wants() -> None:
    shares = (
        np.bincount(
            roulette(np.random.default_rng(0), inverse([1.0, 2.0, 4.0]), 80_000), minlength=3
        )
        / 80_000
    )
    assert shares == pytest.approx(
        np.array([4.0, 2.0, 1.0]) / 7.0, abs=0.007
    )  # four standard errors
