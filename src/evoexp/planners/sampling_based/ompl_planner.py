"""Planners of the Open Motion Planning Library (Sucan et al. 2012), on the same edges.

OMPL asks whether configurations and straight edges are free; both are tested as densely as those of
RRT-Connect, and counted. All numbers are drawn by OMPL, from a seed of the replicate. A generation
is a chunk of a search that goes on: its cost and its population are the path in hand. A planner
that ends with its first path (RRTConnect) is done then, and the path is made shorter by random
shortcuts.
"""

import importlib.util
from collections.abc import Callable, Iterator
from typing import Any, ClassVar, Literal

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from evoexp.errors import SettingError, demand
from evoexp.planners.arm_tasks import ArmProblem, ArmTask
from evoexp.planners.planner import Candidate, Reproducibility
from evoexp.planners.sampling_based.kernels import distance
from evoexp.planners.sampling_based.node_paths import NodePaths, path_length
from evoexp.planners.sampling_based.trees import EdgeTest, ShortenedPath
from evoexp.records import Block, FloatArray
from evoexp.robots.assembly import Robot
from evoexp.validation import Component, Count, NonNegativeCount

SEEDS = 2**31
BYTES_PER_QUERY = 500  # of a graph in OMPL, for the estimate of memory
DONE_WITH_A_PATH = ("RRTConnect",)
ROADMAPS = ("PRMstar",)
MOST_IDLE = 10_000  # iterations of OMPL without a query, after which it is done


class QueryChunks(Component):
    """How long a planner of a library searches per record, and in all."""

    # configurations that are asked for between two records; an edge that is being tested is
    # tested to its end
    queries_per_generation: Count
    num_generations: NonNegativeCount  # records after the first, at most


class OmplPlanner(NodePaths, Component):
    """A planner of OMPL, by its name."""

    component: ClassVar[str] = "ompl"
    revision: ClassVar[int] = 3
    reproducibility: ClassVar[Reproducibility] = "environment"

    # its name in OMPL; all of its settings but `range` are OMPL's own
    algorithm: Literal["RRTConnect", "RRTstar", "InformedRRTstar", "BITstar", "AITstar", "PRMstar"]
    ga: QueryChunks  # configurations asked for per record, and records

    def prepare(self, robot: Robot, scenario: ArmTask) -> ArmProblem:
        """Build the robot, and check start, goal and settings."""
        must = "another planner: ompl needs pip install 'evoexp[baselines]'"
        demand(importlib.util.find_spec("ompl") is not None, "planner", must, self.component)
        from ompl import geometric  # of its Python packages some have more algorithms than others

        must = "another algorithm: the OMPL that is installed has no "
        must += f"{self.algorithm} in Python"
        demand(hasattr(geometric, self.algorithm), "planner.algorithm", must, self.algorithm)
        for name in ("num_shortcuts", "num_smoothings"):
            if getattr(self, name) and self.algorithm not in DONE_WITH_A_PATH:
                must = f"0: {self.algorithm} goes on to shorten its path by itself"
                raise SettingError(f"planner.{name}", must, getattr(self, name))
        return super().prepare(robot, scenario)

    def evolve(self, problem: ArmProblem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield a record per chunk of the search, then of the shortcuts, until it is done."""
        return self.batches(_Search(self, problem, int(rng.integers(1, SEEDS))), rng)

    def num_evaluations(self, index: int) -> int:
        """Return 1: a record judges the path in hand."""
        return 1

    def memory(self, problem: ArmProblem) -> int:
        """Return an estimate by the number of configurations that are asked for."""
        tested = distance(*self.box(problem)) / self.resolution
        queries = (self.num_generations + 1) * self.ga.queries_per_generation
        return int(BYTES_PER_QUERY * queries + 16 * len(problem.start) * tested)


class _Search:
    """A planner of OMPL on one problem, then shortcuts of its path; see `TreePaths.batches`.

    An iteration is a chunk of the search; `population` is the path in hand, at first the start
    alone.
    """

    def __init__(self, planner: OmplPlanner, problem: ArmProblem, seed: int) -> None:
        self._settings, self.stop_reason, self._most = planner, "", 0
        self.edges = planner.edge_test(problem)
        kind = _Roadmap if planner.algorithm in ROADMAPS else _Library
        self._library = kind(planner, problem, self.edges, seed)
        self.population, self._shown = problem.start[None], problem.start.copy()
        self._path: ShortenedPath | None = None

    @property
    def best_cost(self) -> float:
        """Length of the path in hand [deg], inf without one."""
        return path_length(self.population)

    def iterate(self, rng: np.random.Generator, most: int) -> FloatArray:
        """Go on by a chunk, or to the end; return the length of the path in hand then [deg]."""
        settings = self._settings
        self._most += settings.ga.queries_per_generation  # asked for since the start
        if self._path is None:
            path = self._library.solve(self._most)
            shorter = path is not None and path_length(path) < self.best_cost
            if path is not None and shorter and self.edges.unproven(path) is None:
                self.population, self._shown = path, path.flatten()
            if self._library.is_done:
                self.stop_reason = "solution" if len(self.population) > 1 else "no solution"
            if settings.algorithm in DONE_WITH_A_PATH and len(self.population) > 1:
                self._path = ShortenedPath(self.population, self.edges)
        if self._path is not None:
            left = settings.num_improvements - self._path.num_attempts
            while left > 0 and self.edges.queries < self._most:
                self._path.improve(settings.num_shortcuts, rng, 1)
                left -= 1
            if left <= 0:
                self.stop_reason = "solution"
            self._path.settle()
            if self._path.nodes is not self.population:
                self.population, self._shown = self._path.nodes, self._path.nodes.flatten()
        return np.array([self.best_cost])

    def candidate(self) -> Candidate:
        """Return the path in hand as it is recorded; the same array as long as it is the same."""
        terms = {"length_deg": self.best_cost} | self.edges.certificates()
        return Candidate(self._shown, terms, len(self.population) > 1)


class _Library:
    def __init__(
        self, planner: OmplPlanner, problem: ArmProblem, edges: EdgeTest, seed: int
    ) -> None:
        from ompl import base, geometric, util

        util.setLogLevel(getattr(util, "LogLevel", util).LOG_NONE)  # OMPL 2, 1
        util.RNG.setSeed(seed)
        self._edges, self._base, nq = edges, base, len(problem.start)
        self.is_done = False  # whether the planner has come to ask for no further configuration
        low, high = planner.box(problem)
        space, bounds = base.RealVectorStateSpace(nq), base.RealVectorBounds(nq)
        for joint in range(nq):
            bounds.setLow(joint, float(low[joint]))
            bounds.setHigh(joint, float(high[joint]))
        space.setBounds(bounds)
        self._info = base.SpaceInformation(space)
        is_free = _function("StateValidityCheckerFn", lambda q: edges.is_free_at(_array(q, nq)))
        self._info.setStateValidityChecker(is_free)

        class Edges(base.MotionValidator):  # type: ignore[misc]
            def checkMotion(self, one: Any, two: Any, last: Any = None) -> bool:  # noqa: N802
                ends = np.array([_array(one, nq), _array(two, nq)])
                return edges.is_free(*ends) and edges.unproven(ends) is None

        self._motions = Edges(self._info)  # kept: OMPL holds no reference
        self._info.setMotionValidator(self._motions)
        self._info.setup()
        self._ends = [space.allocState() for _ in range(2)]
        for state, q in zip(self._ends, (problem.start, problem.goal), strict=True):
            for joint in range(nq):
                state[joint] = float(q[joint])
        self._problem = base.ProblemDefinition(self._info)
        self._problem.setStartAndGoalStates(*self._ends)
        self._problem.setOptimizationObjective(base.PathLengthOptimizationObjective(self._info))
        self._planner = getattr(geometric, planner.algorithm)(self._info)
        if hasattr(self._planner, "setRange"):
            self._planner.setRange(planner.range)
        self._planner.setProblemDefinition(self._problem)
        self._planner.setup()
        self._nq, self._start, self._goal = nq, problem.start, problem.goal

    def solve(self, most: int) -> FloatArray | None:
        """Search until so many were asked for; return the best path (nodes, nq) [deg], or None."""
        self._planner.solve(self._enough(most))
        if not self._problem.hasExactSolution():
            return None
        states = self._problem.getSolutionPath().getStates()
        return np.array([_array(state, self._nq) for state in states])

    def _enough(self, most: int) -> Any:
        """Return OMPL's condition to stop once so many configurations were asked for."""
        asked, idle = self._edges.queries, 0

        def is_enough() -> bool:
            nonlocal asked, idle
            idle = idle + 1 if self._edges.queries == asked else 0
            asked = self._edges.queries
            self.is_done = idle >= MOST_IDLE
            return self.is_done or asked >= most

        condition = _function("PlannerTerminationConditionFn", is_enough)
        return self._base.PlannerTerminationCondition(condition)


class _Roadmap(_Library):
    """PRM*, whose roadmap grows without OMPL's second thread, which waits for Python for ever.

    `PRMstar.solve` only adds start and goal; the roadmap then grows in this thread, and the
    shortest path over it is looked for here.
    """

    def solve(self, most: int) -> FloatArray | None:
        if self._planner.milestoneCount() == 0:
            self._planner.solve(self._base.plannerAlwaysTerminatingCondition())
        self._planner.growRoadmapPtc(self._enough(most))
        data = self._base.PlannerData(self._info)
        self._planner.getPlannerData(data)
        count = data.numVertices()
        nodes = np.array([_array(data.getVertex(k).getState(), self._nq) for k in range(count)])
        ends = [(k, int(j)) for k in range(count) for j in data.getEdges(k)]
        if not ends:
            return None
        one, two = np.array(ends).T
        lengths = np.sqrt(((nodes[one] - nodes[two]) ** 2).sum(axis=1))
        graph = csr_array((lengths, (one, two)), shape=(count, count))
        start, goal = data.getStartIndex(0), data.getGoalIndex(0)
        _, before = dijkstra(graph, False, start, return_predecessors=True)
        found = [goal]
        while before[found[-1]] >= 0:
            found.append(int(before[found[-1]]))
        return nodes[found[::-1]] if found[-1] == start else None


def _function(kind: str, function: Callable[..., bool]) -> Any:
    """Return a function as OMPL takes it: wrapped by OMPL 1, as it is by OMPL 2."""
    from ompl import base

    return getattr(base, kind, lambda plain: plain)(function)


def _array(state: Any, nq: int) -> FloatArray:
    return np.array([state[joint] for joint in range(nq)])
