"""Paths over a grid: random walks toward a target, loop erasure, length.

A path is written into one row of a table: its number of nodes, then their indices. Its first node
is the start, its last the goal. `place` (nodes,) tells the nodes of a path: a node belongs to it if
the path has that node at its place; so nothing needs to be cleared between paths.
"""

import numpy as np

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.random_stream import Block, used_up
from evoexp.paths.grids import Moves, NodeArray, StepArray
from evoexp.records import FloatArray


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


@kernel
def measure_path(path: NodeArray, kinds: NodeArray, unsafeness: FloatArray) -> tuple[float, float]:
    """Return length and mean unsafeness of a path (Chen & Zalzala 1995, Eqs. 2 and 3).

    Moves of each kind are counted, so the length does not depend on their order.

    Args:
        path: See above.
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
