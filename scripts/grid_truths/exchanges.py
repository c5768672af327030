"""Local search on paths over a grid: pieces of a few nodes are exchanged while the cost falls.

A piece is a run of nodes between two nodes that a path keeps; it may be empty. An exchange replaces
a piece by another one that permitted moves join to both kept nodes and whose nodes the path does
not pass elsewhere. So insertion and removal are exchanges, too, and every result is a valid path
without loops. The cost is Chen & Zalzala's, ε D + λ ΣS / N (1995, Eqs. 1 to 3).

`descend` makes the best exchange as long as one lowers the cost. `improve` goes on from there: it
makes each small exchange in turn, though it costs more, descends from the result, and starts again
where that found a better path. No number is drawn.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.paths.grids import Grid, NodeArray
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import U

NONE = -1
SMALLEST_GAIN = 1e-10  # of a cost: less may be rounding
DIGITS = 9  # decimals of a cost: beyond them costs are equal


class Terrain(NamedTuple):
    """Moves and nodes, with their shares of the cost."""

    neighbours: NodeArray  # (nodes, moves), see `grids.Grid`
    coordinates: NodeArray  # (nodes, dimensions)
    lengths: FloatArray  # (moves,) length of each move, times ε
    unsafeness: FloatArray  # (nodes,) times λ
    # (2 nodes − 1,) the move from one node to another, if it is permitted, by the difference
    # of their indices plus nodes − 1; `NONE` where there is no such move
    moves: IntArray

    @classmethod
    def of(cls, grid: Grid, unsafeness: FloatArray, weights: tuple[float, float]) -> "Terrain":
        """Return a grid's moves and nodes, weighed by ε and λ."""
        lengths = weights[0] * np.sqrt(grid.changes.astype(np.float64))
        moves = np.full(2 * grid.num_nodes - 1, NONE, dtype=np.int64)
        nodes, kinds = np.nonzero(grid.neighbours >= 0)
        moves[grid.neighbours[nodes, kinds] - nodes + grid.num_nodes - 1] = kinds
        return cls(grid.neighbours, grid.coordinates, lengths, weights[1] * unsafeness, moves)


class Trail(NamedTuple):
    """The nodes on the way from a kept node, as `list_pieces` tries them: scratch."""

    nodes: IntArray  # (longest + 1,) the kept node first
    tried: IntArray  # (longest + 1,) the move last tried from each
    lengths: FloatArray  # (longest + 1,) ε times the length up to each
    unsafeness: FloatArray  # (longest + 1,) λ times the sum up to each, the kept node left out


class Pieces(NamedTuple):
    """A table of pieces, written by `list_pieces`."""

    nodes: IntArray  # (most pieces, longest) nodes of each piece in order
    counts: IntArray  # (most pieces,) number of nodes of each
    # (most pieces,) ε times the length from the kept node before to the one behind
    lengths: FloatArray
    unsafeness: FloatArray  # (most pieces,) λ times the sum over the nodes
    trail: Trail  # scratch

    @classmethod
    def of(cls, terrain: Terrain, longest: int) -> "Pieces":
        """Return a table that has room for all pieces of at most so many nodes."""
        most = sum(terrain.neighbours.shape[1] ** count for count in range(longest + 1))
        shape = (most, longest)
        integers = np.zeros(shape, dtype=np.int64), np.zeros(most, dtype=np.int64)
        trail = Trail(*np.zeros((2, longest + 1), dtype=np.int64), *np.zeros((2, longest + 1)))
        return cls(*integers, np.zeros(most), np.zeros(most), trail)


class Exchange(NamedTuple):
    """The exchange of one piece of a path."""

    cost: float  # of the path with the other piece
    place: int  # of the kept node before the piece, counted from 0; `NONE`: there is no exchange
    removed: int  # how many nodes go
    row: int  # of the other piece in the table


def improve(
    terrain: Terrain, paths: Sequence[np.ndarray], longest: int, longest_forced: int
) -> list[IntArray]:
    """Return paths that no exchange of up to `longest` nodes improves, one for each path given.

    Args:
        terrain: Moves and nodes.
        paths: Valid paths without loops, (nodes,) each.
        longest: Most nodes of the pieces that are exchanged.
        longest_forced: Most nodes of the exchanges that are made though they cost more; after each
            of them single nodes are exchanged.
    """
    tables = [Pieces.of(terrain, count) for count in (longest, longest_forced, 1)]
    known: dict[float, IntArray] = {}  # of paths that descend to equal costs one is improved
    found = []
    for path in paths:
        best, cost = descend(terrain, np.asarray(path, dtype=np.int64), tables[0])
        key = round(cost, DIGITS)
        while key not in known:
            forced, lower = descend_beyond(terrain, best, cost, tables[1], tables[2])
            if lower >= cost:
                known[key] = best
            else:
                best, cost = descend(terrain, forced, tables[0])
        found.append(known[key])
    return found


@kernel
def descend(terrain: Terrain, path: IntArray, pieces: Pieces) -> tuple[IntArray, float]:
    """Make the best exchange until none lowers the cost; return the path and its cost."""
    while True:
        exchange = best_exchange(terrain, path, pieces)
        if exchange.place == NONE:
            return path, exchange.cost
        # the pieces of that place are listed once more: the table has those of the last one
        used = used_nodes(terrain, path)
        list_pieces(terrain, path, exchange.place, exchange.removed, used, pieces)
        path = exchanged(path, exchange.place, exchange.removed, pieces, exchange.row)


@kernel
def descend_beyond(
    terrain: Terrain, path: IntArray, cost: float, forced: Pieces, small: Pieces
) -> tuple[IntArray, float]:
    """Make each exchange in turn, though it costs more, and descend; stop at a lower cost.

    Args:
        terrain: Moves and nodes.
        path: A path that no exchange improves.
        cost: Its cost.
        forced: Table for the exchanges that are made in turn.
        small: Table for those of the descents.

    Returns:
        A path of lower cost, and its cost; the path itself if there is none.
    """
    used = used_nodes(terrain, path)
    for removed in range(forced.nodes.shape[1] + 1):
        for place in range(len(path) - 1 - removed):
            count = list_pieces(terrain, path, place, removed, used, forced)
            for row in range(count):
                start = exchanged(path, place, removed, forced, row)
                found, lower = descend(terrain, start, small)
                if lower < cost * (1.0 - SMALLEST_GAIN):
                    return found, lower
    return path, cost


@kernel
def best_exchange(terrain: Terrain, path: IntArray, pieces: Pieces) -> Exchange:
    """Return the exchange that lowers the cost most; its place is `NONE` if none does."""
    terrain, path, pieces = borrowed((terrain, path, pieces))
    used = used_nodes(terrain, path)
    length, unsafeness = measure(terrain, path)
    best = Exchange(length + unsafeness / len(path), NONE, 0, 0)
    lowest = best.cost * (1.0 - SMALLEST_GAIN)
    for removed in range(pieces.nodes.shape[1] + 1):
        for place in range(len(path) - 1 - removed):
            # the path without the piece and the moves to it
            old_length, old_unsafeness = measure(terrain, path[place : place + removed + 2])
            old_unsafeness -= terrain.unsafeness[path[place]]
            old_unsafeness -= terrain.unsafeness[path[place + removed + 1]]
            rest = length - old_length, unsafeness - old_unsafeness, len(path) - removed
            # with every other piece
            for row in range(list_pieces(terrain, path, place, removed, used, pieces)):
                total = rest[1] + pieces.unsafeness[row]
                cost = rest[0] + pieces.lengths[row] + total / (rest[2] + pieces.counts[row])
                if cost < lowest:
                    lowest = cost
                    best = Exchange(cost, place, removed, row)
    return best


@kernel
def list_pieces(
    terrain: Terrain, path: IntArray, place: int, removed: int, used: BoolArray, pieces: Pieces
) -> int:
    """Write all pieces that can stand in the place of a piece of a path, that piece included.

    Args:
        terrain: Moves and nodes.
        path: A valid path without loops.
        place: Of the kept node before the piece.
        removed: How many nodes the piece has.
        used: (nodes,) the nodes of the path; the same again on return.
        pieces: Written.

    Returns:
        The number of pieces.
    """
    terrain, path, used, pieces = borrowed((terrain, path, used, pieces))
    longest, moves = pieces.nodes.shape[1], terrain.neighbours.shape[1]
    behind = path[place + removed + 1]
    for k in range(removed):
        used[path[place + 1 + k]] = False
    # depth first: a trail of nodes from the kept node before, and the next move to try from each
    trail, tried, length, unsafeness = pieces.trail
    trail[0], tried[0], length[0], unsafeness[0] = path[place], NONE, 0.0, 0.0
    depth, count = 0, 0
    while depth >= 0:
        node = trail[depth]
        if tried[depth] == NONE:  # a new node: does a move close the trail?
            last = move_between(terrain, node, behind)
            if last != NONE:
                for k in range(depth):
                    pieces.nodes[count, k] = trail[1 + k]
                pieces.counts[count] = depth
                pieces.lengths[count] = length[depth] + terrain.lengths[last]
                pieces.unsafeness[count] = unsafeness[depth]
                count += 1
        tried[depth] += 1
        if depth == longest or tried[depth] == moves:
            if depth > 0:
                used[node] = False
            depth -= 1
            continue
        other = terrain.neighbours[U(node), U(tried[depth])]
        if other >= 0 and not used[U(other)] and near(terrain, other, behind, longest - depth):
            length[depth + 1] = length[depth] + terrain.lengths[tried[depth]]
            unsafeness[depth + 1] = unsafeness[depth] + terrain.unsafeness[other]
            depth += 1
            trail[depth], tried[depth] = other, NONE
            used[other] = True
    for k in range(removed):
        used[path[place + 1 + k]] = True
    return count


@kernel
def exchanged(path: IntArray, place: int, removed: int, pieces: Pieces, row: int) -> IntArray:
    """Return a path with a piece of the table in the place of one of its own."""
    count = pieces.counts[row]
    found = np.empty(len(path) - removed + count, np.int64)
    found[: place + 1] = path[: place + 1]
    found[place + 1 : place + 1 + count] = pieces.nodes[row, :count]
    found[place + 1 + count :] = path[place + 1 + removed :]
    return found


@kernel
def measure(terrain: Terrain, path: IntArray) -> tuple[float, float]:
    """Return ε D and λ ΣS of a path."""
    length, unsafeness = 0.0, terrain.unsafeness[path[0]]
    for k in range(1, len(path)):
        length += terrain.lengths[move_between(terrain, path[k - 1], path[k])]
        unsafeness += terrain.unsafeness[path[k]]
    return length, unsafeness


@kernel
def used_nodes(terrain: Terrain, path: IntArray) -> BoolArray:
    """Return which nodes a path passes, (nodes,)."""
    used = np.zeros(len(terrain.unsafeness), np.bool_)
    for node in path:
        used[node] = True
    return used


@inlined
def move_between(terrain: Terrain, one: int, two: int) -> int:
    """Return the move from a node to another one; `NONE` if it is not permitted."""
    move: int = terrain.moves[U(two - one + len(terrain.unsafeness) - 1)]
    return move if move != NONE and terrain.neighbours[U(one), U(move)] == two else NONE


@inlined
def near(terrain: Terrain, one: int, two: int, reach: int) -> bool:
    """Return whether two nodes differ by at most `reach` in every coordinate."""
    found = True
    for axis in range(terrain.coordinates.shape[1]):
        found &= abs(terrain.coordinates[U(one), axis] - terrain.coordinates[U(two), axis]) <= reach
    return found
