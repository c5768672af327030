"""Length and unsafeness of paths over a grid, see `grid_walks`."""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import inlined, kernel
from evoexp.paths.grids import NodeArray
from evoexp.records import FloatArray, IntArray

KIND_BITS = 32  # moves of either kind are counted in half of the bits of one number
DIAGONAL = 2**KIND_BITS - 1
POSITIVE = 2**62 - 1
MOST_UNSAFE = 2**31  # of a node, so that sums are exact: of fewer than 2²² nodes
_BY_KIND = np.array([0, 0, 1, 1 << KIND_BITS])  # by how many coordinates a move changes


@kernel
def measure_path(path: NodeArray, kinds: NodeArray, unsafeness: FloatArray) -> tuple[float, float]:
    """Return length and mean unsafeness of a path (Chen & Zalzala 1995, Eqs. 2 and 3).

    Moves of each kind are counted, so the length does not depend on their order.

    Args:
        kinds: See `grids.Grid`.
        unsafeness: (nodes,).

    Returns:
        D [cell] and S [-].
    """
    count = path[0]
    diagonal, spatial = 0, 0
    before = path[1]
    total = unsafeness[before]
    for k in range(2, count + 1):
        node = path[k]
        kind = kinds[abs(node - before)]
        diagonal += kind == 2
        spatial += kind == 3
        total += unsafeness[node]
        before = node
    lateral = count - 1 - diagonal - spatial
    return lateral + diagonal * np.sqrt(2.0) + spatial * np.sqrt(3.0), total / count


class Tolls(NamedTuple):
    """Contributions of moves and nodes to a path, in whole numbers: sums are exact in any order."""

    # (greatest difference of neighbours' indices + 1,) by that difference: diagonal moves are
    # counted in the lower half of the bits, those through space in the upper half
    of_move: IntArray
    of_node: IntArray  # (nodes,) unsafeness; (0,) where it is no whole number

    @classmethod
    def of(cls, kinds: NodeArray, unsafeness: FloatArray) -> "Tolls":
        """Return the tolls of `grids.Grid.kinds` and of an unsafeness (nodes,)."""
        is_whole = (
            (unsafeness == np.floor(unsafeness)) & (unsafeness >= 0.0) & (unsafeness <= MOST_UNSAFE)
        )
        whole = unsafeness if is_whole.all() else unsafeness[:0]
        return cls(_BY_KIND[kinds], whole.astype(np.int64))


@inlined
def measure_by_tolls(path: NodeArray, tolls: Tolls) -> tuple[float, float]:
    """Return D and S of `measure_path`, by whole numbers.

    The masks change no number. Without them LLVM makes vectors of the sums, and processors gather
    their terms in thrice the time.
    """
    count, before = np.int64(path[0]), np.int64(path[1])
    moves, toll = np.int64(0), tolls.of_node[np.uint64(before)]
    for k in range(2, count + 1):
        node = np.int64(path[k])
        moves = (moves + tolls.of_move[np.uint64(abs(node - before))]) & POSITIVE
        toll = (toll + tolls.of_node[np.uint64(node)]) & POSITIVE
        before = node
    diagonal, spatial = moves & DIAGONAL, moves >> KIND_BITS
    lateral = count - 1 - diagonal - spatial
    length = lateral + diagonal * np.sqrt(2.0) + spatial * np.sqrt(3.0)
    return length, np.float64(toll) / count
