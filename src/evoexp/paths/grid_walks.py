"""Paths over a grid: random walks toward a target, loop erasure.

A path is written into one row of a table: its number of nodes, then their indices. Its first node
is the start, its last the goal. `place` (nodes,) tells the nodes of a path: a node belongs to it if
the path has that node at its place; so nothing needs to be cleared between paths.
"""

import numpy as np

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.random_stream import Block, used_up
from evoexp.paths.grid_choices import SHIFT, TOTAL, Choices
from evoexp.paths.grids import Moves, NodeArray


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
def walk_each(
    draws: Block,
    moves: Moves,
    choices: Choices,
    ends: tuple[int, int],
    erase: bool,
    first: int,
    paths: NodeArray,
    place: NodeArray,
) -> int:
    """Write random paths between the same nodes, one after the other, each as `walk` does.

    Args:
        draws: Uniform numbers.
        moves: The moves and their weights.
        choices: The same as a table, or without rows.
        ends: Indices of the first node and of the target.
        erase: Whether loops are erased.
        first: The path to begin with.
        paths: (paths, nodes + 1) written.
        place: (nodes,) scratch.

    Returns:
        How many paths are complete, those before `first` included: fewer than all if the draws did
        not suffice.
    """
    draws, moves, choices, paths = borrowed((draws, moves, choices, paths))
    for k in range(first, len(paths)):
        before = draws.taken[0]
        walk(draws, moves, choices, ends, erase, paths[k], place)
        if used_up(draws):
            draws.taken[0] = before
            return k
    return len(paths)


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
