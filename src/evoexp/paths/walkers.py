"""Many random walks over a grid between the same two nodes, some of them at a time.

A step must wait for the step before it, which names the row to read; meanwhile the other walkers
take theirs.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.paths.grid_choices import SHIFT, TOTAL, Choices
from evoexp.paths.grid_walks import erase_loops, follow_exits
from evoexp.paths.grids import NodeArray
from evoexp.records import IntArray

LANES = 4  # walkers
WORDS = LANES // 2  # of 64 random bits for a step of each
HALF, LOW = np.uint64(32), np.uint64(2**32 - 1)

NEXT, COMPLETE = range(2)  # places in `State.progress`


class State(NamedTuple):
    """Walkers on their ways."""

    progress: IntArray  # (2,) the row that the next path is written to, and the complete paths
    nodes: NDArray[np.uint64]  # (LANES,) where each walker is
    rows: IntArray  # (LANES,) the path that it walks
    exits: NodeArray  # (LANES, nodes) where it last went to from each node, if loops are erased
    counts: IntArray  # (LANES,) number of nodes of its trail, where loops are kept
    trails: NodeArray  # (LANES, nodes + 1) its nodes, from index 1 on, where loops are kept

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
            choices: Of one target, see `grid_choices.choice_table`.
            ends: Indices of start and target.
            erase: Whether loops are erased.
            paths: (paths, nodes + 1), written: a path's number of nodes, then the nodes.
        """
        start, goal = ends
        self._state = State.at(start, choices.entries.shape[1], erase)
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
        """
        return _go(words, self._choices, self._ends, self._erase, self._state, self._paths)


@kernel
def _go(
    words: NDArray[np.uint64],
    choices: Choices,
    ends: tuple[int, int],
    erase: bool,
    state: State,
    paths: NodeArray,
) -> int:
    """Run the kernel of `Walkers.go`.

    Where loops are erased, only the last exit of every node is kept: from the start, they lead to
    the target without loops (Wilson 1996). Where they are kept, those of a trail that is full are
    erased all the same: a path without loops always fits.
    """
    words, choices, state, paths = borrowed((words, choices, state, paths))
    progress, walkers, counts, trails = state.progress, state.nodes, state.counts, state.trails
    exits, target, taken = state.exits, np.uint64(ends[1]), 0
    place = np.empty(0 if erase else trails.shape[1], np.int32)
    while progress[COMPLETE] < len(paths) and taken + WORDS <= len(words):
        # a step of every walker
        has_arrived = False
        for walker in range(LANES):
            word, node = words[taken + (walker >> 1)], walkers[walker]
            following = _next_node(choices, node, word >> HALF if walker & 1 else word & LOW)
            if erase:
                exits[walker, node] = following
            else:
                counts[walker] += 1
                trails[walker, counts[walker]] = following
            walkers[walker] = following
            has_arrived |= following == target
        taken += WORDS
        # who has arrived begins the next path
        for walker in range(LANES if has_arrived or not erase else 0):
            if walkers[walker] == target:
                row = _arrive(walker, ends, state, len(paths))
                if row < len(paths) and erase:
                    follow_exits(exits[walker], ends, paths[row])
                elif row < len(paths):
                    _copy_trail(trails[walker], counts[walker], paths[row])
                counts[walker] = 1
            elif not erase and counts[walker] == trails.shape[1] - 1:
                erase_loops(trails[walker], counts[walker], trails[walker], place)
                counts[walker] = trails[walker, 0]
    return taken


@inlined
def _next_node(choices: Choices, node: np.uint64, random: np.uint64) -> np.uint64:
    """Return where a walker goes by 32 random bits; a node has no sign, as it is an index."""
    entry = choices.entries[0, node]
    part = random * np.uint64(entry & TOTAL) >> HALF
    shift = choices.slots[np.uint64(entry >> SHIFT) + part]
    return np.uint64(np.int64(node) + shift)


@kernel
def _copy_trail(trail: NodeArray, count: int, path: NodeArray) -> None:
    """Write the nodes of a trail as a path."""
    for k in range(1, count + 1):
        path[k] = trail[k]
    path[0] = count


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
