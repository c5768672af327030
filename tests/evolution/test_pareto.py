"""Dominance, beside its definition."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.evolution.pareto import pareto_front


def dominates(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.all(a <= b) and np.any(a < b))


def front_by_definition(criteria: np.ndarray) -> np.ndarray:
    columns = criteria.T
    return np.array(
        [
            not np.isnan(own).any() and not any(dominates(other, own) for other in columns)
            for own in columns
        ],
        dtype=bool,
    )


@pytest.mark.parametrize("num_criteria", [1, 2, 3, 4, 5, 8, 9])
@pytest.mark.parametrize("count", [1, 2, 7, 64, 101])
def test_front_is_what_the_definition_says(num_criteria: int, count: int) -> None:
    criteria = np.random.default_rng(10 * count + num_criteria).random((num_criteria, count))
    assert np.array_equal(pareto_front(criteria), front_by_definition(criteria))


values = st.sampled_from([0.0, -0.0, 1.0, 2.0, 3.0, np.inf, -np.inf, np.nan])


@given(
    st.integers(1, 6).flatmap(
        lambda rows: st.lists(
            st.lists(values, min_size=rows, max_size=rows), min_size=1, max_size=30
        )
    )
)
def test_ties_infinities_and_nan(individuals: list[list[float]]) -> None:
    criteria = np.ascontiguousarray(np.array(individuals).T)
    assert np.array_equal(pareto_front(criteria), front_by_definition(criteria))


def test_nobody_and_no_criteria() -> None:
    assert pareto_front(np.empty((4, 0))).tolist() == []
    with pytest.raises(ValueError, match="one at least"):
        pareto_front(np.empty((0, 5)))
