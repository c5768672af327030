"""The arrays that the kernels of bodies read: two flat ones, and named views of their blocks.

numba takes some 60 ns to recognise an array, and a robot among obstacles has twenty of them: a call
for a few configurations would take longer for the tables than for the answer.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.numeric.compilation import inlined, view_part
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import KinematicChain
from evoexp.scenarios.obstacles import ObstacleTable

(
    JOINT,
    FIRST_RUN,
    STOP_RUN,
    FIRST_CAPSULE,
    STOP_CAPSULE,
    FIRST_BALL,
    FIRST_HALF_SPACE,
    STOP_ENTRY,
    FIRST_PART,
    STOP_PART,
) = range(10)
"""Columns of `BodyTables.units`. Entries are balls around obstacles first, then half-spaces; parts
are units."""

REACH = 3  # column of `BodyTables.balls` behind the centre
THICKNESS, AROUND = 3, 4  # columns of `BodyTables.cores` behind half the edges
OBSTACLES, BETWEEN, SELF = range(3)
"""Rows of the clearances: to obstacles, between arms, between parts of one arm."""

FlatTables = tuple[FloatArray, IntArray]
"""All numbers, and all integers behind each block's first place and number of rows."""


class BodyTables(NamedTuple):
    """A robot made of spheres and capsules among obstacles.

    Units are bodies and then parts of bodies, each with a ball around it. All points are in the
    frames of the kinematic table.
    """

    chain: KinematicChain  # the joints
    obstacles: ObstacleTable  # the obstacles
    # (obstacles, 5) half the edges and the thickness of a box that an obstacle is, or that is
    # around a cylinder, and the radius of a ball around it [length unit]
    cores: FloatArray
    # (units, 10) frame (a joint of the kinematic table, one past its end: the world), then first
    # and one-past-last run of spheres, capsule, entry and part, by the columns above
    units: IntArray
    balls: FloatArray  # (units, 4) centre in the joint's frame, radius
    runs: IntArray  # (runs, 2) first and one-past-last sphere of equal radius
    spheres: FloatArray  # (spheres, 4) centre in the joint's frame, radius
    # (capsules, 8) one end, from there to the other, radius, 1 / squared length
    capsules: FloatArray
    entries: FloatArray  # (entries, 4) coefficients of a body and an obstacle; see `packing`
    owners: IntArray  # (entries,) the obstacle of each
    # (pairs, 5) two bodies, first and one-past-last pair of their parts, row of the result
    pairs: IntArray
    parts: IntArray  # (part pairs, 2) two units
    # (maps, 5) two coordinates, first place among the bounds, and numbers of cells along both
    maps: IntArray
    grids: FloatArray  # (maps, 4) where the first cells begin along both, then 1 / step of both
    bounds: FloatArray  # (cells,) of distances from below, map by map [length unit]
    scale: float  # bound of all coordinates while joints that slide stand at 0 [length unit]


def flattened(tables: BodyTables) -> FlatTables:
    """Return all numbers, and all integers behind a header of places and rows, block by block."""
    blocks: list[np.ndarray] = [*tables.chain, *tables.obstacles, *tables[2:-1]]
    blocks.append(np.array([tables.scale]))
    sizes = {np.dtype(np.float64): 0, np.dtype(np.int64): 2 * len(blocks)}
    header: list[int] = []
    parts: dict[Any, list[np.ndarray]] = {kind: [] for kind in sizes}
    for block in blocks:
        kind = np.dtype(np.float64 if block.dtype == np.float64 else np.int64)
        header += [sizes[kind], len(block)]
        parts[kind].append(block.ravel().astype(kind))
        sizes[kind] += block.size
    numbers, indices = parts.values()
    return np.concatenate(numbers), np.concatenate([np.array(header, dtype=np.int64), *indices])


@inlined
def named_tables(n: FloatArray, i: IntArray) -> BodyTables:
    """Return the blocks of the flat arrays as views."""
    chain = KinematicChain(
        _column(i, i, 0),
        _column(i, i, 1),
        _column(i, i, 2),
        _column(i, i, 3),
        _rows(n, i, 4, 9),
        _rows(n, i, 5, 3),
        _rows(n, i, 6, 2),
    )
    obstacles = ObstacleTable(
        _column(i, i, 7), _rows(n, i, 8, 3), _rows(n, i, 9, 9), _rows(n, i, 10, 3)
    )
    return BodyTables(
        chain,
        obstacles,
        _rows(n, i, 11, 5),
        _rows(i, i, 12, 10),
        _rows(n, i, 13, 4),
        _rows(i, i, 14, 2),
        _rows(n, i, 15, 4),
        _rows(n, i, 16, 8),
        _rows(n, i, 17, 4),
        _column(i, i, 18),
        _rows(i, i, 19, 5),
        _rows(i, i, 20, 2),
        _rows(i, i, 21, 5),
        _rows(n, i, 22, 4),
        _column(n, i, 23),
        n[i[2 * 24]],
    )


@inlined
def _rows(array: Any, indices: IntArray, block: int, width: int) -> Any:
    """Return a block of a flat array, row by row."""
    rows = indices[2 * block + 1]
    return view_part(array, indices[2 * block], rows * width).reshape(rows, width)


@inlined
def _column(array: Any, indices: IntArray, block: int) -> Any:
    """Return a block of a flat array whose rows are single numbers."""
    return view_part(array, indices[2 * block], indices[2 * block + 1])
