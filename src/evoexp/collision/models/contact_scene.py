"""The blocks of `ContactTables` as named views, which kernels make of the two flat arrays."""

from typing import Any, NamedTuple

from evoexp.collision.models.contact_tables import (
    BALLS,
    CENTER,
    ENTRIES,
    ENTRY_OBSTACLES,
    INDEX_Q,
    KIND,
    PAIR_REACHES,
    PAIRS,
    PARENT,
    PART_REACHES,
    PARTS,
    PRISMATIC,
    ROTATION,
    RUNS,
    SCALE,
    SIZE,
    SPHERES,
    TRANSLATION,
    TURN,
    TURNED,
    UNIT_COLUMNS,
    UNITS,
)
from evoexp.numeric.compilation import inlined, view_part, view_rows
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import KinematicChain
from evoexp.scenarios.obstacles import ObstacleTable


class Scene(NamedTuple):
    """A robot made of spheres among obstacles.

    Attributes:
        chain: The joints.
        units: (units, UNIT_COLUMNS) bodies, then parts of bodies: joint, spheres, and see
            `contact_tables`.
        balls: (units, 4) centre in the joint's frame, radius.
        runs: (runs, 2) first and one-past-last sphere of equal radius.
        spheres: (spheres, 4) centre in the joint's frame, radius.
        obstacles: The obstacles.
        entries: (entries, 4) coefficients of a body and an obstacle; see `contact_tables`.
        owners: (entries,) the obstacle of each.
        pairs: (pairs, 4) two bodies, first and one-past-last pair of their parts.
        pair_reaches: (pairs,) squared distance of the balls' centres above which they are apart.
        parts: (part pairs, 2) two units.
        part_reaches: (part pairs,) as `pair_reaches`.
        scale: Bound of all coordinates [length unit].
    """

    chain: KinematicChain
    units: IntArray
    balls: FloatArray
    runs: IntArray
    spheres: FloatArray
    obstacles: ObstacleTable
    entries: FloatArray
    owners: IntArray
    pairs: IntArray
    pair_reaches: FloatArray
    parts: IntArray
    part_reaches: FloatArray
    scale: float


@inlined
def _table(array: Any, indices: IntArray, block: int, width: int) -> Any:
    """Return a block of a flat array, row by row."""
    return view_rows(array, indices[2 * block], indices[2 * block + 1], width)


@inlined
def _column(array: Any, indices: IntArray, block: int) -> Any:
    """Return a block of a flat array whose rows are single numbers."""
    return view_part(array, indices[2 * block], indices[2 * block + 1])


@inlined
def scene_of(n: FloatArray, i: IntArray) -> Scene:
    """Return the blocks of the flat arrays as views."""
    return Scene(
        KinematicChain(
            _column(i, i, PARENT),
            _column(i, i, INDEX_Q),
            _column(i, i, PRISMATIC),
            _column(i, i, TURNED),
            _table(n, i, ROTATION, 9),
            _table(n, i, TRANSLATION, 3),
        ),
        _table(i, i, UNITS, UNIT_COLUMNS),
        _table(n, i, BALLS, 4),
        _table(i, i, RUNS, 2),
        _table(n, i, SPHERES, 4),
        ObstacleTable(
            _column(i, i, KIND),
            _table(n, i, CENTER, 3),
            _table(n, i, TURN, 9),
            _table(n, i, SIZE, 3),
        ),
        _table(n, i, ENTRIES, 4),
        _column(i, i, ENTRY_OBSTACLES),
        _table(i, i, PAIRS, 4),
        _column(n, i, PAIR_REACHES),
        _table(i, i, PARTS, 2),
        _column(n, i, PART_REACHES),
        n[i[2 * SCALE]],
    )
