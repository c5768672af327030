"""Dominance, beside its definition."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.evolution.succession import pareto_front

VALUES = st.sampled_from([0.0, -0.0, 1.0, 2.0, 3.0, np.inf, -np.inf, np.nan])
TABLES = st.integers(1, 6).flatmap(
    lambda rows: st.lists(st.lists(VALUES, min_size=rows, max_size=rows), min_size=1, max_size=30)
)


def front_by_definition(criteria: np.ndarray) -> list[bool]:
    def dominates(a: np.ndarray, b: np.ndarray) -> bool:
        return bool(np.all(a <= b) and np.any(a < b))

    columns = criteria.T
    return [
        not np.isnan(own).any() and not any(dominates(other, own) for other in columns)
        for own in columns
    ]


@pytest.mark.parametrize("num_criteria", [1, 2, 3, 4, 5, 8, 9])
@pytest.mark.parametrize("count", [0, 1, 2, 7, 64, 101])
def test_front_is_what_the_definition_says(num_criteria: int, count: int) -> None:
    criteria = np.random.default_rng(10 * count + num_criteria).random((num_criteria, count))
    assert pareto_front(criteria).tolist() == front_by_definition(criteria)


@given(TABLES)
def test_ties_infinities_and_nan(individuals: list[list[float]]) -> None:
    criteria = np.ascontiguousarray(np.array(individuals).T)
    assert pareto_front(criteria).tolist() == front_by_definition(criteria)


def test_no_criteria_are_refused() -> None:
    with pytest.raises(ValueError, match="one at least"):
        pareto_front(np.empty((0, 5)))
