"""RRT-Connect to a configuration, and to places of a planar arm's tip (Kuffner & LaValle 2000).

Two trees grow toward each other; the first path that is free is made shorter by random shortcuts
(Geraerts & Overmars 2007). The goal is never drawn on purpose. A generation is a batch of
iterations; its costs are the lengths of the path or plan in hand after each, inf before there is
one.
"""

from collections.abc import Generator, Iterator
from typing import ClassVar

import numpy as np

from evoexp.collision.planar.link_ellipses import LinkEllipses
from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.planners.answers import Acceptance, Proofs, of_postures
from evoexp.planners.arm_tasks import ArmProblem
from evoexp.planners.planner import Candidate, JudgementArrays
from evoexp.planners.reaching_tasks import Problem, reaching_problem
from evoexp.planners.sampling_based import node_paths
from evoexp.planners.sampling_based.kernels import distance
from evoexp.planners.sampling_based.trees import EdgeTest, ShortenedPath, TreePair
from evoexp.records import Block, FloatArray
from evoexp.robots.assembly import Robot
from evoexp.robots.planar_ends import bring_tip_to, tip
from evoexp.scenarios.motion_tasks import PickAndPlace
from evoexp.validation import Component, Count, NonNegativeCount, Positive


class RrtConnect(node_paths.InIterations, node_paths.NodePaths, Component):
    """RRT-Connect and shortcuts; the population is all nodes of both trees."""

    revision: ClassVar[int] = 3

    # how often both trees are grown anew once a path is shortened or given up; the shortest
    # path of all is the answer
    num_restarts: NonNegativeCount = 0

    def evolve(self, problem: ArmProblem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield a record per batch of iterations, until the last path is shortened or given up."""
        return self.batches(_ConnectSearch(self, problem), rng)

    @property
    def most_iterations(self) -> int:
        """Iterations of a run that finds its paths last of all, shortcuts included."""
        return (1 + self.num_restarts) * (self.max_iterations + self.num_improvements)


class _ConnectSearch:
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
        if self._path is not None:
            return self._path.num_attempts >= self._planner.num_improvements
        return self.pair.num_iterations >= self._planner.max_iterations


CLOSE = 1e-6  # [-] of the arm's length, by which the tip may miss a place
PLACES = "via point", "goal point"


class RrtReaching(node_paths.InIterations, Component):
    """RRT-Connect to postures that reach the via point, and then to some that reach the goal.

    Postures whose tip is at either point are found from random ones by damped least squares; the
    nearest of the free ones is the goal of two trees. Distances are Euclidean over all joints, in
    degrees. A solution is flat: posture by posture, joint by joint (postures × joints) [rad], the
    start included; the start alone: there is no motion. The population is the shortest plan so far;
    iterations that complete no plan cost inf.
    """

    revision: ClassVar[int] = 2
    unit: ClassVar[float] = 1.0

    range: Positive  # length of a step, the longest edge of a tree [deg]
    # greatest distance between configurations that are tested on an edge [deg]
    resolution: Positive
    # free postures drawn for a place of the tip, of which the nearest one is taken
    num_postures: Count
    num_shortcuts: NonNegativeCount  # attempts to shorten the path to a posture; 0: none
    # how often all is begun anew; the shortest path of all is the answer
    num_restarts: NonNegativeCount
    collision: LinkEllipses  # links as lines among ellipses, tested at single configurations
    # which plans are an answer: those whose tested configurations are free, or those of them
    # that the exact certifier proves
    acceptance: Acceptance = "model"

    def prepare(self, robot: Robot, scenario: PickAndPlace) -> Problem:
        """Build the robot and check that the start fits it and is free of collision."""
        problem = reaching_problem(robot, scenario, self.collision)
        (x, y), (left, right, bottom, top) = problem.targets[1], problem.boxes[1]
        if not (left <= x <= right and bottom <= y <= top):
            must = f"in the box, x from {left:g} to {right:g} and y from {bottom:g} to {top:g}"
            raise SettingError("scenario.goal_point", must, [float(x), float(y)])
        return problem

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield a record per batch of iterations, until the last plan is complete or given up."""
        return self.batches(_ReachingSearch(self, problem), rng)

    @property
    def most_iterations(self) -> int:
        """Iterations of a run that finds all as late as it may, and one to find that it is done."""
        return (1 + self.num_restarts) * 2 * (2 * self.max_iterations + self.num_shortcuts) + 1

    def cost(self, problem: Problem, population: FloatArray) -> JudgementArrays:
        """Judge paths (joints, postures, individuals) [rad]: length [deg], inf in collision."""
        edges = EdgeTest(problem.collision, self.resolution)
        return node_paths.judge_paths(edges, population.transpose(2, 1, 0) / DEGREE)

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return length and contacts of a path, and how near its postures come to both places."""
        path = self.path(problem, solution)
        terms = self.cost(problem, path.T[:, :, None]).named_terms(0)
        via, goal = self._errors(problem, path)
        return terms | {"via_error": via, "goal_error": goal}

    def departures(self, problem: Problem, solution: FloatArray) -> list[str]:
        """Compare start, joint limits and the two places of the tip with the task's."""
        path, close = self.path(problem, solution), CLOSE * problem.collision.arm.lengths.sum()
        found = of_postures(path, problem.start, problem.joint_limits)
        for place, error in zip(PLACES, self._errors(problem, path), strict=True):
            if error > close:
                found.append(f"the tip misses the {place} by {error:.3g}")
        return found

    def box(self, problem: Problem) -> FloatArray:
        """Return the least and the greatest value of each joint, (2, nq) [deg]."""
        return np.asarray(problem.joint_limits.T / DEGREE)

    def _errors(self, problem: Problem, path: FloatArray) -> tuple[float, float]:
        """Return the least distance of the tip from the via point, and its last from the goal."""
        tips = np.array([tip(q, problem.collision.arm) for q in path])
        via, goal = (np.sqrt(((tips - target) ** 2).sum(axis=1)) for target in problem.targets)
        return float(via.min()), float(goal[-1])


class _ReachingSearch:
    """The state of one run; its population is the shortest plan (postures, joints) [rad]."""

    def __init__(self, planner: RrtReaching, problem: Problem) -> None:
        self._planner, self._problem = planner, problem
        self.edges = EdgeTest(problem.collision, planner.resolution)
        self.best_cost, self.population, self.stop_reason = np.inf, problem.start[None], ""
        self._steps: Iterator[float] | None = None
        self._plans = self._iterations = 0
        self._proofs = Proofs(planner, problem) if planner.answers_are_proven else None

    def iterate(self, rng: np.random.Generator, most: int) -> FloatArray:
        """Go on by one iteration; return the length of the plan that it completes [deg], or inf."""
        self._steps = self._steps or self.steps(rng)
        length = next(self._steps, None)
        if length is None:
            self.stop_reason = "solution" if np.isfinite(self.best_cost) else "no solution"
        return np.array([] if length is None else [length])

    def candidate(self) -> Candidate:
        terms = {
            "length_deg": self.best_cost,
            "iterations": float(self._iterations),
            "plans": float(self._plans),
        }
        return Candidate(self.population.ravel(), terms, bool(np.isfinite(self.best_cost)))

    def steps(self, rng: np.random.Generator) -> Iterator[float]:
        """Yield after every iteration: the length of the plan that it completes [deg], or inf."""
        for _ in range(1 + self._planner.num_restarts):
            # a path (postures, joints) [deg] to the via point and on to the goal point
            nodes: FloatArray | None = self._problem.start[None] / DEGREE
            for target in self._problem.targets:
                nodes = None if nodes is None else (yield from self._extended(rng, nodes, target))
            if nodes is None:
                continue
            length, plan = node_paths.path_length(nodes), np.ascontiguousarray(DEGREE * nodes)
            self._plans += 1
            shorter = length < self.best_cost
            if shorter and (self._proofs is None or self._proofs.is_proven(plan.ravel())):
                self.best_cost, self.population = length, plan
            yield length

    def _extended(
        self, rng: np.random.Generator, nodes: FloatArray, target: FloatArray
    ) -> Generator[float, None, FloatArray | None]:
        """Search a way from the end of a path (postures, joints) to a place of the tip."""
        planner = self._planner
        goal = yield from self._posture(rng, nodes[-1], target)
        if goal is None:
            return None
        low, high = planner.box(self._problem)
        trees = TreePair(nodes[-1], goal, self.edges, planner.range)
        for _ in range(planner.max_iterations):
            self._iterations += 1
            found = trees.iterate(low + rng.random(len(low)) * (high - low))
            yield np.inf
            if found is not None:
                break
        else:
            return None
        path = ShortenedPath(found, self.edges)
        for _ in range(planner.num_shortcuts):
            path.attempt(rng.random((1, 2)))
            yield np.inf
        return np.concatenate([nodes, path.nodes[1:]])

    def _posture(
        self, rng: np.random.Generator, begin: FloatArray, target: FloatArray
    ) -> Generator[float, None, FloatArray | None]:
        """Return the free posture nearest to one [deg] whose tip is at a place, or None."""
        problem, planner = self._problem, self._planner
        low, high = problem.joint_limits.T
        nearest, least, count = None, np.inf, 0
        for _ in range(planner.max_iterations):
            q = low + (high - low) * rng.random(len(low))
            reached = bring_tip_to(q, target, problem.joint_limits, problem.collision.arm)
            posture = q / DEGREE
            self._iterations += 1
            if reached and self.edges.is_free_at(posture):
                count += 1
                far = distance(begin, posture)
                nearest, least = (posture, far) if far < least else (nearest, least)
            yield np.inf
            if count == planner.num_postures:
                break
        return nearest
