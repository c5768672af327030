"""Linear scaling and stochastic remainder sampling.

What the paper's formula says, and counts that are unbiased.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.evolution.scaled_selection import (
    choose_by_remainders,
    scale_costs,
)

COSTS = st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=30).map(np.array)


def scale_linearly(costs: np.ndarray, count: int, multiple: float = 2.0) -> np.ndarray:
    expected = np.empty(len(costs))
    scale_costs(costs, count, multiple, expected)
    return expected


def stochastic_remainder(rng: np.random.Generator, expected: np.ndarray) -> np.ndarray:
    count, num = round(expected.sum()), len(expected)
    parents, order = np.empty(count, dtype=np.int64), np.empty(num, dtype=np.int64)
    choose_by_remainders(rng.random(num + 1 + count), expected, order, parents)
    return parents


def scaled_as_printed(fitness: np.ndarray, multiple: float = 2.0) -> np.ndarray:
    """f' = a f + b of Eq. 5, negative ones 0, from its two conditions alone."""
    mean, most = fitness.mean(), fitness.max()
    a, b = np.linalg.solve([[mean, 1.0], [most, 1.0]], [mean, multiple * mean])
    return np.maximum(a * fitness + b, 0.0)


@given(st.integers(0, 2**32), st.integers(2, 40), st.integers(1, 60))
def test_scaling_is_equation_5_whatever_the_constant(seed: int, num: int, count: int) -> None:
    costs = np.random.default_rng(seed).uniform(10.0, 90.0, num)
    for constant in (costs.max(), 250.0):
        scaled = scaled_as_printed(constant - costs)
        np.testing.assert_allclose(
            scale_linearly(costs, count), count * scaled / scaled.sum(), rtol=1e-7, atol=1e-9
        )


@given(COSTS, st.floats(-1e3, 1e3), st.integers(0, 40))
def test_scaling_does_not_change_with_a_shift_and_adds_up(
    costs: np.ndarray, shift: float, count: int
) -> None:
    costs = np.round(costs, 3)
    expected = scale_linearly(costs, count)
    assert expected.sum() == pytest.approx(count)
    assert (expected >= 0.0).all()
    shifted = scale_linearly(np.round(costs + np.round(shift, 3), 3), count)
    np.testing.assert_allclose(shifted, expected, atol=1e-6 * max(count, 1))


def test_infeasible_ones_expect_nothing_and_equal_ones_equally_much() -> None:
    expected = scale_linearly(np.array([np.inf, 3.0, np.nan, 5.0]), 4)
    np.testing.assert_allclose(expected, [0.0, 4.0, 0.0, 0.0])
    np.testing.assert_allclose(scale_linearly(np.full(5, 0.1), 4), np.full(5, 0.8))
    np.testing.assert_allclose(scale_linearly(np.full(5, np.inf), 4), np.full(5, 0.8))


@given(COSTS, st.integers(0, 60), st.integers(0, 2**32))
def test_counts_are_the_floor_or_one_more(costs: np.ndarray, count: int, seed: int) -> None:
    expected = scale_linearly(costs, count)
    parents = stochastic_remainder(np.random.default_rng(seed), expected)
    counts = np.bincount(parents, minlength=len(costs))
    assert len(parents) == count
    assert (counts >= np.floor(expected - 1e-9)).all()
    assert (counts <= np.ceil(expected + 1e-9)).all()


def test_counts_are_unbiased() -> None:
    """The mean of 40000 counts, each of standard deviation ≤ 0.5: six standard errors are 0.015."""
    expected = np.array([0.9, 0.1, 0.5, 0.5, 1.3, 0.7, 2.2, 0.8])
    rng, num = np.random.default_rng(3), 40_000
    counts = sum(np.bincount(stochastic_remainder(rng, expected), minlength=8) for _ in range(num))
    np.testing.assert_allclose(counts / num, expected, atol=0.015)


def test_order_of_parents_is_random() -> None:
    """Each of three parents stands first in a third of 6000 draws.

    Six standard errors are 0.037.
    """
    rng, num = np.random.default_rng(4), 6000
    first = (
        np.bincount([stochastic_remainder(rng, np.ones(3))[0] for _ in range(num)], minlength=3)
        / num
    )
    np.testing.assert_allclose(first, 1 / 3, atol=0.037)
