"""The best path over a grid: Dijkstra for length alone, else the best known one and a bound.

The cost ε D + λ S of Chen & Zalzala 1995 contains the mean S = ΣS / N, so no shortest-path
algorithm minimises it. It is enclosed: from above, by the best path of the frontier of D + μ ΣS
over all μ, or the best walk if it has no loops; from below, by walks, which may pass nodes again:
for a given number N of nodes a walk's cost ε D + (λ / N) ΣS is a sum over moves and nodes, whose
least value dynamic programming finds, the exact optimum where nodes may be passed again.

Of the shipped maps better paths and higher bounds are known (`assets/grid_truths.json`), by
exchanges of a few nodes and by Lagrangian relaxation: see `scripts/update-grid-truths`.
"""

import hashlib
import json
from functools import cache
from importlib import resources
from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.errors import demand
from evoexp.numeric.compilation import kernel
from evoexp.planners.grid_path_ga.planner import GridPathGa
from evoexp.records import FloatArray, IntArray
from evoexp.references.reference import Reference, Truth
from evoexp.validation import LayoutCount, Positive

BLOCK = 16  # numbers of nodes whose walks are bounded together
SAFEST_OF_SHORTEST = 1e-6  # [1] weight of ΣS that decides among equally short paths only
REACHED = 1e-9  # of a cost: a bound so close to it is reached


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
    # place of each move among the moves that end at the same node
    rank = np.arange(len(heads)) - np.searchsorted(heads, heads)
    moves = int(rank.max()) + 1
    tails, lengths = np.zeros((count, moves), dtype=np.int64), np.full((count, moves), np.inf)
    tails[heads, rank] = network.tails[order]
    lengths[heads, rank] = epsilon * network.lengths[order]
    return Arrivals(tails, lengths, network.unsafeness, network.ends)


@kernel
def best_walks(arrivals: Arrivals, weights: FloatArray, count: int) -> tuple[FloatArray, IntArray]:
    """Return the least costs of walks of 0 … `count` nodes, and the best of `count`, (count,).

    The costs (count + 1,) are inf where there is no walk; `weights` (nodes,) are those of passing a
    node.
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


class Known(NamedTuple):
    """Better paths of a map than those of the frontier, and higher bounds than those of walks."""

    of: str  # experiment and label of a condition with this map
    paths: list[list[int]]  # nodes of each
    improved: list[int]  # (paths of the frontier,) the better path of each
    bounds: list[float]  # (numbers of nodes from 2 on,) below the paths of so many nodes


@cache
def known_maps() -> dict[str, Known]:
    """Return the better paths and bounds of the shipped maps, by `GridFrontier.key`."""
    content = resources.files("evoexp").joinpath("assets/grid_truths.json").read_bytes()
    return {key: Known(**found) for key, found in json.loads(content).items()}


class GridFrontier(Reference):
    """The best path known, and the bound below all paths."""

    revision: ClassVar[int] = 4

    planner: GridPathGa  # the path search whose grid and cost it shares
    # values of μ, from `least_weight` to `greatest_weight` by equal ratios, after the very
    # smallest
    num_weights: LayoutCount
    least_weight: Positive  # of μ [cell]
    greatest_weight: Positive  # of μ [cell]
    # of the walks; longer walks are not searched, and cannot be better if ε is not very small
    max_nodes: LayoutCount

    def truth(self, problem: Any) -> Truth:
        """Return the best path known, or the best walk where nodes may be passed again.

        Its terms: `lower_bound`, below which no path costs; `walk_cost` and `walk_nodes` of the
        best walk; `bound_is_reached`, whether a path was found that costs as little as the bound.
        Its arrays: `frontier` (μ, D, S, nodes, cost), one row per distinct path; `improved`, the
        same rows of the better paths that are known; `walks` (nodes, cost), one row per number of
        nodes searched; `bounds` (nodes, cost) by every number of nodes that the best path can have;
        `walk`, nodes of the best one; `goal_field` (NaN where no path can be) and `unsafeness`,
        (nodes along x, along y[, along z]).
        """
        network, lam = network_of(problem), self.planner.objective.unsafeness_weight
        paths = frontier(network, self.weights() if lam else np.array([SAFEST_OF_SHORTEST]))
        known_map = known_maps().get(self.key(problem))
        better = paths
        if known_map is not None:
            nodes = [np.array(path) for path in known_map.paths]
            better = [(mu, nodes[k]) for (mu, _), k in zip(paths, known_map.improved, strict=True)]
        rows, improved = self._rows(problem, paths), self._rows(problem, better)
        best, known = better[int(improved[:, 4].argmin())][1], float(improved[:, 4].min())
        if lam == 0.0:  # Dijkstra's path is exact
            walks, walk = np.array([[len(best), known]]), best
            bounds, bound = walks, known
        else:
            walks, walk = best_walk(
                network, *self.planner.objective.weights, float(rows[:, 4].min()), self.max_nodes
            )
            if self.planner.revisits or len(set(walk.tolist())) == len(walk):
                cost = self.path_cost(problem, walk)
                best, known = (walk, cost) if cost <= known else (best, known)
            floors, beyond = self.floors(network, known, walks)
            if known_map is not None:
                floors[2:] = known_map.bounds
            bounds = np.column_stack([np.arange(2.0, len(floors)), floors[2:]])
            bound = float(min(floors[2:].min(initial=np.inf), beyond, known))
        terms = {
            "lower_bound": bound,
            "walk_cost": float(walks[:, 1].min()),
            "walk_nodes": len(walk),
            "bound_is_reached": abs(known - bound) <= REACHED * known,
        }
        fields = problem.fields
        arrays = {
            "frontier": rows,
            "improved": improved,
            "walks": walks,
            "bounds": bounds,
            "walk": self._solution(problem, walk).reshape(len(walk), -1),
            "goal_field": fields.grid.inner(fields.goal_field(problem.ends[1])),
            "unsafeness": fields.grid.inner(fields.unsafeness),
        }
        solution = self._solution(problem, best)
        return Truth(solution, known, True, len(paths) + len(walks), terms, arrays)

    def weights(self) -> FloatArray:
        """Return the values of μ (weights,) [cell] of the frontier."""
        ratios = geometric_series(self.least_weight, self.greatest_weight, self.num_weights)
        return np.array([SAFEST_OF_SHORTEST, *ratios])

    def key(self, problem: Any) -> str:
        """Return a hash of map, ends, weights and settings, by which a map is known."""
        network, settings = network_of(problem), self.model_dump(mode="json", exclude={"planner"})
        numbers = [*self.planner.objective.weights, float(self.planner.revisits)]
        hashed = hashlib.sha256(json.dumps([settings, numbers], sort_keys=True).encode())
        for values in network:
            kind = np.float64 if np.asarray(values).dtype.kind == "f" else np.int64
            hashed.update(np.ascontiguousarray(values, dtype=kind).tobytes())
        return hashed.hexdigest()[:32]

    def floors(self, network: Network, known: float, walks: FloatArray) -> tuple[FloatArray, float]:
        """Return bounds by walks (see `best_walk`) below the paths of 0, 1, … nodes, and of more.

        `known` is the cost of some path.
        """
        epsilon, lam = self.planner.objective.weights
        most = most_nodes(network, epsilon, lam, known, self.max_nodes)
        # a path of more nodes costs as much at least; without loops there may be none
        beyond = epsilon * most + lam * _least_unsafeness(network)
        present = np.unique(network.tails)
        if not self.planner.revisits and most >= len(present):
            beyond, most = np.inf, len(present)
        # numbers of nodes that are left out have no better walk than the best one
        floors = np.full(most + 1, walks[:, 1].min())
        inside = walks[:, 0] <= most
        floors[walks[inside, 0].astype(np.int64)] = walks[inside, 1]
        return floors, beyond

    def _rows(self, problem: Any, paths: list[tuple[float, np.ndarray]]) -> FloatArray:
        return np.array([(mu, *self._judged(problem, path)) for mu, path in paths])

    def path_cost(self, problem: Any, path: np.ndarray) -> float:
        """Return the planner's cost of a path (nodes,)."""
        return self._judged(problem, path)[3]

    def _judged(self, problem: Any, path: np.ndarray) -> tuple[float, float, float, float]:
        """Return D, S, number of nodes and cost of a path."""
        terms = self.planner.evaluate(problem, self._solution(problem, path))
        return terms["distance"], terms["unsafeness"], terms["num_nodes"], terms["cost"]

    def _solution(self, problem: Any, path: np.ndarray) -> FloatArray:
        return np.asarray(problem.fields.grid.coordinates[path], dtype=np.float64).ravel()


def geometric_series(first: float, last: float, count: int) -> list[float]:
    """Return numbers of equal ratios, the same bits on every machine.

    `numpy.geomspace` takes powers, whose last bits depend on the processor, and these decide ties.
    """
    if count == 1:
        return [first]
    # the ratio by bisection, to neighbouring numbers
    low, high = sorted((1.0, last / first))
    while low < (middle := 0.5 * (low + high)) < high:
        product = first
        for _ in range(count - 1):
            product *= middle
        low, high = (middle, high) if product < last else (low, middle)
    series = [first]
    for _ in range(count - 2):
        series.append(series[-1] * low)
    return [*series, last]


def frontier(network: Network, weights: FloatArray) -> list[tuple[float, np.ndarray]]:
    """Return the paths that minimise D + μ ΣS (Dijkstra), each with the first μ leading to it."""
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

    These are (numbers, 2) numbers of nodes and costs, and (nodes,). Numbers whose walks are shown
    to be no better than another walk, or than some path of cost `known`, are left out.
    SettingError: no walk has as few nodes as `max_nodes`.
    """
    most = most_nodes(network, epsilon, lam, known, max_nodes)
    arrivals, costs = arrivals_of(network, epsilon), np.full(most + 1, np.inf)

    def costs_at(weight: int, count: int) -> FloatArray:
        return best_walks(arrivals, lam / weight * arrivals.unsafeness, count)[0]

    # bounds by blocks of numbers: λ / N is at least that of the block's last number
    bounds = np.full(most + 1, np.inf)
    for last in range(BLOCK, most + BLOCK, BLOCK):
        block = slice(last - BLOCK, min(last, most + 1))
        below = costs_at(last, min(last, most))
        bounds[block] = below[block]
        costs[last : last + 1] = below[last : last + 1]
    # exact costs of the numbers that their bounds do not exclude
    least = costs.min()
    for count in range(2, most + 1):
        if count % BLOCK and bounds[count] < least:
            costs[count] = costs_at(count, count)[count]
            least = min(least, costs[count])
    must = "at least the number of nodes from start to goal"
    demand(np.isfinite(costs.min()), "reference.max_nodes", must, max_nodes)
    best = int(costs.argmin())
    _, walk = best_walks(arrivals, lam / best * arrivals.unsafeness, best)
    numbers = np.flatnonzero(np.isfinite(costs))
    return np.column_stack([numbers.astype(np.float64), costs[numbers]]), walk


def most_nodes(network: Network, epsilon: float, lam: float, known: float, max_nodes: int) -> int:
    """Return how many nodes a walk of a lower cost than `known` has at most."""
    slack = known - lam * _least_unsafeness(network)
    return min(max_nodes, int(slack / epsilon) + 2) if epsilon > 0.0 else max_nodes


def _least_unsafeness(network: Network) -> float:
    return float(network.unsafeness[np.unique(network.tails)].min())
