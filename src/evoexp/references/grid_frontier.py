"""What is the best path over a grid: Dijkstra for length alone, a frontier of length against unsafeness otherwise.

The cost ε D + λ S of Chen & Zalzala 1995 has the mean S = ΣS / N in it, so no shortest-path algorithm minimises it.
Two things can be had: good paths, from the frontier of D + μ ΣS over all μ; and a bound below all paths, the exact
optimum over walks, which may pass nodes again. For a given number N of nodes a walk's cost ε D + (λ / N) ΣS is
additive, so dynamic programming over 1 … N nodes finds the best walk, for every N.
"""

from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.numerics import kernel
from evoexp.records import FloatArray
from evoexp.references.truth import Reference, Truth
from evoexp.validation import Count, Positive

BLOCK = 16  # numbers of nodes whose walks are bounded together
NOTHING = np.zeros((0, 0), dtype=np.int32)
SAFEST_OF_SHORTEST = 1e-6  # [1] weight of ΣS where length alone counts: decides among equally short paths only


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
        num_weights: Values of μ, from `least_weight` to `greatest_weight` by equal ratios, after the very smallest.
        least_weight: Of μ [cell].
        greatest_weight: Of μ [cell].
        max_nodes: Of the walks; longer ones are not looked at, and cannot be better if ε is not very small.
    """

    component: ClassVar[str] = "grid_frontier"

    num_weights: Count
    least_weight: Positive
    greatest_weight: Positive
    max_nodes: Count

    def truth(self, problem: Any) -> Truth:
        """Return the best path of the frontier; where nodes may be passed again, the best walk.

        Its terms: `lower_bound`, the cost of the best walk; `walk_nodes`, its number of nodes; `bound_is_reached`,
        whether a path was found that costs as little. Its arrays: `frontier` (μ, D, S, nodes, cost), one row per
        distinct path; `walks` (nodes, cost), one row per number of nodes looked at; `walk`, nodes of the best one;
        `goal_field` (NaN where no path can be) and `unsafeness`, (nodes along x, along y[, along z]).
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
        terms = {"lower_bound": bound, "walk_nodes": len(walk), "bound_is_reached": abs(cost - bound) <= 1e-9 * cost}
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
    return Network(tails, own.neighbours[tails, moves], lengths, problem.fields.unsafeness, problem.ends)


def frontier(network: Network, weights: FloatArray) -> list[tuple[float, np.ndarray]]:
    """Return the paths that minimise D + μ ΣS (Dijkstra), each with the first μ that it was found for.

    Args:
        network: The moves.
        weights: Values of μ [cell].
    """
    from scipy.sparse import csgraph, csr_array

    dijkstra: Any = csgraph.dijkstra
    count = len(network.unsafeness)
    found: dict[tuple[int, ...], float] = {}
    for mu in weights:
        costs = network.lengths + mu * network.unsafeness[network.heads]
        graph: Any = csr_array((costs, (network.tails, network.heads)), shape=(count, count))
        _, before = dijkstra(graph, indices=network.ends[0], return_predecessors=True)
        path = [network.ends[1]]
        while path[-1] != network.ends[0]:
            path.append(int(before[path[-1]]))
        found.setdefault(tuple(reversed(path)), float(mu))
    return [(mu, np.array(path)) for path, mu in found.items()]


def best_walk(
    network: Network, epsilon: float, lam: float, known: float, max_nodes: int
) -> tuple[FloatArray, np.ndarray]:
    """Return what the best walks of some numbers of nodes cost (numbers, 2), and the best of all (nodes,).

    Numbers whose walks are shown to be no better are left out.

    Args:
        network: The moves.
        epsilon: ε [1/cell].
        lam: λ.
        known: Cost of some path: numbers of nodes at which no walk can be better are left out.
        max_nodes: The greatest number looked at.
    """
    free = np.unique(network.tails)
    slack = known - lam * network.unsafeness[free].min()
    most = min(max_nodes, int(slack / epsilon) + 2) if epsilon > 0.0 else max_nodes
    order = np.argsort(network.heads, kind="stable")
    tails, heads, lengths = (values[order] for values in (network.tails, network.heads, network.lengths))
    first = np.searchsorted(heads, np.arange(len(network.unsafeness) + 1))
    edges = (tails, lengths, first, network.unsafeness, network.ends, epsilon)
    costs = np.full(most + 1, np.inf)
    for count in range(BLOCK, most + 1, BLOCK):
        costs[count] = _walk_costs(*edges, lam / count, count, NOTHING)[count]
    for last in range(BLOCK, most + BLOCK, BLOCK):  # for all these numbers λ / N is at least that of the last
        below = _walk_costs(*edges, lam / last, min(last, most), NOTHING)
        for count in range(max(last - BLOCK + 1, 2), min(last - 1, most) + 1):
            if below[count] < costs.min():
                costs[count] = _walk_costs(*edges, lam / count, count, NOTHING)[count]
    best = int(costs.argmin())
    before = np.zeros((best + 1, len(network.unsafeness)), dtype=np.int32)
    _walk_costs(*edges, lam / best, best, before)
    walk = [network.ends[1]]
    for k in range(best, 1, -1):
        walk.append(int(before[k, walk[-1]]))
    numbers = np.flatnonzero(np.isfinite(costs))
    return np.column_stack([numbers.astype(np.float64), costs[numbers]]), np.array(walk[::-1])


@kernel
def _walk_costs(tails, lengths, first, unsafeness, ends, epsilon, mu, count, before):  # type: ignore[no-untyped-def]
    """Return the least ε D + μ ΣS of walks of 0 … `count` nodes, (count + 1,).

    Args:
        tails: (edges,) node where each edge starts, in the order of the nodes where edges end.
        lengths: (edges,) theirs.
        first: (nodes + 1,) first edge that ends at each node.
        unsafeness: (nodes,).
        ends: Start and goal.
        epsilon: ε.
        mu: μ.
        count: Of nodes.
        before: (count + 1, nodes) written: where the best walk of so many nodes to each node comes from; or empty.
    """
    num = len(unsafeness)
    costs = np.full(count + 1, np.inf)
    present, following = np.full(num, np.inf), np.full(num, np.inf)
    present[ends[0]] = mu * unsafeness[ends[0]]
    for k in range(2, count + 1):
        for node in range(num):
            least, source = np.inf, 0
            for edge in range(first[node], first[node + 1]):
                cost = present[tails[edge]] + epsilon * lengths[edge]
                if cost < least:
                    least, source = cost, tails[edge]
            following[node] = least + mu * unsafeness[node]
            if len(before) > 0:
                before[k, node] = source
        present, following = following, present
        costs[k] = present[ends[1]]
    return costs
