"""The tables of spheres and capsules as flat arrays, and as named views again in kernels."""

from typing import Any

import numpy as np

from evoexp.collision.models.flat_tables import (
    CHAIN_BLOCKS,
    chain_of,
    column_of,
    flattened,
    table_of,
)
from evoexp.collision.models.packed_shapes import (
    ContactTables,
    PackedObstacles,
    PackedShapes,
    PrimitiveTables,
    Units,
)
from evoexp.numeric.compilation import inlined

WHOLE, BALL, RUNS, SPHERES, CAPSULES, MOST, DATA, LISTED, PAIRS = range(
    CHAIN_BLOCKS, CHAIN_BLOCKS + 9
)
"""Blocks of the flat arrays behind a chain."""


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
