"""Random paths over a grid, drawn and measured in memory that is kept from one draw to the next."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.generator_state import STATE_SIZE, state_bytes
from evoexp.numeric.pcg64 import Twin, Words
from evoexp.paths.erased_walks import Exits, Sums, follow_all, room_for_exits, walk_all
from evoexp.paths.grid_choices import Choices
from evoexp.paths.grid_measures import Tolls, length_and_mean
from evoexp.paths.grids import NodeArray
from evoexp.paths.walkers import LANES, WORDS
from evoexp.planners.grid_path_ga.kernels import (
    COST,
    DISTANCE,
    RESULTS,
    UNSAFENESS,
    Population,
    candidate_of,
    note,
)
from evoexp.planners.planner import Candidate
from evoexp.planners.table_search import TableSearch
from evoexp.records import FloatArray

if TYPE_CHECKING:
    from evoexp.planners.grid_path_ga.planner import GridPathGa, Problem

STEPS_PER_WALK = 3.5  # times the fewest: random words for so many steps are drawn at first
PER_CALL = 64  # generations of random paths that are drawn in one call, at most
FEW_WORDS = 512  # (a multiple of `WORDS`) drawn whenever these do not suffice; a rest is lost


class Drawing(NamedTuple):
    """Random walks, and what is written of them.

    Attributes:
        choices: See `walk_all`, as for `ends`, `blocks` and `exits`.
        ends: Indices of start and goal.
        blocks: Words of the first block, and of each further one.
        tolls: Of moves and nodes.
        exits: Written.
        sums: Along each path, written.
        paths: (paths, nodes + 1) written, see `follow_all`.
    """

    choices: Choices
    ends: tuple[int, int]
    blocks: tuple[int, int]
    tolls: Tolls
    exits: Exits
    sums: Sums
    paths: NodeArray


class PathSampling:
    """Draws random paths without loops of one problem from one generator."""

    def __init__(self, problem: "Problem", rng: np.random.Generator, most: int) -> None:
        """Take memory.

        Args:
            problem: For which `is_fit` holds.
            rng: The generator.
            most: Paths that are drawn at once, at most.
        """
        nodes = problem.fields.grid.num_nodes
        self._problem, self._twin = problem, Twin(rng)
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

    def draw(self, count: int) -> NodeArray:
        """Return paths (count, longest + 1), valid until the next draw.

        Raises:
            ValueError: If there is no memory for so many.
        """
        return self._run(_draw, count)

    def draw_generations(
        self,
        count: int,
        weights: tuple[float, float],
        span: tuple[int, int],
        found: Population,
        summaries: FloatArray,
        states: Words,
    ) -> NodeArray:
        """Draw and measure the paths of some generations, as if one after the other.

        Args:
            count: Paths of each.
            weights: ε and λ of Eq. 1.
            span: The first and the last generation.
            found: What is recorded of some generations, see `kernels.note`; number g is at place g
                modulo the number of places.
            summaries: (places, 4) likewise.
            states: (places, 2) written: the generator's state behind each, high half first.

        Returns:
            The paths of the last generation, see `draw`.

        Raises:
            ValueError: If there is no memory for so many.
        """
        return self._run(_draw_generations, count, weights, span, found, summaries, states)

    def _run(self, kernel: Callable[..., int], count: int, *arguments: Any) -> NodeArray:
        """Run a kernel that draws; let the generator follow."""
        if not 0 < count <= len(self._paths):
            raise ValueError(f"count must be 1..{len(self._paths)}, was {count}")
        problem, paths = self._problem, self._paths[:count]
        self._twin.meet()
        blocks = first_words(count, self._fewest), FEW_WORDS
        task = problem.choices, problem.ends, blocks, problem.world.tolls
        drawing = Drawing(*task, self._exits, self._sums, paths)
        longest = kernel(self._twin.words, drawing, *arguments)
        self._twin.follow(self._twin.words[:2])
        return paths[:, : longest + 1]


class RandomPaths(TableSearch):
    """Generations of random paths, each drawn anew: the random search of a path search."""

    def __init__(self, planner: "GridPathGa", problem: "Problem", rng: np.random.Generator) -> None:
        """Begin a run.

        Args:
            planner: Whose sampling, cost and budget are used.
            problem: For which `PathSampling.is_fit` holds.
            rng: The generator.
        """
        ga = planner.ga
        super().__init__(ga, PER_CALL)
        self._weights, self._world = planner.objective.weights, problem.world
        self._sampling = PathSampling(problem, rng, ga.population_size)
        self._best = np.empty((self.num_places, problem.fields.grid.num_nodes + 1), dtype=np.int32)
        self._states = np.empty((self.num_places, 2), dtype=np.uint64)

    def begin(self, rng: np.random.Generator) -> None:
        """Draw the initial population."""
        self._draw(self._ga.population_size, 0, 0)

    def go_on(self, rng: np.random.Generator, first: int, last: int) -> int:
        """Draw generations; only the paths of the last one of them are kept."""
        self._draw(self._ga.num_offspring, first + 1, last)
        rest = state_bytes(rng.bit_generator)[STATE_SIZE:]
        places = np.arange(first + 1, last + 1) % self.num_places
        self.states = [state.tobytes() + rest for state in self._states[places, ::-1]]
        return last

    def _draw(self, count: int, first: int, last: int) -> None:
        if first < 2:  # more paths are drawn at first than later
            self._results = np.empty((self.num_places, RESULTS, count))
            self.costs = self._results[:, COST]
        self._paths = self._sampling.draw_generations(
            count,
            self._weights,
            (first, last),
            Population(self._best, self._results),
            self.summaries,
            self._states,
        )

    def candidate(self, place: int, individual: int) -> Candidate:
        """Return the best path of a generation, and its terms."""
        return candidate_of(self._best[place], self._world, self._results[place, :, individual])

    def population(self, index: int) -> NodeArray:
        """Return the paths of the last generation that was drawn, nothing of those before it."""
        return self._paths if index == self.reached else self._paths[:0]


def first_words(count: int, fewest: int) -> int:
    """Return how many random words are drawn at first for walks of so many steps at least."""
    return WORDS * (int(STEPS_PER_WALK * count * fewest / LANES) + 1)


@kernel
def _draw(words: Words, drawing: Drawing) -> int:
    """Run the kernel of `PathSampling.draw`; return the number of nodes of the longest path."""
    choices, ends, blocks, tolls, exits, sums, paths = drawing
    walk_all(words, choices, ends, blocks, len(paths), exits)
    longest: int = follow_all(exits, ends, tolls, paths, sums)
    return longest


@kernel
def _draw_generations(
    words: Words,
    drawing: Drawing,
    weights: tuple[float, float],
    span: tuple[int, int],
    found: Population,
    summaries: FloatArray,
    states: Words,
) -> int:
    """Run the kernel of `PathSampling.draw_generations`; return the same of the last generation."""
    drawing, found, summaries, states = borrowed((drawing, found, summaries, states))
    paths, sums, longest = drawing.paths, drawing.sums, 0
    results = np.empty((RESULTS, len(paths)))
    for generation in range(span[0], span[1] + 1):
        place = generation % len(summaries)
        longest = _draw(words, drawing)
        states[place, 0], states[place, 1] = words[0], words[1]
        for k in range(len(paths)):
            distance, mean = length_and_mean(paths[k, 0], sums.moves[k], sums.levels[k])
            results[DISTANCE, k], results[UNSAFENESS, k] = distance, mean
            results[COST, k] = weights[0] * distance + weights[1] * mean
        note(Population(paths, results), place, found, summaries)
    return longest
