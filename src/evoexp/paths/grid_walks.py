"""Paths over a grid: random walks toward a target, loop erasure.

A path is written into one row of a table: its number of nodes, then their indices. Its first node
is the start, its last the goal. `place` (nodes,) tells the nodes of a path: a node belongs to it if
the path has that node at its place; so nothing needs to be cleared between paths.
"""

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.random_stream import Block, used_up
from evoexp.paths.grid_choices import SHIFT, TOTAL
from evoexp.paths.grids import Moves, NodeArray, StepArray
from evoexp.records import FloatArray

ONE = np.uint64(1)


@kernel
def walk(
    draws: Block,
    moves: Moves,
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
        ends: Indices of the node it starts at and of the target, which the front must reach.
        erase: Whether loops are erased.
        path: (≥ nodes + 1,), written; see above.
        place: (nodes,) scratch.
    """
    uniforms, taken = draws.uniforms, draws.taken
    node, target = ends
    at, num = taken[0], len(uniforms)
    trail = np.empty(num - min(at, num) + 2, np.int32)
    count = 1
    trail[1] = node
    place[node] = 1
    while node != target and at < num:
        node = _next_node(uniforms[at], moves.neighbours, moves.potentials, moves.steps, node)
        at += 1
        count += 1
        trail[count] = node
        place[node] = count
    taken[0] = at if node == target else num + 1
    _write(trail, count, erase, path, place)


BITS = 53  # of a uniform number
REST = np.int64(2**BITS - 1)
NEAR = np.int64(1024)  # [2⁻⁵³] from a whole number a product may be rounded to it


@kernel
def walk_by_choices(
    draws: Block,
    entries: NDArray[np.uint32],
    slots: NDArray[np.int16],
    ends: tuple[int, int],
    erase: bool,
    path: NodeArray,
    place: NodeArray,
) -> None:
    """Write the same path as `walk`, by the choices toward its target.

    Args:
        draws: See `walk`, as for `ends`, `erase`, `path` and `place`.
        entries: (nodes,) of `grid_choices.Choices`, toward the target.
        slots: See there.
    """
    if erase:
        walk_to_exits(draws, entries, slots, ends, place)
        if not used_up(draws):
            follow_exits(place, ends, path)
        return
    uniforms, taken = draws.uniforms, draws.taken
    node, target = np.uint64(ends[0]), np.uint64(ends[1])
    at, num, count = np.uint64(taken[0]), np.uint64(len(uniforms)), 1
    trail = np.empty(max(len(uniforms) - taken[0], 0) + 2, np.int32)
    trail[1] = node
    while node != target and at < num:
        part = np.uint64(uniforms[at] * np.float64(entries[node] & TOTAL))
        node = np.uint64(np.int64(node) + slots[np.uint64(entries[node] >> SHIFT) + part])
        at += ONE
        count += 1
        trail[count] = node
    taken[0] = at if node == target else num + ONE
    _write(trail, count, False, path, place)


@kernel
def walk_to_exits(
    draws: Block,
    entries: NDArray[np.uint32],
    slots: NDArray[np.int16],
    ends: tuple[int, int],
    exits: NodeArray,
) -> None:
    """Walk as `walk` does, and keep the last exit of every node only.

    Args:
        draws: See `walk`.
        entries: See `walk_by_choices`.
        slots: See there.
        ends: See `walk`.
        exits: (nodes,) written, see `follow_exits`.
    """
    uniforms, taken = draws.uniforms, draws.taken
    at, is_right = _walked(np.uint64(taken[0]), uniforms, entries, slots, ends, False, exits)
    if not is_right:
        at, _ = _walked(np.uint64(taken[0]), uniforms, entries, slots, ends, True, exits)
    taken[0] = at


@inlined
def _walked(
    at: np.uint64,
    uniforms: FloatArray,
    entries: NDArray[np.uint32],
    slots: NDArray[np.int16],
    ends: tuple[int, int],
    is_rounded: bool,
    exits: NodeArray,
) -> tuple[np.uint64, bool]:
    """Walk by uniform numbers from a place on, and keep the last exit of every node.

    Whole weights and their differences are exact, so the part of a product in front of the point
    decides. Products in whole numbers take half the time, but are not rounded as `walk` rounds
    them, which matters close below a whole number only.

    Args:
        at: The place.
        uniforms: (numbers,).
        entries: See `walk_by_choices`, as for `slots` and `ends`.
        is_rounded: Whether products are rounded.
        exits: (nodes,) written.

    Returns:
        The place behind the last number taken; behind the end of the block, if there were too few.
        Whether the walk is that of rounded products.
    """
    node, target, num = np.uint64(ends[0]), np.uint64(ends[1]), np.uint64(len(uniforms))
    nearest = np.int64(0)
    while node != target and at < num:
        entry, uniform = entries[node], uniforms[at]
        total = np.int64(entry & TOTAL)
        product = np.int64(uniform * 2.0**BITS) * total
        if is_rounded:
            part = np.int64(uniform * np.float64(total))
        else:
            part = product >> BITS
            nearest = max(nearest, product & REST)
        following = np.uint64(np.int64(node) + slots[np.uint64(entry >> SHIFT) + np.uint64(part)])
        exits[node] = following
        node = following
        at += ONE
    return (at if node == target else num + ONE), bool(is_rounded or nearest < REST - NEAR)


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
    ends: tuple[int, int],
    erase: bool,
    first: int,
    paths: NodeArray,
    place: NodeArray,
) -> int:
    """Write random paths between the same nodes, one after the other, each as `walk` does.

    Args:
        draws: See `walk`, as for `moves`, `ends`, `erase` and `place`.
        first: The path to begin with.
        paths: (paths, nodes + 1) written.

    Returns:
        How many paths are complete, those before `first` included: fewer than all if the draws did
        not suffice.
    """
    draws, moves, paths = borrowed((draws, moves, paths))
    for k in range(first, len(paths)):
        before = draws.taken[0]
        walk(draws, moves, ends, erase, paths[k], place)
        if used_up(draws):
            draws.taken[0] = before
            return k
    return len(paths)


@kernel
def _next_node(
    uniform: float,
    neighbours: NodeArray,
    potentials: FloatArray,
    steps: StepArray,
    node: int,
) -> int:
    """Choose one of a node's neighbours by a uniform number; the node itself if it has none.

    All moves are looked at without a branch, because no processor can foresee the permitted and the
    chosen ones.
    """
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
    _leap(nodes, count, path, place)


@kernel
def _leap(nodes: NodeArray, count: int, path: NodeArray, place: NodeArray) -> None:
    """Write a path without its loops: from the last place of a node it never comes back."""
    kept, k = 0, 1
    while k <= count:
        node = nodes[k]
        kept += 1
        path[kept] = node
        k = place[node] + 1
    path[0] = kept


@kernel
def _write(
    trail: NodeArray,
    count: int,
    erase: bool,
    path: NodeArray,
    place: NodeArray,
) -> None:
    """Write a walk of `count` nodes as a path.

    Args:
        trail: Nodes of the walk, from index 1 on.
        count: How many.
        erase: Whether loops are erased.
        path: Written.
        place: (nodes,) the last place of every node in the walk.
    """
    if erase:
        _leap(trail, count, path, place)
        return
    kept = 0
    for k in range(1, count + 1):
        if kept == len(path) - 1:  # full: a path without loops always fits
            erase_loops(path, kept, path, place)
            kept = path[0]
        kept += 1
        path[kept] = trail[k]
    path[0] = kept
