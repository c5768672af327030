"""Grids of nodes: which moves they permit, and wave fronts over them.

A node is known by its whole coordinates, or by its index. Around the nodes of a grid there is a
ring of more nodes, which are never free; with it nodes are counted, the last coordinate fastest, so
that the difference of two neighbours' indices tells the move. Moves go to nodes that differ by at
most one in every coordinate.
"""

import itertools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import kernel
from evoexp.records import BoolArray, FloatArray

UNREACHED = -1

NodeArray = NDArray[np.int32]  # indices of nodes
StepArray = NDArray[np.integer[Any]]  # numbers of steps


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
    Zalzala 1995, section 2.1), and it may touch the corner of one. ValueError: not two or three
    dimensions.
    """
    dimensions = blocked.ndim
    if dimensions not in (2, 3):
        raise ValueError(f"blocked must have two or three dimensions, was {blocked.shape}")
    moves = sorted(
        itertools.product((-1, 0, 1), repeat=dimensions), key=lambda move: sum(map(abs, move))
    )[1:]
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
