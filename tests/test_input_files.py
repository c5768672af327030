"""Arrays of .npy files: as numpy reads them, or refused by what is wrong, in little memory."""

import io
import struct
from pathlib import Path

import numpy as np
import pytest

from confinement import confined
from evoexp.input_files import read_npy

ROWS = np.arange(6.0).reshape(2, 3)
ARRAYS = {
    "rows": ROWS,
    "columns": np.asfortranarray(ROWS),
    "big-endian": np.arange(3, dtype=">i2"),
    "flags": np.array([True, False]),
    "one number": np.array(7.5),
    "none": np.empty((0, 4)),
}


def saved(array: np.ndarray | np.float64) -> bytes:
    """Return a `.npy` file."""
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


@pytest.mark.parametrize("array", ARRAYS.values(), ids=ARRAYS)
def test_arrays_are_those_of_numpy(array: np.ndarray) -> None:
    found = read_npy(saved(array))
    assert (found.dtype, found.shape) == (array.dtype, array.shape)
    assert np.array_equal(found, array)


def npy(shape: str, kind: str = "<f8", size: int = 64) -> bytes:
    """Return a file of that many zeros whose header claims a shape."""
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + bytes(size)


OTHERS = {
    "ten thousand million items": (npy("(10000000000,)"), "64 bytes follow"),
    "more items than integers": (npy(f"({2**62}, {2**62})"), "64 bytes follow"),
    "no items along an endless axis": (npy("(0, 9223372036854775807)", size=0), "."),
    "too few items": (npy("(2, 3)", size=32), "2 × 3 numbers of 8 bytes, 32 bytes follow"),
    "too many items": (npy("(2, 3)"), "2 × 3 numbers of 8 bytes, 64 bytes follow"),
    **{shape: (npy(shape), "has no shape|header is damaged") for shape in (
        "(-2, -4)", "(8, -1)", "(8, 1.0)", "(8, True)", "8", "(8, 'a')", "(" * 5000 + ")" * 5000
    )},
    "objects": (npy("(8,)", "|O"), "not numbers"),
    "texts": (saved(np.array(["a"])), "not numbers"),
    "items of no kind": (npy("(8,)", "<f3"), "header is damaged"),
    "fields": (npy("(8,)", "<f8', 'x"), "header is damaged"),
    "a header without end": (b"\x93NUMPY\x02\x00" + struct.pack("<I", 2**32 - 1), "."),
    "code": (b"\x93NUMPY\x01\x00\x20\x00" + b"__import__('os').system('touch x')", "damaged"),
    "half a header": (npy("(8,)")[:20], "header is damaged"),
    "another version": (b"\x93NUMPY\x09\x00" + npy("(8,)")[8:], "."),
    "another file": (b"PK", "first bytes are not those"),
    "nothing": (b"", "first bytes are not those"),
}  # fmt: skip


@pytest.mark.parametrize("name", OTHERS)
def test_others_are_refused(name: str, tmp_path: Path) -> None:
    content, message = OTHERS[name]

    def attempt() -> None:
        with pytest.raises(ValueError, match=message):
            read_npy(content)

    assert read_npy(npy("(8, 1)")).shape == (8, 1)
    confined(attempt, tmp_path, 500)
