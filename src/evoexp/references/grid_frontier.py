"""The best path over a grid: Dijkstra for length alone, else the best known one and a bound.

The cost ε D + λ S of Chen & Zalzala 1995 contains the mean S = ΣS / N, so no shortest-path
algorithm minimises it. The truth is enclosed:

- from above, by valid paths: the frontier of D + μ ΣS over all μ, each of its paths improved by
  exchanges of a few nodes (`grid_exchanges`);
- from below, by walks, which may pass nodes again. For a given number N of nodes a walk's cost
  ε D + (λ / N) ΣS is additive, so dynamic programming over 1 … N nodes finds the best walk, for
  every N. That is the exact optimum where nodes may be passed again. Where they may not,
  multipliers that punish further visits raise the bound (`grid_relaxation`).
"""

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from evoexp.errors import SettingError
from evoexp.numeric.compilation import kernel
from evoexp.planners.grid_path_ga.planner import GridPathGa
from evoexp.records import FloatArray, IntArray
from evoexp.references.grid_exchanges import Terrain, improve
from evoexp.references.grid_networks import (
    Arrivals,
    Network,
    arrivals_of,
    network_of,
)
from evoexp.references.grid_relaxation import relaxed_bounds
from evoexp.references.reference import Reference, Truth
from evoexp.validation import LayoutCount, NonNegativeCount, Positive

BLOCK = 16  # numbers of nodes whose walks are bounded together
LANES = 32  # numbers of nodes whose walks are looked for together
SAFEST_OF_SHORTEST = 1e-6  # [1] weight of ΣS that decides among equally short paths only
REACHED = 1e-9  # of a cost: a bound so close to it is reached


class GridFrontier(Reference):
    """The best path known, and the bound below all paths."""

    component: ClassVar[str] = "grid_frontier"
    revision: ClassVar[int] = 2

    planner: GridPathGa  # the path search whose grid and cost it shares
    # values of μ, from `least_weight` to `greatest_weight` by equal ratios, after the very
    # smallest
    num_weights: LayoutCount
    least_weight: Positive  # of μ [cell]
    greatest_weight: Positive  # of μ [cell]
    # of the walks; longer walks are not searched, and cannot be better if ε is not very small
    max_nodes: LayoutCount
    # no exchange of at most so many nodes improves the best path known
    exchanged_nodes: Annotated[int, Field(ge=0, le=4)]
    # exchanges of at most so many nodes are made though they cost more, to improve the path
    # from there
    forced_nodes: Annotated[int, Field(ge=0, le=4)]
    # the bound is raised until it is within this part of the best cost known, by every number
    # of nodes [-]
    bound_gap: Annotated[float, Field(ge=0.0, lt=1.0)]
    # most steps that raise it, by every number of nodes; 0: the bound by walks
    bound_steps: NonNegativeCount

    def truth(self, problem: Any) -> Truth:
        """Return the best path known, or the best walk where nodes may be passed again.

        Its terms: `lower_bound`, below which no path costs; `walk_cost` and `walk_nodes` of the
        best walk; `bound_is_reached`, whether a path was found that costs as little as the bound.
        Its arrays: `frontier` (μ, D, S, nodes, cost), one row per distinct path; `improved`, the
        same rows after the exchanges; `walks` (nodes, cost), one row per number of nodes searched;
        `bounds` (nodes, cost) by every number of nodes that the best path can have; `walk`, nodes
        of the best one; `goal_field` (NaN where no path can be) and `unsafeness`, (nodes along x,
        along y[, along z]).
        """
        network, lam = network_of(problem), self.planner.objective.unsafeness_weight
        paths = frontier(network, self._weights() if lam else np.array([SAFEST_OF_SHORTEST]))
        better = self._improved(problem, paths)
        rows, improved = self._rows(problem, paths), self._rows(problem, better)
        best, known = better[int(improved[:, 4].argmin())][1], float(improved[:, 4].min())
        if lam == 0.0:  # Dijkstra's path is exact
            walks, walk = np.array([[len(best), known]]), best
            bounds, bound = walks, known
        else:
            walks, walk = self._best_walk(network, float(rows[:, 4].min()))
            simple = len(set(walk.tolist())) == len(walk)
            if (simple or self.planner.revisits) and self._judged(problem, walk)[3] <= known:
                best, known = walk, self._judged(problem, walk)[3]
            bounds, bound = self._bounds(network, known, walks)
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

    def _weights(self) -> FloatArray:
        ratios = np.geomspace(self.least_weight, self.greatest_weight, self.num_weights)
        return np.array([SAFEST_OF_SHORTEST, *ratios])

    def _improved(
        self, problem: Any, paths: list[tuple[float, np.ndarray]]
    ) -> list[tuple[float, np.ndarray]]:
        """Return the paths after the exchanges; the same where these cannot help."""
        epsilon, lam = self.planner.objective.weights
        if lam == 0.0 or self.planner.revisits:
            return paths
        terrain = Terrain.of(problem.fields.grid, problem.fields.unsafeness, (epsilon, lam))
        better = improve(
            terrain, [path for _, path in paths], self.exchanged_nodes, self.forced_nodes
        )
        return [(mu, path) for (mu, _), path in zip(paths, better, strict=True)]

    def _best_walk(self, network: Network, known: float) -> tuple[FloatArray, np.ndarray]:
        return best_walk(network, *self.planner.objective.weights, known, self.max_nodes)

    def _bounds(
        self, network: Network, known: float, walks: FloatArray
    ) -> tuple[FloatArray, float]:
        """Return bounds below all paths: by numbers of nodes (numbers, 2), and of all.

        Args:
            network: The moves.
            known: Cost of some path.
            walks: (numbers, 2) of `best_walk`.
        """
        epsilon, lam = self.planner.objective.weights
        most = most_nodes(network, epsilon, lam, known, self.max_nodes)
        # a path of more nodes costs as much at least; without loops there may be none
        beyond, present = (
            epsilon * most + lam * _least_unsafeness(network),
            np.unique(network.tails),
        )
        if not self.planner.revisits and most >= len(present):
            beyond, most = np.inf, len(present)
        # numbers of nodes that are left out have no better walk than the best one
        floors = np.full(most + 1, walks[:, 1].min())
        inside = walks[:, 0] <= most
        floors[walks[inside, 0].astype(np.int64)] = walks[inside, 1]
        if not self.planner.revisits:
            floors = relaxed_bounds(
                arrivals_of(network, epsilon),
                lam,
                known,
                (1.0 - self.bound_gap) * known,
                floors,
                self.bound_steps,
            )
        rows = np.column_stack([np.arange(2.0, most + 1.0), floors[2:]])
        return rows, float(min(floors[2:].min(initial=np.inf), beyond, known))

    def _rows(self, problem: Any, paths: list[tuple[float, np.ndarray]]) -> FloatArray:
        return np.array([(mu, *self._judged(problem, path)) for mu, path in paths])

    def _judged(self, problem: Any, path: np.ndarray) -> tuple[float, float, float, float]:
        """Return D, S, number of nodes and cost of a path."""
        terms = self.planner.evaluate(problem, self._solution(problem, path))
        return terms["distance"], terms["unsafeness"], terms["num_nodes"], terms["cost"]

    def _solution(self, problem: Any, path: np.ndarray) -> FloatArray:
        return np.asarray(problem.fields.grid.coordinates[path], dtype=np.float64).ravel()


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
    most = most_nodes(network, epsilon, lam, known, max_nodes)
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


def most_nodes(network: Network, epsilon: float, lam: float, known: float, max_nodes: int) -> int:
    """Return how many nodes a walk of a lower cost than `known` has at most."""
    slack = known - lam * _least_unsafeness(network)
    return min(max_nodes, int(slack / epsilon) + 2) if epsilon > 0.0 else max_nodes


def _least_unsafeness(network: Network) -> float:
    return float(network.unsafeness[np.unique(network.tails)].min())


def walk_costs(arrivals: Arrivals, weights: FloatArray, count: int) -> FloatArray:
    """Return the least ε D + μ ΣS of walks of 0 … `count` nodes, (count + 1, weights)."""
    costs = np.full((count + 1, len(weights)), np.inf)
    present = np.full((len(arrivals.tails), len(weights)), np.inf)
    present[arrivals.ends[0]] = weights * arrivals.unsafeness[arrivals.ends[0]]
    _walk_costs(arrivals, weights, costs, present, np.full_like(present, np.inf))
    return costs


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
            own = following[node]
            own[:] = np.inf
            for move in range(tails.shape[1]):
                before, length = present[tails[node, move]], lengths[node, move]
                for lane in range(lanes):
                    cost = before[lane] + length
                    own[lane] = cost if cost < own[lane] else own[lane]
            for lane in range(lanes):
                own[lane] += weights[lane] * unsafeness[node]
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
