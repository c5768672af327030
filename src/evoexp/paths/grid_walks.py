"""Paths over a grid: random walks toward a target, loop erasure, length.

A path is written into one row of a table: its number of nodes, then their indices. Its first node is the start, its
last the goal. Which nodes a path has is looked up in `place` (nodes,): a node is in the path if the path has it at its
place; so nothing needs to be cleared between paths.

Uniform numbers come out of a block: `draws` is the block and, as an array of one number, how many were taken. How
many a walk takes is not known before; if a block is used up, whatever was made with it is to be made again with a
longer one.
"""

import numpy as np

from evoexp.numerics import borrowed, kernel
from evoexp.records import FloatArray

LANES = 4  # walks at a time
MAX_SLOTS = 256  # of a node in a table of choices


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
def walk(draws, moves, ends, erase, path, place):  # type: ignore[no-untyped-def]
    """Write a random path: every step draws one of the permitted moves, weighted toward the target.

    A neighbour of potential U has the weight U_max − U + 1, U_max being the greatest among the neighbours (Chen &
    Zalzala 1995, section 2.3: "a neighbouring node which has a lower distance value to the goal, has more chance").

    Args:
        draws: One number is taken per step; if they are used up, the walk breaks off.
        moves: Neighbours (nodes, moves), see `grids.Grid`; potential after so many steps of the front from the target
            (≥ greatest number of steps + 1,); those steps (nodes,), see `grids.front`.
        ends: Indices of the node it starts at and of the target, which the front must reach.
        erase: Whether loops are erased.
        path: (≥ nodes + 1,) written; see above.
        place: (nodes,) scratch.
    """
    uniforms, taken = draws
    neighbours, potentials, steps = moves
    node, target = ends
    at, num = taken[0], len(uniforms)
    trail = np.empty(num - min(at, num) + 2, np.int32)
    count = 1
    trail[1] = node
    place[node] = 1
    while node != target and at < num:
        node = _next_node(uniforms[at], neighbours, potentials, steps, node)
        at += 1
        count += 1
        trail[count] = node
        place[node] = count
    taken[0] = at if node == target else num + 1
    _write(trail, count, erase, path, place)


@kernel
def walk_all(uniforms, moves, choices, ends, erase, first, paths):  # type: ignore[no-untyped-def]
    """Write random paths, as `walk` does, all between the same nodes: some at a time, one step of each after the other.

    A step waits for the one before it, which says where to look; meanwhile the other walks take theirs.

    Args:
        uniforms: One number is taken per step.
        moves: See `walk`.
        choices: What `choice_table` made of them.
        ends: See `walk`.
        erase: Whether loops are erased.
        first: The path to begin with.
        paths: (paths, nodes + 1) written.

    Returns:
        How many paths are complete, those before `first` included, and how many numbers it took. If they are used up,
        it is to go on there with more of them, the rest of these being the first.
    """
    uniforms, moves, choices, paths = borrowed((uniforms, moves, choices, paths))
    neighbours, potentials, steps = moves
    totals, slots = choices
    start, target = np.uint64(ends[0]), np.uint64(ends[1])  # without a sign, as an index might count from the end
    walkers, counts = np.empty(LANES, np.uint64), np.empty(LANES, np.int64)
    trails = np.empty((LANES, len(uniforms) + 2), np.int32)
    places = np.empty((LANES, len(neighbours)), np.int32)
    taken = 0
    while first < len(paths):
        before, walking = taken, start != target
        for lane in range(LANES):
            walkers[lane] = start if first + lane < len(paths) else target
            counts[lane] = 1
            trails[lane, 1] = walkers[lane]
            places[lane, walkers[lane]] = 1
        while walking:
            if taken + LANES > len(uniforms):
                return first, before
            walking = False
            for lane in range(LANES):  # who has arrived stays, without a branch that would be guessed wrong
                node, count = walkers[lane], counts[lane]
                goes = node != target
                if len(slots) > 0:
                    chosen = np.uint64(slots[node, np.uint64(uniforms[taken] * totals[node])])
                else:
                    chosen = np.uint64(_next_node(uniforms[taken], neighbours, potentials, steps, np.int64(node)))
                node = chosen if goes else node
                taken += goes
                count += goes
                trails[lane, count] = node
                places[lane, node] = count
                walkers[lane], counts[lane] = node, count
                walking |= goes
        for lane in range(min(LANES, len(paths) - first)):
            _write(trails[lane], counts[lane], erase, paths[first + lane], places[lane])
        first = min(first + LANES, len(paths))
    return first, taken


def choice_table(neighbours: np.ndarray, potentials: FloatArray, steps: np.ndarray) -> tuple[FloatArray, np.ndarray]:
    """Return the choices of walks to one target at every node, for many walks: every move as often as it weighs.

    Args:
        neighbours: (nodes, moves), see `grids.Grid`.
        potentials: See `walk`.
        steps: (nodes,) of the front from the target.

    Returns:
        Sums of the weights (nodes,), and where such a move leads to, (nodes, greatest sum). The latter is empty if the
        weights are no whole numbers, or if the table would be large; then moves are to be weighed at every step.
    """
    permitted = neighbours >= 0
    potential = np.where(permitted, potentials[steps[neighbours]], -np.inf)
    greatest = np.maximum(potential.max(axis=1, keepdims=True), 0.0)
    weights = np.where(permitted, greatest - potential + 1.0, 0.0)
    totals = weights.sum(axis=1)
    whole = bool((weights == np.floor(weights)).all())
    if not whole or totals.max() > MAX_SLOTS or len(totals) > 2**15:
        return totals, np.empty((0, 0), dtype=np.int16)
    slot = np.arange(int(totals.max()))
    move = np.zeros((len(totals), len(slot)), dtype=np.int64)
    for ends in np.cumsum(weights, axis=1).T[:-1]:
        move += slot >= ends[:, None]
    return totals, np.take_along_axis(neighbours, move, axis=1).astype(np.int16)


@kernel
def _next_node(uniform, neighbours, potentials, steps, node):  # type: ignore[no-untyped-def]
    """Choose one of a node's neighbours by a uniform number; the node itself if it has none.

    All moves are looked at, without a branch: which ones are permitted or chosen no processor can foresee.
    """
    greatest, total, count = 0.0, 0.0, 0
    for move in range(neighbours.shape[1]):
        other = neighbours[node, move]
        permitted = other >= 0
        potential = potentials[steps[other if permitted else node]]
        greatest = max(greatest, potential if permitted else 0.0)
        total += potential if permitted else 0.0
        count += permitted
    left, chosen = uniform * (count * (greatest + 1.0) - total), node
    for move in range(neighbours.shape[1]):
        other = neighbours[node, move]
        permitted = other >= 0
        weight = greatest - potentials[steps[other if permitted else node]] + 1.0
        chosen = other if permitted & (left >= 0.0) else chosen
        left -= weight if permitted else 0.0
    return chosen


@kernel
def erase_loops(nodes, count, path, place):  # type: ignore[no-untyped-def]
    """Write a path without its loops: wherever it comes back to a node, what lies between is left out.

    Args:
        nodes: (≥ count + 1,) a path, its nodes from index 1 on; may be `path` itself.
        count: Number of its nodes.
        path: (≥ nodes + 1,) written; so is its number of nodes.
        place: (nodes,) scratch.
    """
    for k in range(1, count + 1):
        place[nodes[k]] = k
    _leap(nodes, count, path, place)


@kernel
def _leap(nodes, count, path, place):  # type: ignore[no-untyped-def]
    """Write a path without its loops, by the last place of every node: from there it never comes back."""
    kept, k = 0, 1
    while k <= count:
        node = nodes[k]
        kept += 1
        path[kept] = node
        k = place[node] + 1
    path[0] = kept


@kernel
def _write(trail, count, erase, path, place):  # type: ignore[no-untyped-def]
    """Write a walk of `count` nodes as a path; `place` tells the last place of every node."""
    if erase:
        _leap(trail, count, path, place)
        return
    kept = 0
    for k in range(1, count + 1):
        if kept == len(path) - 1:  # full: what has no loops fits always
            erase_loops(path, kept, path, place)
            kept = path[0]
        kept += 1
        path[kept] = trail[k]
    path[0] = kept


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
