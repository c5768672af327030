"""Arrays of .npy files: as numpy reads them, or refused by what is wrong."""

import io

import numpy as np
import pytest

from evoexp.input_files import read_npy


def npy(array: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def with_header(shape: str) -> bytes:
    """Return a file of 64 bytes of numbers whose header tells another shape."""
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}\n".encode()
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(64)


@pytest.mark.parametrize(
    "array",
    [
        np.arange(6.0).reshape(2, 3),
        np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        np.arange(3, dtype=">i2"),
        np.array([True, False]),
        np.array(7.5),
        np.empty((0, 4)),
    ],
    ids=["rows", "columns", "big-endian", "flags", "one number", "none"],
)
def test_arrays_are_those_of_numpy(array: np.ndarray) -> None:
    found = read_npy(npy(array))
    assert (found.dtype, found.shape) == (array.dtype, array.shape)
    assert np.array_equal(found, np.load(io.BytesIO(npy(array))))


@pytest.mark.parametrize("shape", ["(-2, -4)", "(8, -1)", "(8, 1.0)", "(8, True)", "8", "(8, 'a')"])
def test_a_shape_is_whole_numbers(shape: str) -> None:
    assert read_npy(with_header("(8, 1)")).shape == (8, 1)
    with pytest.raises(ValueError, match="tells no shape|header is damaged"):
        read_npy(with_header(shape))


def test_other_sizes_and_kinds_are_refused() -> None:
    with pytest.raises(ValueError, match="2 × 3 numbers of 8 bytes, 64 bytes follow"):
        read_npy(with_header("(2, 3)"))
    with pytest.raises(ValueError, match="does not begin as one"):
        read_npy(b"PK")
    with pytest.raises(ValueError, match="header is damaged"):
        read_npy(npy(np.arange(3.0))[:20])
    with pytest.raises(ValueError, match="no numbers"):
        read_npy(npy(np.array(["a"])))
