"""Arrays that are copied as memory, and kernels that count no references."""

import sys

import numpy as np
import pytest
from numba.core.errors import TypingError
from numpy.typing import NDArray

from evoexp.numeric.compilation import copy_part, kernel, uncounted


@kernel
def copy(
    source: NDArray[np.int64], first: int, out: NDArray[np.int64], at: int, count: int
) -> None:
    copy_part(source, first, out, at, count)


@pytest.mark.parametrize("kind", [np.uint8, np.int32, np.int64, np.float64])
def test_parts_are_copied_and_nothing_else(kind: type) -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        source, out = rng.integers(0, 200, (2, 40)).astype(kind)
        first, at = rng.integers(0, 40, 2).tolist()
        count = int(rng.integers(0, 41 - max(first, at)))
        expected = out.copy()
        expected[at : at + count] = source[first : first + count]
        copy(source, first, out, at, count)
        np.testing.assert_array_equal(out, expected)


def test_only_contiguous_items_of_one_type_are_copied() -> None:
    whole, single = np.zeros((2, 8)), np.zeros(8, dtype=np.float32)
    for source, out in ((single, whole[0]), (whole[0, ::2], whole[1]), (whole[0], whole[:, 1])):
        with pytest.raises(TypingError):
            copy(source, 0, out, 0, 1)  # type: ignore[arg-type]


@kernel
def sum_of_new(num: int) -> float:
    values = np.empty(num)
    for k in range(num):
        values[k] = k
    return float(values.sum())


@uncounted
def sum_of_both(values: NDArray[np.float64], pair: tuple[NDArray[np.float64], int]) -> float:
    return values[0] + pair[0][1] + sum_of_new(pair[1])


@kernel
def sums_of_own(num: int) -> float:
    total = 0.0
    for _ in range(num):
        values = np.full(1000, 2.0)
        total += sum_of_both(values, (values, 3))
        total += values[999]
    return total


def test_arrays_outlive_kernels_that_do_not_count() -> None:
    """A kernel that one of them calls, and is compiled then, may create arrays."""
    values = np.array([1.0, 2.0])
    before = sys.getrefcount(values)
    assert [sum_of_both(values, (values, 5)) for _ in range(100)] == [13.0] * 100
    assert sys.getrefcount(values) == before
    assert sums_of_own(1000) == 1000 * (2.0 + 2.0 + 3.0 + 2.0)
