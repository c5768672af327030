"""Point-to-point motion of a redundant planar arm among ellipses (Lavoie & Boudreau 2001).

The motion has two sub-paths, straight in joint space: from the start to a posture A whose tip is
near the via point (SP1), from A to a posture B whose tip is near the goal and inside the box (SP2).
A genetic algorithm searches A; if it is successful, a second one searches B; both are repeated
until both are successful, up to `num_attempts` times.

A population is an array (joints, individuals) [rad] of end postures of one sub-path, or (joints ×
bits, individuals). A solution is flat: three postures (start, A, B) × joints [rad].

What "best so far" means: only the second search has whole plans, each worth the objective of SP2
(Eq. 4). The best so far is the plan of the lowest one over all generations and attempts; a
successful attempt has found it, since whatever came before was no success. Until there is a plan of
finite cost its place is taken by the best posture A of any attempt so far, as a plan that stays
there, at the cost inf. In generations of SP1 the best cost is inf, too: there is no plan; the costs
of the individuals are their objective of SP1.
"""

from collections.abc import Generator, Iterator
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np

from evoexp.collision.models.link_ellipses import EllipseCollision, LinkEllipses
from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError
from evoexp.objectives.reaching import Reaching
from evoexp.paths.motion import Motion
from evoexp.planners.planner import PlannerDefaults
from evoexp.planners.redundant_ga import kernels
from evoexp.planners.redundant_ga.kernels import RESULTS
from evoexp.planners.redundant_ga.settings import BinaryGenetic, RealGenetic, SelectiveSettings
from evoexp.planners.redundant_ga.sub_path import Found, Search
from evoexp.records import FloatArray, Generation
from evoexp.robots.assembly import Assembly, Robot
from evoexp.robots.planar_ends import LANES
from evoexp.scenarios.pick_and_place import PickAndPlace
from evoexp.validation import Component, Count, Positive

TERMS = (
    ("of", ""),
    ("position_error", ""),
    ("joint_displacement", "_rad"),
)  # of each sub-path, with unit
ANYWHERE = np.array([-np.inf, np.inf, -np.inf, np.inf])  # the box of SP1


class Problem(NamedTuple):
    """What `prepare` made of robot and scenario.

    Attributes:
        assembly: The robot, built.
        collision: The paper's collision model on it.
        start: (joints,) [rad].
        joint_limits: (joints, 2) [rad].
        targets: (2, 2) via point and goal point.
        boxes: (2, 4) where the tip must end: least and greatest x, y.
        scene: The bodies themselves, for the exact verdict on a motion.
        security_margin: Clearance that the task requires [length unit].
    """

    assembly: Assembly
    collision: EllipseCollision
    start: FloatArray
    joint_limits: FloatArray
    targets: FloatArray
    boxes: FloatArray
    scene: Scene
    security_margin: float


class Judgement(NamedTuple):
    """Whole plans judged.

    Attributes:
        cost: (individuals,) objective of SP2; inf where SP1 is not successful.
        accepted: (individuals,) whether both sub-paths are successful.
        terms: Of every sub-path cost, position error and joint displacement, (2, 3, individuals).
        collision_queries: Configurations judged for it.
    """

    cost: FloatArray
    accepted: np.ndarray
    terms: FloatArray
    collision_queries: int

    @property
    def feasible(self) -> np.ndarray:
        """(individuals,) whether the paper's own rules accept each plan."""
        return self.accepted

    def named_terms(self, individual: int) -> dict[str, float]:
        """Return the terms of one plan by name."""
        return named_terms(self.terms[:, :, individual])


class RedundantGa(PlannerDefaults, Component):
    """The algorithm of Lavoie & Boudreau, sections 3 to 5.

    Attributes:
        num_attempts: How often SP1 and SP2 are searched at most.
        stop_cost_sp1: The search of SP1 ends where the objective is smaller.
        stop_cost_sp2: The same of SP2.
        success: A sub-path is successful below its stopping cost (`threshold`), or if its cost is
            `finite`.
        ga: Population, generations, operators.
        objective: Weights of Eq. 4.
        collision: Positions and chords that are tested.
    """

    component: ClassVar[str] = "redundant_ga"

    num_attempts: Count
    stop_cost_sp1: Positive
    stop_cost_sp2: Positive
    success: Literal["threshold", "finite"]
    ga: SelectiveSettings
    objective: Reaching
    collision: LinkEllipses

    def prepare(self, robot: Robot, scenario: PickAndPlace) -> Problem:
        """Build the robot and check that the start fits it and is free of collision.

        Raises:
            SettingError: If it is not, or the robot has no joint limits to draw postures from.
        """
        if not isinstance(self.ga, RealGenetic | BinaryGenetic):
            raise SettingError("ga", "a real_genetic or a binary_genetic", self.ga.component)
        assembly = robot.build()
        table = scenario.obstacle_table()
        collision = self.collision.bind(assembly, table)
        model, start = assembly.model, np.array(scenario.q_start)
        limits = np.column_stack([model.lowerPositionLimit, model.upperPositionLimit])
        if not (np.abs(limits) < 1e6).all():
            raise SettingError("robot.joint_limits", "given: postures are drawn between them", None)
        if len(start) != model.nq:
            raise SettingError("scenario.q_start", f"one angle per joint ({model.nq})", len(start))
        for k, (angle, (least, greatest)) in enumerate(zip(start, limits, strict=True)):
            if not least <= angle <= greatest:
                must = f"within the joint's limits, {least:g} to {greatest:g} rad"
                raise SettingError(f"scenario.q_start[{k}]", must, float(angle))
        if contact := collision.contact(start, start):
            must = f"free of collision (link {contact.link} touches obstacle {contact.obstacle})"
            raise SettingError("scenario.q_start", must, list(scenario.q_start))
        targets = np.array([scenario.via_point, scenario.goal_point])
        boxes = np.array([ANYWHERE, scenario.box])
        bodies = scene(assembly, table)
        return Problem(
            assembly, collision, start, limits, targets, boxes, bodies, scenario.security_margin
        )

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the generations of all searches, one after the other.

        Their indices go on counting.
        """
        record = _Record(self, problem)
        for _ in range(self.num_attempts):
            record.attempts += 1
            via = yield from self._search(problem, rng, record, 0, problem.start)
            if self.successful(0, via.cost):
                record.via = via
                goal = yield from self._search(problem, rng, record, 1, via.posture)
                if self.successful(1, goal.cost):
                    return

    def _search(
        self,
        problem: Problem,
        rng: np.random.Generator,
        record: "_Record",
        path: int,
        start: FloatArray,
    ) -> Generator[Generation, None, Found]:
        """Search the end of one sub-path (0: SP1, 1: SP2).

        Yield its generations, return the best end.
        """
        search = Search(self.ga, problem.joint_limits, self._judging(problem, path), start)
        search.begin(rng)
        yield record.generation(search, path, self.ga.population_size)
        for index in range(self.ga.num_generations):
            if search.best.cost < self._stop_costs[path]:
                break
            search.advance(rng, index)
            yield record.generation(search, path, self.ga.num_offspring)
        return search.best

    @property
    def _stop_costs(self) -> tuple[float, float]:
        return self.stop_cost_sp1, self.stop_cost_sp2

    def successful(self, path: int, cost: Any) -> Any:
        """Return whether costs of a sub-path (0: SP1, 1: SP2) are a success."""
        return cost < (self._stop_costs[path] if self.success == "threshold" else np.inf)

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
        """Return postures A and B, uniform within the joint limits, (2, joints, count)."""
        low, high = problem.joint_limits.T
        postures = rng.random((2, len(low), count))
        postures *= (high - low)[:, None]
        postures += low[:, None]
        return postures

    def cost(self, problem: Problem, population: FloatArray) -> Judgement:
        """Judge pairs of postures A and B (2, joints, individuals): what random search draws.

        A pair costs what its SP2 does if its SP1 is successful, so it is judged as a finished plan
        of the algorithm is. It is one evaluation of random search and takes two of the objective.
        """
        starts = np.broadcast_to(problem.start[:, None], population.shape[1:])
        terms = np.array(
            [self._judge(problem, 0, starts, population[0]), self._judge(problem, 1, *population)]
        )
        cost = np.where(self.successful(0, terms[0, 0]), terms[1, 0], np.inf)
        queries = 2 * problem.collision.queries * population.shape[2]
        return Judgement(cost, np.asarray(self.successful(1, cost)), terms, queries)

    def _judge(
        self, problem: Problem, path: int, starts: FloatArray, ends: FloatArray
    ) -> FloatArray:
        """Return cost, position error and joint displacement of sub-paths, (3, individuals)."""
        count = starts.shape[1]
        lanes, results = np.arange(count + LANES), np.empty((RESULTS, count))
        starts, ends = np.ascontiguousarray(starts), np.ascontiguousarray(ends)
        hit = np.zeros(count, dtype=np.bool_)
        kernels.judge(starts, ends, lanes, count, self._judging(problem, path), results, hit)
        return results

    def _judging(self, problem: Problem, path: int) -> tuple[Any, ...]:
        """Return what the kernels judge a sub-path by; see `kernels.judge`."""
        collision = problem.collision
        where = problem.targets[path], problem.boxes[path]
        return (
            tuple(collision.arm),
            collision.ellipses,
            collision.path,
            *where,
            self.objective.weights,
        )

    def solution(self, problem: Problem, population: FloatArray, individual: int) -> FloatArray:
        """Return a pair of postures A and B as a flat solution."""
        return np.concatenate([problem.start, *population[:, :, individual]])

    def motion(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the motion of a solution: start, A, B, straight in joint space, in equal times."""
        return Motion(np.ascontiguousarray(self._postures(problem, solution)))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return the terms of both sub-paths, and where each first touches (counted from 1.

        0: it does not).

        Raises:
            ValueError: If the solution has another size than 3 × joints.
        """
        postures = self._postures(problem, solution)
        named = named_terms(self.judge_plan(problem, solution))
        for k in range(2):
            found = problem.collision.contact(*postures[k : k + 2])
            position, obstacle, link, swept = found or (0, 0, 0, False)
            named |= {
                f"contact_position_sp{k + 1}": float(position),
                f"contact_link_sp{k + 1}": float(link),
            }
            named |= {
                f"contact_obstacle_sp{k + 1}": float(obstacle),
                f"contact_swept_sp{k + 1}": float(swept),
            }
        return named

    def judge_plan(self, problem: Problem, solution: FloatArray) -> FloatArray:
        """Return cost, position error and joint displacement of both sub-paths of a solution,.

        2, 3.
        """
        postures = self._postures(problem, solution)
        return np.array(
            [self._judge(problem, k, *postures[k : k + 2, :, None])[:, 0] for k in range(2)]
        )

    def shape(self, problem: Problem) -> tuple[tuple[int], ...]:
        """Return the documented shape of a solution: three postures of (joints,)."""
        return ((len(problem.start),),) * 3

    def _postures(self, problem: Problem, solution: FloatArray) -> FloatArray:
        num = len(problem.start)
        if solution.shape != (3 * num,):
            raise ValueError(f"a solution has {3 * num} values, was {solution.shape}")
        return solution.reshape(3, num)


class _Record:
    """The best plan so far, and the records of generations that carry it."""

    def __init__(self, planner: RedundantGa, problem: Problem) -> None:
        self.planner, self.problem = planner, problem
        self.attempts, self.index = 0, -1
        self.via = Found(np.inf, problem.start, np.empty(0))  # the posture A that SP2 starts from
        self.cost, self.via_cost = (
            np.inf,
            np.inf,
        )  # of the best plan, and of SP1 where there is none
        self.solution: FloatArray | None = None
        self.terms: dict[str, float] = {}
        self.evaluations = self.queries = 0

    def generation(self, search: Search, path: int, count: int) -> Generation:
        """Update the best plan by a population of which `count` are new.

        And return the generation's record.
        """
        best, summary = search.best, search.summary
        self.index += 1
        self.evaluations += count
        self.queries += count * self.problem.collision.queries
        if path == 0:
            self._improve_via(best)
        elif best.cost < self.cost:
            self.cost, self.solution = best.cost, self._plan(self.via.posture, best.posture)
            self.terms = named_terms(np.array([self.via.terms, best.terms]))
        assert self.solution is not None, "SP1 is searched first"
        return Generation(
            index=self.index,
            best=self.solution,
            best_cost=self.cost,
            best_cost_in_generation=np.inf if path == 0 else best.cost,
            mean_cost=summary.mean,
            std_cost=summary.std,
            num_feasible=summary.num_finite,
            evaluations=self.evaluations,
            collision_queries=self.queries,
            solved=bool(self.planner.successful(1, self.cost)),
            terms=self.terms | {"attempts": float(self.attempts), "sub_path": path + 1.0},
            costs=search.costs[None, :],
            population=search.genomes,
        )

    def _improve_via(self, best: Found) -> None:
        """While there is no plan of finite cost.

        Keep the best posture A as a plan that stays there.
        """
        if self.solution is None or (self.cost == np.inf and best.cost < self.via_cost):
            self.via_cost, self.solution = best.cost, self._plan(best.posture, best.posture)
            self.terms = named_terms(self.planner.judge_plan(self.problem, self.solution))

    def _plan(self, via: FloatArray, goal: FloatArray) -> FloatArray:
        return np.concatenate([self.problem.start, via, goal])


def named_terms(terms: FloatArray) -> dict[str, float]:
    """Return cost, position error and joint displacement of both sub-paths (2, 3) by name."""
    names = (f"{name}_sp{path}{unit}" for path in (1, 2) for name, unit in TERMS)
    return dict(zip(names, terms.ravel().tolist(), strict=True))
