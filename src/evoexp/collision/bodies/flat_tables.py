"""Tables of numbers as two flat arrays, and as named views again in kernels.

numba takes some 60 ns to recognise an array, and a robot among obstacles has twenty of them: a call
for a few configurations would take longer for the tables than for the answer.
"""

from typing import Any

import numpy as np

from evoexp.numeric.compilation import inlined, view_part, view_rows
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import KinematicChain
from evoexp.scenarios.obstacles import ObstacleTable

CHAIN_BLOCKS, OBSTACLE_BLOCKS = 7, 4
"""How many blocks a chain and the obstacles take."""


def flattened(blocks: list[np.ndarray]) -> tuple[FloatArray, IntArray]:
    """Return all numbers, and all integers behind a table of places and rows, block by block."""
    header: list[int] = []
    numbers: list[np.ndarray] = [np.empty(0)]
    indices: list[np.ndarray] = []
    next_number, next_index = 0, 2 * len(blocks)
    for block in blocks:
        if block.dtype == np.float64:
            header += [next_number, len(block)]
            numbers.append(block.ravel())
            next_number += block.size
        else:
            header += [next_index, len(block)]
            indices.append(block.ravel().astype(np.int64))
            next_index += block.size
    first = np.array(header, dtype=np.int64)
    return np.concatenate(numbers), np.concatenate([first, *indices])


@inlined
def table_of(array: Any, indices: IntArray, block: int, width: int) -> Any:
    """Return a block of a flat array, row by row."""
    return view_rows(array, indices[2 * block], indices[2 * block + 1], width)


@inlined
def column_of(array: Any, indices: IntArray, block: int) -> Any:
    """Return a block of a flat array whose rows are single numbers."""
    return view_part(array, indices[2 * block], indices[2 * block + 1])


@inlined
def chain_of(n: FloatArray, i: IntArray, block: int) -> KinematicChain:
    """Return the chain whose fields begin with a block."""
    return KinematicChain(
        column_of(i, i, block),
        column_of(i, i, block + 1),
        column_of(i, i, block + 2),
        column_of(i, i, block + 3),
        table_of(n, i, block + 4, 9),
        table_of(n, i, block + 5, 3),
        table_of(n, i, block + 6, 2),
    )


@inlined
def obstacles_of(n: FloatArray, i: IntArray, block: int) -> ObstacleTable:
    """Return the obstacles whose fields begin with a block."""
    return ObstacleTable(
        column_of(i, i, block),
        table_of(n, i, block + 1, 3),
        table_of(n, i, block + 2, 9),
        table_of(n, i, block + 3, 3),
    )
