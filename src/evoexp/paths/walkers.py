"""Many random walks over a grid between the same two nodes.

Some at a time, one step of each after the other.

A step waits for the one before it, which says where to look; meanwhile the other walkers take
theirs.
"""

from typing import Any

import numpy as np

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.paths.grid_walks import erase_loops
from evoexp.records import FloatArray

LANES = 4  # walkers
WORDS = LANES // 2  # of 64 random bits for a step of each
MAX_SLOTS = 256  # of a node in a table of choices
ONE, HALF, LOW = np.uint64(1), np.uint64(32), np.uint64(2**32 - 1)

NEXT, COMPLETE = range(2)


class Walkers:
    """Walkers who fill a table of paths; whoever arrives begins the next one.

    Attributes:
        complete: How many paths are.
    """

    def __init__(
        self,
        choices: tuple[np.ndarray, np.ndarray],
        ends: tuple[int, int],
        erase: bool,
        paths: np.ndarray,
    ) -> None:
        """Put the walkers at the start.

        Args:
            choices: See `choice_table`; not empty.
            ends: Indices of start and target.
            erase: Whether loops are erased.
            paths: (paths, nodes + 1) written: a path's number of nodes, then these.
        """
        nodes = len(choices[0])
        if paths.ndim != 2 or paths.shape[1] != nodes + 1 or paths.dtype != np.int32:
            raise ValueError(
                f"paths must be int32 (paths, {nodes + 1}), were {paths.dtype} {paths.shape}"
            )
        lanes = (
            np.full(LANES, ends[0], dtype=np.uint64),
            np.ones(LANES, dtype=np.uint64),
            np.arange(LANES),
        )
        trails, places = (
            np.empty((LANES, nodes + 1), dtype=np.int32),
            np.zeros((LANES, nodes), dtype=np.int32),
        )
        trails[:, 0], trails[:, 1], places[:, ends[0]] = -1, ends[0], 1
        self._progress = np.array([LANES, 0])
        self._state: Any = self._progress, lanes, trails, places
        self._arguments: Any = choices, ends, erase
        self._paths = paths
        if ends[0] == ends[1]:
            paths[:, 0], paths[:, 1] = 1, ends[0]
            self._progress[COMPLETE] = len(paths)

    @property
    def complete(self) -> int:
        """How many paths are."""
        return int(self._progress[COMPLETE])

    def go(self, words: np.ndarray) -> int:
        """Go on until all paths are complete or the random words (uint64) are used up.

        Return how many were taken.

        Half a word says where one walker goes, the lower one where that with the even number does.
        """
        if words.dtype != np.uint64:
            raise ValueError(f"words must be uint64, were {words.dtype}")
        return int(_go(words, *self._arguments, self._state, self._paths))


@kernel
def _go(
    words: NDArray[np.uint64],
    choices: Choices,
    ends: tuple[int, int],
    erase: bool,
    state: State,
    paths: NDArray[np.int32],
) -> int:
    """The kernel of `Walkers`.

    Loops are erased where they close, in `trails`; of a node that a trail passes, `places` knows
    the place. Nothing of a step is a branch, which would be guessed wrong.
    """
    words, (totals, slots), state, paths = borrowed((words, choices, state, paths))
    progress, (walkers, counts, _), trails, places = state
    target, longest, taken = np.uint64(ends[1]), np.uint64(trails.shape[1] - 1), 0
    while progress[COMPLETE] < len(paths) and taken + WORDS <= len(words):
        to_look_at = False
        for pair in range(WORDS):
            word = words[taken + pair]
            for half in range(2):
                lane = np.uint64(
                    2 * pair + half
                )  # without a sign, as an index might count from the end
                random = word >> HALF if half else word & LOW
                node = walkers[lane]
                node = np.uint64(slots[node, random * totals[node] >> HALF])
                count, known = (
                    counts[lane],
                    np.uint64(places[lane, node]),
                )  # known since an earlier walk, perhaps
                again = np.uint64(
                    erase & (known <= count) & (trails[lane, known] == np.int32(node))
                )
                count = (
                    count + ONE + (known - count - ONE) * again
                )  # so written it stays without a branch
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
    walker: int, ends: tuple[int, int], erase: bool, state: State, paths: NDArray[np.int32]
) -> None:
    """Have a walker who has arrived begin the next path.

    And one whose trail is full erase its loops.
    """
    progress, (walkers, counts, rows), trails, places = state
    if walkers[walker] == ends[1]:
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
    elif not erase and counts[walker] == trails.shape[1] - 1:  # what has no loops fits always
        erase_loops(trails[walker], np.int64(counts[walker]), trails[walker], places[walker])
        counts[walker] = trails[walker, 0]


def choice_table(
    neighbours: np.ndarray, potentials: FloatArray, steps: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the choices of walks to one target at every node: every move as often as it weighs.

    Args:
        neighbours: (nodes, moves), see `grids.Grid`.
        potentials: See `grid_walks.walk`.
        steps: (nodes,) of the front from the target.

    Returns:
        Sums of the weights (nodes,), and where such a move leads to, (nodes, greatest sum). Both
        are empty if the weights are no whole numbers, or if the table would be large; then only
        `grid_walks.walk` is left.
    """
    permitted = neighbours >= 0
    potential = np.where(permitted, potentials[steps[neighbours]], -np.inf)
    greatest = np.maximum(potential.max(axis=1, keepdims=True), 0.0)
    weights = np.where(permitted, greatest - potential + 1.0, 0.0)
    totals = weights.sum(axis=1)
    whole = bool((weights == np.floor(weights)).all())
    if not whole or totals.max() > MAX_SLOTS or len(totals) > 2**15:
        return np.empty(0, dtype=np.uint64), np.empty((0, 0), dtype=np.int16)
    slot = np.arange(int(totals.max()))
    move = np.zeros((len(totals), len(slot)), dtype=np.int64)
    for ends in np.cumsum(weights, axis=1).T[:-1]:
        move += slot >= ends[:, None]
    return totals.astype(np.uint64), np.take_along_axis(neighbours, move, axis=1).astype(np.int16)
