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
    """A robot made of spheres among obstacles."""

    chain: KinematicChain  # the joints
    # (units, UNIT_COLUMNS) bodies, then parts of bodies: joint, spheres, and see `contact_tables`
    units: IntArray
    balls: FloatArray  # (units, 4) centre in the joint's frame, radius
    runs: IntArray  # (runs, 2) first and one-past-last sphere of equal radius
    spheres: FloatArray  # (spheres, 4) centre in the joint's frame, radius
    obstacles: ObstacleTable  # the obstacles
    entries: FloatArray  # (entries, 4) coefficients of a body and an obstacle; see `contact_tables`
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
