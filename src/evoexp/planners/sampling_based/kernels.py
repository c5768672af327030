"""Kernels of trees of configurations: nearest node, steps, tested configurations, path lengths.

All sums run joint by joint in order, so that every processor finds the same nearest node. Distances
are Euclidean, all joints alike [deg].
"""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray

NODES = 64
"""Nodes whose squared distances are computed together, as vectors."""

LANES = 8
"""Configurations that a collision model tests together."""

SLACK = 1e-6
"""[-] by which an edge may be longer than a whole number of tested parts, for rounding's sake."""


@kernel
def nearest_node(nodes: FloatArray, count: int, q: FloatArray) -> int:
    """Return the node that is nearest to q, the first among equals.

    Args:
        nodes: (nq, room) [deg], contiguous; nodes are columns.
        count: Number of nodes, at least 1.
        q: (nq,) [deg].
    """
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
    """Return the configuration one step from q on the line to a target, or the target if nearer.

    Args:
        q: (nq,) [deg].
        target: (nq,) [deg].
        step: Length of the step [deg].
    """
    far = distance(q, target)
    if far <= step:
        return target.copy()
    share, new = step / far, np.empty(len(q))
    for joint in range(len(q)):
        new[joint] = q[joint] + share * (target[joint] - q[joint])
    return new


@kernel
def _num_parts(length: float, resolution: float) -> int:
    """Return the number of equal parts into which tested configurations divide an edge."""
    return max(1, int(np.ceil(length / resolution - SLACK)))


@kernel
def tested_configurations(one: FloatArray, two: FloatArray, resolution: float) -> FloatArray:
    """Return configurations at equal distances along an edge, its second end included.

    The configuration k of s is ((s − k) · one + k · two) / s, the same bits from either side. They
    come in an order in which each `LANES` neighbours are spread over the whole edge: a test that
    leaves at the first contact finds it early (Thomason et al. 2024).

    Args:
        one: (nq,) one end [deg].
        two: (nq,) the other end.
        resolution: Greatest distance of neighbours [deg].

    Returns:
        (nq, s).
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

    Args:
        path: (nodes, nq), two nodes at least.
        lengths: (nodes,) of `lengths_along`.
        at: Length from the start.
        resolution: Greatest distance of tested neighbours [deg].
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
