"""Occupancy grids out of files: text or PNG."""

import io
from typing import Any

import numpy as np

from evoexp.errors import SettingError

BLOCKED, FREE, COMMENT = "*#", "+.", ";"
_PNG = b"\x89PNG\r\n\x1a\n"


def read_map(content: bytes, size: tuple[int, ...], field: str) -> np.ndarray:
    """Return the occupancy grid that a file holds.

    A text has one line per y, the greatest y first, as one looks at a map: `*` or `#` for a blocked
    node, `+` or `.` for a free one, blanks between them at will; `;` begins a comment. In three
    dimensions there is one such block of lines per z, the least z first, with an empty line between
    blocks. A PNG (two dimensions) has one pixel per node, black for a blocked one, white for a free
    one.

    Returns:
        (nodes along x, along y[, along z]), true for blocked nodes.
    """
    is_png = content.startswith(_PNG)
    layers = _read_png(content, size, field)[None] if is_png else _read_text(content, field)
    blocked = layers[:, ::-1, :].transpose(2, 1, 0)  # (x, y, z)
    blocked = blocked[:, :, 0] if len(size) == 2 and blocked.shape[2] == 1 else blocked
    _check_size(size, blocked.shape, field)
    return np.ascontiguousarray(blocked)


def _read_text(content: bytes, field: str) -> np.ndarray:
    """Return layers (z, rows, columns)."""
    try:
        lines = [line for line in content.decode().splitlines() if line[:1] != COMMENT]
    except UnicodeDecodeError:
        raise SettingError(field, "a text or a PNG", "neither") from None
    blocks: list[list[str]] = [[]]
    for number, line in enumerate(lines, 1):
        row = "".join(line.partition(COMMENT)[0].split())
        if wrong := next((letter for letter in row if letter not in BLOCKED + FREE), ""):
            must = f"a map of {' or '.join(BLOCKED)} (blocked) and {' or '.join(FREE)} (free)"
            raise SettingError(field, must, f"{wrong} in row {number}")
        if row:
            blocks[-1].append(row)
        elif blocks[-1]:
            blocks.append([])
    blocks = [block for block in blocks if block]
    lengths = {len(row) for block in blocks for row in block}
    if len(lengths) != 1 or len({len(block) for block in blocks}) != 1:
        raise SettingError(field, "a map whose rows are equally long", sorted(lengths) or "empty")
    return np.array([[[letter in BLOCKED for letter in row] for row in block] for block in blocks])


def _read_png(content: bytes, size: tuple[int, ...], field: str) -> np.ndarray:
    """Return rows (rows, columns); a picture of another size is not unpacked."""
    from PIL import Image  # only pictures need it

    try:
        opened: Any = Image.open(io.BytesIO(content), formats=("PNG",))
        _check_size(size, opened.size, field)
        picture: Any = opened.convert("L")
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise SettingError(field, "a PNG that can be read", str(error)) from None
    pixels = np.asarray(picture)
    if wrong := sorted({int(value) for value in np.unique(pixels)} - {0, 255}):
        must = "a PNG of black (blocked) and white (free) pixels"
        raise SettingError(field, must, f"grey {wrong[0]}")
    return np.asarray(pixels == 0)


def _check_size(size: tuple[int, ...], was: tuple[int, ...], field: str) -> None:
    if was != tuple(size):
        expected, counts = (" × ".join(map(str, shape)) for shape in (size, was))
        raise SettingError(field, f"a map of {expected} nodes, as scenario.size says", counts)
