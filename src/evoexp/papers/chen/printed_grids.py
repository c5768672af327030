"""Grids of numbers as a paper prints them, compared node by node with computed ones.

A printed row may have a number too many or one too few. Rows are aligned by the fewest such slips;
the remaining differences are wrong numbers, surplus numbers and missing numbers.
"""

import difflib
from collections.abc import Sequence
from importlib import resources

import numpy as np
import pandas as pd

from evoexp.records import FloatArray

BLOCKED = "*"
COLUMNS = ["field", "row", "column", "computed", "printed", "slip"]
WRONG, MISSING, SURPLUS = "wrong", "missing", "surplus"


def printed(name: str) -> list[list[list[str]]]:
    """Return the grids of an asset, each a list of rows of words.

    Empty lines stand between grids; lines that begin with `;` are comments.
    """
    text = resources.files("evoexp").joinpath("assets", name).read_text(encoding="utf-8")
    lines = (line for line in text.splitlines() if not line.startswith(";"))
    blocks = "\n".join(lines).split("\n\n")
    return [[row.split() for row in block.strip().splitlines()] for block in blocks]


def rows_of(values: FloatArray, blocked: np.ndarray, edge: str = BLOCKED) -> list[list[str]]:
    """Return a field (along x, along y) as rows of words from the top, as it would be printed.

    Args:
        values: The field.
        blocked: (along x, along y) nodes of obstacles, printed as `*`.
        edge: The word printed for nodes of obstacles that have a free node beside them.
    """
    free = np.pad(~blocked, 1)
    beside = free[:-2, 1:-1] | free[2:, 1:-1] | free[1:-1, :-2] | free[1:-1, 2:]
    numbers = np.vectorize(lambda v: f"{v:g}")(values)
    words = np.where(blocked, np.where(beside, edge, BLOCKED), numbers)
    return [[str(word) for word in row] for row in words.T[::-1]]


def compare(
    name: str, computed: Sequence[Sequence[str]], given: Sequence[Sequence[str]]
) -> pd.DataFrame:
    """Compare a computed grid with a printed one, cell by cell.

    Returns:
        Columns field, row (from the top), column, computed, printed, slip: empty, `wrong`,
        `missing` (nothing is printed for the cell) or `surplus` (printed before the column, and
        belongs to no cell).
    """
    found: list[tuple[object, ...]] = []
    for row, (own, theirs) in enumerate(zip(computed, given, strict=True)):
        opcodes = difflib.SequenceMatcher(None, theirs, own, autojunk=False).get_opcodes()
        for kind, i1, i2, j1, j2 in opcodes:
            both = min(i2 - i1, j2 - j1)
            slip = "" if kind == "equal" else WRONG
            found += [(name, row, j1 + k, own[j1 + k], theirs[i1 + k], slip) for k in range(both)]
            found += [(name, row, j, own[j], "", MISSING) for j in range(j1 + both, j2)]
            found += [(name, row, j2, "", theirs[i], SURPLUS) for i in range(i1 + both, i2)]
    return pd.DataFrame(found, columns=COLUMNS)
