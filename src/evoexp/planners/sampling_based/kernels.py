"""Kernels of straight edges between configurations: tests, trees that grow, paths made shorter.

All sums run joint by joint in order, so that every processor finds the same nearest node. Distances
are Euclidean, all joints alike [deg].
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray, IntArray

NODES = 64  # whose squared distances are computed together, as vectors
LANES = 8  # configurations that a collision model tests together
SLACK = 1e-6  # [-] by which an edge may be longer than a whole number of tested parts: rounding
# outcomes of a step toward a configuration (Kuffner & LaValle 2000, Fig. 2)
TRAPPED, ADVANCED, REACHED = range(3)


class Trees(NamedTuple):
    """Two trees of configurations, each reached from its parent along a free edge."""

    nodes: FloatArray  # (2, nq, room) [deg]
    parents: IntArray  # (2, room), −1: the root; nodes are younger than their parents
    counts: IntArray  # (2,) number of nodes


class FreeSpace(NamedTuple):
    """A collision model as kernels ask it, and how densely edges are tested."""

    num_free: Any  # kernel: how many of a batch are free before the first eight that are not
    tables: Any  # its first argument
    resolution: float  # greatest distance of configurations that are tested [deg]


@kernel
def nearest_node(nodes: FloatArray, count: int, q: FloatArray) -> int:
    """Return the node (a column of nodes (nq, room)) nearest to q, the first among equals."""
    best, least = 0, np.inf
    squares = np.empty(NODES)
    for first in range(0, count, NODES):
        size = min(NODES, count - first)
        for k in range(size):
            squares[k] = 0.0
        for joint in range(len(q)):
            at = q[joint]
            for k in range(size):
                apart = nodes[joint, first + k] - at
                squares[k] += apart * apart
        for k in range(size):
            if squares[k] < least:
                best, least = first + k, squares[k]
    return best


@kernel
def distance(one: FloatArray, two: FloatArray) -> float:
    """Return the distance of two configurations (nq,) [deg]; the same from either side."""
    total = 0.0
    for joint in range(len(one)):
        apart = one[joint] - two[joint]
        total += apart * apart
    return float(np.sqrt(total))


@kernel
def step_toward(q: FloatArray, target: FloatArray, step: float) -> FloatArray:
    """Return the configuration one step from q on the line to a target, or the target if nearer."""
    far = distance(q, target)
    if far <= step:
        return target.copy()
    share, new = step / far, np.empty(len(q))
    for joint in range(len(q)):
        new[joint] = q[joint] + share * (target[joint] - q[joint])
    return new


@kernel
def _num_parts(length: float, resolution: float) -> int:
    return max(1, int(np.ceil(length / resolution - SLACK)))


@kernel
def tested_configurations(one: FloatArray, two: FloatArray, resolution: float) -> FloatArray:
    """Return configurations at equal distances along an edge, its second end included.

    The configuration k of s is ((s − k) · one + k · two) / s, the same bits from either side. They
    come in an order in which each `LANES` neighbours are spread over the whole edge: a test that
    leaves at the first contact finds it early (Thomason et al. 2024). Returns (nq, s).
    """
    parts = _num_parts(distance(one, two), resolution)
    rounds = (parts + LANES - 1) // LANES
    out, column = np.empty((len(one), parts)), 0
    for first in range(rounds):
        for k in range(parts - first, 0, -rounds):  # the end is the first of all
            for joint in range(len(one)):
                between = ((parts - k) * one[joint] + k * two[joint]) / parts
                out[joint, column] = two[joint] if k == parts else between
            column += 1
    return out


@kernel
def edge_is_free(space: FreeSpace, one: FloatArray, two: FloatArray) -> tuple[bool, int]:
    """Return whether an edge is free where it is tested, and how many configurations were asked.

    They are asked for eight at a time, up to the first contact; its first end is known to be free.
    """
    q = DEGREE * tested_configurations(one, two, space.resolution)
    free = space.num_free(space.tables, q)
    return free == q.shape[1], min(q.shape[1], free + LANES)


@kernel
def _extended(
    space: FreeSpace, trees: Trees, tree: int, near: int, target: FloatArray, step: float
) -> tuple[Trees, int, int, int]:
    """EXTEND (Fig. 2) from a given node.

    Returns the trees, the node that is new (else the given one), the outcome, configurations asked
    for.
    """
    q = trees.nodes[tree, :, near].copy()
    new = step_toward(q, target, step)
    outcome = REACHED if (new == target).all() else ADVANCED
    if (new == q).all():  # nothing between them
        return trees, near, outcome if outcome == REACHED else TRAPPED, 0
    is_free, asked = edge_is_free(space, q, new)
    if not is_free:
        return trees, near, TRAPPED, asked
    index, room = trees.counts[tree], trees.parents.shape[1]
    if index == room:
        nodes = np.empty((2, len(q), 2 * room))
        parents = np.empty((2, 2 * room), dtype=np.int64)
        nodes[:, :, :room], parents[:, :room] = trees.nodes, trees.parents
        trees = Trees(nodes, parents, trees.counts)
    trees.nodes[tree, :, index], trees.parents[tree, index] = new, near
    trees.counts[tree] += 1
    return trees, index, outcome, asked


@kernel
def grow(
    space: FreeSpace, trees: Trees, tree: int, target: FloatArray, step: float
) -> tuple[Trees, int, int, int]:
    """Let one tree step toward a configuration, and the other connect to its end (Fig. 5).

    Returns the trees, in arrays of twice the size where one had no room left; where they met, the
    node of the tree that stepped and that of the other one, the same configuration, else −1 for the
    latter; and how many configurations were asked for.
    """
    near = nearest_node(trees.nodes[tree], trees.counts[tree], target)
    trees, end, outcome, asked = _extended(space, trees, tree, near, target, step)
    if outcome == TRAPPED:
        return trees, end, -1, asked
    other, new = 1 - tree, trees.nodes[tree, :, end].copy()
    met, outcome = nearest_node(trees.nodes[other], trees.counts[other], new), ADVANCED
    while outcome == ADVANCED:  # CONNECT
        trees, met, outcome, more = _extended(space, trees, other, met, new, step)
        asked += more
    return trees, end, met if outcome == REACHED else -1, asked


@kernel
def lengths_along(path: FloatArray) -> FloatArray:
    """Return the length of a path up to each of its nodes, (nodes,), of a path (nodes, nq)."""
    lengths = np.zeros(len(path))
    for k in range(1, len(path)):
        lengths[k] = lengths[k - 1] + distance(path[k - 1], path[k])
    return lengths


@kernel
def place_on_path(
    path: FloatArray, lengths: FloatArray, at: float, resolution: float
) -> tuple[int, FloatArray]:
    """Return the tested configuration next to a length along a path: its segment, and itself.

    What is left of a segment on either side of it is tested at those of the segment's own
    configurations that lie there, since both parts are divided as densely as the whole.
    """
    k = 0
    while k < len(path) - 2 and lengths[k + 1] <= at:
        k += 1
    long = lengths[k + 1] - lengths[k]
    parts = _num_parts(long, resolution)
    share = (at - lengths[k]) / long if long > 0.0 else 0.0
    part = min(int(share * parts + 0.5), parts)
    q = np.empty(path.shape[1])
    for joint in range(len(q)):
        between = ((parts - part) * path[k, joint] + part * path[k + 1, joint]) / parts
        q[joint] = between if 0 < part < parts else path[k + part // parts, joint]  # a node itself
    return k, q


@kernel
def shortcuts(
    space: FreeSpace, path: FloatArray, ends: FloatArray
) -> tuple[FloatArray, IntArray, FloatArray, int]:
    """Try straight lines between places of a path (nodes, nq), one after the other.

    The places (lines, 2) are shares of its length; a line begins and ends at the tested
    configurations next to them. Returns all nodes of the shorter paths, path by path; how many
    nodes each has; the length after each line, (lines,); configurations asked for.
    """
    most = len(path) + 2 * len(ends)  # nodes: a line adds two
    found, count, asked = np.empty((most * len(ends), path.shape[1])), 0, 0
    sizes, paths, after = np.empty(len(ends), dtype=np.int64), 0, np.empty(len(ends))
    lengths = lengths_along(path)
    for line in range(len(ends)):
        after[line] = lengths[-1]
        places = np.sort(ends[line] * lengths[-1])
        first, one = place_on_path(path, lengths, places[0], space.resolution)
        last, two = place_on_path(path, lengths, places[1], space.resolution)
        if first == last:  # the line between them is already part of the path
            continue
        new = _with_line(path, first, one, last, two)
        shorter = lengths_along(new)
        if shorter[-1] < lengths[-1]:
            is_free, more = edge_is_free(space, one, two)
            asked += more
            if is_free:
                path, lengths, after[line] = new, shorter, shorter[-1]
                found[count : count + len(new)] = new
                count, sizes[paths], paths = count + len(new), len(new), paths + 1
    return found[:count].copy(), sizes[:paths].copy(), after, asked


@kernel
def _with_line(
    path: FloatArray, first: int, one: FloatArray, last: int, two: FloatArray
) -> FloatArray:
    """Return a path (nodes, nq) with a line from its segment `first` to its segment `last`."""
    new, count = np.empty((len(path) + 2, path.shape[1])), 0
    for k in range(len(path) + 2 - (last - first)):
        if k <= first:
            q = path[k]
        elif k <= first + 2:
            q = one if k == first + 1 else two
        else:
            q = path[k + last - first - 2]
        if count == 0 or (new[count - 1] != q).any():  # a node of the path stays once
            new[count] = q
            count += 1
    return new[:count].copy()
