"""A bound below all paths without loops over a grid, by Lagrangian relaxation.

Let a path without loops have N nodes. It passes every node v at most once, so for any multipliers
π ≥ 0 the sum of π over its nodes is at most Σπ_v, and for its cost (Chen & Zalzala 1995, Eqs. 1
to 3) holds

    ε D + (λ / N) ΣS  ≥  ε D + Σ_i (λ S_i / N + π_i) − Σ_v π_v  ≥  L_N(π),

where i runs over the path's nodes, v over all nodes, and L_N(π) is the least value of the middle
term over all walks of N nodes that never go straight back (a, b, a), never return to the start and
never go on from the goal. A path without loops is such a walk, hence the second inequality. The
middle term is a sum over moves and nodes, so dynamic programming over (node, number of nodes) finds
the least one: for each node it keeps the best walk, and the best one whose last but one node is
another, which is the one to go on with where the best would go straight back.

Walks of n ≤ N nodes at the weight λ / N cost no more than at their own λ / n: one pass of dynamic
programming bounds the paths of all these numbers at once.

The multipliers are raised at nodes that the best walk passes more than once, and lowered at nodes
that it leaves out, by subgradient steps of Polyak's length (Held & Karp 1971). Any π gives a true
bound, however good the steps are.
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray
from evoexp.references.grid_networks import Arrivals, Hops

PATIENCE = 10  # steps without a better bound after which they are halved
SHORTEST_STEP = 1.0 / 64.0  # of Polyak's length, at which a number of nodes is left
NO_NODE = -1


class Walks(NamedTuple):
    """The best walks to every node by every number of nodes, written by `find_walks`.

    Attributes:
        best: (numbers, nodes) values of the best walks.
        second: (numbers, nodes) of the best whose last but one node is another.
        before: (numbers, nodes) last but one node of the best.
        second_before: (numbers, nodes) of the second best.
    """

    best: FloatArray
    second: FloatArray
    before: IntArray
    second_before: IntArray

    @classmethod
    def of(cls, most: int, nodes: int) -> "Walks":
        """Return memory for walks of at most so many nodes on a grid of so many."""
        shape = most + 1, nodes
        values = np.full(shape, np.inf), np.full(shape, np.inf)
        return cls(*values, np.full(shape, NO_NODE), np.full(shape, NO_NODE))


def relaxed_bounds(
    arrivals: Arrivals,
    hops: Hops,
    lam: float,
    known: float,
    enough: float,
    floors: FloatArray,
    most_steps: int,
) -> FloatArray:
    """Raise bounds below the costs of all paths without loops, by their number of nodes.

    Args:
        arrivals: The moves.
        hops: Fewest moves between nodes.
        lam: λ.
        known: Cost of some path; steps are as long as if it were the optimum.
        enough: A bound as great is not raised any further.
        floors: (numbers of nodes, from 0) bounds that are known already.
        most_steps: Per number of nodes.

    Returns:
        (numbers,) bounds, none below its floor.
    """
    bounds, nodes = floors.copy(), len(arrivals.unsafeness)
    walks, multipliers = Walks.of(len(floors) - 1, nodes), np.zeros(nodes)
    # from the greatest number down: the multipliers of one are good ones of the next
    for number in range(len(floors) - 1, 1, -1):
        if bounds[number] < enough:
            raise_bound(
                arrivals, hops, lam, known, enough, number, most_steps, multipliers, walks, bounds
            )
    return bounds


@kernel
def raise_bound(
    arrivals: Arrivals,
    hops: Hops,
    lam: float,
    known: float,
    enough: float,
    number: int,
    most_steps: int,
    multipliers: FloatArray,
    walks: Walks,
    bounds: FloatArray,
) -> None:
    """Raise the bounds of a number of nodes and of all smaller ones by subgradient steps.

    Args:
        arrivals: The moves.
        hops: Fewest moves between nodes.
        lam: λ.
        known: Cost of some path.
        enough: A bound as great ends the steps.
        number: N.
        most_steps: That are made.
        multipliers: (nodes,) π; overwritten by those of the best bound.
        walks: Scratch.
        bounds: (numbers,) raised.
    """
    goal, length, since, best = arrivals.ends[1], 1.0, 0, -np.inf
    best_multipliers = multipliers.copy()
    weights, excess = np.empty(len(multipliers)), np.empty(len(multipliers))
    for _ in range(most_steps):
        for node in range(len(weights)):
            weights[node] = lam / number * arrivals.unsafeness[node] + multipliers[node]
        find_walks(arrivals, hops, weights, number, walks)
        # L_N(π), and bounds of smaller numbers
        total = multipliers.sum()
        value = walks.best[number, goal] - total
        for smaller in range(number + 1):
            bounds[smaller] = max(bounds[smaller], walks.best[smaller, goal] - total)
        # shorter steps, from the best multipliers, where nothing is gained
        since += 1
        if value > best + 1e-9 * abs(known):
            best, since = value, 0
            best_multipliers[:] = multipliers
        elif since == PATIENCE:
            length, since = 0.5 * length, 0
            multipliers[:] = best_multipliers
        if bounds[number] >= enough or length < SHORTEST_STEP:
            break
        # a step along the excess of visits
        square = count_excess(arrivals, walks, number, multipliers, excess)
        if square == 0.0:
            break
        step = length * max(known - value, 1e-9 * abs(known)) / square
        for node in range(len(excess)):
            multipliers[node] = max(0.0, multipliers[node] + step * excess[node])
    multipliers[:] = best_multipliers


@kernel
def find_walks(
    arrivals: Arrivals, hops: Hops, weights: FloatArray, number: int, walks: Walks
) -> None:
    """Write the best walks of 1 … `number` nodes that never go straight back.

    Walks that cannot reach the goal by `number` nodes any more are left out.

    Args:
        arrivals: The moves.
        hops: Fewest moves between nodes.
        weights: (nodes,) cost of passing a node.
        number: Most nodes.
        walks: Written.
    """
    (start, goal), nodes, moves = arrivals.ends, len(weights), arrivals.tails.shape[1]
    best, second, before, second_before = walks
    best[:2], second[:2], before[:2], second_before[:2] = np.inf, np.inf, NO_NODE, NO_NODE
    best[1, start] = weights[start]
    for k in range(2, number + 1):
        for node in range(nodes):
            one, two, tail_one, tail_two = np.inf, np.inf, NO_NODE, NO_NODE
            in_time = hops.from_start[node] < k and hops.to_goal[node] <= number - k
            for move in range(moves if in_time and node != start else 0):
                tail = arrivals.tails[node, move]
                if tail == goal:
                    continue
                is_back = before[k - 1, tail] == node
                value = second[k - 1, tail] if is_back else best[k - 1, tail]
                value += arrivals.lengths[node, move]
                if value < one:
                    one, two, tail_one, tail_two = value, one, tail, tail_one
                elif value < two:
                    two, tail_two = value, tail
            best[k, node], second[k, node] = one + weights[node], two + weights[node]
            before[k, node], second_before[k, node] = tail_one, tail_two


@kernel
def count_excess(
    arrivals: Arrivals, walks: Walks, number: int, multipliers: FloatArray, excess: FloatArray
) -> float:
    """Write how much oftener than once the best walk passes each node.

    Args:
        arrivals: The moves.
        walks: Of `find_walks`.
        number: Nodes of the walk.
        multipliers: (nodes,); nodes that the walk leaves out count if theirs can still be lowered.
        excess: (nodes,) written.

    Returns:
        The sum of squares; 0 if there is no walk of so many nodes.
    """
    excess[:] = -1.0
    node, is_second = arrivals.ends[1], False
    if walks.best[number, node] == np.inf:
        return 0.0
    for k in range(number, 0, -1):
        excess[node] += 1.0
        tail = walks.second_before[k, node] if is_second else walks.before[k, node]
        # the walk to `tail` that does not come from `node`
        is_second = k > 1 and walks.before[k - 1, tail] == node
        node = tail
    square = 0.0
    for other in range(len(excess)):
        if excess[other] < 0.0 and multipliers[other] == 0.0:
            excess[other] = 0.0
        square += excess[other] * excess[other]
    return square
