"""Eight bytes at once: every lane does what numpy's int8 does."""

import numpy as np
import pytest
from numba.core.errors import TypingError
from numpy.typing import NDArray

from evoexp.numeric.compilation import kernel
from evoexp.numeric.vector_bytes import (
    equal_bytes,
    load_bytes,
    load_mask,
    spread_byte,
    store_bytes,
)
from evoexp.numeric.vectors import LANES, select


@kernel
def replaced(
    values: NDArray[np.int8], bits: NDArray[np.uint8], old: int, new: int, out: NDArray[np.int8]
) -> None:
    """Write numbers, `new` in the place of `old` where a bit is set."""
    for k in range(0, len(values) - LANES + 1, LANES):
        present = load_bytes(values, np.uint64(k))
        chosen = equal_bytes(present, old) & load_mask(bits, np.uint64(k // LANES))
        store_bytes(out, np.uint64(k), select(chosen, spread_byte(new), present))


@pytest.mark.parametrize(("old", "new"), [(-128, 127), (-1, 0), (3, -2), (127, -128)])
def test_bytes_are_compared_chosen_and_written_lane_by_lane(old: int, new: int) -> None:
    rng = np.random.default_rng(old + 128)
    values = rng.choice(np.array([old, new, 5, -7], dtype=np.int8), 101 * LANES)
    bits = rng.integers(0, 256, 101).astype(np.uint8)
    out = np.zeros_like(values)
    replaced(values, bits, old, new, out)
    # bit k of a number belongs to lane k
    chosen = ((bits[:, None] >> np.arange(LANES)) & 1).ravel() == 1
    np.testing.assert_array_equal(out, np.where(chosen & (values == old), new, values))
    assert (out != values).any()


def test_arrays_of_another_type_are_refused() -> None:
    @kernel
    def read(values: NDArray[np.int64], out: NDArray[np.int8]) -> None:
        store_bytes(out, np.uint64(0), load_bytes(values, np.uint64(0)))

    with pytest.raises(TypingError, match="contiguous int8"):
        read(np.zeros(LANES, dtype=np.int64), np.zeros(LANES, dtype=np.int8))
