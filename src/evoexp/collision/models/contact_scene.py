"""The blocks of `ContactTables` as named views, which kernels make of the two flat arrays."""

from typing import NamedTuple

from evoexp.collision.models.contact_tables import (
    BALLS,
    CHAIN,
    ENTRIES,
    ENTRY_OBSTACLES,
    OBSTACLES,
    PAIR_REACHES,
    PAIRS,
    PART_REACHES,
    PARTS,
    RUNS,
    SCALE,
    SPHERES,
    UNIT_COLUMNS,
    UNITS,
)
from evoexp.collision.models.flat_tables import chain_of, column_of, obstacles_of, table_of
from evoexp.numeric.compilation import inlined
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
