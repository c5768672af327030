"""Paths over a grid: random walks toward a target, loop erasure, length and unsafeness.

A path is written into one row of a table: its number of nodes, then their indices. Its first node
is the start, its last the goal. `place` (nodes,) tells the nodes of a path: a node belongs to it if
the path has that node at its place; so nothing needs to be cleared between paths.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.random_stream import Block
from evoexp.paths.grids import Moves, NodeArray
from evoexp.records import FloatArray

LANES = 4  # walkers of `walk_all`
WORDS = LANES // 2  # of 64 random bits for a step of each
HALF, LOW = np.uint64(32), np.uint64(2**32 - 1)
SHARE = 2.0**-32  # that half a word is of its greatest number and one

SumArray = NDArray[np.unsignedinteger[Any]]


@kernel
def weigh_moves(moves: Moves, node: int, sums: FloatArray) -> None:
    """Write the running sums (moves,) of the weights of a node's moves.

    A neighbour of potential U has the weight U_max − U + 1, U_max being the greatest among the
    neighbours (Chen & Zalzala 1995, section 2.3: "a neighbouring node which has a lower distance
    value to the goal, has more chance"). A move that is not permitted weighs nothing.
    """
    neighbours, potentials, steps = moves.neighbours, moves.potentials, moves.steps
    greatest, total = 0.0, 0.0
    for move in range(len(sums)):
        other = neighbours[node, move]
        if other >= 0:
            greatest = max(greatest, potentials[steps[other]])
    for move in range(len(sums)):
        other = neighbours[node, move]
        if other >= 0:
            total += greatest - potentials[steps[other]] + 1.0
        sums[move] = total


@kernel
def weigh_all(moves: Moves) -> FloatArray:
    """Return the running sums of the weights of all moves, (nodes, moves)."""
    sums = np.empty(moves.neighbours.shape)
    for node in range(len(sums)):
        weigh_moves(moves, node, sums[node])
    return sums


@inlined
def drawn_move(uniform: float, sums: NDArray[Any]) -> int:
    """Return the move at which the running sum of weights (moves,) passes the uniform part."""
    last = len(sums) - 1
    part, move = uniform * sums[last], 0
    for other in range(last):  # without a branch, which no processor could foresee
        move += sums[other] <= part
    return move


@kernel
def walk(
    draws: Block,  # one number is taken per step; if they are used up, the walk breaks off
    moves: Moves,  # with a table of sums their potentials are not read
    sums: SumArray,  # (1, nodes, moves) of `weigh_all`; (0, nodes, moves): worked out on the way
    ends: tuple[int, int],  # indices of the start and of the target, which the front must reach
    erase: bool,  # whether loops are erased
    path: NodeArray,  # (≥ nodes + 1,), written; see above
    place: NodeArray,  # (nodes,) scratch
) -> None:
    """Write a random path: a step draws a permitted move, weighted as by `weigh_moves`."""
    uniforms, taken, neighbours = draws.uniforms, draws.taken, moves.neighbours
    node, target = ends
    at, num, count, is_table = taken[0], len(uniforms), 1, len(sums) > 0
    own = np.empty(neighbours.shape[1])
    path[1] = node
    while node != target and at < num:
        if is_table:
            move = drawn_move(uniforms[at], sums[0, node])
        else:
            weigh_moves(moves, node, own)
            move = drawn_move(uniforms[at], own)
        node = neighbours[node, move]
        if count == len(path) - 1:  # full: a path without loops always fits
            erase_loops(path, count, path, place)
            count = path[0]
        count += 1
        path[count] = node
        at += 1
    taken[0] = at if node == target else num + 1
    path[0] = count
    if erase:
        erase_loops(path, count, path, place)


@kernel
def walk_all(
    words: NDArray[np.uint64],  # (any,) random
    num_words: int,  # words that are drawn at first, for a step of every walker each `WORDS`
    more_words: int,  # words that are drawn whenever these do not suffice
    neighbours: NodeArray,  # (nodes, moves), see `grids.Grid`
    sums: SumArray,  # (nodes, moves) of `weigh_all`, toward the target
    ends: tuple[int, int],  # indices of two nodes, start and target
    erase: bool,  # whether loops are erased
    paths: NodeArray,  # (paths, nodes + 1) written
) -> int:
    """Write random paths between the same two nodes, each as `walk` does, by half words.

    A step must wait for the step before it, which names the row to read; so `LANES` walkers take
    turns, 2 i by the lower half of word i, 2 i + 1 by its upper half. Who arrives begins anew.

    Returns:
        The number of words drawn, a rest included that nobody took; −1 if there are not as many.
    """
    words, neighbours, sums, paths = borrowed((words, neighbours, sums, paths))
    nodes, target = len(neighbours), np.uint64(ends[1])
    here, rows = np.full(LANES, np.uint64(ends[0])), np.arange(LANES)
    # the nodes of each walker, from index 1 on
    trails, counts = np.empty((LANES, nodes + 1), dtype=np.int32), np.ones(LANES, dtype=np.int64)
    trails[:, 1] = ends[0]
    place = np.empty(nodes, dtype=np.int32)
    begun, complete, taken, drawn = LANES, 0, 0, num_words
    while complete < len(paths):
        drawn += more_words if taken == drawn else 0
        if drawn > len(words):
            return -1
        # a step of every walker
        needs_care = False
        for walker in range(LANES):
            word, node = words[taken + (walker >> 1)], here[walker]
            bits = word >> HALF if walker & 1 else word & LOW
            move = drawn_move(SHARE * np.float64(bits), sums[node])
            following = here[walker] = np.uint64(neighbours[node, move])
            counts[walker] += 1
            trails[walker, counts[walker]] = following
            needs_care |= (following == target) | (counts[walker] == nodes)
        taken += WORDS
        # who has arrived begins the next path
        for walker in range(LANES if needs_care else 0):
            trail, count, row = trails[walker], counts[walker], rows[walker]
            if here[walker] == target:
                if row < len(paths) and erase:
                    erase_loops(trail, count, paths[row], place)
                elif row < len(paths):
                    paths[row, 0], paths[row, 1 : count + 1] = count, trail[1 : count + 1]
                complete += row < len(paths)
                rows[walker], here[walker], counts[walker] = begun, np.uint64(ends[0]), 1
                begun += 1
            elif count == nodes:  # full: a path without loops always fits
                erase_loops(trail, count, trail, place)
                counts[walker] = trail[0]
    return drawn


@kernel
def erase_loops(nodes: NodeArray, count: int, path: NodeArray, place: NodeArray) -> None:
    """Write a path of `count` nodes, from index 1 on, without its loops; it may be `path` itself.

    The nodes between two visits of a node are left out: every node's last exit leads on (Wilson
    1996).
    """
    for k in range(1, count + 1):
        place[nodes[k]] = k
    num_left, k = 0, 1
    while k <= count:  # from the last place of a node the path never comes back to it
        node = nodes[k]
        num_left += 1
        path[num_left] = node
        k = place[node] + 1
    path[0] = num_left


@kernel
def measure_path(path: NodeArray, kinds: NodeArray, unsafeness: FloatArray) -> tuple[float, float]:
    """Return length D [cell] and mean unsafeness S of a path (Chen & Zalzala 1995, Eqs. 2 and 3).

    Moves of each kind (see `grids.Grid`) are counted, so the length does not depend on their order.
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
