"""Tables of the choices of random walks over a grid at every node: one look-up makes a step.

Every move has as many slots as it weighs, so a random whole number below the sum of the weights is
a choice. Nodes whose moves weigh the same share their slots, which hold differences of indices: a
grid has a few hundred patterns of weights, which stay in the fastest memory.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.paths.grids import Moves, NodeArray, StepArray
from evoexp.records import BoolArray, FloatArray, IntArray

MOST_SLOTS = 256  # of a node
MOST_NODES = 2**15  # whose differences are 16 bits
TOTAL_BITS = 9  # of an entry: the number of slots
TOTAL = np.uint32(2**TOTAL_BITS - 1)
SHIFT = np.uint32(TOTAL_BITS)
BYTES = 8  # of a word
SCATTER = np.uint64(0x9E3779B97F4A7C15)  # odd; 2⁶⁴ over the golden ratio (Knuth 1998)


class Choices(NamedTuple):
    """The choices of walks to some targets at every node.

    There are no rows where there are no such tables.
    """

    # (targets, nodes) uint32: the sum of the weights in the lowest `TOTAL_BITS`, the place of the
    # first slot above them
    entries: NDArray[np.uint32]
    # (any,) the index of the node that a choice leads to, less that of the node where the walk is
    slots: NDArray[np.int16]


class _Patterns(NamedTuple):
    """Weights of the moves of one node, each combination once."""

    # (patterns + 1, words) a byte for the weight of each move, the lowest first; the last row is
    # scratch
    words: NDArray[np.uint64]
    # (patterns + 1,) place of the first slot of each; behind the last one, of the next
    first: IntArray
    known: IntArray  # (a power of two,) where each is found by its hash; −1: nowhere


def choices_of(
    neighbours: NodeArray, potentials: FloatArray, fronts: StepArray, most_patterns: int
) -> Choices:
    """Return the choices of walks to some targets; without rows where they do not fit.

    They do not fit if a weight is no whole number, if a node has more than `MOST_SLOTS`, or if
    there are more patterns than `most_patterns`.

    Args:
        neighbours: See `grids.Moves`, as for `potentials`.
        fronts: (targets, nodes) steps to every node from each target.
        most_patterns: Patterns of weights for which there is memory.
    """
    nodes, moves = neighbours.shape
    none = Choices(np.empty((0, nodes), dtype=np.uint32), np.zeros(1, dtype=np.int16))
    if nodes > MOST_NODES:
        return none
    patterns = _Patterns(
        np.zeros((most_patterns + 1, -(-moves // BYTES)), dtype=np.uint64),
        np.zeros(most_patterns + 1, dtype=np.int64),
        np.full(4 << most_patterns.bit_length(), -1, dtype=np.int64),
    )
    entries, potential = np.empty(fronts.shape, dtype=np.uint32), np.empty(nodes)
    has_moves = np.asarray((neighbours >= 0).any(axis=1))
    count = _find_patterns(neighbours, has_moves, potentials, fronts, potential, patterns, entries)
    if count < 0:
        return none
    # a move leads to the same difference of indices from every node that has it
    origins = np.arange(nodes, dtype=np.int32)[:, None]
    differences = np.where(neighbours >= 0, neighbours - origins, 0)
    shifts = differences[np.abs(differences).argmax(axis=0), np.arange(moves)]
    word, place = np.divmod(np.arange(moves), BYTES)
    weights = patterns.words[:count, word] >> (BYTES * place).astype(np.uint64) & np.uint64(255)
    repeats = weights.astype(np.int64)
    stays = (~repeats.any(axis=1)).astype(np.int64)  # without a neighbour a walk stays
    counts = np.column_stack([repeats, stays]).ravel()
    return Choices(entries, np.repeat(np.tile([*shifts, 0], count), counts).astype(np.int16))


def choice_table(moves: Moves) -> Choices:
    """Return the choices of walks to one target, one row of them.

    There is no row if the weights are no whole numbers or the table would be large; such walks
    weigh the moves of every node anew, see `grid_walks.walk`.
    """
    fronts = moves.steps[None, :]
    return choices_of(moves.neighbours, moves.potentials, fronts, len(moves.neighbours))


@kernel
def _find_patterns(
    neighbours: NodeArray,
    has_moves: BoolArray,
    potentials: FloatArray,
    fronts: StepArray,
    potential: FloatArray,
    patterns: _Patterns,
    entries: NDArray[np.uint32],
) -> int:
    """Write the entries of all nodes toward all targets, and the patterns that they need.

    Args:
        neighbours: See `choices_of`, as for `potentials` and `fronts`.
        has_moves: (nodes,) whether a node has a neighbour.
        potential: (nodes,) scratch.
        patterns: Written.
        entries: (targets, nodes) written.

    Returns:
        The number of patterns; −1 if the choices do not fit.
    """
    neighbours, has_moves, potentials, fronts = borrowed(
        (neighbours, has_moves, potentials, fronts)
    )
    potential, patterns, entries = borrowed((potential, patterns, entries))
    words, first = patterns.words, patterns.first
    # of nodes without a neighbour: one slot
    count = 1
    if len(first) < 2:
        return -1
    first[1] = 1
    _same_or_new(0, patterns)
    for target in range(len(fronts)):
        for node in range(len(potential)):
            potential[node] = potentials[fronts[target, node]]
        for node in range(len(neighbours)):
            if not has_moves[node]:
                entries[target, node] = 0
                continue
            total = _weigh(neighbours, potential, node, words[count])
            if total < 0:
                return -1
            # one that is known, or a new one
            found = _same_or_new(count, patterns)
            if found == count:
                count += 1
                if count == len(first):
                    return -1
                first[count] = first[found] + total
            entries[target, node] = first[found] << TOTAL_BITS | total
    return count


@inlined
def _weigh(
    neighbours: NodeArray, potential: FloatArray, node: int, words: NDArray[np.uint64]
) -> int:
    """Write the weights of a node's moves, see `grid_walks.walk`; return their sum.

    Args:
        neighbours: See `choices_of`.
        potential: (nodes,).
        node: The node.
        words: (words,) written.

    Returns:
        The sum; −1 if it is more than `MOST_SLOTS`, or if a weight is no whole number.
    """
    greatest, total, moves = 0.0, 0, neighbours.shape[1]
    for move in range(moves):
        other = neighbours[node, move]
        greatest = max(greatest, potential[other] if other >= 0 else 0.0)
    for k in range(len(words)):
        word = np.uint64(0)
        for move in range(BYTES * k, min(BYTES * (k + 1), moves)):
            other = neighbours[node, move]
            weight = greatest - potential[other] + 1.0 if other >= 0 else 0.0
            if weight > MOST_SLOTS or weight != np.floor(weight):
                return -1
            total += int(weight)
            word |= np.uint64(int(weight)) << np.uint64(BYTES * (move - BYTES * k))
        words[k] = word
    return total if total <= MOST_SLOTS else -1


@inlined
def _same_or_new(count: int, patterns: _Patterns) -> int:
    """Return the number of the pattern with the weights of number `count`; `count` if it is new."""
    words, known = patterns.words, patterns.known
    mixed = np.uint64(0)
    for k in range(words.shape[1]):
        mixed = (mixed ^ words[count, k]) * SCATTER
    place = np.int64(mixed >> np.uint64(32))
    while True:
        place = place & (len(known) - 1)
        other: int = known[place]
        if other < 0:
            known[place] = count
            return count
        alike = True
        for k in range(words.shape[1]):
            alike &= words[count, k] == words[other, k]
        if alike:
            return other
        place += 1
