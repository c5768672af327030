"""Named tuples that go into kernels as plain ones."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from numba.core.errors import TypingError

from evoexp.numeric.compilation import kernel
from evoexp.numeric.named_tuples import named, plain
from evoexp.records import FloatArray


class Inner(NamedTuple):
    rows: FloatArray
    scale: float


class Outer(NamedTuple):
    inner: Inner
    count: int
    sizes: tuple[int, int]


@kernel
def difference(given: tuple[Any, ...]) -> float:
    """Use every field by its name, in another order than theirs."""
    outer = named(Outer, given)
    sizes = outer.sizes[0] - outer.sizes[1]
    return outer.count - outer.inner.scale * outer.inner.rows[1] + sizes


@kernel
def rows_of(given: tuple[Any, ...]) -> FloatArray:
    return named(Outer, given).inner.rows


def test_plain_tuples_have_the_same_values_and_no_names() -> None:
    rows = np.arange(3.0)
    given = plain(Outer(Inner(rows, 0.5), 4, (7, 2)))
    assert given == ((rows, 0.5), 4, (7, 2))
    assert given[0][0] is rows
    assert type(given) is type(given[0]) is tuple


def test_kernels_name_them_again_to_any_depth() -> None:
    given = plain(Outer(Inner(np.array([1.0, 3.0]), 0.5), 4, (7, 2)))
    assert difference(given) == 4 - 0.5 * 3.0 + 5


def test_arrays_outlive_the_tuple_that_they_came_in() -> None:
    given = plain(Outer(Inner(np.arange(100.0), 0.5), 4, (7, 2)))
    kept = [rows_of(given) for _ in range(50)]
    del given
    assert all(np.array_equal(rows, np.arange(100.0)) for rows in kept)


def test_a_tuple_of_another_length_is_refused() -> None:
    with pytest.raises((TypingError, ValueError)):
        difference(((np.ones(2), 0.5), 4))


def test_interpreted_kernels_name_them_too() -> None:
    given = Outer(Inner(np.array([1.0, 3.0]), 0.5), 4, (7, 2))
    found = named(Outer, plain(given))
    assert found == given
    assert type(found) is Outer
    assert type(found.inner) is Inner
