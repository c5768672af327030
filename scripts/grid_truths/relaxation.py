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
from evoexp.references.grid_frontier import Arrivals

NO_MOVE, NO_WAY_BACK = -1, -2

PATIENCE = 10  # steps without a better bound after which they are halved
SHORTEST_STEP = 1.0 / 64.0  # of Polyak's length, at which a number of nodes is left


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


class Walks(NamedTuple):
    """The best walks to every node by every number of nodes, written by `find_walks`.

    Costs are kept of two numbers of nodes only, which take turns.
    """

    costs: FloatArray  # (numbers,) of the best walks to the goal
    best: FloatArray  # (2, nodes) costs of the best walks
    second: FloatArray  # (2, nodes) of the best whose last but one node is another
    moves: IntArray  # (numbers, nodes) the last move of the best walks; else `NO_MOVE`
    second_moves: IntArray  # (numbers, nodes) of the second best

    @classmethod
    def of(cls, most: int, num_nodes: int) -> "Walks":
        """Return memory for walks of at most so many nodes on a grid."""
        moves = np.full((2, most + 1, num_nodes), NO_MOVE, dtype=np.int64)
        return cls(np.full(most + 1, np.inf), *np.full((2, 2, num_nodes), np.inf), *moves)


def relaxed_bounds(
    arrivals: Arrivals,
    lam: float,
    known: float,
    enough: float,
    floors: FloatArray,
    most_steps: int,
) -> FloatArray:
    """Raise bounds below the costs of all paths without loops, by their number of nodes.

    Args:
        arrivals: The moves.
        lam: λ.
        known: Cost of some path; steps are as long as if it were the optimum.
        enough: A bound as great is not raised any further.
        floors: (numbers of nodes, from 0) bounds that are known already.
        most_steps: Per number of nodes.

    Returns:
        (numbers,) bounds, none below its floor.
    """
    bounds, moves = floors.copy(), moves_of(arrivals)
    walks = Walks.of(len(floors) - 1, len(arrivals.unsafeness))
    multipliers = np.zeros(len(arrivals.unsafeness))
    # from the greatest number down: the multipliers of one are good ones of the next
    for number in range(len(floors) - 1, 1, -1):
        if bounds[number] < enough:
            raise_bound(moves, lam, known, enough, number, most_steps, multipliers, walks, bounds)
    return bounds


@kernel
def raise_bound(
    moves: Moves,
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
        moves: The moves.
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
    weights, excess = np.zeros(len(multipliers)), np.empty(len(multipliers))
    for _ in range(most_steps):
        for node in range(len(multipliers)):
            weights[node] = lam / number * moves.unsafeness[node] + multipliers[node]
        find_walks(moves, weights, number, walks)
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
        square = count_excess(moves, walks, number, multipliers, excess)
        if square == 0.0:
            break
        step = length * max(known - value, 1e-9 * abs(known)) / square
        for node in range(len(excess)):
            multipliers[node] = max(0.0, multipliers[node] + step * excess[node])
    multipliers[:] = best_multipliers


@kernel
def find_walks(moves: Moves, weights: FloatArray, number: int, walks: Walks) -> None:
    """Write the best walks of 1 … `number` nodes that never go straight back.

    Nodes whose index is too far from that of the start, or of the goal, to be on such a walk are
    left out: costs that they keep from before lead to no node that can be.

    Args:
        moves: The moves.
        weights: (nodes,) cost of passing a node.
        number: Most nodes.
        walks: Written.
    """
    start, goal = moves.ends
    walks.best[:], walks.second[:] = np.inf, np.inf
    walks.moves[:2] = NO_MOVE
    walks.best[1, start] = weights[start]
    walks.costs[0], walks.costs[1] = np.inf, walks.best[1, goal]
    farthest = np.abs(moves.differences).max()
    for k in range(2, number + 1):
        since, left = (k - 1) * farthest, (number - k) * farthest
        _extend_walks(
            moves,
            max(moves.first, start - since, goal - left),
            min(moves.stop, start + since + 1, goal + left + 1),
            weights,
            walks.best[(k + 1) & 1],
            walks.second[(k + 1) & 1],
            walks.moves[k - 1],
            walks.best[k & 1],
            walks.second[k & 1],
            walks.moves[k],
            walks.second_moves[k],
        )
        walks.costs[k] = walks.best[k & 1, goal]


@kernel
def _extend_walks(
    moves: Moves,
    first: int,
    stop: int,
    weights: FloatArray,
    best: FloatArray,
    second: FloatArray,
    last: IntArray,
    longer: FloatArray,
    longer_second: FloatArray,
    longer_last: IntArray,
    longer_second_last: IntArray,
) -> None:
    """Write the best walks of one node more, and their last moves.

    Args:
        moves: The moves.
        first: The walks are those to nodes from this one on.
        stop: And before this one.
        weights: (nodes,) cost of passing a node.
        best: (nodes,) costs of the best walks, and `second`, of the second best.
        last: (nodes,) last moves of the best walks.
        longer: (nodes,) written, and so are the three others.
    """
    count = max(0, stop - first)
    one, two = longer[first:stop], longer_second[first:stop]
    move_one, move_two = longer_last[first:stop], longer_second_last[first:stop]
    value, own = np.empty(count), weights[first:stop]
    one[:], two[:], move_one[:], move_two[:] = np.inf, np.inf, NO_MOVE, NO_MOVE
    # loops over few arrays each, which compilers turn into vector code
    for move in range(len(moves.differences)):
        before = slice(first - moves.differences[move], stop - moves.differences[move])
        best_before, second_before, last_before = best[before], second[before], last[before]
        back, length, barred = (
            moves.backward[move],
            moves.lengths[move],
            moves.barred[move, first:stop],
        )
        # the best walk, or the second best where the best one would go straight back
        for n in range(count):
            straight, other = best_before[n], second_before[n]
            cost = other if last_before[n] == back else straight
            value[n] = cost + length + barred[n]
        # the last moves, then the costs: of the best so far and of the second best
        for n in range(count):
            cost, first_move, second_move = value[n], move_one[n], move_two[n]
            is_one, is_two = cost < one[n], cost < two[n]
            kept = first_move if is_one else move
            move_two[n] = kept if is_two else second_move
            move_one[n] = move if is_one else first_move
        for n in range(count):
            cost, lowest, next_lowest = value[n], one[n], two[n]
            greater = lowest if cost < lowest else cost
            two[n] = greater if greater < next_lowest else next_lowest
            one[n] = cost if cost < lowest else lowest
    for n in range(count):
        one[n] += own[n]
        two[n] += own[n]


@kernel
def count_excess(
    moves: Moves, walks: Walks, number: int, multipliers: FloatArray, excess: FloatArray
) -> float:
    """Write how much oftener than once the best walk passes each node.

    Args:
        moves: The moves.
        walks: Of `find_walks`.
        number: Nodes of the walk.
        multipliers: (nodes,); nodes that the walk leaves out count if theirs can still be lowered.
        excess: (nodes,) written.

    Returns:
        The sum of squares; 0 if there is no walk of so many nodes.
    """
    excess[:] = -1.0
    node, is_second = moves.ends[1], False
    if walks.costs[number] == np.inf:
        return 0.0
    for k in range(number, 1, -1):
        excess[node] += 1.0
        last_moves = walks.second_moves if is_second else walks.moves
        move = last_moves[k, node]
        # the walk to the node before that does not come from this one
        node -= moves.differences[move]
        is_second = walks.moves[k - 1, node] == moves.backward[move]
    excess[node] += 1.0
    square = 0.0
    for other in range(len(excess)):
        if excess[other] < 0.0 and multipliers[other] == 0.0:
            excess[other] = 0.0
        square += excess[other] * excess[other]
    return square
