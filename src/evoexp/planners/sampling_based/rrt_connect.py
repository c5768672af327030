"""RRT-Connect: two trees that grow toward each other (Kuffner & LaValle 2000), then shortcuts.

It is done with the first path that is free, and makes that one shorter by random shortcuts
(Geraerts & Overmars 2007). The goal is never drawn on purpose. A generation is a batch of
iterations; its costs are the lengths of the path in hand after each, inf before there is one; its
population is all nodes of both trees.
"""

from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from evoexp.planners.arm_tasks import ArmProblem
from evoexp.planners.planner import Candidate
from evoexp.planners.sampling_based.node_paths import InIterations, NodePaths
from evoexp.planners.sampling_based.trees import ShortenedPath, TreePair
from evoexp.records import Block, FloatArray
from evoexp.validation import Component, NonNegativeCount


class RrtConnect(InIterations, NodePaths, Component):
    """RRT-Connect and shortcuts."""

    component: ClassVar[str] = "rrt_connect"
    revision: ClassVar[int] = 3

    # how often both trees are grown anew once a path is shortened or given up; the shortest
    # path of all is the answer
    num_restarts: NonNegativeCount = 0

    def evolve(self, problem: ArmProblem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield a record per batch of iterations, until the last path is shortened or given up."""
        return self.batches(_Search(self, problem), rng)

    @property
    def most_iterations(self) -> int:
        """Iterations of a run that finds its paths last of all, shortcuts included."""
        return (1 + self.num_restarts) * (self.max_iterations + self.num_improvements)


class _Search:
    """The state of one run: the trees until they meet, then the path, and so at each start."""

    def __init__(self, planner: RrtConnect, problem: ArmProblem) -> None:
        self._planner, self._ends = planner, (problem.start, problem.goal)
        self._low, self._high = planner.box(problem)
        self.edges = planner.edge_test(problem)
        self.pair = TreePair(*self._ends, self.edges, planner.range)
        self._path: ShortenedPath | None = None
        self._first = {"first_solution_queries": np.inf, "first_solution_length_deg": np.inf}
        self._starts, self._iterations, self.best_cost = 1, 0, np.inf
        self._solution = problem.start.copy()

    @property
    def stop_reason(self) -> str:
        """Why the run ends now; empty while it goes on."""
        if not self._is_done() or self._starts <= self._planner.num_restarts:
            return ""
        return "solution" if np.isfinite(self.best_cost) else "no solution"

    @property
    def population(self) -> FloatArray:
        """(nodes, nq) all nodes of both trees [deg]."""
        return self.pair.nodes

    def iterate(self, rng: np.random.Generator, most: int) -> FloatArray:
        """Grow the trees, or try some shortcuts; return the length after each [deg], or inf."""
        if self._is_done():
            self._keep_shortest()
            self.pair = TreePair(*self._ends, self.edges, self._planner.range)
            self._path, self._starts = None, self._starts + 1
        if self._path is not None:
            return self._path.improve(self._planner.num_shortcuts, rng, most)
        drawn = self._low + rng.random(len(self._low)) * (self._high - self._low)
        self._iterations += 1
        nodes = self.pair.iterate(drawn)
        if nodes is None:
            return np.array([np.inf])
        self._path = ShortenedPath(nodes, self.edges)
        if not np.isfinite(self._first["first_solution_queries"]):
            self._first = {
                "first_solution_queries": float(self.edges.queries),
                "first_solution_length_deg": self._path.length,
            }
        return self._path.lengths[-1:]

    def candidate(self) -> Candidate:
        """Return the shortest path as it is recorded, the same array as long as it is the same."""
        self._keep_shortest()
        terms = {
            "length_deg": self.best_cost,
            "iterations": float(self._iterations),
            "nodes": float(len(self.pair.nodes)),
        }
        terms |= self._first | self.edges.certificates()
        return Candidate(self._solution, terms, bool(np.isfinite(self.best_cost)))

    def _keep_shortest(self) -> None:
        """Keep the path in hand if it is the shortest so far, and proven where asked for."""
        path = self._path
        if path is not None and path.length < self.best_cost:
            path.settle()
            if path.length < self.best_cost:
                self.best_cost, self._solution = path.length, path.nodes.flatten()

    def _is_done(self) -> bool:
        """Whether the present start has come to its end."""
        if self._path is not None:
            return self._path.num_attempts >= self._planner.num_improvements
        return self.pair.num_iterations >= self._planner.max_iterations
