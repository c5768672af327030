"""Answers of planners whose solution is a path of straight edges, and searches in iterations.

All arms together are one configuration (nq,) [deg]; angles are not wrapped. Random configurations
are uniform within the joints' limits. A solution is flat: node by node, joint by joint (nodes × nq)
[deg], start and goal included; the start alone: no path was found, and there is no motion.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from evoexp.collision.bodies.covered_bodies import CoveredBodies
from evoexp.collision.bodies.touching_spheres import TouchingSpheres
from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.paths.motion import Motion
from evoexp.planners.answers import Acceptance, Proofs, in_shape
from evoexp.planners.arm_tasks import UNLIMITED, ArmDefaults, ArmProblem, ArmTask, arm_problem
from evoexp.planners.planner import JudgementArrays, Keeper, PlannerDefaults
from evoexp.planners.sampling_based.kernels import distance, lengths_along
from evoexp.planners.sampling_based.trees import EdgeTest
from evoexp.records import Block, FloatArray
from evoexp.robots.assembly import Robot
from evoexp.validation import Component, Count, LayoutCount, NonNegativeCount, Positive, Settings

MOST_STEPS = 10_000  # of a line through the whole space of configurations
MOST_TESTED = 1_000_000  # configurations on such a line
NODES_PER_ITERATION = 4  # of both trees, for the estimate of memory: most have fewer


class TreePaths(PlannerDefaults):
    """The answers that all planners of such paths share, whatever unit their solutions have."""

    component: ClassVar[str]
    unit: ClassVar[float] = DEGREE  # [rad] of a solution

    def sample(self, problem: Any, rng: np.random.Generator, count: int) -> FloatArray:
        """Refuse: trees are grown, paths are not drawn one by one."""
        raise SettingError("planner", "a planner that draws paths one by one", self.component)

    def solution(self, problem: Any, population: FloatArray, individual: int) -> FloatArray:
        """Return one path of a population (nq, nodes, individuals) as a flat solution."""
        return np.asarray(population[:, :, individual].T.ravel())

    def motion(self, problem: Any, solution: FloatArray) -> Motion | None:
        """Return the joint-space motion: straight, nodes in equal times; None without a path."""
        path = self.path(problem, solution)
        return Motion(np.ascontiguousarray(self.unit * path)) if len(path) > 1 else None

    def cost_of_terms(self, terms: Mapping[str, float]) -> float:
        """Return the length, the cost of a path that is free."""
        return terms["length_deg"]

    def shape(self, problem: Any) -> tuple[Any, ...]:
        """Return the documented shape of a solution: any number of nodes × nq."""
        return ..., (len(problem.start),)

    def batches(self, search: Any, rng: np.random.Generator) -> Iterator[Block]:
        """Yield a record per batch of iterations, until a search comes to its end.

        It has `edges`, `best_cost` [deg], `stop_reason` (empty while it goes on), `population`
        (shown by a record), `candidate()`, and `iterate(rng, most)`: it goes on by some iterations
        and returns the length in hand after each [deg]; none if all was done before.
        """
        keeper = Keeper()
        for index in range(self.num_generations + 1):
            costs, asked = np.empty(0), search.edges.queries
            left = self.num_evaluations(index)
            while left > len(costs) and not search.stop_reason:
                some = search.iterate(rng, left - len(costs))
                if len(some) == 0:
                    break
                costs = np.concatenate([costs, some])
            costs = costs if len(costs) else np.full(1, np.inf)
            best = search.candidate()  # may take the best path over
            keeper.keep(search.best_cost, best)
            queries, reason = search.edges.queries - asked, search.stop_reason
            yield keeper.record(costs, search.population, queries, stop_reason=reason)
            if search.stop_reason:
                return

    def path(self, problem: Any, solution: FloatArray) -> FloatArray:
        """Return a flat solution as a path (nodes, nq)."""
        return in_shape(solution, -1, len(problem.start))


class NodePaths(TreePaths, ArmDefaults, Settings):
    """The usual answers of a planner of paths in degrees, to be inherited before `Component`.

    Distances are Euclidean over all joints of all arms, in degrees; a metre of a sliding joint
    counts as a radian, 57.3 degrees.
    """

    range: Positive  # length of a step, the longest edge of a tree [deg]
    num_shortcuts: NonNegativeCount  # attempts to shorten the path that was found; 0: none
    free_turn: Positive  # how far joints without limits may go beyond start and goal [deg]
    # the touching circles or spheres, or covers of the bodies. An edge as long as `range` is
    # tested at `collision_substeps` configurations, other edges as densely
    collision: TouchingSpheres | CoveredBodies
    # which edges are free: those whose tested configurations are (`model`), or those of them
    # that the exact certifier proves free of contact all along (`certified`), or free by the
    # task's margins (`margin`). An edge that is refuted counts as colliding
    acceptance: Acceptance = "model"
    # how often all corners of the path are cut behind the shortcuts; 0: never
    num_smoothings: Annotated[int, Field(ge=0, le=8)] = 0

    @property
    def resolution(self) -> float:
        """Greatest distance between configurations that are tested on an edge [deg]."""
        return self.range / self.collision.collision_substeps

    @property
    def num_improvements(self) -> int:
        """Attempts to make a path better: shortcuts, then passes over all of its corners."""
        return self.num_shortcuts + self.num_smoothings

    def prepare(self, robot: Robot, scenario: ArmTask) -> ArmProblem:
        """Build the robot, and check that start and goal fit it and are free of collision."""
        problem = arm_problem(robot, scenario, self.collision)
        low, high = self.box(problem)
        through, substeps = distance(low, high), self.collision.collision_substeps
        most = min(MOST_STEPS, MOST_TESTED // substeps)
        if through > most * self.range:
            must = f"at least {through / most:.3g} deg: a line through the ranges of all joints "
            must += f"({through:.4g} deg) has at most {MOST_STEPS:,} steps and {MOST_TESTED:,} "
            must += f"configurations tested, {substeps} per step"
            raise SettingError("planner.range", must, self.range)
        return problem

    def box(self, problem: ArmProblem) -> tuple[FloatArray, FloatArray]:
        """Return the least and the greatest value of each joint that is drawn, each (nq,) [deg]."""
        low, high = problem.limits.T
        # ends that lie on a limit lie within it, whatever the last bit of the conversion is
        first = np.minimum(problem.start, problem.goal)
        last = np.maximum(problem.start, problem.goal)
        free_low, free_high = self._free_joints(problem)
        return (
            np.where(free_low, first - self.free_turn, np.minimum(low, first)),
            np.where(free_high, last + self.free_turn, np.maximum(high, last)),
        )

    def edge_test(self, problem: ArmProblem) -> EdgeTest:
        """Return the test of edges by the collision model and, if so asked, by proof."""
        proofs = Proofs(self, problem) if self.answers_are_proven else None
        return EdgeTest(problem.collision, self.resolution, proofs)

    def cost(self, problem: ArmProblem, population: FloatArray) -> JudgementArrays:
        """Judge paths (nq, nodes, individuals): length, inf in collision or if not proven."""
        edges = self.edge_test(problem)
        judged = judge_paths(edges, population.transpose(2, 1, 0))
        feasible, segments = judged.feasible, np.full(len(judged.cost), population.shape[1] - 1)
        for k in np.flatnonzero(feasible):
            feasible[k] = edges.unproven(np.ascontiguousarray(population[:, :, k].T)) is None
        cost, length = np.where(feasible, judged.cost, np.inf), judged.terms["length_deg"]
        terms = {"length_deg": length, "segments": segments, **judged.terms}
        return judged._replace(cost=cost, terms=terms)

    def evaluate(self, problem: ArmProblem, solution: FloatArray) -> dict[str, float]:
        """Return length, segments and contacts of a path; its length beside the straight line's."""
        path = self.path(problem, solution)
        terms = self.cost(problem, path.T[:, :, None]).named_terms(0)
        straight = distance(problem.start, problem.goal)
        ratio = {"length_ratio": terms["length_deg"] / straight} if straight > 0.0 else {}
        return terms | ratio

    def notes(self, problem: ArmProblem) -> list[str]:
        """Describe how densely edges are tested, the ranges of free joints, and the covers."""
        lines = [f"edges are tested every {self.resolution:.4g} deg or more densely"]
        free_low, free_high = self._free_joints(problem)
        if count := int(np.count_nonzero(free_low | free_high)):
            joints = f"{count} joints have" if count > 1 else "1 joint has"
            lines.append(
                f"{joints} no limits: drawn up to {self.free_turn:g} deg beyond start and goal"
            )
        return lines + super().notes(problem)

    def _free_joints(self, problem: ArmProblem) -> tuple[np.ndarray, np.ndarray]:
        """Return which joints have no lower and which have no upper limit, each (nq,)."""
        low, high = problem.limits.T
        most = UNLIMITED / DEGREE
        return low <= -most, high >= most


class TreeGrowth(Component):
    """How much is searched per record, and in all."""

    # iterations between two records: random configurations that the trees grow toward, and,
    # once there is a path, attempts to shorten it
    iterations_per_generation: LayoutCount
    num_generations: NonNegativeCount  # records after the first, at most


class InIterations(TreePaths, Settings):
    """Counts the iterations of a search that goes on in batches of them, one per record.

    The planner has a `resolution` of its tests [deg] and a `box` of its draws, as `NodePaths`.
    """

    max_iterations: Count  # random configurations after which a search is given up
    ga: TreeGrowth  # iterations per record, and records

    @property
    def most_iterations(self) -> int:
        """Iterations of a run that finds all as late as it may."""
        raise NotImplementedError

    @property
    def num_generations(self) -> int:
        """Batches after the first, at most."""
        batches = -(-self.most_iterations // self.ga.iterations_per_generation)
        return min(self.ga.num_generations, batches - 1)

    def num_evaluations(self, index: int) -> int:
        """Return the iterations of a generation, at most; a run may end within one."""
        size = self.ga.iterations_per_generation
        return max(0, min(size, self.most_iterations - index * size))

    def memory(self, problem: Any) -> int:
        """Return the memory of both trees, whose arrays double, and of an edge's tests."""
        most = (self.num_generations + 1) * self.ga.iterations_per_generation
        nodes = NODES_PER_ITERATION * min(self.max_iterations, most)  # trees of one start
        planner: Any = self
        tested = distance(*planner.box(problem)) / planner.resolution
        return int(8 * (len(problem.start) + 1) * (8 * nodes + 2 * tested))


def judge_paths(edges: EdgeTest, paths: FloatArray) -> JudgementArrays:
    """Judge paths (paths, nodes, nq) [deg]: their length, inf where a tested edge collides."""
    rows = [np.ascontiguousarray(path) for path in paths]
    lengths = np.array([path_length(path) for path in rows])
    collisions = np.array([edges.num_contacts(path) for path in rows])
    feasible = (collisions == 0) & np.isfinite(lengths)
    terms = {"length_deg": lengths, "collisions": collisions}
    return JudgementArrays(np.where(feasible, lengths, np.inf), feasible, edges.queries, terms)


def path_length(path: FloatArray) -> float:
    """Return the length of a path (nodes, nq) [deg]; inf of a single configuration."""
    return float(lengths_along(path)[-1]) if len(path) > 1 else np.inf
