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
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vector_bytes import (
    equal_bytes,
    load_bytes,
    load_mask,
    spread_byte,
    store_bytes,
)
from evoexp.numeric.vectors import LANES, load, lower, select, spread, store, upper
from evoexp.records import FloatArray
from evoexp.references.grid_networks import NO_MOVE, Arrivals, Hops, Shifts, shifts_of
from evoexp.robots.kinematics import U

PATIENCE = 10  # steps without a better bound after which they are halved
SHORTEST_STEP = 1.0 / 64.0  # of Polyak's length, at which a number of nodes is left


class Walks(NamedTuple):
    """The best walks to every node by every number of nodes, written by `find_walks`.

    Costs are kept of two numbers of nodes only, which take turns.

    Attributes:
        costs: (numbers,) of the best walks to the goal.
        best: (2 · width,) costs of the best walks; see `Shifts` for the width.
        second: (2 · width,) of the best whose last but one node is another.
        moves: (numbers · width,) int8, the last move of the best walks; `NO_MOVE` where there is
            none.
        second_moves: (numbers · width,) of the second best.
    """

    costs: FloatArray
    best: FloatArray
    second: FloatArray
    moves: NDArray[np.int8]
    second_moves: NDArray[np.int8]

    @classmethod
    def of(cls, most: int, shifts: Shifts) -> "Walks":
        """Return memory for walks of at most so many nodes on a grid."""
        moves = np.full((2, (most + 1) * shifts.width), NO_MOVE, dtype=np.int8)
        return cls(np.full(most + 1, np.inf), *np.full((2, 2 * shifts.width), np.inf), *moves)


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
    length, since, best = 1.0, 0, -np.inf
    best_multipliers = multipliers.copy()
    weights, excess = np.zeros(shifts.width), np.empty(len(multipliers))
    for _ in range(most_steps):
        for node in range(len(multipliers)):
            weights[node] = lam / number * shifts.unsafeness[node] + multipliers[node]
        find_walks(shifts, weights, number, walks)
        # L_N(π), and bounds of smaller numbers
        total = multipliers.sum()
        value = walks.costs[number] - total
        for smaller in range(number + 1):
            bounds[smaller] = max(bounds[smaller], walks.costs[smaller] - total)
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

    Blocks of nodes are left out until the start reaches them, and as soon as they cannot reach the
    goal by `number` nodes any more: costs that they keep from before lead to no other block that
    can.

    Args:
        shifts: The moves.
        weights: (width,) cost of passing a node.
        number: Most nodes.
        walks: Written.
    """
    shifts, weights, walks = borrowed((shifts, weights, walks))
    (start, goal), width = shifts.ends, shifts.width
    walks.best[:], walks.second[:] = np.inf, np.inf
    walks.moves[: 2 * width] = NO_MOVE
    walks.best[width + start] = weights[start]
    walks.costs[0], walks.costs[1] = np.inf, walks.best[width + goal]
    for k in range(2, number + 1):
        for block in range(len(shifts.to_goal)):
            if shifts.from_start[block] < k and shifts.to_goal[block] <= number - k:
                _extend_walks(shifts, weights, k, block, walks)
        walks.costs[k] = walks.best[(k & 1) * width + goal]


@inlined
def _extend_walks(shifts: Shifts, weights: FloatArray, k: int, block: int, walks: Walks) -> None:
    """Write the best walks of k nodes to a block of nodes, from those of one node less.

    Args:
        shifts: The moves.
        weights: (width,) cost of passing a node.
        k: Number of nodes of the walks.
        block: Which nodes.
        walks: Written.
    """
    width, kinds = shifts.width, len(shifts.differences)
    node = shifts.first + block * LANES
    before, to = ((k + 1) & 1) * width + node, (k & 1) * width + node
    moves_before = (k - 1) * width + node
    one, two = spread(np.inf), spread(np.inf)
    move_one, move_two = spread_byte(NO_MOVE), spread_byte(NO_MOVE)
    for move in range(kinds):
        difference = shifts.differences[move]
        at = U(before - difference)
        # the best walk, or the second best where the best one would go straight back
        is_back = equal_bytes(
            load_bytes(walks.moves, U(moves_before - difference)), shifts.backward[move]
        )
        value = select(is_back, load(walks.second, at), load(walks.best, at))
        value = value + shifts.lengths[move]
        # the best so far, then the second best
        permitted = load_mask(shifts.permitted, U(block * kinds + move))
        value = select(permitted, value, spread(np.inf))
        is_one, is_two = value < one, value < two
        own = spread_byte(move)
        move_two = select(is_two, select(is_one, move_one, own), move_two)
        move_one = select(is_one, own, move_one)
        two = lower(two, upper(one, value))
        one = lower(one, value)
    weight = load(weights, U(node))
    store(walks.best, U(to), one + weight)
    store(walks.second, U(to), two + weight)
    store_bytes(walks.moves, U(k * width + node), move_one)
    store_bytes(walks.second_moves, U(k * width + node), move_two)


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
    node, is_second, width = shifts.ends[1], False, shifts.width
    if walks.costs[number] == np.inf:
        return 0.0
    for k in range(number, 1, -1):
        excess[node] += 1.0
        moves = walks.second_moves if is_second else walks.moves
        move = moves[k * width + node]
        # the walk to the node before that does not come from this one
        node -= shifts.differences[move]
        is_second = walks.moves[(k - 1) * width + node] == shifts.backward[move]
    excess[node] += 1.0
    square = 0.0
    for other in range(len(excess)):
        if excess[other] < 0.0 and multipliers[other] == 0.0:
            excess[other] = 0.0
        square += excess[other] * excess[other]
    return square
