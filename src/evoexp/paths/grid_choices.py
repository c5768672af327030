"""Tables of the choices of random walks over a grid at every node: one look-up makes a step.

Every move has as many slots as it weighs, so a random whole number below the sum of the weights is
a choice. Nodes whose moves weigh the same share their slots, which hold differences of indices: a
grid has a few hundred patterns of weights, which stay in the fastest memory.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import inlined, kernel
from evoexp.paths.grids import Moves, NodeArray, StepArray
from evoexp.records import FloatArray, IntArray

MOST_SLOTS = 256  # of a node
MOST_NODES = 2**15  # whose differences are 16 bits
TOTAL_BITS = 9  # of an entry: the number of slots
TOTAL = np.uint32(2**TOTAL_BITS - 1)
SHIFT = np.uint32(TOTAL_BITS)
# the hash of Fowler, Noll and Vo, by whole weights instead of bytes
FNV_BASIS, FNV_PRIME = np.uint64(0xCBF29CE484222325), np.uint64(0x100000001B3)
ONE, HALF = np.uint64(1), np.uint64(32)


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
    entries = np.empty((len(fronts), nodes), dtype=np.uint32)
    patterns = np.empty((most_patterns, moves), dtype=np.int64)
    slots = np.empty(most_patterns * MOST_SLOTS, dtype=np.int16)
    places = np.full(1 << (2 * most_patterns).bit_length(), -1)
    # a move leads to the same difference of indices from every node that has it
    differences = np.where(neighbours >= 0, neighbours - np.arange(nodes)[:, None], 0)
    shifts = differences[np.abs(differences).argmax(axis=0), np.arange(moves)]
    count = 0
    if nodes <= MOST_NODES:
        count = _tabulate(neighbours, potentials, fronts, shifts, places, patterns, entries, slots)
    return Choices(entries if count else entries[:0], slots[: max(1, count)].copy())


@kernel
def _tabulate(
    neighbours: NodeArray,  # see `choices_of`, as for `potentials` and `fronts`
    potentials: FloatArray,
    fronts: StepArray,
    shifts: IntArray,  # (moves,) difference of indices that each move makes
    places: IntArray,  # (a power of two,) −1; written: numbers of patterns by their hashes
    patterns: IntArray,  # (most patterns, moves) written: weights
    entries: NDArray[np.uint32],  # (targets, nodes) written
    slots: NDArray[np.int16],  # (any,) written
) -> int:
    """Write the choices at every node; return the number of slots, 0 if they do not fit.

    Patterns are found by open addressing: `places` holds the number of each pattern, by which its
    weights stand in `patterns` and the place of its first slot in `firsts`.
    """
    nodes, moves = neighbours.shape
    weights, firsts = np.zeros(moves, dtype=np.int64), np.empty(len(patterns), dtype=np.int64)
    mask, num_patterns, num_slots = np.uint64(len(places) - 1), 0, 0
    for target in range(len(fronts)):
        steps = fronts[target]
        for node in range(nodes):
            # the weights of all moves, and their hash
            greatest, total, key = 0.0, 0, FNV_BASIS
            for move in range(moves):
                other = neighbours[node, move]
                if other >= 0:
                    greatest = max(greatest, potentials[steps[other]])
            for move in range(moves):
                other, weight = neighbours[node, move], 0.0
                if other >= 0:
                    weight = greatest - potentials[steps[other]] + 1.0
                weights[move] = int(weight)
                if weights[move] != weight or weight > MOST_SLOTS:
                    return 0
                total += weights[move]
                key = (key ^ np.uint64(weights[move])) * FNV_PRIME
            if total > MOST_SLOTS:
                return 0
            # the pattern of these weights
            at = (key ^ key >> HALF) & mask
            while places[at] >= 0 and not _are_equal(patterns[places[at]], weights):
                at = (at + ONE) & mask
            # a new pattern, its slots; without a neighbour a walk stays
            if places[at] < 0:
                if num_patterns + 1 >= len(patterns):
                    return 0
                places[at], firsts[num_patterns] = num_patterns, num_slots
                patterns[num_patterns] = weights
                for move in range(moves):
                    slots[num_slots : num_slots + weights[move]] = shifts[move]
                    num_slots += weights[move]
                if total == 0:
                    slots[num_slots] = 0
                    num_slots += 1
                num_patterns += 1
            entries[target, node] = firsts[places[at]] << TOTAL_BITS | total
    return num_slots


@inlined
def _are_equal(one: IntArray, two: IntArray) -> bool:
    """Return whether two rows of weights are the same."""
    num_equal = 0
    for k in range(len(one)):
        num_equal += one[k] == two[k]
    return num_equal == len(one)


def choice_table(moves: Moves) -> Choices:
    """Return the choices of walks to one target, one row of them.

    There is no row if the weights are no whole numbers or the table would be large; such walks
    weigh the moves of every node anew, see `grid_walks.walk`.
    """
    fronts = moves.steps[None, :]
    return choices_of(moves.neighbours, moves.potentials, fronts, len(moves.neighbours))
