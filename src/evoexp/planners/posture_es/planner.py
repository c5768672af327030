"""Postures as individuals: an evolution strategy whose winner's ancestry is the path.

Corsépius 2001. An individual is one posture. The search begins with the momentary posture alone;
every cycle generates offspring by random steps within a local scope of the parents (Fig. 2), and
selects the best as the next parents. When an individual meets the goal, the path is its line of
ancestors. A task may have several phases; each is a search of its own that begins at the last
posture before.

A population is an array (nq, individuals) [rad]. A solution is flat: the ancestry, postures × nq
[rad], from the start to the best so far, through all phases.

The best so far is the individual of the lowest cost in its phase; once individuals meet the goal,
the cheapest of these. Costs of different phases cannot be compared: while a phase before the last
is searched, the plan's cost is inf. Individuals that collide or pass a hard limit are never
parents; means and deviations leave them out.
"""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field

from evoexp.collision.bodies.body_models import CollisionModel
from evoexp.collision.scene import Part
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.posture_cost import COLUMNS, PARALLEL, TERMS, UPRIGHT, PostureCost
from evoexp.paths.motion import Motion
from evoexp.planners.answers import Acceptance, CoverShape, Listing, Proofs, in_shape, of_postures
from evoexp.planners.arm_tasks import cover_shapes, hull_notes
from evoexp.planners.planner import COPIES, JudgementArrays, PlannerDefaults
from evoexp.planners.posture_es.cycles import Search, StrategySettings, named, path_terms
from evoexp.planners.posture_es.kernels import COST
from evoexp.planners.posture_es.phases import Problem, Span
from evoexp.planners.posture_es.problem import prepare
from evoexp.records import Block, FloatArray
from evoexp.robots.assembly import Robot
from evoexp.scenarios.motion_tasks import PostureTask
from evoexp.scenarios.moveit import MoveitTask
from evoexp.validation import Component, NonNegativeCount, Positive

TERM_VALUES = 60  # numbers kept for an individual: terms, and what the kernels note of it
DENSE = 50  # configurations per step at which tilts of the continuous motion are sampled


class PostureEs(PlannerDefaults, Component):
    """The evolution strategy of Corsépius, section 4."""

    goal_is_region: ClassVar[bool] = True

    # how far a joint may step at most: one number for all joints, or one per joint [rad],
    # lengths for sliding joints
    scope: Annotated[
        tuple[Positive, ...],
        Field(min_length=1),
        BeforeValidator(lambda scope: (scope,) if type(scope) in (int, float) else scope),
    ]
    # configurations tested between a parent and its child; 0: none, as in the paper
    edge_check: NonNegativeCount
    ga: StrategySettings  # parents, offspring, selection, mutation, when to stop
    objective: PostureCost  # terms of the cost
    collision: CollisionModel  # covers of the bodies
    # who may be a parent or the winner: everybody whom the model accepts, or those of them to
    # whom the exact certifier proves the way from their parent
    acceptance: Acceptance = "model"

    def prepare(self, robot: Robot, scenario: PostureTask | MoveitTask) -> Problem:
        """Build the robot and check the task against it."""
        return prepare(robot, scenario, self.scope, self.objective, self.collision)

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Block]:
        """Yield the start and then every cycle, phase by phase; their indices go on counting."""
        return Search(self, problem).blocks(rng)

    def sample(self, problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
        """Return postures uniform within the joint limits, (nq, count)."""
        low, high = problem.limits.T
        return np.asarray(low[:, None] + (high - low)[:, None] * rng.random((len(low), count)))

    def cost(self, problem: Problem, population: FloatArray) -> JudgementArrays:
        """Judge postures (nq, individuals) by the first phase."""
        judged = problem.first_stage.judge(population)
        if self.answers_are_proven:
            met = np.where(judged.met, judged.cost, np.inf)
            Proofs(self, problem).settle(met, lambda k: self.solution(problem, population, k))
            refuted = judged.met & ~np.isfinite(met)
            judged.feasible[refuted] = judged.met[refuted] = False
        cost = np.where(judged.feasible, judged.cost, np.inf)
        terms = {COLUMNS[k]: judged.rows[k] for k in self.chosen} | {"cost": judged.cost}
        return JudgementArrays(cost, judged.met, len(cost), terms)

    @property
    def chosen(self) -> tuple[int, ...]:
        """Indices of the recorded terms: all that the objective gives a weight."""
        return tuple(k for k, name in enumerate(TERMS) if name in self.objective.chosen)

    def solution(self, problem: Problem, population: FloatArray, individual: int) -> FloatArray:
        """Return a posture as a flat solution: straight from the start."""
        return np.concatenate([problem.start, population[:, individual]])

    def motion(self, problem: Problem, solution: FloatArray) -> Motion:
        """Return the motion of a solution: straight in joint space, a posture per instant."""
        return Motion(self._postures(problem, solution))

    def evaluate(self, problem: Problem, solution: FloatArray) -> dict[str, float]:
        """Return the terms of the last posture in its phase, and of the whole path.

        `phase_1_end` and so on: postures, from 0, at which phases end; −1: not reached.
        """
        postures = self._postures(problem, solution)
        found, several = problem.spans(postures), len(problem.phases) > 1
        terms = named(found[-1].judged.rows[:, -1], self.chosen)
        terms |= path_terms(postures, problem.scope)
        for k in range(len(problem.phases) if several else 0):
            reached = k < len(found) and found[k].reached
            terms[f"phase_{k + 1}_end"] = float(found[k].last) if reached else -1.0
        infeasible = sum(np.sum(~span.judged.feasible) for span in found)
        return terms | {"infeasible_postures": float(infeasible)} | self._tilts(found, postures)

    def departures(self, problem: Problem, solution: FloatArray) -> list[str]:
        """Compare the start with the task's, and all postures with the joint limits."""
        return of_postures(self._postures(problem, solution), problem.start, problem.limits)

    def listing(self, problem: Problem, solution: FloatArray) -> Listing:
        """Return a table with one row per posture: phase, terms, cost, step from the one before."""
        postures = self._postures(problem, solution)
        terms = (COLUMNS[k] for k in self.chosen)
        names = ["posture", "phase", *terms, "cost", "goal", "step_rad", "step_scopes"]
        rows: list[list[Any]] = []
        for span in problem.spans(postures):
            for n in range(0 if span.first == 0 else 1, span.last - span.first + 1):
                at, judged = span.first + n, span.judged
                step = np.abs(postures[at] - postures[at - 1]) if at else np.zeros_like(postures[0])
                values = [float(judged.rows[k, n]) for k in (*self.chosen, COST)]
                steps = [float(step.max()), float((step / problem.scope).max())]
                rows.append([at, span.stage.phase.name, *values, bool(judged.met[n]), *steps])
        return Listing(names, rows)

    def parts(self, problem: Problem, motion: Motion) -> list[Part]:
        """Return the motion phase by phase: what is held changes the bodies."""
        spans = problem.spans(motion.q)
        return [Part(problem.scene_of(span.stage), span.first, span.last) for span in spans]

    def memory(self, problem: Problem) -> int:
        """Return the memory of a cycle's postures and their terms, and of all parents so far."""
        ga, nq = self.ga, len(problem.start)
        offspring = max(ga.initial_size, ga.num_offspring) + ga.num_immigrants + ga.num_parents
        parents = min(ga.num_parents, offspring) * ga.num_generations * len(problem.phases)
        return 8 * (offspring * (COPIES * nq + TERM_VALUES) + 2 * parents * (nq + 1))

    def shape(self, problem: Problem) -> tuple[Any, ...]:
        """Return the documented shape of a solution: any number of postures × nq."""
        return ..., (len(problem.start),)

    def notes(self, problem: Problem) -> tuple[str, ...]:
        """Describe the collision model and list the body pairs that it skips."""
        objects = zip(problem.task.names, problem.task.objects, strict=True)
        hulls = [name for name, each in objects if each.shape == "hull"]
        own = problem.bodies.notes(problem.task.length_unit, is_complete=True)
        return *own, *hull_notes(hulls)

    def covers(self, problem: Problem) -> tuple[CoverShape, ...]:
        """Return the spheres or capsules around the robot's bodies."""
        return cover_shapes(problem.bodies)

    def _tilts(self, found: list[Span], postures: FloatArray) -> dict[str, float]:
        """Return the greatest limited tilts, at postures and on the motion between them."""
        limits = {UPRIGHT: self.objective.upright, PARALLEL: self.objective.keep_parallel}
        terms = {}
        for term in (term for term, limit in limits.items() if limit is not None):
            name, at, between = TERMS[term], [0.0], [0.0]
            for span in (span for span in found if span.stage.judging.weights[term] > 0.0):
                at.append(float(span.judged.rows[term].max()))
                on_the_way = dense(postures[span.first : span.last + 1])
                between.append(float(span.stage.judge(on_the_way).rows[term].max()))
            terms[f"greatest_{name}_deg"] = max(at) / DEGREE
            terms[f"greatest_{name}_between_deg"] = max(between) / DEGREE
        return terms

    def _postures(self, problem: Problem, solution: FloatArray) -> FloatArray:
        return in_shape(solution, -1, len(problem.start))


def dense(postures: FloatArray) -> FloatArray:
    """Return configurations (nq, n) along the straight motion through postures (postures, nq)."""
    shares = np.arange(DENSE) / DENSE
    between = postures[:-1, None, :] + shares[:, None] * np.diff(postures, axis=0)[:, None, :]
    every = np.concatenate([between.reshape(-1, postures.shape[1]), postures[-1:]])
    return np.ascontiguousarray(every.T)
