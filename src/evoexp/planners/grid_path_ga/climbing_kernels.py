"""Trials of path climbing, compiled: what a piece changes is worked out, not the whole path.

A path without loops, of which a piece is regenerated, is measured by sums up to each of its places:
moves of each kind, and the unsafeness of nodes, in whole numbers, whose sums are exact in any
order. So a trial takes the nodes of its walk, and the path is written only if it is kept. The same
results as `kernels.climb`, which regenerates, settles and measures whole paths.
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.random_stream import Block, draw_index, used_up
from evoexp.paths.grid_choices import Choices
from evoexp.paths.grid_measures import POSITIVE, Tolls, length_and_mean
from evoexp.paths.grid_walks import walk_to_exits
from evoexp.paths.grids import NodeArray
from evoexp.planners.grid_path_ga.kernels import (
    COST,
    DISTANCE,
    UNSAFENESS,
    Population,
    note,
)
from evoexp.planners.grid_path_ga.path_operators import World
from evoexp.records import FloatArray, IntArray


class Ledger(NamedTuple):
    """Sums along climbing paths, and where they pass."""

    # (paths, nodes) place of every node in each path; 0: the path does not pass it
    place: NodeArray
    moves: IntArray  # (paths, nodes + 1) tolls of the moves up to each place
    levels: IntArray  # (paths, nodes + 1) tolls of the nodes up to each place
    tolls: Tolls  # of moves and nodes
    exits: NodeArray  # (nodes,) scratch of walks
    walked: NodeArray  # (nodes + 1,) scratch: nodes of a walk without loops, from index 1 on

    @staticmethod
    def is_fit(world: World) -> bool:
        """Return whether unsafeness and weights of moves are whole numbers, and the grid small."""
        return bool(len(world.choices.entries) and len(world.tolls.of_node))

    @classmethod
    def of(cls, paths: NodeArray, world: World) -> "Ledger":
        """Return the sums along paths without loops (paths, nodes + 1)."""
        num, nodes = len(paths), len(world.tolls.of_node)
        own = cls(
            np.zeros((num, nodes), dtype=np.int32),
            np.zeros((num, nodes + 1), dtype=np.int64),
            np.zeros((num, nodes + 1), dtype=np.int64),
            world.tolls,
            np.empty(nodes, dtype=np.int32),
            np.empty(nodes + 1, dtype=np.int32),
        )
        for k, path in enumerate(paths):
            _enter(path, 1, own, k)
        return own


class Piece(NamedTuple):
    """A path whose piece is regenerated: its head, some nodes of a walk, its tail."""

    head: int  # place of the last node of the head
    begin: int  # place in the walk of the same node
    end: int  # place in the walk of the first node of the tail
    tail: int  # place of the same node in the path
    moves: int  # tolls of all its moves
    level: int  # tolls of all its nodes


@kernel
def climb_generations(
    draws: Block,
    trial: int,
    span: tuple[int, int],
    trials: int,
    world: World,
    weights: tuple[float, float],
    population: Population,
    ledger: Ledger,
    found: Population,
    summaries: FloatArray,
) -> int:
    """Make the trials of some generations.

    Args:
        draws: Uniform numbers.
        trial: Number of the first trial.
        span: The last generation that is complete, and the one to reach.
        trials: Of each generation.
        world: See `kernels.climb`, as for `weights` and `population`.
        weights: ε and λ of Eq. 1.
        population: Paths and their results, changed.
        ledger: Of these paths, changed with them.
        found: Some generations, see `kernels.note`; number g is at place g modulo the number of
            places.
        summaries: (places, 4) written, likewise.

    Returns:
        The number of the next trial: that of an earlier generation if the draws did not suffice.
    """
    draws, world, population, ledger = borrowed((draws, world, population, ledger))
    found, summaries = borrowed((found, summaries))
    for generation in range(span[0] + 1, span[1] + 1):
        trial = climb_by_pieces(
            draws, trial, generation * trials, world, weights, population, ledger
        )
        if trial < generation * trials:
            return trial
        note(population, generation % len(summaries), found, summaries)
    return trial


@kernel
def climb_by_pieces(
    draws: Block,
    first: int,
    last: int,
    world: World,
    weights: tuple[float, float],
    population: Population,
    ledger: Ledger,
) -> int:
    """Make the trials of `kernels.climb` where loops are erased.

    Args:
        draws: See there, as for `first`, `last`, `world`, `weights` and `population`.
        ledger: Of these paths, changed with them.

    Returns:
        The number of the next trial: less than `last` if the draws did not suffice.
    """
    draws, world, population, ledger = borrowed((draws, world, population, ledger))
    paths, results = population
    entries, slots = world.choices
    for trial in range(first, last):
        before, k = draws.taken[0], trial % len(paths)
        path, count = paths[k], int(np.int64(paths[k, 0]))
        # two different nodes, and a walk from one to the other
        one = draw_index(draws, count) + 1
        two = draw_index(draws, count - 1) + 1
        two += two >= one
        low, high = min(one, two), max(one, two)
        ends = (path[low], path[high])
        target = np.int64(ends[1])
        walk_to_exits(draws, Choices(entries[target : target + 1], slots), ends, ledger.exits)
        if used_up(draws):
            draws.taken[0] = before
            return trial
        # the cost of the path with it
        piece = _regenerated(ends, low, high, count, k, ledger)
        nodes = piece.head + (piece.end - piece.begin) + (count - piece.tail)
        distance, mean = length_and_mean(nodes, piece.moves, piece.level)
        cost = weights[0] * distance + weights[1] * mean
        if cost <= results[COST, k]:
            _replace(path, piece, ledger, k)
            results[DISTANCE, k], results[UNSAFENESS, k] = distance, mean
            results[COST, k] = cost
    return last


@inlined
def _regenerated(
    ends: tuple[int, int], low: int, high: int, count: int, k: int, ledger: Ledger
) -> Piece:
    """Return a path whose nodes between two places are replaced by a walk, without loops.

    Erasing loops one by one leaves the head up to the first node that the walk passes, too, and the
    walk from there up to the first node of the tail.

    Args:
        ends: First and last node of the walk.
        low: Place of the first one in the path.
        high: Place of the last one.
        count: Number of nodes of the path.
        k: Number of the path.
        ledger: With the last exits of the walk; `walked` is written.
    """
    place, moves, levels = ledger.place[k], ledger.moves[k], ledger.levels[k]
    node, target, walked = np.uint64(ends[0]), np.uint64(ends[1]), ledger.walked
    # where the walk meets the path: no processor can foresee it, so there is no branch
    num, head, begin, tail, end = 1, low, 1, 0, 1
    walked[1] = node
    while node != target:
        node = np.uint64(ledger.exits[node])
        num += 1
        walked[num] = node
        own = int(np.int64(place[node]))
        ends_head, begins_tail = (own > 0) & (own < head), (own >= high) & (tail == 0)
        head, begin = own if ends_head else head, num if ends_head else begin
        tail, end = own if begins_tail else tail, num if begins_tail else end
        tail = 0 if ends_head else tail
    # sums along what is left of it
    moved, level = _tolls_between(walked, begin, end, ledger.tolls)
    return Piece(
        head,
        begin,
        end,
        tail,
        moves[head] + moved + (moves[count] - moves[tail]),
        levels[head] + level + (levels[count] - levels[tail]),
    )


@inlined
def _tolls_between(nodes: NodeArray, first: int, last: int, tolls: Tolls) -> tuple[int, int]:
    """Return tolls of the moves between two places of a path, and of the nodes behind the first.

    The masks change no number, see `grid_measures.measure_by_tolls`.
    """
    moved, level, before = np.int64(0), np.int64(0), np.int64(nodes[first])
    for at in range(first + 1, last + 1):
        node = np.int64(nodes[at])
        moved = (moved + tolls.of_move[np.uint64(abs(node - before))]) & POSITIVE
        level = (level + tolls.of_node[np.uint64(node)]) & POSITIVE
        before = node
    return int(moved), int(level)


@kernel
def _replace(path: NodeArray, piece: Piece, ledger: Ledger, k: int) -> None:
    """Write a path with its regenerated piece."""
    place, walked, count = ledger.place[k], ledger.walked, path[0]
    head, tail = piece.head, piece.tail
    for at in range(head + 1, tail):
        place[path[at]] = 0
    # the tail, from its near end or its far end on, so that nothing is overwritten
    shift = head + (piece.end - piece.begin) - tail
    if shift < 0:
        for at in range(tail, count + 1):
            path[at + shift] = path[at]
    elif shift > 0:
        for at in range(count, tail - 1, -1):
            path[at + shift] = path[at]
    # the walk between head and tail
    for at in range(piece.begin + 1, piece.end):
        path[head + (at - piece.begin)] = walked[at]
    path[0] = count + shift
    _enter(path, head + 1, ledger, k)


@kernel
def _enter(path: NodeArray, first: int, ledger: Ledger, k: int) -> None:
    """Write places and sums of a path from a place on."""
    place, moves, levels = ledger.place[k], ledger.moves[k], ledger.levels[k]
    if first == 1:
        place[path[1]], levels[1] = 1, ledger.tolls.of_node[path[1]]
    for at in range(max(first, 2), path[0] + 1):
        node = path[at]
        place[node] = at
        moves[at] = moves[at - 1] + ledger.tolls.of_move[abs(node - path[at - 1])]
        levels[at] = levels[at - 1] + ledger.tolls.of_node[node]
