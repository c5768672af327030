"""Grids of nodes: the moves that they permit, wave fronts over them, and paths.

A node is known by its whole coordinates, or by its index. Around the nodes of a grid there is a
ring of more nodes, which are never free; with it nodes are counted, the last coordinate fastest, so
that the difference of two neighbours' indices tells the move. Moves go to nodes that differ by at
most one in every coordinate.

A path is written into one row of a table: its number of nodes, then their indices. Its first node
is the start, its last the goal. `place` (nodes,) tells the nodes of a path: a node belongs to it if
the path has that node at its place; so nothing needs to be cleared between paths.
"""

import itertools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.random_stream import Block
from evoexp.records import BoolArray, FloatArray

UNREACHED = -1
LANES = 4  # walkers of `walk_all`
WORDS = LANES // 2  # of 64 random bits for a step of each
HALF, LOW = np.uint64(32), np.uint64(2**32 - 1)
SHARE = 2.0**-32  # that half a word is of its greatest number and one

NodeArray = NDArray[np.int32]  # indices of nodes
StepArray = NDArray[np.integer[Any]]  # numbers of steps
SumArray = NDArray[np.unsignedinteger[Any]]  # of weights of moves


class Grid(NamedTuple):
    """A grid, and the moves that it permits."""

    # (nodes along x + 2, along y + 2[, along z + 2]) whether a path may pass a node; never on the
    # ring
    free: BoolArray
    coordinates: NodeArray  # (nodes, dimensions) of every node, those of the ring included
    # (nodes, moves) index of the node that each move leads to, −1 where it is not permitted
    neighbours: NodeArray
    # (moves,) how many coordinates each move changes; ascending, so that the first 2m moves are
    # lateral
    changes: NodeArray
    # (greatest difference of neighbours' indices + 1,) how many coordinates a move changes, by that
    # difference
    kinds: NodeArray

    @property
    def num_nodes(self) -> int:
        """Number of nodes, the ring included."""
        return int(self.free.size)

    def index_of(self, node: tuple[int, ...]) -> int:
        """Return the index of a node, of the ring at most."""
        return int(np.ravel_multi_index(tuple(value + 1 for value in node), self.free.shape))

    def inner(self, values: np.ndarray) -> np.ndarray:
        """Return values (nodes,) without the ring: (nodes along x, along y[, along z])."""
        return values.reshape(self.free.shape)[(slice(1, -1),) * self.free.ndim]

    def moves_within(self, neighbourhood: int) -> int:
        """Return how many moves change at most so many coordinates; they come first."""
        return int(np.count_nonzero(self.changes <= neighbourhood))


class Moves(NamedTuple):
    """The moves of random walks to one target, and their weights."""

    neighbours: NodeArray  # (nodes, moves), see `Grid`
    # (≥ greatest number of steps + 1,) potential after so many steps of the front from the target
    potentials: FloatArray
    steps: StepArray  # (nodes,) of that front, see `front`


def grid(blocked: BoolArray) -> Grid:
    """Return a grid with its permitted moves.

    `blocked` (nodes along x, along y[, along z]) is true for a node of an obstacle. A diagonal move
    is permitted if its two nodes are also joined by lateral moves within the box that they span:
    "It is not permissible for the robot to pass between the corners of obstacle regions" (Chen &
    Zalzala 1995, section 2.1), and it may touch the corner of one.
    """
    steps = itertools.product((-1, 0, 1), repeat=blocked.ndim)
    moves = sorted(steps, key=lambda move: sum(map(abs, move)))[1:]
    free = np.pad(~blocked.astype(bool), 1)
    nodes = np.arange(free.size, dtype=np.int32).reshape(free.shape)
    changes = np.array([sum(map(abs, move)) for move in moves], dtype=np.int32)
    rows = [np.where(_permitted(free, move), _moved(nodes, move), -1).ravel() for move in moves]
    # how far each move leads in the order of the nodes
    apart = np.abs((np.array(moves) * nodes.strides).sum(axis=1)) // nodes.itemsize
    kinds = np.zeros(apart.max() + 1, dtype=np.int32)
    kinds[apart] = changes
    coordinates = np.ascontiguousarray(np.argwhere(nodes >= 0).astype(np.int32) - 1)
    return Grid(free, coordinates, np.stack(rows, axis=1).astype(np.int32), changes, kinds)


def _permitted(free: np.ndarray, move: tuple[int, ...]) -> np.ndarray:
    """Return for every node whether a move can be made: an order of its parts passes free nodes."""
    parts = np.diag(move)[np.flatnonzero(move)]
    permitted = np.zeros_like(free)
    for order in itertools.permutations(parts):
        route = free
        for place in np.cumsum(order, axis=0):
            route = route & _moved(free, tuple(place))
        permitted |= route
    return permitted


def _moved(values: np.ndarray, move: tuple[int, ...]) -> np.ndarray:
    """Return the values one move away from every node; a free node's neighbours are in the grid."""
    return np.roll(values, [-step for step in move], range(values.ndim))


def front(of: Grid, sources: NDArray[np.integer[Any]], neighbourhood: int) -> NodeArray:
    """Return after how many steps (nodes,) a wave front arrives (Barraquand & Latombe 1991).

    It starts from the nodes of the indices `sources`, and a step changes at most `neighbourhood`
    coordinates, p. `UNREACHED`: it never comes there.
    """
    steps, queue = np.empty(of.num_nodes, dtype=np.int32), np.empty(of.num_nodes, dtype=np.int32)
    starts = np.asarray(sources, dtype=np.int32)
    spread_front(of.neighbours, of.moves_within(neighbourhood), starts, steps, queue)
    return steps


@kernel
def spread_front(
    neighbours: NodeArray, num_moves: int, sources: NodeArray, steps: StepArray, queue: NodeArray
) -> None:
    """Run the kernel of `front`: the first `num_moves` moves; `queue` (nodes,) is scratch."""
    # the sources, each once
    steps[:] = UNREACHED
    head, tail = 0, 0
    for k in range(len(sources)):
        if steps[sources[k]] != 0:
            steps[sources[k]] = 0
            queue[tail] = sources[k]
            tail += 1
    # breadth first
    while head < tail:
        node = queue[head]
        head += 1
        for move in range(num_moves):
            other = neighbours[node, move]
            if other >= 0 and steps[other] == UNREACHED:
                steps[other] = steps[node] + 1
                queue[tail] = other
                tail += 1


@kernel
def weigh_moves(moves: Moves, node: int, sums: FloatArray) -> None:
    """Write the running sums (moves,) of the weights of a node's moves.

    A neighbour of potential U has the weight U_max − U + 1, U_max being the greatest among the
    neighbours (Chen & Zalzala 1995, section 2.3: "a neighbouring node which has a lower distance
    value to the goal, has more chance"). A move that is not permitted weighs nothing.
    """
    neighbours, potentials, steps = moves.neighbours, moves.potentials, moves.steps
    greatest, total = 0.0, 0.0
    for move in range(len(sums)):
        other = neighbours[node, move]
        if other >= 0:
            greatest = max(greatest, potentials[steps[other]])
    for move in range(len(sums)):
        other = neighbours[node, move]
        if other >= 0:
            total += greatest - potentials[steps[other]] + 1.0
        sums[move] = total


@kernel
def weigh_all(moves: Moves) -> FloatArray:
    """Return the running sums of the weights of all moves, (nodes, moves)."""
    sums = np.empty(moves.neighbours.shape)
    for node in range(len(sums)):
        weigh_moves(moves, node, sums[node])
    return sums


@inlined
def drawn_move(uniform: float, sums: NDArray[Any]) -> int:
    """Return the move at which the running sum of weights (moves,) passes the uniform part."""
    last = len(sums) - 1
    part, move = uniform * sums[last], 0
    for other in range(last):  # without a branch, which no processor could foresee
        move += sums[other] <= part
    return move


@kernel
def walk(
    draws: Block,  # one number is taken per step; if they are used up, the walk breaks off
    moves: Moves,  # with a table of sums their potentials are not read
    sums: SumArray,  # (1, nodes, moves) of `weigh_all`; (0, nodes, moves): worked out on the way
    ends: tuple[int, int],  # indices of the start and of the target, which the front must reach
    erase: bool,  # whether loops are erased
    path: NodeArray,  # (≥ nodes + 1,), written; see above
    place: NodeArray,  # (nodes,) scratch
) -> None:
    """Write a random path: a step draws a permitted move, weighted as by `weigh_moves`."""
    uniforms, taken, neighbours = draws.uniforms, draws.taken, moves.neighbours
    node, target = ends
    at, num, count, is_table = taken[0], len(uniforms), 1, len(sums) > 0
    own = np.empty(neighbours.shape[1])
    path[1] = node
    while node != target and at < num:
        if is_table:
            move = drawn_move(uniforms[at], sums[0, node])
        else:
            weigh_moves(moves, node, own)
            move = drawn_move(uniforms[at], own)
        node = neighbours[node, move]
        if count == len(path) - 1:  # full: a path without loops always fits
            erase_loops(path, count, path, place)
            count = path[0]
        count += 1
        path[count] = node
        at += 1
    taken[0] = at if node == target else num + 1
    path[0] = count
    if erase:
        erase_loops(path, count, path, place)


@kernel
def walk_all(
    words: NDArray[np.uint64],  # (any,) random
    num_words: int,  # words that are drawn at first, for a step of every walker each `WORDS`
    more_words: int,  # words that are drawn whenever these do not suffice
    neighbours: NodeArray,  # (nodes, moves), see `grids.Grid`
    sums: SumArray,  # (nodes, moves) of `weigh_all`, toward the target
    ends: tuple[int, int],  # indices of two nodes, start and target
    erase: bool,  # whether loops are erased
    paths: NodeArray,  # (paths, nodes + 1) written
) -> int:
    """Write random paths between the same two nodes, each as `walk` does, by half words.

    A step must wait for the step before it, which names the row to read; so `LANES` walkers take
    turns, 2 i by the lower half of word i, 2 i + 1 by its upper half. Who arrives begins anew.

    Returns:
        The number of words drawn, a rest included that nobody took; −1 if there are not as many.
    """
    words, neighbours, sums, paths = borrowed((words, neighbours, sums, paths))
    nodes, target = len(neighbours), np.uint64(ends[1])
    here, rows = np.full(LANES, np.uint64(ends[0])), np.arange(LANES)
    # the nodes of each walker, from index 1 on
    trails, counts = np.empty((LANES, nodes + 1), dtype=np.int32), np.ones(LANES, dtype=np.int64)
    trails[:, 1] = ends[0]
    place = np.empty(nodes, dtype=np.int32)
    begun, complete, taken, drawn = LANES, 0, 0, num_words
    while complete < len(paths):
        drawn += more_words if taken == drawn else 0
        if drawn > len(words):
            return -1
        # a step of every walker
        needs_care = False
        for walker in range(LANES):
            word, node = words[taken + (walker >> 1)], here[walker]
            bits = word >> HALF if walker & 1 else word & LOW
            move = drawn_move(SHARE * np.float64(bits), sums[node])
            following = here[walker] = np.uint64(neighbours[node, move])
            counts[walker] += 1
            trails[walker, counts[walker]] = following
            needs_care |= (following == target) | (counts[walker] == nodes)
        taken += WORDS
        # who has arrived begins the next path
        for walker in range(LANES if needs_care else 0):
            trail, count, row = trails[walker], counts[walker], rows[walker]
            if here[walker] == target:
                if row < len(paths) and erase:
                    erase_loops(trail, count, paths[row], place)
                elif row < len(paths):
                    paths[row, 0], paths[row, 1 : count + 1] = count, trail[1 : count + 1]
                complete += row < len(paths)
                rows[walker], here[walker], counts[walker] = begun, np.uint64(ends[0]), 1
                begun += 1
            elif count == nodes:  # full: a path without loops always fits
                erase_loops(trail, count, trail, place)
                counts[walker] = trail[0]
    return drawn


@kernel
def erase_loops(nodes: NodeArray, count: int, path: NodeArray, place: NodeArray) -> None:
    """Write a path of `count` nodes, from index 1 on, without its loops; it may be `path` itself.

    The nodes between two visits of a node are left out: every node's last exit leads on (Wilson
    1996).
    """
    for k in range(1, count + 1):
        place[nodes[k]] = k
    num_left, k = 0, 1
    while k <= count:  # from the last place of a node the path never comes back to it
        node = nodes[k]
        num_left += 1
        path[num_left] = node
        k = place[node] + 1
    path[0] = num_left


@kernel
def measure_path(path: NodeArray, kinds: NodeArray, unsafeness: FloatArray) -> tuple[float, float]:
    """Return length D [cell] and mean unsafeness S of a path (Chen & Zalzala 1995, Eqs. 2 and 3).

    Moves of each kind (see `grids.Grid`) are counted, so the length does not depend on their order.
    """
    count = path[0]
    diagonal, spatial = 0, 0
    before = path[1]
    total = unsafeness[before]
    for k in range(2, count + 1):
        node = path[k]
        kind = kinds[abs(node - before)]
        diagonal += kind == 2
        spatial += kind == 3
        total += unsafeness[node]
        before = node
    lateral = count - 1 - diagonal - spatial
    return lateral + diagonal * np.sqrt(2.0) + spatial * np.sqrt(3.0), total / count
