"""Safe paths over a grid by a genetic algorithm on paths of any length (Chen & Zalzala 1995, section 2).

Every individual is a path of neighbouring nodes from start to goal. It is valid by construction: random walks make
moves that the grid permits, and crossover and mutation put such walks together. Its cost is its length and the mean
unsafeness of its nodes, which a wave front from obstacles tells.

A population is a table of whole numbers, see `paths.grid_walks`; a solution is flat: the coordinates of its nodes, x,
y[, z] of one after the other, as many as there are.
"""

import functools
from collections.abc import Iterator
from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.collision.potential_fields import Fields, PotentialFields
from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError
from evoexp.evolution.scaled_settings import ScaledGenetic
from evoexp.evolution.statistics import cost_statistics
from evoexp.objectives.path_cost import PathCost
from evoexp.paths.grid_walks import choice_table, walk_all
from evoexp.paths.grids import UNREACHED, spread_front
from evoexp.paths.motion import Motion
from evoexp.planners import grid_kernels
from evoexp.planners.grid_kernels import COST, DISTANCE, RESULTS, UNSAFENESS
from evoexp.records import FloatArray, Generation
from evoexp.robots.floor_platform import FloorPlatform
from evoexp.scenarios.grid_motion import GridMotion
from evoexp.validation import Component, NonNegativeCount

FEW_NODES = 2048  # of grids so small the steps between all nodes are worked out once: at most 16 MB
BLOCK = 16384  # uniform numbers drawn at once, at least: what one generation leaves of them is for the next
SMALL_BLOCK = 1024  # the same, for the walks of one population, whose rest is thrown away
STEPS_PER_WALK = 2.5  # as a multiple of the fewest: for so many numbers are drawn at first


class Problem(NamedTuple):
    """What `prepare` made of robot and scenario.

    Attributes:
        fields: Grid, unsafeness, potentials.
        moves: What walks to the goal need, see `grid_walks.walk`; the last of it are the steps of every node to it.
        choices: The same as a table, see `grid_walks.choice_table`.
        ends: Indices of start and goal.
        world: What the kernels of a generation need, see `grid_kernels.advance`.
        scene: The bodies themselves, for the exact verdict on a motion.
        security_margin: Clearance that the task requires [length unit].
    """

    fields: Fields
    moves: tuple[np.ndarray, FloatArray, np.ndarray]
    choices: tuple[FloatArray, np.ndarray]
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


class GridPathGa(Component):
    """The algorithm of Chen & Zalzala, section 2.3.

    Attributes:
        revisits: Whether a path may pass a node again; if not, loops are erased wherever they arise.
        crossover_reach: How far apart two nodes may be, in every coordinate, to cross paths there that have no node in
            common [cell].
        ga: Population, generations, rates; `mutation_rate` is per path.
        objective: Weights of Eq. 1.
        collision: The potential fields.
    """

    component: ClassVar[str] = "grid_path_ga"
    revision: ClassVar[int] = 2

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
        search = _Search(self, problem)
        best_cost, best, terms = np.inf, np.empty(0), {}
        for index in range(self.ga.num_generations + 1):
            if index:
                search.advance(rng)
            else:
                search.begin(rng)
            paths, results = search.population
            statistics = cost_statistics(results[COST])
            lowest = float(results[COST, statistics.best])
            if lowest < best_cost:
                best_cost, best = lowest, self.solution(problem, paths, statistics.best)
                terms = named_terms(results[:, statistics.best], paths[statistics.best, 0])
            yield Generation(
                index=index,
                best=best,
                best_cost=best_cost,
                best_cost_in_generation=lowest,
                mean_cost=statistics.mean,
                std_cost=statistics.std,
                num_feasible=len(paths),
                evaluations=self.ga.population_size + index * self.ga.num_offspring,
                collision_queries=0,
                solved=True,
                terms=terms,
                costs=results[COST],
                population=paths,
            )

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> np.ndarray:
        """Return random paths as the initial population has them, (count, nodes + 1)."""
        paths, _ = _table(count, problem.fields.grid.num_nodes)
        arguments = (problem.moves, problem.choices, problem.ends, not self.revisits)
        uniforms = rng.random(int(STEPS_PER_WALK * count * problem.moves[2][problem.ends[0]]) + 1)
        complete, taken = walk_all(uniforms, *arguments, 0, paths)
        while complete < count:
            left = uniforms[taken:]
            uniforms = np.concatenate([left, rng.random(max(SMALL_BLOCK, len(left)))])
            complete, taken = walk_all(uniforms, *arguments, complete, paths)
        return paths

    def cost(self, problem: Problem, population: np.ndarray) -> Judgement:
        """Judge paths (individuals, nodes + 1), valid ones.

        Raises:
            ValueError: If the table has another width.
        """
        if population.ndim != 2 or population.shape[1] != problem.fields.grid.num_nodes + 1:
            raise ValueError(
                f"paths must be (individuals, {problem.fields.grid.num_nodes + 1}), was {population.shape}"
            )
        results = np.empty((RESULTS, len(population)))
        grid_kernels.measure_all(population, problem.world, self.objective.weights, results)
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
        """Return D, S and cost of a path, and what is wrong with it; the cost is inf if anything is.

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
            raise SettingError(f"path[{k}]", f"a node of the grid, whole numbers ({inside})", nodes[k].tolist())
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
            grid_kernels.measure(path, problem.world, self.objective.weights, results, 0)
        else:
            results[DISTANCE] = np.sqrt(((nodes[1:] - nodes[:-1]) ** 2).sum(axis=1)).sum()
            results[UNSAFENESS] = problem.fields.unsafeness[path[1:]].mean()
        cost = np.inf if any(faults.values()) else float(results[COST, 0])
        return named_terms(results[:, 0], len(nodes)) | faults | {"cost": cost}

    def shape(self, problem: Problem) -> tuple[Any, ...]:
        """Return the documented shape of a solution: any number of nodes of two or three coordinates."""
        return (..., (problem.fields.grid.free.ndim,))

    def _nodes(self, problem: Problem, solution: FloatArray) -> FloatArray:
        return np.asarray(solution).reshape(-1, problem.fields.grid.free.ndim)


class _Search:
    """Two populations that take turns, and memory for the kernels.

    Attributes:
        population: Paths and results of the present one.
    """

    def __init__(self, planner: GridPathGa, problem: Problem) -> None:
        ga, nodes = planner.ga, problem.fields.grid.num_nodes
        self._planner, self._problem = planner, problem
        self.population, self._other = _table(ga.population_size, nodes), _table(ga.population_size, nodes)
        count = ga.num_offspring
        parents, elites = np.empty(count, dtype=np.int64), np.empty(ga.num_elites, dtype=np.int64)
        choosing = parents, elites, np.empty(ga.population_size), np.empty(ga.population_size, dtype=np.int64)
        integers = [np.zeros(size, dtype=np.int32) for size in (nodes, 3 * nodes + 3, nodes, nodes, nodes + 1)]
        place, joined, steps, queue, walked = integers
        sites = np.zeros((2, nodes + 1), dtype=np.int32)
        self._memory = choosing, (place, joined, sites, steps, queue, walked)
        rates = ga.scaling_multiple, ga.crossover_rate, planner.crossover_reach, ga.mutation_rate
        self._breeding = (not planner.revisits, *rates)
        self._uniforms, self._taken = np.empty(0), np.zeros(1, dtype=np.int64)

    def begin(self, rng: np.random.Generator) -> None:
        """Draw the initial population."""
        planner, (paths, results) = self._planner, self._other
        paths[:] = planner.sample(self._problem, rng, len(paths))
        grid_kernels.measure_all(paths, self._problem.world, planner.objective.weights, results)
        self.population, self._other = self._other, self.population

    def advance(self, rng: np.random.Generator) -> None:
        """Go on to the next generation."""
        fixed = (self._problem.world, self._planner.objective.weights, self._breeding)
        taken, before = self._taken, self._taken[0]
        while not grid_kernels.advance((self._uniforms, taken), *fixed, self.population, self._other, self._memory):
            left = self._uniforms[before:]
            self._uniforms = np.concatenate([left, rng.random(max(BLOCK, len(left)))])
            taken[0] = before = 0
        self.population, self._other = self._other, self.population


@functools.lru_cache(maxsize=32)
def _prepared(collision: PotentialFields, robot: FloorPlatform, scenario: GridMotion) -> Problem:
    """Prepare what many planners share that differ in weights and rates alone."""
    if robot.dimensions != len(scenario.size):
        raise SettingError("robot.dimensions", f"as many as the grid has ({len(scenario.size)})", robot.dimensions)
    fields = collision.bind(scenario.blocked())
    own = fields.grid
    start, goal = own.index_of(scenario.start), own.index_of(scenario.goal)
    for name, node in (("start", start), ("goal", goal)):
        if not own.free.flat[node]:
            must = f"a node of an unsafeness of at most collision.max_unsafeness ({collision.max_unsafeness:g})"
            raise SettingError(f"scenario.{name}", must, float(fields.unsafeness[node]))
    steps = fields.steps_to(goal)
    if steps[start] == UNREACHED:
        must = f"a node that can be reached from the start {list(scenario.start)}; obstacles are between"
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
    moves = own.neighbours, fields.potentials, steps
    world += (_fronts(fields),)
    return Problem(fields, moves, choice_table(*moves), ends, world, bodies, scenario.security_margin)


def named_terms(results: FloatArray, num_nodes: Any) -> dict[str, float]:
    """Return D, S and the number of nodes of a path by name."""
    named = {"distance": float(results[DISTANCE]), "unsafeness": float(results[UNSAFENESS])}
    return named | {"num_nodes": float(num_nodes)}


def _table(count: int, nodes: int) -> tuple[np.ndarray, FloatArray]:
    return np.zeros((count, nodes + 1), dtype=np.int32), np.zeros((RESULTS, count))


def _fronts(fields: Fields) -> np.ndarray:
    """Return the steps to every node from every other, (nodes, nodes), of small grids; else (0, nodes)."""
    nodes = fields.grid.num_nodes
    fronts = np.empty((nodes if nodes <= FEW_NODES else 0, nodes), dtype=np.int32)
    queue, source = np.empty(nodes, dtype=np.int32), np.empty(1, dtype=np.int32)
    for node, steps in enumerate(fronts):
        source[0] = node
        spread_front(fields.grid.neighbours, fields.num_moves, source, steps, queue)
    return fronts
