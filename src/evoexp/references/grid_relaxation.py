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

Nodes of a grid are counted so that the difference of two neighbours' indices tells the move
(`paths.grids`). So eight nodes side by side are looked at together: the nodes from which one move
leads to them stand side by side, too.

The multipliers are raised at nodes that the best walk passes more than once, and lowered at nodes
that it leaves out, by subgradient steps of Polyak's length (Held & Karp 1971). Any π gives a true
bound, however good the steps are.
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vectors import LANES, any_lane, load, lower, select, spread, store, upper
from evoexp.records import FloatArray
from evoexp.references.grid_networks import Arrivals, Hops, Shifts, shifts_of
from evoexp.robots.kinematics import U

PATIENCE = 10  # steps without a better bound after which they are halved
SHORTEST_STEP = 1.0 / 64.0  # of Polyak's length, at which a number of nodes is left
NO_NODE = -1.0


class Walks(NamedTuple):
    """The best walks to every node by every number of nodes, written by `find_walks`.

    Attributes:
        best: (numbers, width) values of the best walks; see `Shifts` for the width.
        second: (numbers, width) of the best whose last but one node is another.
        before: (numbers, width) last but one node of the best, a whole number.
        second_before: (numbers, width) of the second best.
    """

    best: FloatArray
    second: FloatArray
    before: FloatArray
    second_before: FloatArray

    @classmethod
    def of(cls, most: int, shifts: Shifts) -> "Walks":
        """Return memory for walks of at most so many nodes on a grid."""
        shape = most + 1, shifts.lengths.shape[1]
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
    bounds, shifts = floors.copy(), shifts_of(arrivals, hops)
    walks = Walks.of(len(floors) - 1, shifts)
    multipliers = np.zeros(len(arrivals.unsafeness))
    # from the greatest number down: the multipliers of one are good ones of the next
    for number in range(len(floors) - 1, 1, -1):
        if bounds[number] < enough:
            raise_bound(shifts, lam, known, enough, number, most_steps, multipliers, walks, bounds)
    return bounds


@kernel
def raise_bound(
    shifts: Shifts,
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
        shifts: The moves.
        lam: λ.
        known: Cost of some path.
        enough: A bound as great ends the steps.
        number: N.
        most_steps: That are made.
        multipliers: (nodes,) π; overwritten by those of the best bound.
        walks: Scratch.
        bounds: (numbers,) raised.
    """
    goal, length, since, best = shifts.ends[1], 1.0, 0, -np.inf
    best_multipliers = multipliers.copy()
    weights, excess = np.zeros(shifts.lengths.shape[1]), np.empty(len(multipliers))
    for _ in range(most_steps):
        for node in range(len(multipliers)):
            weights[node] = lam / number * shifts.unsafeness[node] + multipliers[node]
        find_walks(shifts, weights, number, walks)
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
        square = count_excess(shifts, walks, number, multipliers, excess)
        if square == 0.0:
            break
        step = length * max(known - value, 1e-9 * abs(known)) / square
        for node in range(len(excess)):
            multipliers[node] = max(0.0, multipliers[node] + step * excess[node])
    multipliers[:] = best_multipliers


@kernel
def find_walks(shifts: Shifts, weights: FloatArray, number: int, walks: Walks) -> None:
    """Write the best walks of 1 … `number` nodes that never go straight back.

    Walks that cannot reach the goal by `number` nodes any more are left out.

    Args:
        shifts: The moves.
        weights: (width,) cost of passing a node.
        number: Most nodes.
        walks: Written.
    """
    shifts, weights, walks = borrowed((shifts, weights, walks))
    start, lengths = shifts.ends[0], shifts.lengths.reshape(-1)
    walks.best[:2], walks.second[:2] = np.inf, np.inf
    walks.before[:2], walks.second_before[:2] = NO_NODE, NO_NODE
    walks.best[1, start] = weights[start]
    flat = borrowed(
        Walks(
            walks.best.reshape(-1),
            walks.second.reshape(-1),
            walks.before.reshape(-1),
            walks.second_before.reshape(-1),
        )
    )
    for k in range(2, number + 1):
        for node in range(shifts.first, shifts.last + 1, LANES):
            _extend_walks(shifts, lengths, weights, k, number, node, flat)


@inlined
def _extend_walks(
    shifts: Shifts,
    lengths: FloatArray,
    weights: FloatArray,
    k: int,
    number: int,
    node: int,
    walks: Walks,
) -> None:
    """Write the best walks of k nodes to eight nodes from one on, from those of one node less.

    Args:
        shifts: The moves.
        lengths: (moves · width,) theirs, flat.
        weights: (width,) cost of passing a node.
        k: Number of nodes of the walks.
        number: Most nodes of a walk to the goal.
        node: The first of the eight.
        walks: (numbers · width,) each, flat.
    """
    best, second, before, second_before = walks
    width = len(weights)
    own, to = load(shifts.indices, U(node)), k * width + node
    nowhere = spread(np.inf)
    one, two = nowhere, nowhere
    tail_one, tail_two = spread(NO_NODE), spread(NO_NODE)
    # nodes that the start reaches, and from which the goal is reached, in time
    left = select(
        load(shifts.from_start, U(node)) < k * 1.0, load(shifts.to_goal, U(node)), nowhere
    )
    in_time = left < number - k + 0.5
    if any_lane(in_time):
        for move in range(len(shifts.differences)):
            difference = shifts.differences[move]
            at = U(to - width - difference)
            is_back = load(before, at) == own
            value = select(is_back, load(second, at), load(best, at))
            value = value + load(lengths, U(move * width + node))
            tail = own - 1.0 * difference
            # the best so far, then the second best
            is_one, is_two = value < one, value < two
            tail_two = select(is_two, select(is_one, tail_one, tail), tail_two)
            tail_one = select(is_one, tail, tail_one)
            two = lower(two, upper(one, value))
            one = lower(one, value)
        weight, none = load(weights, U(node)), spread(NO_NODE)
        one = select(in_time, one + weight, nowhere)
        two = select(in_time, two + weight, nowhere)
        tail_one = select(in_time, tail_one, none)
        tail_two = select(in_time, tail_two, none)
    store(best, U(to), one)
    store(second, U(to), two)
    store(before, U(to), tail_one)
    store(second_before, U(to), tail_two)


@kernel
def count_excess(
    shifts: Shifts, walks: Walks, number: int, multipliers: FloatArray, excess: FloatArray
) -> float:
    """Write how much oftener than once the best walk passes each node.

    Args:
        shifts: The moves.
        walks: Of `find_walks`.
        number: Nodes of the walk.
        multipliers: (nodes,); nodes that the walk leaves out count if theirs can still be lowered.
        excess: (nodes,) written.

    Returns:
        The sum of squares; 0 if there is no walk of so many nodes.
    """
    excess[:] = -1.0
    node, is_second = shifts.ends[1], False
    if walks.best[number, node] == np.inf:
        return 0.0
    for k in range(number, 0, -1):
        excess[node] += 1.0
        tail = walks.second_before[k, node] if is_second else walks.before[k, node]
        # the walk to `tail` that does not come from `node`
        is_second = k > 1 and walks.before[k - 1, int(tail)] == node
        node = int(tail)
    square = 0.0
    for other in range(len(excess)):
        if excess[other] < 0.0 and multipliers[other] == 0.0:
            excess[other] = 0.0
        square += excess[other] * excess[other]
    return square
