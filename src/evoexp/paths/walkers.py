"""Many random walks over a grid between the same two nodes, some of them at a time.

A step must wait for the step before it, which names the row to read; meanwhile the other walkers
take theirs.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.paths.grid_choices import SHIFT, TOTAL, Choices, choices_of
from evoexp.paths.grid_walks import erase_loops, follow_exits
from evoexp.paths.grids import Moves, NodeArray
from evoexp.records import IntArray

LANES = 4  # walkers
WORDS = LANES // 2  # of 64 random bits for a step of each
HALF, LOW = np.uint64(32), np.uint64(2**32 - 1)

NEXT, COMPLETE = range(2)
"""Places in `State.progress`: the row that the next path is written to, and the complete paths."""


class State(NamedTuple):
    """Walkers on their ways.

    Attributes:
        progress: (2,) see NEXT and COMPLETE.
        nodes: (LANES,) where each walker is.
        rows: (LANES,) the path that it walks.
        exits: (LANES, nodes) the node to which it last went from each; without columns where loops
            are kept.
        counts: (LANES,) number of nodes of its trail, where loops are kept.
        trails: (LANES, nodes + 1) its nodes, from index 1 on; without columns where loops are
            erased.
    """

    progress: IntArray
    nodes: NDArray[np.uint64]
    rows: IntArray
    exits: NodeArray
    counts: IntArray
    trails: NodeArray

    @classmethod
    def at(cls, start: int, nodes: int, erase: bool) -> "State":
        """Return walkers at a node, of so many; their trails are kept, or their last exits."""
        trails = np.empty((LANES, 0 if erase else nodes + 1), dtype=np.int32)
        trails[:, 1:2] = start
        return cls(
            progress=np.array([LANES, 0]),
            nodes=np.full(LANES, start, dtype=np.uint64),
            rows=np.arange(LANES),
            exits=np.empty((LANES, nodes if erase else 0), dtype=np.int32),
            counts=np.ones(LANES, dtype=np.int64),
            trails=trails,
        )


class Walkers:
    """Walkers that fill a table of paths; a walker that arrives begins the next path."""

    def __init__(
        self,
        choices: Choices,
        ends: tuple[int, int],
        erase: bool,
        paths: NodeArray,
    ) -> None:
        """Put the walkers at the start.

        Args:
            choices: See `choice_table`; with one row.
            ends: Indices of start and target.
            erase: Whether loops are erased.
            paths: (paths, nodes + 1), written: a path's number of nodes, then the nodes.

        Raises:
            ValueError: If `paths` has another shape or type.
        """
        nodes = choices.entries.shape[1]
        if paths.ndim != 2 or paths.shape[1] != nodes + 1 or paths.dtype != np.int32:
            raise ValueError(
                f"paths must be int32 (paths, {nodes + 1}), were {paths.dtype} {paths.shape}"
            )
        start, goal = ends
        self._state = State.at(start, nodes, erase)
        self._choices, self._ends, self._erase, self._paths = choices, ends, erase, paths
        if start == goal:
            paths[:, 0], paths[:, 1] = 1, start
            self._state.progress[COMPLETE] = len(paths)

    @property
    def complete(self) -> int:
        """Number of complete paths."""
        return int(self._state.progress[COMPLETE])

    def go(self, words: NDArray[np.uint64]) -> int:
        """Go on until all paths are complete or the random words are used up.

        Args:
            words: (any,) uint64. Half a word decides a step of one walker: the lower half of word i
                that of walker 2 i, the upper half that of walker 2 i + 1, and so on in turns.

        Returns:
            Number of words taken.

        Raises:
            ValueError: If words has another type.
        """
        if words.dtype != np.uint64:
            raise ValueError(f"words must be uint64, were {words.dtype}")
        go = _go_without_loops if self._erase else _go_with_loops
        return go(words, self._choices, self._ends, self._state, self._paths)


@inlined
def next_node(choices: Choices, node: np.uint64, random: np.uint64) -> np.uint64:
    """Return where a walker goes by 32 random bits; a node has no sign, as it is an index."""
    entry = choices.entries[0, node]
    part = random * np.uint64(entry & TOTAL) >> HALF
    shift = choices.slots[np.uint64(entry >> SHIFT) + part]
    return np.uint64(np.int64(node) + shift)


@kernel
def _go_without_loops(
    words: NDArray[np.uint64],
    choices: Choices,
    ends: tuple[int, int],
    state: State,
    paths: NodeArray,
) -> int:
    """Run the kernel of `Walkers.go` where loops are erased.

    Only the last exit of every node is kept: from the start, they lead to the target without loops
    (Wilson 1996). A step has no branch, because its outcome cannot be foreseen.
    """
    words, choices, state, paths = borrowed((words, choices, state, paths))
    progress, walkers, exits = state.progress, state.nodes, state.exits
    target, taken = np.uint64(ends[1]), 0
    one, two, three, four = walkers[0], walkers[1], walkers[2], walkers[3]
    while progress[COMPLETE] < len(paths) and taken + WORDS <= len(words):
        first, second = words[taken], words[taken + 1]
        taken += WORDS
        to_one, to_two = (
            next_node(choices, one, first & LOW),
            next_node(choices, two, first >> HALF),
        )
        to_three = next_node(choices, three, second & LOW)
        to_four = next_node(choices, four, second >> HALF)
        exits[0, one], exits[1, two] = to_one, to_two
        exits[2, three], exits[3, four] = to_three, to_four
        one, two, three, four = to_one, to_two, to_three, to_four
        if (one == target) | (two == target) | (three == target) | (four == target):
            walkers[0], walkers[1], walkers[2], walkers[3] = one, two, three, four
            for walker in range(LANES):
                if walkers[walker] == target:
                    row = _arrive(walker, ends, state, len(paths))
                    if row < len(paths):
                        follow_exits(exits[walker], ends, paths[row])
            one, two, three, four = walkers[0], walkers[1], walkers[2], walkers[3]
    walkers[0], walkers[1], walkers[2], walkers[3] = one, two, three, four
    return taken


@kernel
def _go_with_loops(
    words: NDArray[np.uint64],
    choices: Choices,
    ends: tuple[int, int],
    state: State,
    paths: NodeArray,
) -> int:
    """Run the kernel of `Walkers.go` where loops are kept, but those of a trail that is full."""
    words, choices, state, paths = borrowed((words, choices, state, paths))
    progress, walkers, counts, trails = state.progress, state.nodes, state.counts, state.trails
    target, longest, taken = np.uint64(ends[1]), trails.shape[1] - 1, 0
    place = np.empty(longest, np.int32)
    while progress[COMPLETE] < len(paths) and taken + WORDS <= len(words):
        for walker in range(LANES):
            word = words[taken + (walker >> 1)]
            random = word >> HALF if walker & 1 else word & LOW
            node = next_node(choices, walkers[walker], random)
            counts[walker] += 1
            trails[walker, counts[walker]] = node
            walkers[walker] = node
        taken += WORDS
        for walker in range(LANES):
            trail, count = trails[walker], counts[walker]
            if walkers[walker] == target:
                row = _arrive(walker, ends, state, len(paths))
                if row < len(paths):
                    for k in range(1, count + 1):
                        paths[row, k] = trail[k]
                    paths[row, 0] = count
                counts[walker], trail[1] = 1, ends[0]
            elif count == longest:  # a path without loops always fits
                erase_loops(trail, count, trail, place)
                counts[walker] = trail[0]
    return taken


@kernel
def _arrive(walker: int, ends: tuple[int, int], state: State, num_paths: int) -> int:
    """Put a walker that has arrived at the start; return the row of the path that it walked."""
    progress = state.progress
    row: int = state.rows[walker]
    progress[COMPLETE] += row < num_paths
    state.rows[walker] = progress[NEXT]
    progress[NEXT] += 1
    state.nodes[walker] = ends[0]
    return row


def choice_table(moves: Moves) -> Choices:
    """Return the choices of walks to one target, one row of them.

    There is no row if the weights are no whole numbers or the table would be large; such walks are
    left to `grid_walks.walk`.
    """
    fronts = moves.steps[None, :]
    return choices_of(moves.neighbours, moves.potentials, fronts, len(moves.neighbours))
