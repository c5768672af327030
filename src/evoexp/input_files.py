"""Files that somebody else wrote: read whole, up to a size; arrays only as large as their file.

Whatever such a file claims, reading it takes memory in proportion to its size, and its size is
limited.
"""

import ast
import errno
import math
import os
import re
import stat
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

MEGABYTE = 1_000_000
# Text and pictures that a configuration refers to, meshes and recorded motions; they travel with
# every log of the condition. The largest meshes in robots' own packages take some 20 MB.
MAX_INPUT = 64 * MEGABYTE

_NPY = b"\x93NUMPY"
_MAX_HEADER = 10_000  # [B] of an array file, as numpy has it
_NUMBERS = re.compile(r"[<>|=]?[biuf]\d{1,2}")  # kinds of plain numbers, as numpy names them


def read_bounded(path: str | Path, limit: int = MAX_INPUT) -> bytes:
    """Return the content of a file.

    Args:
        path: Of a regular file: reading a device or a pipe might never end.
        limit: [B] of the largest file that is read.

    Raises:
        OSError: If it cannot be read, is no regular file, or is larger.
    """
    name = str(path)
    if "\0" in name:
        raise OSError(errno.EINVAL, "no name of a file", name)
    status = os.stat(path)
    if not stat.S_ISREG(status.st_mode):
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), name)
        raise OSError(errno.EINVAL, "no regular file", name)
    if status.st_size > limit:
        reason = f"larger than {limit / MEGABYTE:g} MB: {status.st_size / MEGABYTE:.0f} MB"
        raise OSError(errno.EFBIG, reason, name)
    with open(path, "rb") as file:
        return file.read(status.st_size)


def stand_in(content: bytes) -> str:
    """Name the thing that a download left in the place of a file; empty: nothing of the kind."""
    start = content[:1000].removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    if start.startswith(b"version https://git-lfs"):
        return "a Git-LFS pointer in the file's place (git lfs pull brings the file)"
    if start.startswith((b"<!doctype html", b"<html")):
        return "an HTML page in the file's place (download the raw file)"
    return "" if start else "an empty file"


def read_npy(content: bytes) -> NDArray[Any]:
    """Return the array of numbers that the bytes of a `.npy` file hold.

    Nothing is allocated before the header's shape is found to be that of the bytes behind it.

    Raises:
        ValueError: If the bytes are no such file, in one line.
    """
    if content[:6] != _NPY or len(content) < 12:
        raise ValueError("it does not begin as one")
    width = 2 if content[6] == 1 else 4
    start = 8 + width
    length = int.from_bytes(content[8:start], "little")
    if content[6] not in (1, 2, 3) or length > _MAX_HEADER or start + length > len(content):
        raise ValueError("its header is damaged")
    kind, columns_first, shape = _header(content[start : start + length])
    data = memoryview(content)[start + length :]
    if math.prod(shape) * kind.itemsize != len(data):
        raise ValueError(f"its header tells {_told(shape, kind)}, {len(data)} bytes follow")
    order: Any = "F" if columns_first else "C"
    return np.frombuffer(data, kind).reshape(shape, order=order).copy()


def _header(text: bytes) -> tuple[np.dtype[Any], bool, tuple[int, ...]]:
    """Return kind of numbers, whether columns come first, and shape."""
    try:
        header = ast.literal_eval(text.decode("latin1").strip())
        kind, columns_first, shape = header["descr"], header["fortran_order"], header["shape"]
    except (ValueError, SyntaxError, TypeError, LookupError, RecursionError, MemoryError):
        raise ValueError("its header is damaged") from None
    if not isinstance(kind, str) or not _NUMBERS.fullmatch(kind):
        raise ValueError(f"it holds no numbers but {str(kind)[:40]!r}")
    is_shape = isinstance(shape, tuple) and len(shape) <= 16
    if not is_shape or not all(type(n) is int and 0 <= n < 2**63 for n in shape):
        raise ValueError("its header tells no shape")
    try:
        return np.dtype(kind), bool(columns_first), shape
    except TypeError:
        raise ValueError(f"it holds numbers of no known kind, {kind!r}") from None


def _told(shape: tuple[int, ...], kind: np.dtype[Any]) -> str:
    numbers = " × ".join(map(str, shape))
    return f"{numbers[:60]} numbers of {kind.itemsize} bytes" if shape else "one number"
