"""Hill climbing on grid paths: the mutation of `grid_path_ga` alone, without evolution."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from evoexp.errors import SettingError, demand
from evoexp.numeric.generator_state import state_bytes
from evoexp.numeric.random_stream import Draws
from evoexp.paths.grids import NodeArray
from evoexp.planners.grid_path_ga import kernels
from evoexp.planners.grid_path_ga.kernels import COST, RESULTS, PathTable, Population
from evoexp.planners.grid_path_ga.path_operators import Scratch
from evoexp.planners.grid_path_ga.planner import BLOCK, GridPathGa, Problem, trimmed
from evoexp.planners.planner import WrappedPlanner
from evoexp.records import Block
from evoexp.validation import Count

PER_CALL = 64  # generations that are computed in one call, at most


class PathClimbing(WrappedPlanner):
    """Climbs from a few random walks at once, trial by trial in turn; keeps what costs no more.

    The best `num_paths` of as many random walks as the planner draws are kept; every generation
    makes as many trials as the planner evaluates individuals.
    """

    num_paths: Count  # paths that climb side by side

    def prepare(self, robot: Any, scenario: Any) -> Any:
        """Prepare the wrapped planner's problem."""
        must = f"left out: {self.planner.component} has no paths over a grid"
        demand(isinstance(self.planner, GridPathGa), "control", must, self.component)
        if self.num_paths > self.planner.num_evaluations(0):
            must = f"at most ga.population_size ({self.planner.num_evaluations(0)})"
            raise SettingError("control.num_paths", must, self.num_paths)
        return super().prepare(robot, scenario)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the random walks, then the climbing paths after every generation's trials."""
        assert isinstance(self.planner, GridPathGa), "prepare refuses other planners"
        return _Climbing(self.planner, problem, self.num_paths).blocks(rng)


class _Climbing(PathTable):
    """One run, and memory for its kernels; generations have the generator behind each of them."""

    def __init__(self, planner: GridPathGa, problem: Problem, num_paths: int) -> None:
        super().__init__(planner.ga, PER_CALL)
        self.make_table(problem.world, num_paths)
        self._draws = Draws(BLOCK)
        self._planner, self._problem, self._num_paths = planner, problem, num_paths
        width = problem.fields.grid.num_nodes + 1
        candidate = Population(np.empty((1, width), dtype=np.int32), np.empty((RESULTS, 1)))
        self._scratch = candidate, Scratch.of(width - 1)

    def begin(self, rng: np.random.Generator) -> None:
        """Draw the random walks; keep the best of them, in a table as wide as any path."""
        planner, problem = self._planner, self._problem
        drawn = planner.sample(problem, rng, planner.ga.population_size)
        results = planner.measured(problem, drawn)
        best = np.argsort(results[COST], kind="stable")[: self._num_paths]
        paths = np.zeros((len(best), problem.fields.grid.num_nodes + 1), dtype=np.int32)
        paths[:, : drawn.shape[1]] = drawn[best]
        self._paths = Population(paths, np.ascontiguousarray(results[:, best]))
        kernels.note(self._paths, 0, self.recorded, self.summaries)

    def go_on(self, rng: np.random.Generator, first: int, last: int) -> int:
        """Make the trials of generations; draw more numbers whenever they do not suffice."""
        self.states, num_trials = [], self._ga.num_offspring
        task = self._problem.world, self._planner.objective.weights, not self._planner.revisits
        for generation in range(first, last):
            trial, stop = generation * num_trials, (generation + 1) * num_trials
            while trial < stop:
                block = self._draws.block
                trial = kernels.climb(block, trial, stop, *task, self._paths, *self._scratch)
                if trial < stop:
                    self._draws.extend(rng)
            place = (generation + 1) % self.num_places
            kernels.note(self._paths, place, self.recorded, self.summaries)
            self.states.append(state_bytes(rng.bit_generator))
        return last

    def population(self, index: int) -> NodeArray:
        """Return the paths of the generation computed last without rests of rows."""
        paths = self._paths.paths
        return trimmed(paths) if index == self.reached else paths[:0]
