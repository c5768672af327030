"""Random paths over a grid, drawn and measured in memory that is kept from one draw to the next."""

from typing import TYPE_CHECKING

import numpy as np

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.pcg64 import Twin, Words
from evoexp.paths.erased_walks import Exits, Sums, follow_all, room_for_exits, walk_all
from evoexp.paths.grid_choices import Choices
from evoexp.paths.grid_measures import Tolls, length_and_mean
from evoexp.paths.grids import NodeArray
from evoexp.paths.walkers import LANES, WORDS
from evoexp.planners.grid_path_ga.kernels import COST, DISTANCE, RESULTS, UNSAFENESS
from evoexp.records import FloatArray

if TYPE_CHECKING:
    from evoexp.planners.grid_path_ga.planner import Problem

STEPS_PER_WALK = 3.5  # times the fewest: random words for so many steps are drawn at first
FEW_WORDS = 512  # (a multiple of `WORDS`) drawn whenever these do not suffice; a rest is lost


class PathSampling:
    """Draws random paths without loops of one problem from one generator, and measures them."""

    def __init__(
        self,
        problem: "Problem",
        weights: tuple[float, float],
        rng: np.random.Generator,
        most: int,
    ) -> None:
        """Take memory.

        Args:
            problem: For which `is_fit` holds.
            weights: ε and λ of Eq. 1.
            rng: The generator.
            most: Paths that are drawn at once, at most.
        """
        nodes = problem.fields.grid.num_nodes
        self._problem, self._weights, self._twin = problem, weights, Twin(rng)
        self._fewest = int(problem.moves.steps[problem.ends[0]])
        self._paths = np.empty((most, nodes + 1), dtype=np.int32)
        self._exits = room_for_exits(most, nodes)
        self._sums = Sums(np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int64))

    @staticmethod
    def is_fit(problem: "Problem", rng: np.random.Generator) -> bool:
        """Return whether weights of moves and unsafeness are whole numbers, and the generator fits.

        Start and goal must differ.
        """
        whole = len(problem.choices.entries) and len(problem.world.tolls.of_node)
        fits = isinstance(rng.bit_generator, np.random.PCG64)
        return bool(whole) and fits and problem.ends[0] != problem.ends[1]

    def draw(self, count: int) -> tuple[NodeArray, FloatArray]:
        """Return paths (count, longest + 1), valid until the next draw; lengths, S, C (3, count).

        Raises:
            ValueError: If there is no memory for so many.
        """
        if not 0 < count <= len(self._paths):
            raise ValueError(f"count must be 1..{len(self._paths)}, was {count}")
        paths, results, problem = self._paths[:count], np.empty((RESULTS, count)), self._problem
        self._twin.meet()
        longest = _draw_and_measure(
            self._twin.words,
            problem.choices,
            problem.ends,
            (first_words(count, self._fewest), FEW_WORDS),
            problem.world.tolls,
            self._weights,
            self._exits,
            self._sums,
            paths,
            results,
        )
        self._twin.follow(self._twin.words)
        return paths[:, : longest + 1], results


def first_words(count: int, fewest: int) -> int:
    """Return how many random words are drawn at first for walks of so many steps at least."""
    return WORDS * (int(STEPS_PER_WALK * count * fewest / LANES) + 1)


@kernel
def _draw_and_measure(
    words: Words,
    choices: Choices,
    ends: tuple[int, int],
    blocks: tuple[int, int],
    tolls: Tolls,
    weights: tuple[float, float],
    exits: Exits,
    sums: Sums,
    paths: NodeArray,
    results: FloatArray,
) -> int:
    """Run the kernel of `PathSampling.draw`; return the number of nodes of the longest path."""
    choices, tolls, exits, sums = borrowed((choices, tolls, exits, sums))
    paths, results = borrowed((paths, results))
    walk_all(words, choices, ends, blocks, len(paths), exits)
    longest: int = follow_all(exits, ends, tolls, paths, sums)
    for k in range(len(paths)):
        distance, mean = length_and_mean(paths[k, 0], sums.moves[k], sums.levels[k])
        results[DISTANCE, k], results[UNSAFENESS, k] = distance, mean
        results[COST, k] = weights[0] * distance + weights[1] * mean
    return longest
