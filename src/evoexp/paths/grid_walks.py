"""Paths over a grid: random walks toward a target, loop erasure.

A path is written into one row of a table: its number of nodes, then their indices. Its first node
is the start, its last the goal. `place` (nodes,) tells the nodes of a path: a node belongs to it if
the path has that node at its place; so nothing needs to be cleared between paths.
"""

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.random_stream import Block
from evoexp.paths.grid_choices import SHIFT, TOTAL, Choices
from evoexp.paths.grids import Moves, NodeArray

LANES = 4  # walkers of `walk_all`
WORDS = LANES // 2  # of 64 random bits for a step of each
HALF, LOW = np.uint64(32), np.uint64(2**32 - 1)


@kernel
def walk(
    draws: Block,
    moves: Moves,
    choices: Choices,
    ends: tuple[int, int],
    erase: bool,
    path: NodeArray,
    place: NodeArray,
) -> None:
    """Write a random path: every step draws one of the permitted moves, weighted toward the target.

    A neighbour of potential U has the weight U_max − U + 1, U_max being the greatest among the
    neighbours (Chen & Zalzala 1995, section 2.3: "a neighbouring node which has a lower distance
    value to the goal, has more chance").

    Args:
        draws: One number is taken per step; if they are used up, the walk breaks off.
        moves: The moves and their weights.
        choices: The same as a table, one row toward the target; without rows: there is none.
        ends: Indices of the node it starts at and of the target, which the front must reach.
        erase: Whether loops are erased.
        path: (≥ nodes + 1,), written; see above.
        place: (nodes,) scratch.
    """
    uniforms, taken = draws.uniforms, draws.taken
    node, target = np.uint64(ends[0]), np.uint64(ends[1])
    at, num, count, is_table = taken[0], len(uniforms), 1, len(choices.entries) > 0
    path[1] = node
    while node != target and at < num:
        if is_table:
            following = chosen_node(uniforms[at], choices, node)
        else:
            following = np.uint64(_weighed_node(uniforms[at], moves, int(np.int64(node))))
        if erase:
            place[node] = following
        else:
            if count == len(path) - 1:  # full: a path without loops always fits
                erase_loops(path, count, path, place)
                count = path[0]
            count += 1
            path[count] = following
        node = following
        at += 1
    taken[0] = at if node == target else num + 1
    if not erase:
        path[0] = count
    elif node == target:
        follow_exits(place, ends, path)


@inlined
def chosen_node(uniform: float, choices: Choices, node: np.uint64) -> np.uint64:
    """Return where a uniform number leads by a table of choices; a node is an index, unsigned."""
    entry = choices.entries[0, node]
    part = np.uint64(uniform * np.float64(entry & TOTAL))
    return np.uint64(np.int64(node) + choices.slots[np.uint64(entry >> SHIFT) + part])


@kernel
def follow_exits(exits: NodeArray, ends: tuple[int, int], path: NodeArray) -> None:
    """Write a walk without its loops: every node's last exit leads on (Wilson 1996).

    Args:
        exits: (nodes,) the node to which the walk last went from each.
        ends: Its first node and its last.
        path: Written.
    """
    node, target, count = np.uint64(ends[0]), np.uint64(ends[1]), 1
    path[1] = node
    while node != target:
        node = np.uint64(exits[node])
        count += 1
        path[count] = node
    path[0] = count


@kernel
def walk_all(
    words: NDArray[np.uint64],  # (any,) random
    num_words: int,  # words that are drawn at first, for a step of every walker each `WORDS`
    more_words: int,  # words that are drawn whenever these do not suffice
    choices: Choices,  # of one target, see `grid_choices.choice_table`
    ends: tuple[int, int],  # indices of two nodes, start and target
    erase: bool,  # whether loops are erased
    paths: NodeArray,  # (paths, nodes + 1) written
) -> int:
    """Write random paths between the same two nodes, each as `walk` does, by half words.

    A step must wait for the step before it, which names the row to read; so `LANES` walkers take
    their steps in turns. The lower half of word i is that of walker 2 i, the upper half that of
    walker 2 i + 1, and so on. A walker that arrives begins the next path.

    Returns:
        The number of words drawn, a rest included that nobody took; −1 if there are not as many.
    """
    words, choices, paths = borrowed((words, choices, paths))
    nodes, target = choices.entries.shape[1], np.uint64(ends[1])
    here, rows = np.full(LANES, np.uint64(ends[0])), np.arange(LANES)
    # of each walker its last exit from each node; where loops are kept its nodes, from index 1 on
    trails, counts = np.empty((LANES, nodes + 1), dtype=np.int32), np.ones(LANES, dtype=np.int64)
    trails[:, 1] = ends[0]
    place = np.empty(nodes, dtype=np.int32)
    begun, complete, taken, drawn = LANES, 0, 0, num_words
    while complete < len(paths):
        if taken == drawn:
            drawn += more_words
        if drawn > len(words):
            return -1
        # a step of every walker
        has_arrived = False
        for walker in range(LANES):
            word, node = words[taken + (walker >> 1)], here[walker]
            following = _node_of_bits(choices, node, word >> HALF if walker & 1 else word & LOW)
            if erase:
                trails[walker, node] = following
            else:
                counts[walker] += 1
                trails[walker, counts[walker]] = following
            here[walker] = following
            has_arrived |= following == target
        taken += WORDS
        # who has arrived begins the next path
        for walker in range(LANES if has_arrived or not erase else 0):
            trail, count = trails[walker], counts[walker]
            if here[walker] == target:
                row = rows[walker]
                if row < len(paths) and erase:
                    follow_exits(trail, ends, paths[row])
                elif row < len(paths):
                    paths[row, 0], paths[row, 1 : count + 1] = count, trail[1 : count + 1]
                complete += row < len(paths)
                rows[walker], here[walker], counts[walker] = begun, np.uint64(ends[0]), 1
                begun += 1
            elif not erase and count == nodes:  # full: a path without loops always fits
                erase_loops(trail, count, trail, place)
                counts[walker] = trail[0]
    return drawn


@inlined
def _node_of_bits(choices: Choices, node: np.uint64, bits: np.uint64) -> np.uint64:
    """Return where 32 random bits lead by a table of choices; a node is an index, unsigned."""
    entry = choices.entries[0, node]
    part = bits * np.uint64(entry & TOTAL) >> HALF
    return np.uint64(np.int64(node) + choices.slots[np.uint64(entry >> SHIFT) + part])


@kernel
def _weighed_node(uniform: float, moves: Moves, node: int) -> int:
    """Choose one of a node's neighbours by a uniform number; the node itself if it has none.

    All moves are looked at without a branch, because no processor can foresee the permitted and the
    chosen ones.
    """
    neighbours, potentials, steps = moves.neighbours, moves.potentials, moves.steps
    # greatest potential, sum and number of the permitted neighbours
    greatest, total, count = 0.0, 0.0, 0
    for move in range(neighbours.shape[1]):
        other = neighbours[node, move]
        permitted = other >= 0
        potential = potentials[steps[other if permitted else node]]
        greatest = max(greatest, potential if permitted else 0.0)
        total += potential if permitted else 0.0
        count += permitted
    # the neighbour at which the sum of weights passes the uniform part
    left, chosen = uniform * (count * (greatest + 1.0) - total), node
    for move in range(neighbours.shape[1]):
        other = neighbours[node, move]
        permitted = other >= 0
        weight = greatest - potentials[steps[other if permitted else node]] + 1.0
        chosen = other if permitted & (left >= 0.0) else chosen
        left -= weight if permitted else 0.0
    return chosen


@kernel
def erase_loops(nodes: NodeArray, count: int, path: NodeArray, place: NodeArray) -> None:
    """Write a path without its loops: the nodes between two visits of a node are left out.

    Args:
        nodes: (≥ count + 1,) a path, its nodes from index 1 on; may be `path` itself.
        count: Number of its nodes.
        path: (≥ nodes + 1,), written, its number of nodes first.
        place: (nodes,) scratch.
    """
    for k in range(1, count + 1):
        place[nodes[k]] = k
    kept, k = 0, 1
    while k <= count:  # from the last place of a node the path never comes back to it
        node = nodes[k]
        kept += 1
        path[kept] = node
        k = place[node] + 1
    path[0] = kept
