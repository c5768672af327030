"""Roulettes by cost: how often each individual is a parent."""

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
)

COUNT = 40_000
FITNESS = FitnessRoulette(fitness_offset=4.0)


@pytest.mark.parametrize(
    ("operator", "costs", "weights"),
    [
        (InverseRoulette(), [1.0, 4.0, 0.5, np.inf], [1.0, 0.25, 2.0, 0.0]),
        (InverseRoulette(), [3.0, 0.0, 1.0, -0.0, np.inf], [0.0, 1.0, 0.0, 1.0, 0.0]),
        (InverseRoulette(), [1.0, np.nan], [1.0, 0.0]),
        (InverseRoulette(), [np.inf, np.inf], [1.0, 1.0]),  # nobody weighs anything
        (DifferenceRoulette(), [1.0, 4.0, 2.5, np.inf], [3.0, 0.0, 1.5, 0.0]),
        (DifferenceRoulette(), [2.0, np.inf, 2.0, np.nan], [1.0, 0.0, 1.0, 0.0]),
        (DifferenceRoulette(), [np.inf, np.inf], [1.0, 1.0]),
        (FITNESS, [1.0, 3.5, 4.0, 9.0], [3.0, 0.5, 0.0, 0.0]),
        (FITNESS, [5.0, 9.0], [1.0, 1.0]),
    ],
)
def test_parents_are_drawn_by_their_weights(
    operator: Selection, costs: list[float], weights: list[float]
) -> None:
    parents = drawn.selected(operator, np.random.default_rng(0), np.array(costs), COUNT)
    shares = np.bincount(parents, minlength=len(costs)) / COUNT
    assert shares == pytest.approx(np.array(weights) / sum(weights), abs=0.01)  # 4 standard errors


@pytest.mark.parametrize("operator", [InverseRoulette(), DifferenceRoulette()])
@given(st.lists(st.floats(0.0, 1e300) | st.just(np.inf), min_size=1, max_size=30))
def test_infeasible_individuals_are_drawn_only_if_all_are(
    operator: Selection, costs: list[float]
) -> None:
    parents = drawn.selected(operator, np.random.default_rng(0), np.array(costs), 50)
    assert np.isfinite(np.array(costs)[parents]).all() == np.isfinite(costs).any()
