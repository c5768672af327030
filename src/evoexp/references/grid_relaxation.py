"""A bound below all paths without loops over a grid, by Lagrangian relaxation.

Let a path without loops have N nodes. It passes every node v at most once, so for any multipliers
π ≥ 0 the sum of π over its nodes is at most Σπ_v, and for its cost (Chen & Zalzala 1995, Eqs. 1
to 3) holds

    ε D + (λ / N) ΣS  ≥  ε D + Σ_i (λ S_i / N + π_i) − Σ_v π_v  ≥  L_N(π),

where i runs over the path's nodes, v over all nodes, and L_N(π) is the least value of the middle
term over all walks of N nodes. The middle term is a sum over moves and nodes, so dynamic
programming over (node, number of nodes) finds it. Walks of n ≤ N nodes at the weight λ / N cost no
more than at their own λ / n: one pass bounds the paths of all these numbers at once.

The multipliers are raised at nodes that the best walk passes more than once, and lowered at nodes
that it leaves out, by subgradient steps of Polyak's length (Held & Karp 1971). Any π gives a true
bound, however good the steps are. Each walk without its loops is a path.
"""

import numpy as np

from evoexp.records import FloatArray, IntArray
from evoexp.references.grid_networks import Arrivals, best_walks

PATIENCE = 10  # steps without a better bound after which they are halved
SHORTEST_STEP = 1.0 / 64.0  # of Polyak's length, at which a number of nodes is left
SMALL = 1e-9  # of the known cost: less is no gain


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
