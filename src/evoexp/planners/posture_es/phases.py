"""The phases of a task: goals, held objects, permitted contacts, and the bodies of each phase.

An object's place at the begin of a phase depends on the postures before; the rest is made once. A
phase ends at the first posture that meets its goal, so a list of postures alone says which phase
each of them belongs to.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.scene import Part, Scene
from evoexp.numeric.elementary import DEGREE
from evoexp.objectives.posture_cost import (
    DISTANCE,
    TERMS,
    PostureCost,
)
from evoexp.paths.motion import Motion
from evoexp.planners.posture_es import kernels
from evoexp.planners.posture_es.cell import Cell, Situation
from evoexp.planners.posture_es.kernels import COST, ROWS, Judging
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.poses import IDENTITY, compose, frame_pose, invert
from evoexp.scenarios.obstacles import ObstacleTable
from evoexp.scenarios.posture_task import (
    Phase,
    ShiftGoal,
)

KEPT = 64  # stages and scenes that a problem keeps


class Judged(NamedTuple):
    """Judged postures."""

    rows: FloatArray  # (ROWS, postures) terms, cost
    feasible: BoolArray  # (postures,)
    met: BoolArray  # (postures,) whether they meet the goal

    @property
    def cost(self) -> FloatArray:
        """The cost, (postures,)."""
        return np.asarray(self.rows[COST])

    @property
    def distance(self) -> FloatArray:
        """Distance from the goal, also inside of a body, (postures,) [length unit]."""
        return np.asarray(np.abs(self.rows[DISTANCE]))


class Stage(NamedTuple):
    """One phase, begun."""

    number: int  # of the phase, from 0
    phase: Phase  # the phase
    situation: Situation  # the places of all objects in it
    # index into the kinematic table, and local pose (12,), of the frame that is controlled
    controlled: tuple[int, FloatArray]
    judging: Judging  # terms and limits for `kernels.judge`

    @property
    def target_position(self) -> FloatArray:
        """The goal's point, or the middle of the object that is approached, (3,) [length unit]."""
        return self.judging.aim.point

    def weight(self, term: str) -> float:
        """Return the weight of a term of the cost, one of `posture_cost.TERMS`; 0: not counted."""
        return float(self.judging.weights[TERMS.index(term)])

    def judge(self, q: FloatArray) -> Judged:
        """Judge postures q (nq, postures) [rad]."""
        q = np.ascontiguousarray(q)
        count = q.shape[1]
        flags = np.empty(count, dtype=np.bool_), np.empty(count, dtype=np.bool_)
        found = Judged(np.empty((ROWS, count)), *flags)
        kernels.judge(q, self.judging, *found)
        return found


class Span(NamedTuple):
    """A phase in a list of postures."""

    stage: Stage  # the phase, begun
    first: int  # index of its first posture
    last: int  # index of its last posture, where the next phase begins
    judged: Judged  # its postures, judged by it
    reached: bool  # whether the last one meets its goal


@dataclass(frozen=True)
class Problem(Cell):
    """Robot and scenario, prepared for the search."""

    phases: tuple[Phase, ...]  # the phases of the task, subgoals included
    weights: FloatArray  # (phases, terms) of the cost
    objective: PostureCost  # the cost
    start: FloatArray  # (nq,) [rad]
    limits: FloatArray  # (nq, 2) [rad]
    scope: FloatArray  # (nq,) of a step [rad]
    scene: Scene | None  # the bodies themselves in the first phase
    security_margin: float  # clearance that the task requires [length unit]
    memory: dict[Any, Any]  # stages that begin with nothing moved, made once

    @property
    def last_stage(self) -> Stage:
        """The last phase, begun at the start with nothing moved."""
        return self.begin(len(self.phases) - 1, self.start, self.first_situation)

    def obstacles_in(self, stage: Stage) -> ObstacleTable:
        """Return the obstacles in a phase; a held object stands where it was taken."""
        return self.placed_obstacles(stage.situation)

    def parts(self, motion: Motion) -> list[Part]:
        """Return the motion phase by phase, each with its own bodies."""
        return [Part(self.scene_of(s.stage), s.first, s.last) for s in self.spans(motion.q)]

    def begin(self, index: int, q: FloatArray, situation: Situation) -> Stage:
        """Begin a phase at posture q (nq,); stages are kept, verdict and terms need them again."""
        moved = situation.held >= 0 or not np.array_equal(
            situation.poses, self.first_situation.poses
        )
        key = (index, situation.poses.tobytes(), situation.grasp.tobytes()) if moved else (index,)
        if isinstance(self.phases[index].goal, ShiftGoal):
            key = (*key, q.tobytes())
        if key not in self.memory:
            if len(self.memory) > KEPT:
                self.memory.clear()
            self.memory[key] = self._begun(index, q, situation)
        stage: Stage = self.memory[key]
        return stage

    def _begun(self, index: int, q: FloatArray, situation: Situation) -> Stage:
        phase, (joint, local) = self.phases[index], self.tool
        controlled = (joint, situation.grasp if situation.held >= 0 else local)
        collision, touching = self.collisions(phase, situation)
        objective, task = self.objective, self.task
        near = phase.position_tolerance or task.position_tolerance
        tilt = np.inf if phase.upright_tolerance is None else phase.upright_tolerance
        judging = Judging(
            self.assembly.table.chain,
            joint,
            controlled[1],
            self.aim(phase, q, situation, controlled),
            self.weights[index],
            np.array(objective.tilt_limits),
            self.limits,
            collision.tables,
            objective.free_space.reach if objective.free_space else 0.0,
            np.array([near, DEGREE * task.angle_tolerance, DEGREE * tilt]),
            objective.grasp_angles == "larger",
            (touching or collision).tables,
            touching is not None,
        )
        return Stage(index, phase, situation, controlled, judging)

    def finish(self, stage: Stage, q: FloatArray) -> Situation:
        """Return the places of all objects after a phase that ended at posture q (nq,)."""
        situation, phase = stage.situation, stage.phase
        if phase.then == "attach":
            held = self.task.names.index(phase.object)
            joint, _ = self.tool
            frame = frame_pose(self.assembly.table, joint, IDENTITY, q)
            return situation._replace(
                held=held, grasp=compose(invert(frame), situation.poses[held])
            )
        if phase.then == "detach":
            poses = situation.poses.copy()
            poses[situation.held] = frame_pose(self.assembly.table, *stage.controlled, q)
            return Situation(poses, -1, IDENTITY)
        return situation

    def spans(self, postures: FloatArray) -> list[Span]:
        """Return the phases that a list of postures (postures, nq) reaches."""
        found: list[Span] = []
        first, situation, last = 0, self.first_situation, len(postures) - 1
        for index in range(len(self.phases)):
            stage = self.begin(index, postures[first], situation)
            judged = stage.judge(postures[first:].T)
            where = np.flatnonzero(judged.met)
            stop = first + int(where[0]) if len(where) else last
            kept = slice(0, stop - first + 1)
            own = Judged(judged.rows[:, kept], judged.feasible[kept], judged.met[kept])
            found.append(Span(stage, first, stop, own, bool(len(where))))
            if not len(where):
                break
            situation, first = self.finish(stage, postures[stop]), stop
        return found

    def scene_of(self, stage: Stage) -> Scene:
        """Return the bodies of a phase, for the exact verdict."""
        situation = stage.situation
        key = (
            "scene",
            stage.phase.contacts,
            situation.held,
            situation.grasp.tobytes(),
            situation.poses.tobytes(),
        )
        if key not in self.memory:
            self.memory[key] = self.scene_in(stage.phase, situation)
        bodies: Scene = self.memory[key]
        return bodies
