"""Safe paths over a grid by a genetic algorithm on paths of any length.

Chen & Zalzala 1995, section 2. Every individual is a path of neighbouring nodes from start to goal,
valid by construction: random walks make permitted moves, and crossover and mutation join them. Its
cost is the weighted sum of its length and the mean unsafeness of its nodes.

A population is a table of whole numbers, see `paths.grids`; a solution is flat: the
coordinates x, y[, z] of all its nodes, one after the other.
"""

import functools
from collections.abc import Iterator
from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.collision.certifier.certificate import is_proven
from evoexp.collision.potential_fields import Fields, PotentialFields
from evoexp.collision.scene import Part, Scene, scene
from evoexp.errors import SettingError, demand
from evoexp.evolution.operators.operator import ScaledGenetic
from evoexp.numeric.random_stream import Draws, used_up
from evoexp.paths import grids
from evoexp.paths.motion import Motion
from evoexp.planners.answers import Acceptance
from evoexp.planners.driver import ScaledSearch
from evoexp.planners.grid_path_ga import kernels
from evoexp.planners.grid_path_ga.path_operators import Breeding, Scratch, World
from evoexp.planners.planner import JudgementArrays, PlannerDefaults
from evoexp.records import Block, FloatArray
from evoexp.robots.arms import FloorPlatform
from evoexp.scenarios.grid_motion import GridMotion
from evoexp.validation import Component, NonNegative, NonNegativeCount

FEW_NODES = 1200  # weights of moves toward all nodes of smaller grids are kept: 12 MB of a floor
MOST_NODES = 2**15  # of a grid whose first paths walkers draw in turns
MOST_WEIGHT = 256  # of the moves of a node of such a grid
FAULTS = "blocked_nodes", "forbidden_moves", "missed_ends"  # with one, a path costs inf
KEPT = 2  # generations whose paths are in memory
PER_CALL = 8  # generations; see `ScaledSearch`: another number needs another revision
STEPS_PER_WALK = 3.5  # times the fewest: random words for so many steps are drawn at first
MORE_WORDS = 512  # (a multiple of `WORDS`) drawn whenever these do not suffice; a rest is lost
BLOCK = 16384  # uniform numbers drawn at once, at least


class PathCost(Component):
    """Weights of Eq. 1, C = ε D + λ S."""

    distance_weight: NonNegative  # ε, of the length D (Eq. 2) [1/cell]
    unsafeness_weight: NonNegative  # λ, of the mean unsafeness S of the path's nodes (Eq. 3) [-]

    def _check(self) -> None:
        must = "above 0, or unsafeness_weight is: else all paths cost 0"
        self.demand("distance_weight", any(self.weights), must)

    @property
    def weights(self) -> tuple[float, float]:
        """(ε, λ), as kernels take them."""
        return self.distance_weight, self.unsafeness_weight


class Problem(NamedTuple):
    """Robot and scenario, prepared for the search."""

    fields: Fields  # grid, unsafeness, potentials
    moves: grids.Moves  # the moves of walks to the goal, and their weights
    # (nodes, moves) of these weights; (0, moves) where walkers do not take turns
    sums: grids.SumArray
    ends: tuple[int, int]  # indices of start and goal
    world: World  # grid and fields, as the kernels take them
    scene: Scene  # the bodies themselves, for the exact verdict on a motion
    security_margin: float  # clearance that the task requires [length unit]


class GridPathGa(PlannerDefaults, Component):
    """The algorithm of Chen & Zalzala, section 2.3."""

    revision: ClassVar[int] = 3

    revisits: bool  # whether a path may pass a node again; if not, all loops are erased
    # greatest difference of two nodes, in every coordinate, at which paths without a common
    # node may be crossed [cell]
    crossover_reach: NonNegativeCount
    ga: ScaledGenetic  # population, generations, rates; `mutation_rate` is per path
    objective: PathCost  # weights of Eq. 1
    collision: PotentialFields  # the potential fields
    # which moves a path may make: those between free nodes, or those of them that the exact
    # certifier proves
    acceptance: Acceptance = "model"

    def prepare(self, robot: FloorPlatform, scenario: GridMotion) -> Problem:
        """Work out the fields, and check that the goal can be reached."""
        return _prepared(self.collision, self.acceptance, robot, scenario)

    def prior_queries(self, problem: Problem) -> int:
        """Return the number of nodes of the map, which says of each whether it is free."""
        grid = problem.fields.grid
        return int(grid.inner(grid.free).size)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the population of random paths, then every generation."""
        return _Search(self, problem).blocks(rng)

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> np.ndarray:
        """Return random paths as in the initial population, (count, longest + 1)."""
        nodes, moves, ends = problem.fields.grid.num_nodes, problem.moves, problem.ends
        paths = np.empty((count, nodes + 1), dtype=np.int32)
        if len(problem.sums):
            # walkers fill the table, from the start with more words if some lack
            fewest = int(moves.steps[ends[0]])
            first = grids.WORDS * (int(STEPS_PER_WALK * count * fewest / grids.LANES) + 1)
            walks = first, MORE_WORDS, moves.neighbours, problem.sums, ends, not self.revisits
            words = rng.bit_generator.random_raw(first)
            while grids.walk_all(words, *walks, paths) < 0:
                words = np.concatenate([words, rng.bit_generator.random_raw(MORE_WORDS)])
            return trimmed(paths)
        draws, place = Draws(BLOCK), np.zeros(nodes, dtype=np.int32)
        task = moves, problem.world.sums[:0], ends, not self.revisits
        for path in paths:
            before = draws.block.taken.item(0)
            grids.walk(draws.block, *task, path, place)
            while used_up(draws.block):
                draws.block.taken[0], before = before, 0
                draws.extend(rng)
                grids.walk(draws.block, *task, path, place)
        return trimmed(paths)

    def cost(self, problem: Problem, population: np.ndarray) -> JudgementArrays:
        """Judge paths (individuals, longest + 1), which are valid by construction."""
        sizes = population[..., 0]
        if population.ndim != 2 or not 1 <= sizes.min() <= sizes.max() < population.shape[1]:
            raise ValueError(f"paths must be (individuals, longest + 1), was {population.shape}")
        distance, unsafeness, cost = self.measured(problem, population)
        terms = {"distance": distance, "unsafeness": unsafeness, "num_nodes": population[:, 0]}
        return JudgementArrays(cost, np.isfinite(cost), 0, terms)

    def measured(self, problem: Problem, paths: grids.NodeArray) -> FloatArray:
        """Return lengths, mean unsafenesses and costs of paths, (3, individuals)."""
        results = np.empty((kernels.RESULTS, len(paths)))
        kernels.measure_all(paths, problem.world, self.objective.weights, results)
        return results

    def solution(self, problem: Problem, population: np.ndarray, individual: int) -> FloatArray:
        """Return a path as a flat solution."""
        return kernels.solution_of(population[individual], problem.world)

    def motion(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the motion of a solution: from node to node in equal times."""
        return Motion(np.ascontiguousarray(self._nodes(problem, solution)))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return D, S and cost of a path, and the numbers of its faults; with one it costs inf."""
        nodes, own = self._nodes(problem, solution), problem.fields.grid
        last = np.array(own.free.shape) - 3
        demand(len(nodes) >= 2, "path", "two nodes at least", nodes.tolist())
        are_nodes = ((nodes == np.floor(nodes)) & (nodes >= 0) & (nodes <= last)).all(axis=1)
        k, inside = int(are_nodes.argmin()), " × ".join(f"0..{value}" for value in last)
        must = f"a node of the grid, whole numbers ({inside})"
        demand(are_nodes.all(), f"path[{k}]", must, nodes[k].tolist())
        indices = np.ravel_multi_index(tuple(nodes.astype(np.int64).T + 1), own.free.shape)
        path = np.array([len(nodes), *indices], dtype=np.int32)
        made = (own.neighbours[indices[:-1]] == indices[1:, None]).any(axis=1)
        counts = (
            np.count_nonzero(~own.free.ravel()[path[1:]]),
            np.count_nonzero(~made),
            (path[1] != problem.ends[0]) + (path[-1] != problem.ends[1]),
        )
        faults = dict(zip(FAULTS, map(float, counts), strict=True))
        results = np.full((kernels.RESULTS, 1), np.inf)
        if made.all():
            kernels.measure(path, problem.world, self.objective.weights, results, 0)
        else:
            results[kernels.DISTANCE] = np.sqrt(((nodes[1:] - nodes[:-1]) ** 2).sum(axis=1)).sum()
            results[kernels.UNSAFENESS] = problem.fields.unsafeness[path[1:]].mean()
        cost = np.inf if any(faults.values()) else float(results[kernels.COST, 0])
        return kernels.named_terms(results[:, 0], len(nodes)) | faults | {"cost": cost}

    def departures(self, problem: Problem, solution: FloatArray) -> list[str]:
        """Name the faults that `evaluate` counts: ends, blocked nodes, forbidden moves."""
        terms = self.evaluate(problem, solution)
        present = [name for name in FAULTS if terms[name] > 0.0]
        return [f"{name.replace('_', ' ')}: {terms[name]:.0f}" for name in present]

    def memory(self, problem: Problem) -> int:
        """Return the memory of the paths of a call, each as long as there are nodes."""
        width = 4 * (problem.fields.grid.num_nodes + 1)
        return (KEPT + 2) * width * self.ga.population_size

    def shape(self, problem: Problem) -> tuple[Any, ...]:
        """Return the documented shape of a solution: any number of nodes, each its coordinates."""
        return (..., (problem.fields.grid.free.ndim,))

    def _nodes(self, problem: Problem, solution: FloatArray) -> FloatArray:
        return np.asarray(solution).reshape(-1, problem.fields.grid.free.ndim)


class _Search(kernels.PathTable, ScaledSearch):
    def __init__(self, planner: GridPathGa, problem: Problem) -> None:
        ga, nodes, size = planner.ga, problem.fields.grid.num_nodes, planner.ga.population_size
        ScaledSearch.__init__(self, ga, PER_CALL, BLOCK)
        self.make_table(problem.world, size)
        self._planner, self._problem = planner, problem
        self.table = kernels.Population(
            np.empty((KEPT, size, nodes + 1), dtype=np.int32),
            np.empty((KEPT, kernels.RESULTS, size)),
        )
        breeding = Breeding(
            not planner.revisits,
            ga.num_elites,
            ga.scaling_multiple,
            ga.crossover_rate,
            planner.crossover_reach,
            ga.mutation_rate,
        )
        self._settings, self._scratch = (planner.objective.weights, breeding), Scratch.of(nodes)

    def begin(self, rng: np.random.Generator) -> None:
        paths, results = present = self.at(0)
        drawn = self._planner.sample(self._problem, rng, len(paths))
        paths[:, : drawn.shape[1]] = drawn
        results[:] = self._planner.measured(self._problem, paths)
        self.note(present, 0)

    def breed(self, present: kernels.Population, following: kernels.Population) -> bool:
        rules, populations = self._settings, (present, following)
        task = self.draws.block, self._problem.world
        return bool(kernels.advance(*task, *rules, *populations, self._scratch))

    def note(self, population: kernels.Population, place: int) -> None:
        kernels.note(population, place, self.recorded, self.summaries)

    def population(self, index: int) -> grids.NodeArray:
        """Return the paths of one of the generations computed last, without rests of rows."""
        paths: grids.NodeArray = self.at(index).paths
        return trimmed(paths) if index > self.reached - KEPT else paths[:0]


def trimmed(paths: grids.NodeArray) -> grids.NodeArray:
    """Return a copy of paths as wide as the longest one; zeros stand behind the others."""
    width = int(paths[:, 0].max()) + 1
    return np.where(np.arange(width) <= paths[:, :1], paths[:, :width], np.int32(0))


@functools.lru_cache(maxsize=32)
def _prepared(
    collision: PotentialFields, acceptance: Acceptance, robot: FloorPlatform, scenario: GridMotion
) -> Problem:
    """Prepare a problem, kept for planners that differ in weights and rates alone."""
    must = f"the dimensions of the grid ({len(scenario.size)})"
    demand(robot.dimensions == len(scenario.size), "robot.dimensions", must, robot.dimensions)
    fields, margin = collision.bind(scenario.blocked()), scenario.security_margin
    bodies, between = scene(robot.build(), scenario.bodies()), "obstacles"
    if acceptance != "model":
        proven = only_proven(fields.grid, bodies, margin, acceptance == "margin")
        fields, between = fields._replace(grid=proven), "obstacles, or moves that are not proven,"
    own = fields.grid
    start, goal = own.index_of(scenario.start), own.index_of(scenario.goal)
    for name, node in (("start", start), ("goal", goal)):
        if not own.free.flat[node]:
            must = "a node of an unsafeness of at most collision.max_unsafeness "
            must += f"({collision.max_unsafeness:g})"
            raise SettingError(f"scenario.{name}", must, float(fields.unsafeness[node]))
    steps = fields.steps_to(goal)
    must = f"a node that can be reached from the start {list(scenario.start)}; "
    must += f"{between} are between"
    demand(steps[start] != grids.UNREACHED, "scenario.goal", must, list(scenario.goal))
    world = World(
        own.neighbours,
        fields.num_moves,
        own.coordinates,
        own.kinds,
        fields.unsafeness,
        fields.potentials,
        _weigh_moves(fields),
    )
    moves = grids.Moves(own.neighbours, fields.potentials, steps)
    # toward the goal; walkers take turns on grids of few nodes whose sums are small whole numbers
    exact = grids.weigh_all(moves)
    sums = np.minimum(exact, MOST_WEIGHT).astype(np.uint16)
    if len(sums) > MOST_NODES or (sums != exact).any():
        sums = sums[:0]
    return Problem(fields, moves, sums, (start, goal), world, bodies, margin)


def _weigh_moves(fields: Fields) -> grids.SumArray:
    """Return `weigh_all` toward every node; none of large grids, or where 8 bits hold no sum."""
    grid, potentials = fields.grid, fields.potentials
    nodes, moves = grid.neighbours.shape
    tables = np.empty((nodes if nodes <= FEW_NODES else 0, nodes, moves), dtype=np.uint8)
    steps, queue = (np.empty(nodes, dtype=np.int32) for _ in range(2))
    for node, table in enumerate(tables):
        source = np.array([node], dtype=np.int32)
        grids.spread_front(grid.neighbours, fields.num_moves, source, steps, queue)
        sums = grids.weigh_all(grids.Moves(grid.neighbours, potentials, steps))
        table[:] = sums
        if not np.array_equal(table, sums):
            return tables[:0]
    return tables


def only_proven(
    grid: grids.Grid, scene: Scene, security_margin: float, by_margin: bool
) -> grids.Grid:
    """Return a grid without the moves that the certifier does not prove, in either direction.

    A length unit lies between its nodes. With `by_margin` moves must keep the security margin.
    """
    neighbours = grid.neighbours.copy()

    def judge(line: grids.NodeArray, move: int) -> None:
        """Forbid the moves of a line of nodes that are not proven."""
        ends = Motion(grid.coordinates[line[[0, -1]]].astype(np.float64))
        if is_proven((Part(scene, 0, 1),), ends, security_margin, by_margin):
            return
        if len(line) > 2:
            middle = len(line) // 2
            judge(line[: middle + 1], move)
            judge(line[middle:], move)
            return
        neighbours[line[0], move] = -1
        neighbours[line[1], neighbours[line[1]] == line[0]] = -1

    for move, targets in enumerate(grid.neighbours.T):
        # moves to nodes of greater index; the others are their ways back
        first = np.flatnonzero(targets >= 0)[:1]
        if len(first) and targets[first[0]] > first[0]:
            for line in _lines(targets):
                judge(line, move)
    return grid._replace(neighbours=neighbours)


def _lines(targets: grids.NodeArray) -> Iterator[grids.NodeArray]:
    """Yield the nodes of each longest line of one move, which leads to `targets` (nodes,) or −1."""
    is_target = np.zeros(len(targets), dtype=bool)
    is_target[targets[targets >= 0]] = True
    for node in np.flatnonzero((targets >= 0) & ~is_target):
        line = [int(node)]
        while targets[line[-1]] >= 0:
            line.append(int(targets[line[-1]]))
        yield np.array(line, dtype=np.int32)
