"""A (1+λ) search for the motion of several arms among obstacles: an example to be changed.

An individual is a path: via-points at equal times from start to goal, with straight lines between
them. The best path so far is kept; every generation displaces all its via-points at random, λ
times, and the best of these paths takes its place if it is better.

A population is an array (nq, instants, individuals) [deg], the start and the goal among the
instants. A solution is flat: instant by instant, joint by joint (instants × nq) [deg].
"""

from collections.abc import Iterator
from typing import ClassVar, NamedTuple

import numpy as np

from evoexp.collision.models.touching_spheres import SphereCollision, TouchingSpheres
from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.paths.motion import Motion
from evoexp.planners.planner import JudgementArrays, Keeper, PlannerDefaults, Shape
from evoexp.records import FloatArray, Generation
from evoexp.robots.assembly import Robot
from evoexp.scenarios.arm_motion import ArmMotion
from evoexp.validation import Component, Count, NonNegative, Positive


class SearchSettings(Component):
    """How much is searched.

    Attributes:
        population_size: Paths drawn for the initial population; the best of them is kept.
        num_offspring: λ, the displaced paths of every generation.
        num_generations: Generations after the initial one.
    """

    component: ClassVar[str] = "my_planner_settings"

    population_size: Count
    num_offspring: Count
    num_generations: Count


class Problem(NamedTuple):
    """Robot and scenario as the search needs them.

    Attributes:
        straight: (nq, instants) the straight path from start to goal [deg].
        collision: The collision model.
        scene: The bodies, for the exact verdict on a motion.
        security_margin: Clearance that the task requires [length unit].
    """

    straight: FloatArray
    collision: SphereCollision
    scene: Scene
    security_margin: float


class MyPlanner(PlannerDefaults, Component):
    """The search.

    Attributes:
        num_via_points: Via-points between start and goal.
        max_displacement: Largest random displacement of a joint at a via-point [deg].
        collision_weight: Cost of every colliding configuration [deg], like the length of a path.
        ga: How much is searched.
        collision: Collision model, and configurations tested per segment.
    """

    component: ClassVar[str] = "my_planner"

    num_via_points: Count
    max_displacement: Positive
    collision_weight: NonNegative
    ga: SearchSettings
    collision: TouchingSpheres

    def prepare(self, robot: Robot, scenario: ArmMotion) -> Problem:
        """Build the robot, and check that start and goal are free of collision.

        Raises:
            SettingError: If they are not.
        """
        assembly = robot.build()
        start, goal = scenario.ends(assembly.arm_slices)
        collision = self.collision.bind(assembly, scenario.obstacles)
        for name, q in (("q_start", start), ("q_goal", goal)):
            if collision.clearance(q[:, None]).least[0] < 0.0:
                raise SettingError(f"scenario.{name}", "free of collision", q.tolist())
        straight = np.linspace(start, goal, self.num_via_points + 2, axis=1)
        bodies = scene(assembly, scenario.obstacles)
        return Problem(straight, collision, bodies, scenario.security_margin)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Generation]:
        """Yield the initial population, then λ displaced paths per generation."""
        keeper = Keeper()
        population = self.sample(problem, rng, self.ga.population_size)
        for _ in range(self.ga.num_generations + 1):
            yield keeper.record_judged(self, problem, population, self.cost(problem, population))
            parent = keeper.best.solution.reshape(problem.straight.T.shape).T
            population = self._displaced(parent, rng, self.ga.num_offspring)

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
        """Return displaced straight paths."""
        return self._displaced(problem.straight, rng, count)

    def _displaced(self, path: FloatArray, rng: np.random.Generator, count: int) -> FloatArray:
        """Return copies of a path (nq, instants) whose via-points are displaced at random."""
        population = np.repeat(path[:, :, None], count, axis=2)
        moves = 2.0 * rng.random((len(path), self.num_via_points, count)) - 1.0
        population[:, 1:-1] += self.max_displacement * moves
        return population

    def cost(self, problem: Problem, population: FloatArray) -> JudgementArrays:
        """Judge paths: their length, and how many of the tested configurations collide."""
        steps = np.diff(population, axis=1)  # (nq, segments, individuals)
        length = np.sqrt((steps**2).sum(axis=0)).sum(axis=0)
        # configurations at equal distances along every segment, its end included
        part = np.linspace(0.0, 1.0, self.collision.collision_substeps + 1)[1:, None]
        q = population[:, :-1, None] + part * steps[:, :, None]
        clearance = problem.collision.clearance(q.reshape(len(q), -1), limit=0.0).least
        collisions = (clearance < 0.0).reshape(-1, population.shape[2]).sum(axis=0)
        cost = length + self.collision_weight * collisions
        terms = {"length_deg": length, "collisions": collisions}
        return JudgementArrays(cost, collisions == 0, q[0].size, terms)

    def solution(self, problem: Problem, population: FloatArray, individual: int) -> FloatArray:
        """Return one path as a flat solution."""
        return population[:, :, individual].T.ravel()

    def motion(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the motion of a solution: straight from instant to instant."""
        return Motion(DEGREE * solution.reshape(problem.straight.T.shape))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return length and collisions of a solution.

        Raises:
            ValueError: If the solution has another size.
        """
        path = solution.reshape(problem.straight.T.shape).T
        return self.cost(problem, path[:, :, None]).named_terms(0)

    def shape(self, problem: Problem) -> Shape:
        """Return the shape of a solution: one part, (instants, nq)."""
        return (problem.straight.T.shape,)
