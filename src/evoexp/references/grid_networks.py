"""The permitted moves over a grid as a graph, as the references of grid paths take them."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.numeric.vectors import LANES
from evoexp.records import FloatArray, IntArray

TILE = 4  # moves to a node are filled up to a multiple


class Network(NamedTuple):
    """The permitted moves as edges.

    Attributes:
        tails: (edges,) node where each edge starts.
        heads: (edges,) node where it ends.
        lengths: (edges,) [cell].
        unsafeness: (nodes,).
        ends: Start and goal.
    """

    tails: np.ndarray
    heads: np.ndarray
    lengths: FloatArray
    unsafeness: FloatArray
    ends: tuple[int, int]


def network_of(problem: Any) -> Network:
    """Return the permitted moves of a problem of `grid_path_ga`."""
    own = problem.fields.grid
    tails, moves = np.nonzero(own.neighbours >= 0)
    lengths = np.sqrt(own.changes[moves].astype(np.float64))
    return Network(
        tails, own.neighbours[tails, moves], lengths, problem.fields.unsafeness, problem.ends
    )


class Arrivals(NamedTuple):
    """The permitted moves by the nodes where they end, filled up with moves of infinite length.

    Attributes:
        tails: (nodes, moves) node where each move starts; a multiple of `TILE` moves.
        lengths: (nodes, moves) times ε.
        unsafeness: (nodes,).
        ends: Start and goal.
    """

    tails: IntArray
    lengths: FloatArray
    unsafeness: FloatArray
    ends: tuple[int, int]


def arrivals_of(network: Network, epsilon: float) -> Arrivals:
    """Return the permitted moves by their ends; see `best_walk`."""
    order = np.argsort(network.heads, kind="stable")
    heads, count = network.heads[order], len(network.unsafeness)
    # place of each move among those that end at the same node
    rank = np.arange(len(heads)) - np.searchsorted(heads, heads)
    moves = -(-(int(rank.max()) + 1) // TILE) * TILE
    tails, lengths = np.zeros((count, moves), dtype=np.int64), np.full((count, moves), np.inf)
    tails[heads, rank] = network.tails[order]
    lengths[heads, rank] = epsilon * network.lengths[order]
    return Arrivals(tails, lengths, network.unsafeness, network.ends)


class Hops(NamedTuple):
    """Fewest moves between nodes; inf where no path leads.

    Attributes:
        from_start: (nodes,).
        to_goal: (nodes,).
    """

    from_start: FloatArray
    to_goal: FloatArray


def hops_of(network: Network) -> Hops:
    """Return the fewest moves from the start to every node, and from every node to the goal."""
    from scipy.sparse import csgraph, csr_array

    dijkstra: Any = csgraph.dijkstra
    count, (start, goal) = len(network.unsafeness), network.ends
    ones = np.ones(len(network.tails))
    graph: Any = csr_array((ones, (network.tails, network.heads)), shape=(count, count))
    return Hops(
        dijkstra(graph, indices=start, unweighted=True),
        dijkstra(graph.T, indices=goal, unweighted=True),
    )


class Shifts(NamedTuple):
    """The permitted moves by the difference of their nodes' indices, for vectors of nodes.

    Rows are `width` long: the nodes, and as many places behind them as vectors read; no move ends
    there.

    Attributes:
        differences: (moves,) index where each kind of move ends, less that where it starts;
            descending, so that nodes where moves start ascend.
        lengths: (moves, width) times ε, of the move that ends at each node; inf where there is
            none, and of moves from the goal or to the start.
        unsafeness: (nodes,).
        indices: (width,) 0, 1, 2, ….
        from_start: (width,) fewest moves from the start; inf where no path leads.
        to_goal: (width,) fewest moves to the goal.
        first: The first node where a move ends.
        last: The last one.
        ends: Start and goal.
    """

    differences: IntArray
    lengths: FloatArray
    unsafeness: FloatArray
    indices: FloatArray
    from_start: FloatArray
    to_goal: FloatArray
    first: int
    last: int
    ends: tuple[int, int]


def shifts_of(arrivals: Arrivals, hops: Hops) -> Shifts:
    """Return the permitted moves by their differences.

    Raises:
        ValueError: If a node of the first ones has no ring of nodes around it.
    """
    (start, goal), nodes = arrivals.ends, len(arrivals.unsafeness)
    heads, moves = np.nonzero(np.isfinite(arrivals.lengths))
    tails = arrivals.tails[heads, moves]
    lengths = np.where(tails == goal, np.inf, arrivals.lengths[heads, moves])
    differences = np.unique(heads - tails)[::-1].copy()
    first, last, farthest = int(heads.min()), int(heads.max()), int(np.abs(differences).max())
    if first < farthest:
        raise ValueError(f"node {first} is no node within a ring: moves go {farthest} nodes on")
    width = nodes + farthest + LANES
    table = np.full((len(differences), width), np.inf)
    table[np.searchsorted(-differences, tails - heads), heads] = lengths
    table[:, start] = np.inf
    from_start, to_goal = np.full((2, width), np.inf)
    from_start[:nodes], to_goal[:nodes] = hops.from_start, hops.to_goal
    return Shifts(
        differences,
        table,
        arrivals.unsafeness,
        np.arange(float(width)),
        from_start,
        to_goal,
        first,
        last,
        arrivals.ends,
    )
