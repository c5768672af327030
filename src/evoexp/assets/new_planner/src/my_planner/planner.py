"""A (1+λ) search for the motion of several arms among obstacles: an example to be changed.

An individual is a path: via-points at equal times from start to goal, with straight lines between
them. The best path so far is kept; every generation displaces all its via-points at random, λ
times, and the best of these paths replaces it if it is better.

A population is an array (nq, instants, individuals) [deg], the start and the goal among the
instants. A solution is flat: instant by instant, joint by joint (instants × nq) [deg].
"""

from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from evoexp.collision.bodies.covered_bodies import CoveredBodies
from evoexp.collision.bodies.touching_spheres import TouchingSpheres
from evoexp.numeric.elementary import DEGREE
from evoexp.paths.interpolation import interpolate_linear
from evoexp.paths.motion import Motion
from evoexp.planners.arm_tasks import ArmProblem, ArmTask, arm_problem
from evoexp.planners.planner import JudgementArrays, Keeper, PlannerDefaults, Shape
from evoexp.records import Block, FloatArray
from evoexp.robots.assembly import Robot
from evoexp.validation import Component, Count, NonNegative, Positive


class SearchSettings(Component):
    """How much is searched."""

    component: ClassVar[str] = "my_planner_settings"

    population_size: Count  # paths drawn for the initial population; the best of them is kept
    num_offspring: Count  # λ, the displaced paths of every generation
    num_generations: Count  # generations after the initial one


class MyPlanner(PlannerDefaults, Component):
    """The search."""

    component: ClassVar[str] = "my_planner"

    num_via_points: Count  # via-points between start and goal
    max_displacement: Positive  # largest random displacement of a joint at a via-point [deg]
    # cost of every colliding configuration [deg], like the length of a path
    collision_weight: NonNegative
    ga: SearchSettings  # how much is searched
    # collision model, and configurations tested per segment
    collision: TouchingSpheres | CoveredBodies

    def prepare(self, robot: Robot, scenario: ArmTask) -> ArmProblem:
        """Build robot and scene, and check that start and goal are free of collision."""
        return arm_problem(robot, scenario, self.collision)

    def evolve(self, problem: ArmProblem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the initial population, then λ displaced paths per generation."""
        keeper = Keeper()
        population = self.sample(problem, rng, self.ga.population_size)
        for _ in range(self.ga.num_generations + 1):
            yield keeper.record_judged(self, problem, population, self.cost(problem, population))
            parent = self._path(problem, keeper.best.solution)
            population = self._displaced(problem, parent, rng, self.ga.num_offspring)

    def sample(self, problem: ArmProblem, rng: np.random.Generator, count: int) -> FloatArray:
        """Return displaced straight paths."""
        straight = np.linspace(problem.start, problem.goal, self.num_via_points + 2, axis=1)
        return self._displaced(problem, straight, rng, count)

    def _displaced(
        self, problem: ArmProblem, path: FloatArray, rng: np.random.Generator, count: int
    ) -> FloatArray:
        """Return copies of a path (nq, instants) with via-points displaced, within joint limits."""
        population = np.repeat(path[:, :, None], count, axis=2)
        moves = 2.0 * rng.random((len(path), self.num_via_points, count)) - 1.0
        population[:, 1:-1] += self.max_displacement * moves
        return np.clip(population, *problem.limits.T[:, :, None, None])

    def cost(self, problem: ArmProblem, population: FloatArray) -> JudgementArrays:
        """Judge paths: their length, and how many of the tested configurations collide."""
        steps = np.diff(population, axis=1)  # (nq, segments, individuals)
        length = np.sqrt((steps**2).sum(axis=0)).sum(axis=0)
        # configurations at equal distances along every segment, its end included
        q = interpolate_linear(population, self.collision.collision_substeps)
        collides = problem.collision.collides(q.reshape(len(q), -1)).reshape(q.shape[1:])
        collisions = collides.sum(axis=0)
        cost = length + self.collision_weight * collisions
        terms = {"length_deg": length, "collisions": collisions}
        return JudgementArrays(cost, collisions == 0, collides.size, terms)

    def solution(self, problem: ArmProblem, population: FloatArray, individual: int) -> FloatArray:
        """Return one path as a flat solution."""
        return population[:, :, individual].T.ravel()

    def _path(self, problem: ArmProblem, solution: FloatArray) -> FloatArray:
        """Return the path (nq, instants) of a solution; ValueError if it has another size."""
        return solution.reshape(-1, len(problem.start)).T

    def motion(self, problem: ArmProblem, solution: FloatArray) -> Motion:
        """Return the motion of a solution: straight from instant to instant."""
        return Motion(DEGREE * self._path(problem, solution).T)

    def evaluate(self, problem: ArmProblem, solution: FloatArray) -> dict[str, float]:
        """Return length and collisions of a solution."""
        return self.cost(problem, self._path(problem, solution)[:, :, None]).named_terms(0)

    def shape(self, problem: ArmProblem) -> Shape:
        """Return the shape of a solution: one part, (instants, nq)."""
        return ((self.num_via_points + 2, len(problem.start)),)
