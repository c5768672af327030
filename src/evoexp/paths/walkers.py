"""Many random walks over a grid between the same two nodes, some of them at a time.

A step must wait for the step before it, which names the row to read; meanwhile the other walkers
take theirs.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.paths.grid_walks import erase_loops
from evoexp.paths.grids import NodeArray, StepArray
from evoexp.records import FloatArray, IntArray

LANES = 4  # walkers
WORDS = LANES // 2  # of 64 random bits for a step of each
MAX_SLOTS = 256  # of a node in a table of choices
ONE, HALF, LOW = np.uint64(1), np.uint64(32), np.uint64(2**32 - 1)

NEXT, COMPLETE = range(2)
"""Places in `State.progress`: the row that the next path is written to, and the complete paths."""


class Choices(NamedTuple):
    """The choices of walks to one target at every node: every move as often as it weighs.

    Both arrays are empty where there is no such table.

    Attributes:
        totals: (nodes,) sums of the weights.
        slots: (nodes, greatest sum) the node that each choice leads to.
    """

    totals: NDArray[np.uint64]
    slots: NDArray[np.int16]


class State(NamedTuple):
    """Walkers on their ways.

    Attributes:
        progress: (2,) see NEXT and COMPLETE.
        nodes: (LANES,) where each walker is.
        counts: (LANES,) number of nodes of its trail.
        rows: (LANES,) the path that it walks.
        trails: (LANES, nodes + 1) its nodes, from index 1 on.
        places: (LANES, nodes) place of every node in its trail.
    """

    progress: IntArray
    nodes: NDArray[np.uint64]
    counts: NDArray[np.uint64]
    rows: IntArray
    trails: NodeArray
    places: NodeArray


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
            choices: See `choice_table`; not empty.
            ends: Indices of start and target.
            erase: Whether loops are erased.
            paths: (paths, nodes + 1), written: a path's number of nodes, then the nodes.

        Raises:
            ValueError: If `paths` has another shape or type.
        """
        nodes = len(choices.totals)
        if paths.ndim != 2 or paths.shape[1] != nodes + 1 or paths.dtype != np.int32:
            raise ValueError(
                f"paths must be int32 (paths, {nodes + 1}), were {paths.dtype} {paths.shape}"
            )
        start, goal = ends
        self._state = State(
            progress=np.array([LANES, 0]),
            nodes=np.full(LANES, start, dtype=np.uint64),
            counts=np.ones(LANES, dtype=np.uint64),
            rows=np.arange(LANES),
            trails=np.empty((LANES, nodes + 1), dtype=np.int32),
            places=np.zeros((LANES, nodes), dtype=np.int32),
        )
        trails = self._state.trails
        trails[:, 0], trails[:, 1], self._state.places[:, start] = -1, start, 1
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

    Loops are erased in `trails` where they close, by the place of every node in `places`. A step
    has no branch, because its outcome cannot be foreseen.
    """
    words, choices, state, paths = borrowed((words, choices, state, paths))
    totals, slots, progress = choices.totals, choices.slots, state.progress
    walkers, counts, trails, places = state.nodes, state.counts, state.trails, state.places
    target, longest, taken = np.uint64(ends[1]), np.uint64(trails.shape[1] - 1), 0
    while progress[COMPLETE] < len(paths) and taken + WORDS <= len(words):
        to_look_at = False
        for pair in range(WORDS):
            word = words[taken + pair]
            for half in range(2):
                # the next node; the lane has no sign, as an index with one might count from the end
                lane = np.uint64(2 * pair + half)
                random = word >> HALF if half else word & LOW
                node = walkers[lane]
                node = np.uint64(slots[node, random * totals[node] >> HALF])
                # back to its place if the trail has it (a place may be an earlier walk's)
                count, known = counts[lane], np.uint64(places[lane, node])
                there = trails[lane, known] == np.int32(node)
                again = np.uint64(erase & (known <= count) & there)
                count = count + ONE + (known - count - ONE) * again
                trails[lane, count] = node
                places[lane, node] = count
                walkers[lane], counts[lane] = node, count
                to_look_at |= (node == target) | (count == longest)
        taken += WORDS
        if to_look_at:
            for walker in range(LANES):
                _look_at(walker, ends, erase, state, paths)
    return taken


@kernel
def _look_at(
    walker: int, ends: tuple[int, int], erase: bool, state: State, paths: NodeArray
) -> None:
    """Begin the next path where a walker has arrived; erase the loops of a trail that is full."""
    progress, walkers, counts, rows = state.progress, state.nodes, state.counts, state.rows
    trails, places = state.trails, state.places
    if walkers[walker] == ends[1]:
        # the trail becomes a path, and the walker stands at the start
        row = rows[walker]
        if row < len(paths):
            count = np.int64(counts[walker])
            for k in range(1, count + 1):
                paths[row, k] = trails[walker, k]
            paths[row, 0] = count
            progress[COMPLETE] += 1
        rows[walker] = progress[NEXT]
        progress[NEXT] += 1
        walkers[walker], counts[walker] = ends[0], 1
        trails[walker, 1] = ends[0]
        places[walker, ends[0]] = 1
    elif not erase and counts[walker] == trails.shape[1] - 1:  # a path without loops always fits
        full = int(np.int64(counts[walker]))
        erase_loops(trails[walker], full, trails[walker], places[walker])
        counts[walker] = trails[walker, 0]


def choice_table(neighbours: NodeArray, potentials: FloatArray, steps: StepArray) -> Choices:
    """Return the table of choices of walks to one target.

    It is empty if the weights are no whole numbers or the table would be large; such walks are left
    to `grid_walks.walk`.

    Args:
        neighbours: See `grids.Moves`, as for the next two.
        potentials: See there.
        steps: See there.
    """
    permitted = neighbours >= 0
    potential = np.where(permitted, potentials[steps[neighbours]], -np.inf)
    greatest = np.maximum(potential.max(axis=1, keepdims=True), 0.0)
    weights = np.where(permitted, greatest - potential + 1.0, 0.0)
    totals = weights.sum(axis=1)
    whole = bool((weights == np.floor(weights)).all())
    if not whole or totals.max() > MAX_SLOTS or len(totals) > 2**15:
        return Choices(np.empty(0, dtype=np.uint64), np.empty((0, 0), dtype=np.int16))
    slot = np.arange(int(totals.max()))
    move = np.zeros((len(totals), len(slot)), dtype=np.int64)
    for ends in np.cumsum(weights, axis=1).T[:-1]:
        move += slot >= ends[:, None]
    slots = np.take_along_axis(neighbours, move, axis=1).astype(np.int16)
    return Choices(totals.astype(np.uint64), slots)
