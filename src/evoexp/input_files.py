"""Files that somebody else wrote: read whole, up to a size; tables and arrays of numbers.

Whatever such a file claims, reading it takes memory in proportion to its size, and its size is
limited.
"""

import csv
import errno
import io
import math
import os
import re
import stat
import tokenize
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

MEGABYTE = 1_000_000
# Text and pictures that a configuration refers to, meshes and recorded motions; they travel with
# every log of the condition. The largest meshes in robots' own packages take some 20 MB.
MAX_INPUT = 64 * MEGABYTE

# errors of numpy for a header that cannot be read
_UNREADABLE = (ValueError, SyntaxError, TypeError, LookupError, tokenize.TokenError)
NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]{1,3})?")
"""A number in the cell of a table."""


def read_bounded(path: str | Path, limit: int = MAX_INPUT) -> bytes:
    """Return the content of a regular file of at most `limit` bytes.

    OSError is also raised for a larger file, and a device or pipe, which might never end.
    """
    name = str(path)
    if "\0" in name:
        raise OSError(errno.EINVAL, "not a file name", name)
    status = os.stat(path)
    if not stat.S_ISREG(status.st_mode):
        if stat.S_ISDIR(status.st_mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), name)
        raise OSError(errno.EINVAL, "not a regular file", name)
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


class TableError(ValueError):
    """A table that cannot be read: its line, what that must be, and what it was."""

    def __init__(self, line: int, must: str, was: object) -> None:
        super().__init__(f"line {line}: must be {must}, was {was!r}")
        self.line, self.must, self.was = line, must, was


class TableRow(NamedTuple):
    """A row of a table."""

    line: int  # number of its line, from 1
    cells: list[str]  # without blanks around them


def read_table(content: bytes) -> list[TableRow]:
    """Return the rows of a CSV file in UTF-8, all as long as the first; blank lines are left out.

    Cells are separated by semicolons or tabs if the first line has some, else by commas.

    Raises:
        TableError: If it is no such file.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise TableError(line, "text in UTF-8", error.object[error.start]) from None
    first = text.lstrip().partition("\n")[0]
    mark = next((mark for mark in (";", "\t") if mark in first), ",")
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=mark, strict=True)
    rows: list[TableRow] = []
    try:
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            rows.append(TableRow(reader.line_num, [cell.strip() for cell in cells]))
            if len(cells) != len(rows[0].cells):
                must = f"{len(rows[0].cells)} cells, as in the first line"
                raise TableError(reader.line_num, must, len(cells))
    except csv.Error as error:
        raise TableError(reader.line_num, "a line of CSV", str(error)) from None
    return rows


def read_npy(content: bytes) -> NDArray[Any]:
    """Return the array of numbers that the bytes of a `.npy` file hold, or raise ValueError.

    Nothing is allocated before the header's shape is found to be that of the bytes behind it.
    """
    if not content.startswith(npy_format.MAGIC_PREFIX):
        raise ValueError("its first bytes are not those of a .npy file")
    file = io.BytesIO(content)
    try:
        is_first = npy_format.read_magic(file) == (1, 0)
        reads = npy_format.read_array_header_1_0 if is_first else npy_format.read_array_header_2_0
        with warnings.catch_warnings(action="ignore"):  # of headers that Python 2 wrote
            shape, columns_first, kind = reads(file)
    except (*_UNREADABLE, RecursionError, MemoryError):
        raise ValueError("its header is damaged") from None
    if kind.kind not in "biuf":
        raise ValueError(f"it holds {kind.str!r}, not numbers")
    if not all(type(n) is int and 0 <= n < 2**63 for n in shape):
        raise ValueError("its header has no shape")
    data = file.read()
    if math.prod(shape) * kind.itemsize != len(data):
        numbers = f"{' × '.join(map(str, shape))[:60]} numbers of {kind.itemsize} bytes"
        told = numbers if shape else "one number"
        raise ValueError(f"its header promises {told}, {len(data)} bytes follow")
    order: Any = "F" if columns_first else "C"
    return np.frombuffer(data, kind).reshape(shape, order=order).copy()
