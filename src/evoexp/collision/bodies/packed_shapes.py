"""The arrays that the kernels of spheres and capsules read, and the names of their columns.

Kernels take them as two flat arrays, and make named views again (`flat_tables`).
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.bodies.flat_tables import (
    CHAIN_BLOCKS,
    chain_of,
    column_of,
    flattened,
    table_of,
)
from evoexp.numeric.compilation import inlined
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import KinematicChain

BOXES, CYLINDERS, HALF_SPACES = range(3)
"""Classes of obstacles; spheres and capsules are thickened boxes."""

JOINT, FIRST_RUN, STOP_RUN, FIRST_CAPSULE, STOP_CAPSULE, FIRST_LISTED, STOP_LISTED = range(7)
"""Columns of `Units.whole`."""

REACH, SLACK = 3, 4
"""Columns of `Units.ball` behind the centre."""

TURN, CORE_SIZE, AROUND, BOX, BOX_THICKNESS = 3, 12, 16, 17, 20
"""First columns in `PackedObstacles.data`, behind the centre."""

WHOLE, BALL, RUNS, SPHERES, CAPSULES, MOST, DATA, LISTED, PAIRS = range(
    CHAIN_BLOCKS, CHAIN_BLOCKS + 9
)
"""Blocks of the flat arrays behind a chain."""


class Units(NamedTuple):
    """Bodies and then parts of bodies, each with a ball around it."""

    # (units, 7) frame (a joint of the kinematic table, one past its end: the world); first and
    # one-past-last run of spheres; the same of capsules; the same of entries in the list of
    # obstacles that a body is checked against
    whole: IntArray
    # (units, 5) centre in the frame, radius, and the slack: the least distance of any shape's end
    # from this centre, less its own radius
    ball: FloatArray


class PackedShapes(NamedTuple):
    """Spheres and capsules in the frames of the kinematic table, in the order of the units."""

    runs: IntArray  # (runs, 2) first and one-past-last sphere of equal radius
    spheres: FloatArray  # (spheres, 4) centre, radius
    # (capsules, 8) one end, from there to the other, radius, 1 / squared length
    capsules: FloatArray
    most: int  # greatest number of spheres of a unit


class PackedObstacles(NamedTuple):
    """Obstacles, and the lists of those that each body is checked against."""

    # (obstacles, 21) centre; rotation, row by row; half the edges and thickness of a box, or radius
    # and half the length of a cylinder; radius of a ball around; half the edges and thickness of a
    # box around
    data: FloatArray
    # (entries, 2) obstacle, and its class: BOXES, CYLINDERS or HALF_SPACES; body by body
    listed: IntArray


class ContactTables(NamedTuple):
    """A robot made of spheres among obstacles, as two arrays: see `contact_tables`."""

    numbers: FloatArray  # all numbers, block by block
    # for each block its place and its rows, then all integers; of no length for robots that are not
    # made of spheres alone
    indices: IntArray

    @property
    def known(self) -> bool:
        """Whether the robot is made of spheres alone."""
        return len(self.indices) > 0


class PrimitiveTables(NamedTuple):
    """All tables of a robot among obstacles."""

    chain: KinematicChain  # the joints
    units: Units  # bodies, then their parts
    shapes: PackedShapes  # of the units
    obstacles: PackedObstacles  # the obstacles, and which body is checked against which
    pairs: IntArray  # (pairs, 3) two units, and the row of the result that they count for
    contacts: ContactTables  # the same once more, for `find_contacts`


def flat_primitives(tables: PrimitiveTables) -> tuple[Any, ...]:
    """Return the tables as kernels take them: two flat arrays, and those of `find_contacts`."""
    shapes = tables.shapes
    own = [*shapes[:3], np.array([shapes.most], dtype=np.int64)]
    blocks = [*tables.chain, *tables.units, *own, *tables.obstacles, tables.pairs]
    return (*flattened(blocks), *tables.contacts)


@inlined
def named_primitives(tables: tuple[Any, ...]) -> PrimitiveTables:
    """Return the tables in the arrays of `flat_primitives` as views."""
    n, i, contact_numbers, contact_indices = tables
    most = column_of(i, i, MOST)
    return PrimitiveTables(
        chain_of(n, i, 0),
        Units(table_of(i, i, WHOLE, 7), table_of(n, i, BALL, 5)),
        PackedShapes(
            table_of(i, i, RUNS, 2),
            table_of(n, i, SPHERES, 4),
            table_of(n, i, CAPSULES, 8),
            most[0],
        ),
        PackedObstacles(table_of(n, i, DATA, 21), table_of(i, i, LISTED, 2)),
        table_of(i, i, PAIRS, 3),
        ContactTables(contact_numbers, contact_indices),
    )
