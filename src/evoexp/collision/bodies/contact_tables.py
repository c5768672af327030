"""Robots made of spheres among obstacles, as two flat arrays for the kernel `find_contacts`.

The kernel makes a `Scene` of named views of them again.
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.bodies.flat_tables import (
    CHAIN_BLOCKS,
    OBSTACLE_BLOCKS,
    chain_of,
    column_of,
    flattened,
    obstacles_of,
    table_of,
)
from evoexp.collision.bodies.packed_shapes import (
    FIRST_LISTED,
    REACH,
    STOP_LISTED,
    STOP_RUN,
    ContactTables,
    PackedShapes,
    Units,
)
from evoexp.collision.models.obstacle_kernels import MARGIN
from evoexp.numeric.compilation import inlined
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import KinematicChain
from evoexp.scenarios.obstacles import CAPSULE, CYLINDER, HALF_SPACE, SPHERE, ObstacleTable

ROUNDING = 1e-12
"""Clearances below this times the scale are in doubt: rounding errors are a hundredth of it."""

(
    UNITS,
    BALLS,
    RUNS,
    SPHERES,
    ENTRIES,
    ENTRY_OBSTACLES,
    PAIRS,
    PAIR_REACHES,
    PARTS,
    PART_REACHES,
    SCALE,
) = range(CHAIN_BLOCKS + OBSTACLE_BLOCKS, CHAIN_BLOCKS + OBSTACLE_BLOCKS + 11)
CHAIN, OBSTACLES = 0, CHAIN_BLOCKS
"""Blocks of the flat arrays; a chain and obstacles take several."""

UNIT_COLUMNS = 8
FIRST_BALL, FIRST_HALF_SPACE, STOP_ENTRY, FIRST_PART, STOP_PART = range(3, 8)
"""Columns of UNITS behind `STOP_RUN`: entries of balls around obstacles, then of half-spaces; units
that are the parts of a body."""


class Scene(NamedTuple):
    """A robot made of spheres among obstacles."""

    chain: KinematicChain  # the joints
    # (units, UNIT_COLUMNS) bodies, then parts of bodies: joint, spheres, and the columns above
    units: IntArray
    balls: FloatArray  # (units, 4) centre in the joint's frame, radius
    runs: IntArray  # (runs, 2) first and one-past-last sphere of equal radius
    spheres: FloatArray  # (spheres, 4) centre in the joint's frame, radius
    obstacles: ObstacleTable  # the obstacles
    entries: FloatArray  # (entries, 4) coefficients of a body and an obstacle; see `_entry`
    owners: IntArray  # (entries,) the obstacle of each
    pairs: IntArray  # (pairs, 4) two bodies, first and one-past-last pair of their parts
    # (pairs,) squared distance of the balls' centres above which they are apart
    pair_reaches: FloatArray
    parts: IntArray  # (part pairs, 2) two units
    part_reaches: FloatArray  # (part pairs,) as `pair_reaches`
    scale: float  # bound of all coordinates [length unit]


@inlined
def scene_of(n: FloatArray, i: IntArray) -> Scene:
    """Return the blocks of the flat arrays as views."""
    return Scene(
        chain_of(n, i, CHAIN),
        table_of(i, i, UNITS, UNIT_COLUMNS),
        table_of(n, i, BALLS, 4),
        table_of(i, i, RUNS, 2),
        table_of(n, i, SPHERES, 4),
        obstacles_of(n, i, OBSTACLES),
        table_of(n, i, ENTRIES, 4),
        column_of(i, i, ENTRY_OBSTACLES),
        table_of(i, i, PAIRS, 4),
        column_of(n, i, PAIR_REACHES),
        table_of(i, i, PARTS, 2),
        column_of(n, i, PART_REACHES),
        n[i[2 * SCALE]],
    )


def contact_tables(
    chain: KinematicChain,
    units: Units,
    shapes: PackedShapes,
    listed: IntArray,
    obstacles: ObstacleTable,
    pairs: IntArray,
    bodies: list[tuple[int, int]],
    parts: list[list[int]],
) -> ContactTables:
    """Return the tables of a robot among obstacles.

    Args:
        units: Bodies, then parts of bodies.
        shapes: Spheres of the units.
        listed: (entries, 2) obstacles that bodies are checked against; see `PackedObstacles`.
        pairs: (pairs, 3) of parts, those of two bodies side by side.
        bodies: (pairs,) the two bodies of each.
        parts: (bodies,) indices of the units that are each body's parts, side by side.
    """
    if len(shapes.capsules):
        return ContactTables(np.empty(0), np.empty(0, dtype=np.int64))
    scale = _scale(chain, units, obstacles)
    rows, entries, owners = _unit_rows(units, listed, obstacles, parts, scale)
    # pairs of bodies, and the pairs of parts of each
    starts = [k for k, pair in enumerate(bodies) if k == 0 or pair != bodies[k - 1]]
    ends = [*starts, len(bodies)][1:]
    of_bodies = [(*bodies[k], k, end) for k, end in zip(starts, ends, strict=True)]
    reach = units.ball[:, REACH]
    blocks = [
        *chain,
        *obstacles,
        rows,
        units.ball[:, : REACH + 1],
        shapes.runs,
        shapes.spheres,
        entries,
        owners,
        np.array(of_bodies, dtype=np.int64).reshape(-1, 4),
        np.array([((reach[a] + reach[b]) * MARGIN) ** 2 for a, b, *_ in of_bodies]),
        pairs[:, :2],
        ((reach[pairs[:, 0]] + reach[pairs[:, 1]]) * MARGIN) ** 2,
        np.array([scale]),
    ]
    return ContactTables(*flattened(blocks))


def _unit_rows(
    units: Units, listed: IntArray, obstacles: ObstacleTable, parts: list[list[int]], scale: float
) -> tuple[IntArray, FloatArray, IntArray]:
    """Return UNITS, ENTRIES and ENTRY_OBSTACLES."""
    rows = np.zeros((len(units.whole), UNIT_COLUMNS), dtype=np.int64)
    rows[:, : STOP_RUN + 1] = units.whole[:, : STOP_RUN + 1]
    entries: list[FloatArray] = []
    owners: list[int] = []
    for b, own_parts in enumerate(parts):
        rows[b, FIRST_PART], rows[b, STOP_PART] = own_parts[0], own_parts[-1] + 1
        own = listed[units.whole[b, FIRST_LISTED] : units.whole[b, STOP_LISTED], 0]
        flat = obstacles.kind[own] == HALF_SPACE
        rows[b, FIRST_BALL] = len(owners)
        rows[b, FIRST_HALF_SPACE] = len(owners) + np.count_nonzero(~flat)
        rows[b, STOP_ENTRY] = len(owners) + len(own)
        for o in (*own[~flat], *own[flat]):
            entries.append(_entry(obstacles, o, float(units.ball[b, REACH]), scale))
            owners.append(int(o))
    return rows, np.array(entries).reshape(-1, 4), np.array(owners, dtype=np.int64)


def _scale(chain: KinematicChain, units: Units, obstacles: ObstacleTable) -> float:
    """Return a bound of all coordinates while joints that slide stand at 0 [length unit]."""
    size = np.where(np.isfinite(obstacles.size), obstacles.size, 0.0)
    reach = np.sqrt((chain.translation**2).sum(axis=1)).sum()
    reach += (np.sqrt((units.ball[:, :3] ** 2).sum(axis=1)) + units.ball[:, REACH]).max()
    around = np.sqrt((obstacles.center**2).sum(axis=1)) + np.sqrt((size**2).sum(axis=1))
    return float(reach + max(around, default=0.0))


def _entry(obstacles: ObstacleTable, o: int, reach: float, scale: float) -> FloatArray:
    """Return the coefficients of a function of a ball's centre m: positive where it is far enough.

    The function is m² + (e0, e1, e2) · m + e3 for a ball of radius R around an obstacle at c:
    |m − c|² − R² multiplied out. Of a half-space it is linear.
    """
    center, size = obstacles.center[o], obstacles.size[o]
    if obstacles.kind[o] == HALF_SPACE:
        normal = obstacles.rotation[o, [2, 5, 8]]
        level = (normal * center).sum() + reach * MARGIN
        return scale * np.array([*normal, -level])
    around = float(np.sqrt((_extent(int(obstacles.kind[o]), size) ** 2).sum()))
    within = (around + reach) * MARGIN
    return np.array([*(-2.0 * center), (center**2).sum() - within * within])


def _extent(kind: int, size: FloatArray) -> FloatArray:
    """Return lengths whose root sum of squares is the radius of a ball around an obstacle."""
    if kind == SPHERE:
        return size[:1]
    if kind == CAPSULE:
        return np.array([size[0] + size[1]])
    return size[:2] if kind == CYLINDER else size
