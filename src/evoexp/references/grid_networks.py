"""The permitted moves over a grid as a graph, as the references of grid paths take them."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.records import FloatArray, IntArray

NO_MOVE, NO_WAY_BACK = -1, -2


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


class Moves(NamedTuple):
    """The permitted moves by the difference of their nodes' indices, for walks that never go back.

    Nodes side by side are looked at together: those from which one kind of move leads to them
    stand side by side, too.
    """

    differences: IntArray  # (kinds,) index where a move ends less that where it starts, descending
    backward: IntArray  # (kinds,) the kind that leads back; `NO_WAY_BACK` where there is none
    lengths: FloatArray  # (kinds,) times ε
    # (kinds, nodes) 0 where such a move ends at a node, else inf; none leads from the goal, or to
    # the start
    barred: FloatArray
    unsafeness: FloatArray  # (nodes,)
    first: int  # moves end at nodes from this one on
    stop: int  # and before this one
    ends: tuple[int, int]  # start and goal


def moves_of(arrivals: Arrivals) -> Moves:
    """Return the permitted moves by their differences.

    Raises:
        ValueError: If a node of the first ones has no ring of nodes around it.
    """
    (start, goal), nodes = arrivals.ends, len(arrivals.unsafeness)
    heads, moves = np.nonzero(np.isfinite(arrivals.lengths))
    tails, lengths = arrivals.tails[heads, moves], arrivals.lengths[heads, moves]
    differences, kinds = np.unique(tails - heads, return_inverse=True)
    differences = -differences
    first, stop, farthest = int(heads.min()), int(heads.max()) + 1, int(np.abs(differences).max())
    if first < farthest or stop + farthest > nodes:
        raise ValueError(f"nodes {first} to {stop - 1} are not within a ring of {farthest} nodes")
    by_kind = np.empty(len(differences))
    by_kind[kinds] = lengths
    backward = [np.flatnonzero(differences == -other) for other in differences]
    barred = np.full((len(differences), nodes), np.inf)
    allowed = (tails != goal) & (heads != start)
    barred[kinds[allowed], heads[allowed]] = 0.0
    return Moves(
        differences,
        np.array([found[0] if len(found) else NO_WAY_BACK for found in backward]),
        by_kind,
        barred,
        arrivals.unsafeness,
        first,
        stop,
        arrivals.ends,
    )
