"""The permitted moves of a grid, and the best walks over them by dynamic programming.

A walk may pass nodes again. For a given number N of nodes its cost ε D + (λ / N) ΣS (Chen & Zalzala
1995, Eqs. 1 to 3) is a sum over moves and nodes, so dynamic programming over (node, number of
nodes) finds the least one. A path without loops is a walk, and costs no less.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray


class Network(NamedTuple):
    """The permitted moves as edges."""

    tails: np.ndarray  # (edges,) node where each edge starts
    heads: np.ndarray  # (edges,) node where it ends
    lengths: FloatArray  # (edges,) [cell]
    unsafeness: FloatArray  # (nodes,)
    ends: tuple[int, int]  # start and goal


def network_of(problem: Any) -> Network:
    """Return the permitted moves of a problem of `grid_path_ga`."""
    own = problem.fields.grid
    tails, moves = np.nonzero(own.neighbours >= 0)
    lengths = np.sqrt(own.changes[moves].astype(np.float64))
    return Network(
        tails, own.neighbours[tails, moves], lengths, problem.fields.unsafeness, problem.ends
    )


class Arrivals(NamedTuple):
    """The permitted moves by the nodes where they end, filled up with moves of infinite length."""

    tails: IntArray  # (nodes, moves) node where each move starts
    lengths: FloatArray  # (nodes, moves) times ε
    unsafeness: FloatArray  # (nodes,)
    ends: tuple[int, int]  # start and goal


def arrivals_of(network: Network, epsilon: float) -> Arrivals:
    """Return the permitted moves by their ends; see `best_walk`."""
    order = np.argsort(network.heads, kind="stable")
    heads, count = network.heads[order], len(network.unsafeness)
    # place of each move among those that end at the same node
    rank = np.arange(len(heads)) - np.searchsorted(heads, heads)
    moves = int(rank.max()) + 1
    tails, lengths = np.zeros((count, moves), dtype=np.int64), np.full((count, moves), np.inf)
    tails[heads, rank] = network.tails[order]
    lengths[heads, rank] = epsilon * network.lengths[order]
    return Arrivals(tails, lengths, network.unsafeness, network.ends)


@kernel
def best_walks(arrivals: Arrivals, weights: FloatArray, count: int) -> tuple[FloatArray, IntArray]:
    """Return the least costs of walks of 0 … `count` nodes, and the best walk of `count` nodes.

    Args:
        weights: (nodes,) cost of passing a node.
        count: Most nodes.

    Returns:
        (count + 1,), inf where there is no walk from two nodes on; (count,).
    """
    tails, lengths, ends = arrivals.tails, arrivals.lengths, arrivals.ends
    num = len(weights)
    costs, before = np.full(count + 1, np.inf), np.zeros((count + 1, num), dtype=np.int32)
    present, following = np.full(num, np.inf), np.full(num, np.inf)
    present[ends[0]] = weights[ends[0]]
    # the best way to every node by k nodes, and the node before on it
    for k in range(2, count + 1):
        for node in range(num):
            least = np.inf
            for move in range(tails.shape[1]):
                cost = present[tails[node, move]] + lengths[node, move]
                if cost < least:
                    least, before[k, node] = cost, tails[node, move]
            following[node] = least + weights[node]
        present, following = following, present
        costs[k] = present[ends[1]]
    # the walk, from the goal back
    walk = np.empty(count, dtype=np.int64)
    walk[count - 1] = ends[1]
    for k in range(count, 1, -1):
        walk[k - 2] = before[k, walk[k - 1]]
    return costs, walk
