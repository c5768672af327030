"""The best path over a grid: Dijkstra for length alone, else a frontier of length and unsafeness.

The cost ε D + λ S of Chen & Zalzala 1995 contains the mean S = ΣS / N, so no shortest-path
algorithm minimises it. Two things can be computed: good paths, from the frontier of D + μ ΣS over
all μ; and a bound below all paths, the exact optimum over walks, which may pass nodes again. For a
given number N of nodes a walk's cost ε D + (λ / N) ΣS is additive, so dynamic programming over 1 …
N nodes finds the best walk, for every N.
"""

from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.compilation import kernel
from evoexp.planners.grid_path_ga.planner import GridPathGa
from evoexp.records import FloatArray, IntArray
from evoexp.references.reference import Reference, Truth
from evoexp.validation import Count, Positive

BLOCK = 16  # numbers of nodes whose walks are bounded together
LANES = 32  # numbers of nodes whose walks are looked for together
VECTOR = 16  # numbers of them are filled up to a multiple
TILE = 4  # moves that are compared together
SAFEST_OF_SHORTEST = 1e-6  # [1] weight of ΣS that decides among equally short paths only


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


class GridFrontier(Reference):
    """The frontier scan, and the bound by walks.

    Attributes:
        planner: The path search whose grid and cost it shares.
        num_weights: Values of μ, from `least_weight` to `greatest_weight` by equal ratios, after
            the very smallest.
        least_weight: Of μ [cell].
        greatest_weight: Of μ [cell].
        max_nodes: Of the walks; longer walks are not searched, and cannot be better if ε is not
            very small.
    """

    component: ClassVar[str] = "grid_frontier"

    planner: GridPathGa
    num_weights: Count
    least_weight: Positive
    greatest_weight: Positive
    max_nodes: Count

    def truth(self, problem: Any) -> Truth:
        """Return the best path of the frontier, or the best walk where nodes may be passed again.

        Its terms: `lower_bound`, the cost of the best walk; `walk_nodes`, its number of nodes;
        `bound_is_reached`, whether a path was found that costs as little. Its arrays: `frontier`
        (μ, D, S, nodes, cost), one row per distinct path; `walks` (nodes, cost), one row per number
        of nodes searched; `walk`, nodes of the best one; `goal_field` (NaN where no path can be)
        and `unsafeness`, (nodes along x, along y[, along z]).
        """
        network, (epsilon, lam) = network_of(problem), self.planner.objective.weights
        paths = frontier(network, self._weights() if lam else np.array([SAFEST_OF_SHORTEST]))
        rows = np.array([(mu, *self._judged(problem, path)) for mu, path in paths])
        best = paths[int(rows[:, 4].argmin())][1]
        if lam == 0.0:
            walks, walk = np.array([[len(best), rows[:, 4].min()]]), best
        else:
            walks, walk = best_walk(network, epsilon, lam, float(rows[:, 4].min()), self.max_nodes)
        bound = float(walks[:, 1].min())
        simple = len(set(walk.tolist())) == len(walk)
        if simple or self.planner.revisits:
            best = walk if self._judged(problem, walk)[3] <= rows[:, 4].min() else best
        solution = self._solution(problem, best)
        cost = self._judged(problem, best)[3]
        terms = {
            "lower_bound": bound,
            "walk_nodes": len(walk),
            "bound_is_reached": abs(cost - bound) <= 1e-9 * cost,
        }
        fields = problem.fields
        arrays = {
            "frontier": rows,
            "walks": walks,
            "walk": self._solution(problem, walk).reshape(len(walk), -1),
            "goal_field": fields.grid.inner(fields.goal_field(problem.ends[1])),
            "unsafeness": fields.grid.inner(fields.unsafeness),
        }
        return Truth(solution, cost, True, len(paths) + len(walks), terms, arrays)

    def _weights(self) -> FloatArray:
        ratios = np.geomspace(self.least_weight, self.greatest_weight, self.num_weights)
        return np.array([SAFEST_OF_SHORTEST, *ratios])

    def _judged(self, problem: Any, path: np.ndarray) -> tuple[float, float, float, float]:
        """Return D, S, number of nodes and cost of a path."""
        terms = self.planner.evaluate(problem, self._solution(problem, path))
        return terms["distance"], terms["unsafeness"], terms["num_nodes"], terms["cost"]

    def _solution(self, problem: Any, path: np.ndarray) -> FloatArray:
        return np.asarray(problem.fields.grid.coordinates[path], dtype=np.float64).ravel()


def network_of(problem: Any) -> Network:
    """Return the permitted moves of a problem of `grid_path_ga`."""
    own = problem.fields.grid
    tails, moves = np.nonzero(own.neighbours >= 0)
    lengths = np.sqrt(own.changes[moves].astype(np.float64))
    return Network(
        tails, own.neighbours[tails, moves], lengths, problem.fields.unsafeness, problem.ends
    )


def frontier(network: Network, weights: FloatArray) -> list[tuple[float, np.ndarray]]:
    """Return the paths that minimise D + μ ΣS (Dijkstra), each with the first μ that leads to it.

    Args:
        network: The moves.
        weights: Values of μ [cell].
    """
    from scipy.sparse import csgraph, csr_array

    dijkstra: Any = csgraph.dijkstra
    count, edges = len(network.unsafeness), np.arange(1.0, len(network.tails) + 1.0)
    graph: Any = csr_array((edges, (network.tails, network.heads)), shape=(count, count))
    # the order of the edges in the graph: with another μ only its numbers change
    order = graph.data.astype(np.int64) - 1
    lengths, unsafeness = network.lengths[order], network.unsafeness[network.heads[order]]
    found: dict[tuple[int, ...], float] = {}
    for mu in weights:
        graph.data[:] = lengths + mu * unsafeness
        _, before = dijkstra(graph, indices=network.ends[0], return_predecessors=True)
        path = [network.ends[1]]
        while path[-1] != network.ends[0]:
            path.append(int(before[path[-1]]))
        found.setdefault(tuple(reversed(path)), float(mu))
    return [(mu, np.array(path)) for path, mu in found.items()]


def best_walk(
    network: Network, epsilon: float, lam: float, known: float, max_nodes: int
) -> tuple[FloatArray, np.ndarray]:
    """Return the costs of the best walks by their numbers of nodes, and the best walk of all.

    Numbers of nodes whose walks are shown to be no better are left out.

    Args:
        network: The moves.
        epsilon: ε [1/cell].
        lam: λ.
        known: Cost of some path: numbers of nodes at which no walk can be better are left out.
        max_nodes: The greatest number of nodes that is searched.

    Returns:
        (numbers, 2) numbers of nodes and costs; (nodes,) the best walk.

    Raises:
        SettingError: If no walk has as few nodes.
    """
    # how many nodes a better walk has at most
    slack = known - lam * network.unsafeness[np.unique(network.tails)].min()
    most = min(max_nodes, int(slack / epsilon) + 2) if epsilon > 0.0 else max_nodes
    arrivals = arrivals_of(network, epsilon)
    costs = np.full(most + 1, np.inf)
    # bounds by blocks of numbers: λ / N is at least that of the block's last number
    lasts = np.arange(BLOCK, most + BLOCK, BLOCK)
    below = walk_costs(arrivals, lam / lasts, most)
    whole = np.flatnonzero(lasts <= most)
    costs[lasts[whole]] = below[lasts[whole], whole]
    others = np.setdiff1d(np.arange(2, most + 1), lasts)
    bounds = below[others, others // BLOCK]
    others, bounds = others[bounds < costs.min()], bounds[bounds < costs.min()]
    # exact costs of the numbers that their bounds do not exclude
    for k in range(0, len(others), LANES):
        counts = others[k : k + LANES]
        exact = walk_costs(arrivals, lam / counts, int(counts[-1]))[counts, np.arange(len(counts))]
        for count, bound, cost in zip(counts, bounds[k : k + LANES], exact, strict=True):
            if bound < costs.min():  # which may be less by now
                costs[count] = cost
    if not np.isfinite(costs.min()):
        raise SettingError(
            "reference.max_nodes", "as many as a path from start to goal has", max_nodes
        )
    best = int(costs.argmin())
    walk = _best_walk(arrivals, lam / best, best)
    numbers = np.flatnonzero(np.isfinite(costs))
    return np.column_stack([numbers.astype(np.float64), costs[numbers]]), walk


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


def walk_costs(arrivals: Arrivals, weights: FloatArray, count: int) -> FloatArray:
    """Return the least ε D + μ ΣS of walks of 0 … `count` nodes, (count + 1, weights)."""
    # a rest would not be vector code
    filled = np.pad(weights, (0, -len(weights) % VECTOR), mode="edge")
    costs = np.full((count + 1, len(filled)), np.inf)
    present = np.full((len(arrivals.tails), len(filled)), np.inf)
    present[arrivals.ends[0]] = filled * arrivals.unsafeness[arrivals.ends[0]]
    _walk_costs(arrivals, filled, costs, present, np.full_like(present, np.inf))
    return costs[:, : len(weights)]


@kernel
def _walk_costs(
    arrivals: Arrivals,
    weights: FloatArray,
    costs: FloatArray,
    present: FloatArray,
    following: FloatArray,
) -> None:
    """Compute `walk_costs` for all weights together.

    Args:
        arrivals: The moves.
        weights: (weights,) values of μ.
        costs: (numbers of nodes, weights) inf; written from two nodes on.
        present: (nodes, weights) cost of the walk of one node, inf at all other nodes; overwritten.
        following: (nodes, weights) inf; overwritten.
    """
    tails, lengths, unsafeness, ends = arrivals
    num, lanes = len(unsafeness), len(weights)
    for k in range(2, len(costs)):
        for node in range(num):
            if lengths[node, 0] == np.inf:
                continue  # no move ends here: infinite at all times
            own = unsafeness[node]
            for tile in range(0, tails.shape[1], TILE):
                # four moves that end here, for all weights
                a, b = tails[node, tile], tails[node, tile + 1]
                c, d = tails[node, tile + 2], tails[node, tile + 3]
                to_a, to_b = lengths[node, tile], lengths[node, tile + 1]
                to_c, to_d = lengths[node, tile + 2], lengths[node, tile + 3]
                for lane in range(lanes):
                    one = min(present[a, lane] + to_a, present[b, lane] + to_b)
                    two = min(present[c, lane] + to_c, present[d, lane] + to_d)
                    least = min(one, two) + weights[lane] * own
                    before = following[node, lane]
                    following[node, lane] = least if tile == 0 else min(before, least)
        present, following = following, present
        for lane in range(lanes):
            costs[k, lane] = present[ends[1], lane]


@kernel
def _best_walk(arrivals: Arrivals, mu: float, count: int) -> IntArray:
    """Return the walk of `count` nodes that has the least ε D + μ ΣS, (count,)."""
    tails, lengths, unsafeness, ends = arrivals
    num = len(unsafeness)
    before = np.zeros((count + 1, num), dtype=np.int64)
    present, following = np.full(num, np.inf), np.full(num, np.inf)
    present[ends[0]] = mu * unsafeness[ends[0]]
    # the best way to every node by k nodes, and the node before on it
    for k in range(2, count + 1):
        for node in range(num):
            least = np.inf
            for move in range(tails.shape[1]):
                cost = present[tails[node, move]] + lengths[node, move]
                if cost < least:
                    least, before[k, node] = cost, tails[node, move]
            following[node] = least + mu * unsafeness[node]
        present, following = following, present
    # the walk, from the goal back
    walk = np.empty(count, dtype=np.int64)
    walk[count - 1] = ends[1]
    for k in range(count, 1, -1):
        walk[k - 2] = before[k, walk[k - 1]]
    return walk
