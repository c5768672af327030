"""Paths over a grid: random walks toward a target, loop erasure, length.

A path is written into one row of a table: its number of nodes, then their indices. Its first node is the start, its
last the goal. Which nodes a path has is looked up in `place` (nodes,): a node is in the path if the path has it at its
place; so nothing needs to be cleared between paths.

Uniform numbers come out of a block: `draws` is the block and, as an array of one number, how many were taken. How
many a walk takes is not known before; if a block is used up, whatever was made with it is to be made again with a
longer one.
"""

import numpy as np

from evoexp.numerics import kernel
from evoexp.records import FloatArray


@kernel
def draw(draws):  # type: ignore[no-untyped-def]
    """Return the next uniform number of a block; 0 behind its end."""
    uniforms, taken = draws
    taken[0] += 1
    return uniforms[taken[0] - 1] if taken[0] <= len(uniforms) else 0.0


@kernel
def used_up(draws):  # type: ignore[no-untyped-def]
    """Return whether more numbers were asked for than the block has."""
    return draws[1][0] > len(draws[0])


@kernel
def draw_index(draws, count):  # type: ignore[no-untyped-def]
    """Return one of 0 … count − 1."""
    return min(int(draw(draws) * count), count - 1)


@kernel
def walk(draws, neighbours, potentials, steps, choices, ends, erase, path, place):  # type: ignore[no-untyped-def]
    """Write a random path: every step draws one of the permitted moves, weighted toward the target.

    A neighbour of potential U has the weight U_max − U + 1, U_max being the greatest among the neighbours (Chen &
    Zalzala 1995, section 2.3: "a neighbouring node which has a lower distance value to the goal, has more chance").

    Args:
        draws: One number is taken per step; if they are used up, the walk breaks off.
        neighbours: (nodes, moves), see `grids.Grid`.
        potentials: (≥ greatest number of steps + 1,) potential after so many steps of the front from the target.
        steps: (nodes,) of the front from the target, see `grids.front`.
        choices: What `choice_table` made of all that, or empty arrays.
        ends: Indices of the node it starts at and of the target, which the front must reach.
        erase: Whether loops are erased as they arise.
        path: (≥ nodes + 1,) written; see above.
        place: (nodes,) scratch.
    """
    uniforms, taken = draws
    added, targets = choices
    node, target = ends
    at, num = taken[0], len(uniforms)
    path[1], count = node, 1
    place[node] = 1
    while node != target and at < num:
        if len(added) > 0:
            node = _choose(uniforms[at], added, targets, node)
        else:
            node = _next_node(uniforms[at], neighbours, potentials, steps, node)
        at += 1
        if not erase and count == len(path) - 1:  # full: what has no loops fits always
            count = erase_loops(path, count, path, place)
        known = place[node]
        looked = erase & (known >= 1) & (known <= count)
        known = known if looked else 1
        count = known if looked & (path[known] == node) else count + 1  # a branch here would be guessed wrong often
        path[count] = node
        place[node] = count
    taken[0] = at if node == target else num + 1
    path[0] = count


def choice_table(neighbours: np.ndarray, potentials: FloatArray, steps: np.ndarray) -> tuple[FloatArray, np.ndarray]:
    """Return the choices of walks to one target at every node, which many walks share.

    Args:
        neighbours: (nodes, moves), see `grids.Grid`.
        potentials: See `walk`.
        steps: (nodes,) of the front from the target.

    Returns:
        Weights of the moves added up, and where each move leads to, (nodes, moves); a move that is not permitted adds
        nothing and leads where the one before it does.
    """
    permitted = neighbours >= 0
    potential = np.where(permitted, potentials[steps[neighbours]], -np.inf)
    greatest = np.maximum(potential.max(axis=1, keepdims=True), 0.0)
    weights = np.where(permitted, greatest - potential + 1.0, 0.0)
    targets = np.where(permitted, neighbours, -1)
    before = np.arange(len(targets))
    for move in range(targets.shape[1]):
        targets[:, move] = before = np.where(permitted[:, move], targets[:, move], before)
    return np.cumsum(weights, axis=1), targets.astype(np.int32)


@kernel
def _choose(uniform, added, targets, node):  # type: ignore[no-untyped-def]
    """Choose one of a node's neighbours as `_next_node` does, from a `choice_table`.

    All moves are compared: where to stop is what no processor can foresee, and a wrong guess takes longer.
    """
    last = added.shape[1] - 1
    place, move = uniform * added[node, last], 0
    for other in range(last):
        move += added[node, other] <= place
    return targets[node, move]


@kernel
def _next_node(uniform, neighbours, potentials, steps, node):  # type: ignore[no-untyped-def]
    """Choose one of a node's neighbours by a uniform number; the node itself if it has none."""
    greatest, total, count = 0.0, 0.0, 0
    for move in range(neighbours.shape[1]):
        other = neighbours[node, move]
        if other >= 0:
            potential = potentials[steps[other]]
            greatest = max(greatest, potential)
            total += potential
            count += 1
    left, chosen = uniform * (count * (greatest + 1.0) - total), node
    for move in range(neighbours.shape[1]):
        other = neighbours[node, move]
        if other >= 0 and left >= 0.0:
            chosen = other
            left -= greatest - potentials[steps[other]] + 1.0
    return chosen


@kernel
def erase_loops(nodes, count, path, place):  # type: ignore[no-untyped-def]
    """Write a path without its loops: wherever it comes back to a node, what lies between is left out.

    Args:
        nodes: (≥ count + 1,) a path, its nodes from index 1 on; may be `path` itself.
        count: Number of its nodes.
        path: (≥ nodes + 1,) written; so is its number of nodes.
        place: (nodes,) scratch.

    Returns:
        The number of nodes left.
    """
    kept = 0
    for k in range(1, count + 1):
        node = nodes[k]
        known = place[node]
        if 1 <= known <= kept and path[known] == node:
            kept = known
        else:
            kept += 1
            path[kept] = node
            place[node] = kept
    path[0] = kept
    return kept


@kernel
def measure_path(path, kinds, unsafeness):  # type: ignore[no-untyped-def]
    """Return length and mean unsafeness of a path (Chen & Zalzala 1995, Eqs. 2 and 3).

    Moves of each kind are counted, so the length does not depend on their order.

    Args:
        path: See above.
        kinds: See `grids.Grid`.
        unsafeness: (nodes,).

    Returns:
        D [cell], S.
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
