"""Bounds of the best path over a grid: walks and a relaxation from below, exchanges from above.

The relaxation is Lagrangian. Let a path without loops have N nodes. It passes every node v at most
once, so for any multipliers π ≥ 0 the sum of π over its nodes is at most Σπ_v, and for its cost
(Chen & Zalzala 1995, Eqs. 1 to 3) holds

    ε D + (λ / N) ΣS  ≥  ε D + Σ_i (λ S_i / N + π_i) − Σ_v π_v  ≥  L_N(π),

where i runs over the path's nodes, v over all nodes, and L_N(π) is the least value of the middle
term over all walks of N nodes. The middle term is a sum over moves and nodes, so dynamic
programming over (node, number of nodes) finds it. Walks of n ≤ N nodes at the weight λ / N cost no
more than at their own λ / n: one pass bounds the paths of all these numbers at once.

The multipliers are raised at nodes that the best walk passes more than once, and lowered at nodes
that it leaves out, by subgradient steps of Polyak's length (Held & Karp 1971). Any π gives a true
bound, however good the steps are. Each walk without its loops is a path.

Exchanges improve a path: a run of nodes between two nodes that it keeps, perhaps none, is replaced
by another one that permitted moves join to both and whose nodes the path does not pass elsewhere.
So every result is a valid path without loops.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray

SMALLEST_GAIN = 1e-10  # of a cost: less may be rounding
PATIENCE = 10  # steps without a better bound after which they are halved
SHORTEST_STEP = 1.0 / 64.0  # of Polyak's length, at which a number of nodes is left
SMALL = 1e-9  # of the known cost: less is no gain


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


def relaxed(
    arrivals: Arrivals, lam: float, known: float, enough: float, floors: FloatArray, most_steps: int
) -> list[IntArray]:
    """Raise bounds below the costs of all paths without loops, by their number of nodes.

    Args:
        lam: λ.
        known: Cost of some path; steps are as long as if it were the optimum.
        enough: A bound as great is not raised any further.
        floors: (numbers of nodes, from 0) bounds that are known already; raised.
        most_steps: Per number of nodes.

    Returns:
        Paths that were found on the way, without loops.
    """
    multipliers, paths = np.zeros(len(arrivals.unsafeness)), dict[tuple[int, ...], None]()
    # from the greatest number down: the multipliers of one are good ones of the next
    for number in range(len(floors) - 1, 1, -1):
        length, since, best, best_multipliers = 1.0, 0, -np.inf, multipliers
        for _ in range(most_steps):
            if floors[number] >= enough or length < SHORTEST_STEP:
                break
            weights = lam / number * arrivals.unsafeness + multipliers
            costs, walk = best_walks(arrivals, weights, number)
            # L_N(π), and bounds of smaller numbers
            costs -= multipliers.sum()
            floors[: number + 1] = np.maximum(floors[: number + 1], costs)
            if not np.isfinite(costs[number]):
                break
            paths[without_loops(walk)] = None
            # shorter steps, from the best multipliers, where nothing is gained
            since += 1
            if costs[number] > best + SMALL * abs(known):
                best, since, best_multipliers = float(costs[number]), 0, multipliers
            elif since == PATIENCE:
                length, since, multipliers = 0.5 * length, 0, best_multipliers
            # a step along the excess of visits
            excess = np.bincount(walk, minlength=len(multipliers)) - 1.0
            excess[(excess < 0.0) & (multipliers == 0.0)] = 0.0
            square = float((excess * excess).sum())
            if square == 0.0:
                break
            step = length * max(known - costs[number], SMALL * abs(known)) / square
            multipliers = np.maximum(0.0, multipliers + step * excess)
        multipliers = best_multipliers
    return [np.array(path) for path in paths]


def without_loops(walk: IntArray) -> tuple[int, ...]:
    """Return a walk without its loops: the nodes between two visits of a node are left out."""
    nodes, path, k = walk.tolist(), list[int](), 0
    last = {node: k for k, node in enumerate(nodes)}
    while k < len(nodes):
        path.append(nodes[k])
        k = last[nodes[k]] + 1
    return tuple(path)


class Exchanges:
    """Exchanges of pieces of at most so many nodes, judged by ε D + λ ΣS / N."""

    def __init__(self, network: Network, weights: tuple[float, float], longest: int) -> None:
        """Take the moves, ε and λ, and the number of nodes."""
        self._longest = longest
        self._unsafeness: list[float] = (weights[1] * network.unsafeness).tolist()
        # of each node: where moves lead, and ε times their lengths
        self._moves: list[dict[int, float]] = [{} for _ in self._unsafeness]
        lengths = (weights[0] * network.lengths).tolist()
        for tail, head, length in zip(
            network.tails.tolist(), network.heads.tolist(), lengths, strict=True
        ):
            self._moves[tail][head] = length

    def descend(self, path: IntArray) -> IntArray:
        """Make the best exchange until none lowers the cost."""
        nodes = path.tolist()
        while (better := self._best_exchange(nodes)) is not None:
            nodes = better
        return np.array(nodes)

    def _best_exchange(self, path: list[int]) -> list[int] | None:
        """Return a path after the exchange that lowers its cost most, if one does."""
        length, unsafe = self._measured(path)
        lowest, best = (length + unsafe / len(path)) * (1.0 - SMALLEST_GAIN), None
        for removed in range(self._longest + 1):
            for first in range(1, len(path) - removed):
                # the path without the piece and the moves to it
                head, tail = path[:first], path[first + removed :]
                old_length, _ = self._measured(path[first - 1 : first + removed + 1])
                rest_length = length - old_length
                rest_unsafe = unsafe - sum(
                    self._unsafeness[node] for node in path[first:][:removed]
                )
                # with every other piece
                for piece in self._pieces([head[-1]], tail[0], {*head, *tail}):
                    added = sum(self._unsafeness[node] for node in piece)
                    new_length, _ = self._measured([head[-1], *piece, tail[0]])
                    count = len(path) - removed + len(piece)
                    cost = rest_length + new_length + (rest_unsafe + added) / count
                    if cost < lowest:
                        lowest, best = cost, [*head, *piece, *tail]
        return best

    def _pieces(self, trail: list[int], tail: int, used: set[int]) -> Iterator[list[int]]:
        """Yield the pieces behind a kept node and the nodes of a trail, up to another kept node."""
        if tail in self._moves[trail[-1]]:
            yield trail[1:]
        if len(trail) <= self._longest:
            for node in self._moves[trail[-1]]:
                if node not in used and node not in trail:
                    yield from self._pieces([*trail, node], tail, used)

    def _measured(self, path: list[int]) -> tuple[float, float]:
        """Return ε D and λ ΣS of a path."""
        length = sum(self._moves[one][two] for one, two in pairwise(path))
        return length, sum(self._unsafeness[node] for node in path)
