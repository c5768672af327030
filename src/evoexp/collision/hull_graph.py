"""Convex hulls whose farthest corner in a direction is found by climbing from corner to corner.

The height of a convex body's corners has no local maximum but the greatest: a climb along edges
that starts near by ends after a few steps, where a look at every corner takes hundreds.
"""

from itertools import product
from typing import NamedTuple

import numpy as np

from evoexp.numeric.convex_hull import hull_of
from evoexp.numeric.ordered_sums import matrix_product
from evoexp.records import FloatArray, IntArray

FEWEST = 32  # corners from which on a climb takes less time than a look at all of them
CELLS = 64  # cells of directions, see `cell_of`; 48 of them exist


class HullGraph(NamedTuple):
    """Corners of a convex hull, and the edges between them."""

    corners: FloatArray  # (corners, 3)
    # (corners,) of arrays: the corners at the other ends of each one's edges
    neighbours: tuple[IntArray, ...]
    # (CELLS,) the corner that is farthest in the middle of each cell of directions; −1 in all cells
    # if the corners are looked at one by one
    starts: IntArray


def plain_corners(corners: FloatArray) -> HullGraph:
    """Return corners without edges between them."""
    none = np.empty(0, dtype=np.int64)
    return HullGraph(corners, (none,) * len(corners), np.full(CELLS, -1, dtype=np.int64))


def hull_graph(points: FloatArray) -> HullGraph:
    """Return the convex hull of points (points, 3).

    Points without an inside, and hulls of few corners, come without edges.
    """
    found = hull_of(points)
    if found is None:
        return plain_corners(points)
    corners, triangles = found
    if len(corners) < FEWEST:
        return plain_corners(corners)
    others: list[set[int]] = [set() for _ in corners]
    for triangle in triangles.tolist():
        for one, two in ((0, 1), (1, 2), (2, 0)):
            others[triangle[one]].add(triangle[two])
            others[triangle[two]].add(triangle[one])
    neighbours = tuple(np.array(sorted(each), dtype=np.int64) for each in others)
    starts = np.full(CELLS, -1, dtype=np.int64)
    for cell, direction in _cell_middles():
        starts[cell] = int(np.argmax(matrix_product(corners, direction)))
    return HullGraph(corners, neighbours, starts)


def _cell_middles() -> list[tuple[int, FloatArray]]:
    """Return the number of every cell of directions that exists, and a direction within it."""
    found = []
    for sizes in ((3, 2, 1), (3, 1, 2), (2, 3, 1), (1, 3, 2), (2, 1, 3), (1, 2, 3)):
        for signs in product((-1.0, 1.0), repeat=3):
            direction = np.array(sizes) * signs
            found.append((cell_of(*direction.tolist()), direction))
    return found


def cell_of(x: float, y: float, z: float) -> int:
    """Return the cell of a direction: its signs, and the order of its parts by size."""
    cell = (x > 0.0) + 2 * (y > 0.0) + 4 * (z > 0.0)
    a, b, c = abs(x), abs(y), abs(z)
    return int(cell + 8 * (a > b) + 16 * (b > c) + 32 * (a > c))
