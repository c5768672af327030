"""The permitted moves over a grid as a graph, as the references of grid paths take them."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.vectors import LANES
from evoexp.records import FloatArray, IntArray

TILE = 4  # moves to a node are filled up to a multiple
NO_MOVE, NO_WAY_BACK = -1, -2
UNREACHED = 2**31  # more moves than any path has


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

    Nodes are counted in blocks of `LANES`, from the first one where a move ends. The last block may
    reach beyond the nodes; no move ends there.

    Attributes:
        differences: (moves,) index where each kind of move ends, less that where it starts;
            descending, so that nodes where moves start ascend.
        backward: (moves,) the kind of move that leads back; `NO_WAY_BACK` where there is none.
        lengths: (moves,) times ε.
        permitted: (blocks · moves,) uint8; bit k of entry block · moves + move tells whether such a
            move ends at node k of the block. None leads from the goal or to the start.
        unsafeness: (nodes,).
        from_start: (blocks,) fewest moves from the start to a node of the block; `UNREACHED` where
            no path leads.
        to_goal: (blocks,) fewest moves from a node of the block to the goal.
        first: The first node of the first block.
        width: Of a row of numbers for all nodes: so many vectors may be read.
        ends: Start and goal.
    """

    differences: IntArray
    backward: IntArray
    lengths: FloatArray
    permitted: NDArray[np.uint8]
    unsafeness: FloatArray
    from_start: IntArray
    to_goal: IntArray
    first: int
    width: int
    ends: tuple[int, int]


def shifts_of(arrivals: Arrivals, hops: Hops) -> Shifts:
    """Return the permitted moves by their differences.

    Raises:
        ValueError: If a node of the first ones has no ring of nodes around it.
    """
    (start, goal), nodes = arrivals.ends, len(arrivals.unsafeness)
    heads, moves = np.nonzero(np.isfinite(arrivals.lengths))
    tails, lengths = arrivals.tails[heads, moves], arrivals.lengths[heads, moves]
    differences, kinds = np.unique(tails - heads, return_inverse=True)
    differences = -differences
    first, last, farthest = int(heads.min()), int(heads.max()), int(np.abs(differences).max())
    if first < farthest:
        raise ValueError(f"node {first} is no node within a ring: moves go {farthest} nodes on")
    by_kind = np.empty(len(differences))
    by_kind[kinds] = lengths
    backward = [np.flatnonzero(differences == -other) for other in differences]
    # which moves end at the nodes of each block
    blocks = (last - first) // LANES + 1
    ends_here = np.zeros((blocks * LANES, len(differences)), dtype=bool)
    allowed = (tails != goal) & (heads != start)
    ends_here[heads[allowed] - first, kinds[allowed]] = True
    bits = np.packbits(ends_here.reshape(blocks, LANES, -1), axis=1, bitorder="little")
    return Shifts(
        differences,
        np.array([found[0] if len(found) else NO_WAY_BACK for found in backward]),
        by_kind,
        bits.ravel(),
        arrivals.unsafeness,
        _least_of_blocks(hops.from_start, first, blocks),
        _least_of_blocks(hops.to_goal, first, blocks),
        first,
        max(nodes, first + blocks * LANES) + farthest,
        arrivals.ends,
    )


def _least_of_blocks(hops: FloatArray, first: int, blocks: int) -> IntArray:
    """Return the fewest moves of the nodes of each block, (blocks,)."""
    count = blocks * LANES
    own = hops[first : first + count]
    filled = np.pad(own, (0, count - len(own)), constant_values=np.inf)
    least = filled.reshape(blocks, LANES).min(axis=1)
    return np.where(np.isfinite(least), least, UNREACHED).astype(np.int64)
