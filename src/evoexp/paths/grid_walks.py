"""Paths over a grid: random walks toward a target, loop erasure, length.

A path is written into one row of a table: its number of nodes, then their indices. Its first node
is the start, its last the goal. `place` (nodes,) tells the nodes of a path: a node belongs to it if
the path has that node at its place; so nothing needs to be cleared between paths.
"""

import numpy as np
from numpy.typing import NDArray

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


MOST_MOVES = 8  # of a node, for weights packed into one word
HEAVIEST = 15  # weight: eight of them stay below 128
_BYTES = np.uint64(0x0101010101010101)
_HIGH_BITS = np.uint64(0x8080808080808080)


@kernel
def pack_weights(
    neighbours: NodeArray, potentials: FloatArray, fronts: StepArray, out: NDArray[np.uint64]
) -> bool:
    """Write the weights of all moves toward all targets, see `walk`: one byte per move.

    Args:
        neighbours: (nodes, at most `MOST_MOVES`), see `grids.Grid`.
        potentials: See `grids.Moves`.
        fronts: (targets, nodes) steps to every node from each target.
        out: (targets, nodes) written; the first move's weight is the lowest byte.

    Returns:
        False if a weight is no whole number up to `HEAVIEST`; then `out` is not complete.
    """
    neighbours, potentials, fronts, out = borrowed((neighbours, potentials, fronts, out))
    for target in range(len(fronts)):
        for node in range(len(neighbours)):
            greatest, word = 0.0, np.uint64(0)
            for move in range(neighbours.shape[1]):
                if neighbours[node, move] >= 0:
                    greatest = max(greatest, potentials[fronts[target, neighbours[node, move]]])
            for move in range(neighbours.shape[1]):
                if neighbours[node, move] >= 0:
                    weight = greatest - potentials[fronts[target, neighbours[node, move]]] + 1.0
                    if weight > HEAVIEST or weight != np.floor(weight):
                        return False
                    word |= np.uint64(int(weight)) << np.uint64(8 * move)
            out[target, node] = word
    return True


@kernel
def walk_by_weights(
    draws: Block,
    neighbours: NodeArray,
    weights: NDArray[np.uint64],
    ends: tuple[int, int],
    erase: bool,
    path: NodeArray,
    place: NodeArray,
) -> None:
    """Write the same path as `walk`, by weights (nodes,) of `pack_weights` toward its target.

    Whole weights and their differences are exact, so the part of a uniform number in front of the
    point decides. The sums of bytes up to each move are those of one multiplication; the move is
    the number of sums that do not pass that part.
    """
    uniforms, taken = draws.uniforms, draws.taken
    node, target = np.uint64(ends[0]), np.uint64(ends[1])
    at, num, count = taken[0], len(uniforms), 1
    trail = np.empty(num - min(at, num) + 2, np.int32)
    trail[1] = node
    place[node] = 1
    while node != target and at < num:
        sums = weights[node] * _BYTES
        total = sums >> np.uint64(56)
        part = np.uint64(uniforms[at] * np.float64(total))
        passed = ((part * _BYTES | _HIGH_BITS) - sums) & _HIGH_BITS
        move = (passed >> np.uint64(7)) * _BYTES >> np.uint64(56)
        # a node without a neighbour stays where it is
        node = np.uint64(neighbours[node, move]) if total > np.uint64(0) else node
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
