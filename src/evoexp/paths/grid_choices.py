"""Tables of the choices of random walks over a grid at every node: one look-up makes a step.

Every move has as many slots as it weighs, so a random whole number below the sum of the weights is
a choice. Nodes whose moves weigh the same share their slots, which hold differences of indices: a
grid has a few hundred patterns of weights, which stay in the fastest memory.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.paths.grids import Moves, NodeArray, StepArray
from evoexp.records import BoolArray, FloatArray

MOST_SLOTS = 256  # of a node
MOST_NODES = 2**15  # whose differences are 16 bits
TOTAL_BITS = 9  # of an entry: the number of slots
TOTAL = np.uint32(2**TOTAL_BITS - 1)
SHIFT = np.uint32(TOTAL_BITS)
BYTES = 8  # of a word


class Choices(NamedTuple):
    """The choices of walks to some targets at every node.

    There are no rows where there are no such tables.
    """

    # (targets, nodes) uint32: the sum of the weights in the lowest `TOTAL_BITS`, the place of the
    # first slot above them
    entries: NDArray[np.uint32]
    # (any,) the index of the node that a choice leads to, less that of the node where the walk is
    slots: NDArray[np.int16]


def choices_of(
    neighbours: NodeArray, potentials: FloatArray, fronts: StepArray, most_patterns: int
) -> Choices:
    """Return the choices of walks to some targets; without rows where they do not fit.

    They do not fit if a weight is no whole number, if a node has more than `MOST_SLOTS`, or if
    there are more patterns than `most_patterns`.

    Args:
        neighbours: See `grids.Moves`, as for `potentials`.
        fronts: (targets, nodes) steps to every node from each target.
        most_patterns: Most combinations of the weights of a node's moves.
    """
    nodes, moves = neighbours.shape
    none = Choices(np.empty((0, nodes), dtype=np.uint32), np.zeros(1, dtype=np.int16))
    if nodes > MOST_NODES or not len(fronts):
        return none
    # a byte for the weight of each move, words of them for each node
    weights = np.zeros((*fronts.shape, BYTES * -(-moves // BYTES)), dtype=np.uint8)
    permitted = neighbours >= 0
    for target, steps in enumerate(fronts):
        whole = _weights(neighbours, permitted, potentials[steps])
        if whole is None:
            return none
        weights[target, :, :moves] = whole
    # each combination of weights once, and which of them a node has
    words = weights.reshape(-1, weights.shape[2]).view(np.uint64)
    _, pattern = np.unique(words[:, 0], return_inverse=True)
    for word in words.T[1:]:
        _, column = np.unique(word, return_inverse=True)
        _, pattern = np.unique(pattern * (column.max() + 1) + column, return_inverse=True)
    count = int(pattern.max()) + 1
    if count >= most_patterns:
        return none
    example = np.empty(count, dtype=np.int64)
    example[pattern] = np.arange(len(pattern))
    repeats = weights.reshape(len(words), -1)[example, :moves].astype(np.int64)
    # a move leads to the same difference of indices from every node that has it
    differences = np.where(permitted, neighbours - np.arange(nodes, dtype=np.int32)[:, None], 0)
    shifts = differences[np.abs(differences).argmax(axis=0), np.arange(moves)]
    stays = (~repeats.any(axis=1)).astype(np.int64)  # without a neighbour a walk stays
    counts = np.column_stack([repeats, stays])
    first, totals = np.cumsum(counts.sum(axis=1)) - counts.sum(axis=1), repeats.sum(axis=1)
    entries = (first << TOTAL_BITS | totals).astype(np.uint32)[pattern].reshape(fronts.shape)
    slots = np.repeat(np.tile([*shifts, 0], count), counts.ravel()).astype(np.int16)
    return Choices(entries, slots)


def choice_table(moves: Moves) -> Choices:
    """Return the choices of walks to one target, one row of them.

    There is no row if the weights are no whole numbers or the table would be large; such walks
    weigh the moves of every node anew, see `grid_walks.walk`.
    """
    fronts = moves.steps[None, :]
    return choices_of(moves.neighbours, moves.potentials, fronts, len(moves.neighbours))


def _weights(
    neighbours: NodeArray, permitted: BoolArray, potential: FloatArray
) -> FloatArray | None:
    """Return the weights of the moves from every node (nodes, moves), see `grid_walks.walk`.

    There are none if a node has more than `MOST_SLOTS`, or if a weight is no whole number.

    Args:
        neighbours: See `choices_of`.
        permitted: (nodes, moves) whether there is a neighbour.
        potential: (nodes,) toward the target.
    """
    around = np.where(permitted, potential[neighbours], 0.0)
    greatest = around.max(axis=1, keepdims=True)
    weights = np.where(permitted, greatest - around + 1.0, 0.0)
    fit = weights.sum(axis=1).max() <= MOST_SLOTS and (weights == np.floor(weights)).all()
    return weights if fit else None
