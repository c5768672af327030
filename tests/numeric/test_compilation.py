"""Arrays that are copied as memory."""

import numpy as np
import pytest
from numba.core.errors import TypingError
from numpy.typing import NDArray

from evoexp.numeric.compilation import copy_part, kernel


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
