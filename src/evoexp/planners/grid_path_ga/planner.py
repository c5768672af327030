"""Safe paths over a grid by a genetic algorithm on paths of any length.

Chen & Zalzala 1995, section 2.

Every individual is a path of neighbouring nodes from start to goal. It is valid by construction:
random walks make moves that the grid permits, and crossover and mutation put such walks together.
Its cost is its length and the mean unsafeness of its nodes, which a wave front from obstacles
tells.

A population is a table of whole numbers, see `paths.grid_walks`; a solution is flat: the
coordinates of its nodes, x, y[, z] of one after the other, as many as there are.
"""

import functools
from collections.abc import Iterator
from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.collision.models.potential_fields import Fields, PotentialFields
from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError
from evoexp.evolution.scaled_settings import ScaledGenetic
from evoexp.numeric.random_stream import Draws
from evoexp.objectives.path_cost import PathCost
from evoexp.paths.grid_walks import walk_each
from evoexp.paths.grids import UNREACHED, Moves, spread_front
from evoexp.paths.motion import Motion
from evoexp.paths.walkers import LANES, WORDS, Choices, Walkers, choice_table
from evoexp.planners.grid_path_ga import kernels
from evoexp.planners.grid_path_ga.kernels import COST, DISTANCE, RESULTS, UNSAFENESS
from evoexp.planners.planner import PlannerDefaults
from evoexp.planners.stretches import Found, Stretches
from evoexp.records import FloatArray, Generation
from evoexp.robots.floor_platform import FloorPlatform
from evoexp.scenarios.grid_motion import GridMotion
from evoexp.validation import Component, NonNegativeCount

FEW_NODES = 2048  # of grids so small the steps between all nodes are worked out once: at most 8 MB
STRETCH = 8  # generations that are computed in one call of a kernel, at most
BLOCK = 16384  # uniform numbers drawn at once, at least
STEPS_PER_WALK = (
    3.5  # as a multiple of the fewest: for so many steps random words are drawn at first
)
# (a multiple of `WORDS`) are drawn whenever these do not suffice; what is left at the end is lost
FEW_WORDS = 512


class Problem(NamedTuple):
    """What `prepare` made of robot and scenario.

    Attributes:
        fields: Grid, unsafeness, potentials.
        moves: The moves of walks to the goal, and their weights.
        choices: The same as a table, see `walkers.choice_table`.
        ends: Indices of start and goal.
        world: What the kernels of a generation need, see `kernels.advance`.
        scene: The bodies themselves, for the exact verdict on a motion.
        security_margin: Clearance that the task requires [length unit].
    """

    fields: Fields
    moves: Moves
    choices: Choices
    ends: tuple[int, int]
    world: tuple[Any, ...]
    scene: Scene
    security_margin: float


class Judgement(NamedTuple):
    """Paths judged.

    Attributes:
        results: (3, individuals) length, mean unsafeness, cost.
        num_nodes: (individuals,).
        collision_queries: None: which nodes and moves are free is known before.
    """

    results: FloatArray
    num_nodes: np.ndarray
    collision_queries: int = 0

    @property
    def cost(self) -> FloatArray:
        """(individuals,)."""
        return np.asarray(self.results[COST])

    @property
    def feasible(self) -> np.ndarray:
        """(individuals,) true: paths are valid by construction."""
        return np.isfinite(self.cost)

    def named_terms(self, individual: int) -> dict[str, float]:
        """Return the terms of one path by name."""
        return named_terms(self.results[:, individual], self.num_nodes[individual])


class GridPathGa(PlannerDefaults, Component):
    """The algorithm of Chen & Zalzala, section 2.3.

    Attributes:
        revisits: Whether a path may pass a node again; if not, loops are erased wherever they
            arise.
        crossover_reach: How far apart two nodes may be, in every coordinate, to cross paths there
            that have no node in common [cell].
        ga: Population, generations, rates; `mutation_rate` is per path.
        objective: Weights of Eq. 1.
        collision: The potential fields.
    """

    component: ClassVar[str] = "grid_path_ga"
    revision: ClassVar[int] = 3

    revisits: bool
    crossover_reach: NonNegativeCount
    ga: ScaledGenetic
    objective: PathCost
    collision: PotentialFields

    def prepare(self, robot: FloorPlatform, scenario: GridMotion) -> Problem:
        """Work out the fields, and check that the goal can be reached.

        Raises:
            SettingError: If it cannot, or start or goal is no place to be, or the parts do not fit.
        """
        return _prepared(self.collision, robot, scenario)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the population of random paths, then every generation."""
        return _Search(self, problem).generations(rng)

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> np.ndarray:
        """Return random paths as the initial population has them, (count, longest + 1)."""
        paths = np.empty((count, problem.fields.grid.num_nodes + 1), dtype=np.int32)
        if len(problem.choices[0]):
            self._fill(problem, rng, paths)
        else:
            self._fill_one_by_one(problem, rng, paths)
        return trimmed(paths)

    def _fill(self, problem: Problem, rng: np.random.Generator, paths: np.ndarray) -> None:
        """Let walkers fill a table of paths."""
        walkers = Walkers(problem.choices, problem.ends, not self.revisits, paths)
        steps = STEPS_PER_WALK * len(paths) * problem.moves.steps[problem.ends[0]]
        num_words = WORDS * (int(steps / LANES) + 1)
        while walkers.complete < len(paths):
            walkers.go(rng.bit_generator.random_raw(num_words))
            num_words = FEW_WORDS

    def _fill_one_by_one(
        self, problem: Problem, rng: np.random.Generator, paths: np.ndarray
    ) -> None:
        """Fill a table of paths where moves weigh such that there is no table of choices."""
        draws, complete = Draws(BLOCK), 0
        place = np.zeros(problem.fields.grid.num_nodes, dtype=np.int32)
        arguments = problem.moves, problem.ends, not self.revisits
        while (complete := walk_each(draws.block, *arguments, complete, paths, place)) < len(paths):
            draws.extend(rng)

    def cost(self, problem: Problem, population: np.ndarray) -> Judgement:
        """Judge paths (individuals, longest + 1), valid ones.

        Raises:
            ValueError: If a path is empty or longer than the table is wide.
        """
        if (
            population.ndim != 2
            or not 1 <= population[:, 0].min() <= population[:, 0].max() < population.shape[1]
        ):
            raise ValueError(f"paths must be (individuals, longest + 1), was {population.shape}")
        results = np.empty((RESULTS, len(population)))
        kernels.measure_all(population, problem.world, self.objective.weights, results)
        return Judgement(results, population[:, 0])

    def solution(self, problem: Problem, population: np.ndarray, individual: int) -> FloatArray:
        """Return a path as a flat solution."""
        path = population[individual]
        nodes = problem.fields.grid.coordinates[path[1 : path[0] + 1]]
        return np.asarray(nodes, dtype=np.float64).ravel()

    def motion(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the motion of a solution: from node to node in equal times."""
        return Motion(np.ascontiguousarray(self._nodes(problem, solution)))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return D, S and cost of a path, and what is wrong with it.

        The cost is inf if anything is.

        Raises:
            SettingError: If it has fewer than two nodes, or one that is none of the grid's.
        """
        nodes, own = self._nodes(problem, solution), problem.fields.grid
        last = np.array(own.free.shape) - 3
        if len(nodes) < 2:
            raise SettingError("path", "two nodes at least", nodes.tolist())
        are_nodes = ((nodes == np.floor(nodes)) & (nodes >= 0) & (nodes <= last)).all(axis=1)
        if not are_nodes.all():
            k, inside = int(are_nodes.argmin()), " × ".join(f"0..{value}" for value in last)
            raise SettingError(
                f"path[{k}]", f"a node of the grid, whole numbers ({inside})", nodes[k].tolist()
            )
        indices = np.ravel_multi_index(tuple(nodes.astype(np.int64).T + 1), own.free.shape)
        path = np.array([len(nodes), *indices], dtype=np.int32)
        made = (own.neighbours[indices[:-1]] == indices[1:, None]).any(axis=1)
        faults = {
            "blocked_nodes": float(np.count_nonzero(~own.free.ravel()[path[1:]])),
            "forbidden_moves": float(np.count_nonzero(~made)),
            "missed_ends": float((path[1] != problem.ends[0]) + (path[-1] != problem.ends[1])),
        }
        results = np.full((RESULTS, 1), np.inf)
        if made.all():
            kernels.measure(path, problem.world, self.objective.weights, results, 0)
        else:
            results[DISTANCE] = np.sqrt(((nodes[1:] - nodes[:-1]) ** 2).sum(axis=1)).sum()
            results[UNSAFENESS] = problem.fields.unsafeness[path[1:]].mean()
        cost = np.inf if any(faults.values()) else float(results[COST, 0])
        return named_terms(results[:, 0], len(nodes)) | faults | {"cost": cost}

    def shape(self, problem: Problem) -> tuple[Any, ...]:
        """Return the documented shape of a solution.

        Any number of nodes of two or three coordinates.
        """
        return (..., (problem.fields.grid.free.ndim,))

    def _nodes(self, problem: Problem, solution: FloatArray) -> FloatArray:
        return np.asarray(solution).reshape(-1, problem.fields.grid.free.ndim)


class _Search(Stretches):
    """One run, and memory for its kernels."""

    def __init__(self, planner: GridPathGa, problem: Problem) -> None:
        ga, nodes = planner.ga, problem.fields.grid.num_nodes
        super().__init__(ga, STRETCH, BLOCK)
        self._planner, self._problem = planner, problem
        self._paths = np.empty((self.num_places, ga.population_size, nodes + 1), dtype=np.int32)
        self._results = np.empty((self.num_places, RESULTS, ga.population_size))
        self.costs = self._results[:, COST]
        count = ga.num_offspring
        parents, elites = np.empty(count, dtype=np.int64), np.empty(ga.num_elites, dtype=np.int64)
        choosing = (
            parents,
            elites,
            np.empty(ga.population_size),
            np.empty(ga.population_size, dtype=np.int64),
        )
        integers = [
            np.zeros(size, dtype=np.int32)
            for size in (nodes, 3 * nodes + 3, nodes, nodes, nodes + 1)
        ]
        place, joined, steps, queue, walked = integers
        sites = np.zeros((2, nodes + 1), dtype=np.int32)
        memory = choosing, (place, joined, sites, steps, queue, walked)
        rates = ga.scaling_multiple, ga.crossover_rate, planner.crossover_reach, ga.mutation_rate
        self._world = problem.world, planner.objective.weights
        tables = self._paths, self._results
        self._arguments = (
            *self._world,
            (not planner.revisits, *rates),
            tables,
            memory,
            self.records,
        )

    def begin(self, rng: np.random.Generator) -> None:
        """Draw and measure the initial population."""
        drawn = self._planner.sample(self._problem, rng, self._paths.shape[1])
        self._paths[0, :, : drawn.shape[1]] = drawn
        kernels.measure_all(self._paths[0], *self._world, self._results[0])
        kernels.record(self._results[0], self.records[0])

    def go_on(self, draws: tuple[np.ndarray, np.ndarray], first: int, last: int) -> int:
        """Compute generations."""
        return int(kernels.evolve(draws, (first, last), *self._arguments))

    def found(self, place: int, individual: int) -> Found:
        """Return a path, which is valid, and its terms."""
        paths, results = self._paths[place], self._results[place]
        terms = named_terms(results[:, individual], paths[individual, 0])
        return Found(self._planner.solution(self._problem, paths, individual), terms, True)

    def population(self, place: int, is_last: bool) -> np.ndarray:
        """Return the paths; of the last generation without what stands behind them."""
        return trimmed(self._paths[place]) if is_last else self._paths[place]


def trimmed(paths: np.ndarray) -> np.ndarray:
    """Return a copy of paths as wide as the longest one; zeros stand behind the others."""
    out = np.zeros((len(paths), int(paths[:, 0].max()) + 1), dtype=np.int32)
    kernels.copy_paths(paths, out)
    return out


@functools.lru_cache(maxsize=32)
def _prepared(collision: PotentialFields, robot: FloorPlatform, scenario: GridMotion) -> Problem:
    """Prepare what many planners share that differ in weights and rates alone."""
    if robot.dimensions != len(scenario.size):
        raise SettingError(
            "robot.dimensions", f"as many as the grid has ({len(scenario.size)})", robot.dimensions
        )
    fields = collision.bind(scenario.blocked())
    own = fields.grid
    start, goal = own.index_of(scenario.start), own.index_of(scenario.goal)
    for name, node in (("start", start), ("goal", goal)):
        if not own.free.flat[node]:
            must = (
                "a node of an unsafeness of at most collision.max_unsafeness "
                f"({collision.max_unsafeness:g})"
            )
            raise SettingError(f"scenario.{name}", must, float(fields.unsafeness[node]))
    steps = fields.steps_to(goal)
    if steps[start] == UNREACHED:
        must = (
            f"a node that can be reached from the start {list(scenario.start)}; obstacles are "
            "between"
        )
        raise SettingError("scenario.goal", must, list(scenario.goal))
    world: tuple[Any, ...] = (
        own.neighbours,
        fields.num_moves,
        own.coordinates,
        own.kinds,
        fields.unsafeness,
        fields.potentials,
    )
    ends = start, goal
    bodies = scene(robot.build(), scenario.bodies())
    moves = Moves(own.neighbours, fields.potentials, steps)
    world += (_fronts(fields),)
    return Problem(
        fields, moves, choice_table(*moves), ends, world, bodies, scenario.security_margin
    )


def named_terms(results: FloatArray, num_nodes: Any) -> dict[str, float]:
    """Return D, S and the number of nodes of a path by name."""
    named = {"distance": float(results[DISTANCE]), "unsafeness": float(results[UNSAFENESS])}
    return named | {"num_nodes": float(num_nodes)}


def _fronts(fields: Fields) -> np.ndarray:
    """Return the steps to every node from every other, (nodes, nodes), of small grids.

    Else (0, nodes).
    """
    nodes = fields.grid.num_nodes
    fronts = np.empty((nodes if nodes <= FEW_NODES else 0, nodes), dtype=np.int16)
    queue, source = np.empty(nodes, dtype=np.int32), np.empty(1, dtype=np.int32)
    for node, steps in enumerate(fronts):
        source[0] = node
        spread_front(fields.grid.neighbours, fields.num_moves, source, steps, queue)
    return fronts
