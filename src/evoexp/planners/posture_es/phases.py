"""The phases of a task: goals, held objects, permitted contacts, and the bodies of each phase.

An object's place at the begin of a phase depends on the postures before; the rest is made once. A
phase ends at the first posture that meets its goal, so a list of postures alone says which phase
each of them belongs to.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.bodies.body_models import BodyModel, Carried
from evoexp.collision.covers.body_covers import Cover
from evoexp.collision.scene import AllowedContact, Scene, geometry_scene, obstacle_shapes
from evoexp.numeric.elementary import DEGREE
from evoexp.numeric.rotations import rotation_matrix
from evoexp.objectives.posture_cost import DISTANCE, EDGED, POINT, ROD, ROUND, Aim, PostureCost
from evoexp.planners.posture_es import kernels
from evoexp.planners.posture_es.kernels import COST, ROWS, Judging
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.poses import IDENTITY, compose, frame_pose, invert, pose_of
from evoexp.scenarios.obstacles import BOX, CYLINDER, ObstacleTable, obstacle_hulls
from evoexp.scenarios.posture_task import (
    Phase,
    PlaceGoal,
    PointGoal,
    PoseGoal,
    PostureTask,
    ShiftGoal,
    SurfaceGoal,
)

TOOL_UP, OBJECT_UP = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
KEPT = 64  # stages and scenes that a problem keeps


class Situation(NamedTuple):
    """The places of all objects."""

    poses: FloatArray  # (obstacles, 12) in the world; a held object stands where it was taken
    held: int  # index of the held object; −1: none
    # (12,) of the held object, in the table's frame of the joint that moves the tool
    grasp: FloatArray


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
class Problem:
    """Robot, objects and scenario, prepared for the search."""

    assembly: Assembly  # the robot, built
    bodies: BodyModel  # its bodies, covered
    task: PostureTask  # the scenario
    obstacles: ObstacleTable  # the obstacles at the start
    # covers of the objects that are grasped, by index, in their own frames, and shapes inside
    # them
    covers: dict[int, tuple[Cover, Cover]]
    # index into the kinematic table of the joint that moves the tool; its local pose (12,)
    tool: tuple[int, FloatArray]
    phases: tuple[Phase, ...]  # the phases of the task, subgoals included
    weights: FloatArray  # (phases, terms) of the cost
    objective: PostureCost  # the cost
    start: FloatArray  # (nq,) [rad]
    limits: FloatArray  # (nq, 2) [rad]
    scope: FloatArray  # (nq,) of a step [rad]
    scene: Scene | None  # the bodies themselves in the first phase
    security_margin: float  # clearance that the task requires [length unit]
    memory: dict[Any, Any]  # stages that begin with nothing moved, made once

    def begin(self, index: int, q: FloatArray, situation: Situation) -> Stage:
        """Begin a phase at posture q (nq,); stages are kept, verdict and terms need them again."""
        moved = situation.held >= 0 or not np.array_equal(
            situation.poses, self.first_situation.poses
        )
        key = (index, situation.poses.tobytes(), situation.grasp.tobytes()) if moved else (index,)
        if isinstance(self.phases[index].goal, ShiftGoal):
            key = (*key, q.tobytes())
        if key in self.memory:
            stage: Stage = self.memory[key]
            return stage
        if len(self.memory) > KEPT:
            self.memory.clear()
        phase, (joint, local) = self.phases[index], self.tool
        controlled = (joint, situation.grasp if situation.held >= 0 else local)
        # the collision models of pairs that must not touch, and of those that may
        bodies, (obstacles, allowed, carried) = self.bodies, self.surroundings(phase, situation)
        collision = bodies.collision(obstacles, allowed, carried)
        touching = bodies.touching(obstacles, allowed, self.allowed_penetration, carried)
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
        stage = self.memory[key] = Stage(index, phase, situation, controlled, judging)
        return stage

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

    @property
    def first_situation(self) -> Situation:
        """All objects where the scenario puts them."""
        table = self.obstacles
        return Situation(np.hstack([table.rotation, table.center]), -1, IDENTITY)

    def placed_obstacles(self, situation: Situation) -> ObstacleTable:
        """Return the obstacles in a situation; a held object stands where it was taken."""
        poses = situation.poses
        return self.obstacles._replace(rotation=poses[:, :9].copy(), center=poses[:, 9:].copy())

    @property
    def allowed_penetration(self) -> float:
        """How deep pairs that may touch may overlap [length unit]."""
        return self.task.allowed_penetration or 0.0

    def scene_in(self, phase: Phase, situation: Situation) -> Scene:
        """Return the bodies of a phase, for the exact verdict."""
        assembly = self.assembly
        items = list(assembly.geometry.geometryObjects)
        geometry = pin.GeometryModel()
        for item in items:
            geometry.addGeometryObject(
                pin.GeometryObject(item.name, item.parentJoint, 0, item.placement, item.geometry)
            )
        hulls, obstacles = obstacle_hulls(self.task.objects), self.placed_obstacles(situation)
        for k, (shape, placement) in enumerate(obstacle_shapes(obstacles, hulls)):
            joint, where = 0, placement
            if k == situation.held:
                joint, pose = self._held_pose(situation)
                where = pin.SE3(pose[:9].reshape(3, 3), pose[9:])
            geometry.addGeometryObject(
                pin.GeometryObject(self.task.names[k], joint, 0, where, shape)
            )
        allowed = _allowed(phase)
        pairs = list(self.bodies.sorted_pairs.judged)
        touching: list[AllowedContact] = []
        for k in range(len(self.task.names)):
            if k == situation.held:
                others = [len(items) + j for j in range(len(self.task.names)) if j != k]
                watched = [*self._apart_from_tool(), *others]
                pairs += [(body, len(items) + k) for body in watched]
            else:
                pairs += [
                    (body, len(items) + k)
                    for body, item in enumerate(items)
                    if item.parentJoint > 0
                ]
        names = [item.name for item in geometry.geometryObjects]
        for a, b in pairs:
            if frozenset((names[a], names[b])) in allowed:
                touching.append(AllowedContact(a, b, self.allowed_penetration))
            else:
                geometry.addCollisionPair(pin.CollisionPair(a, b))
        scene = geometry_scene(assembly.model, geometry, assembly.table)
        return scene._replace(contacts=tuple(touching))

    def surroundings(
        self, phase: Phase, situation: Situation
    ) -> tuple[ObstacleTable, tuple[tuple[int, int], ...], Carried | None]:
        """Return the obstacles, the pairs (body, obstacle) that may touch, the carried object."""
        names, bodies = self.task.names, self.bodies.names
        allowed = _allowed(phase)
        held = situation.held
        left = [k for k in range(len(names)) if k != held]
        table = self.placed_obstacles(situation)
        table = ObstacleTable(*(np.ascontiguousarray(column[left]) for column in table))
        own = len(bodies)
        numbers = {name: k for k, name in enumerate(bodies)} | (
            {names[held]: own} if held >= 0 else {}
        )
        moving = {
            k
            for k, item in enumerate(self.assembly.geometry.geometryObjects)
            if item.parentJoint > 0
        } | {own}
        ignored = tuple(
            (number, place)
            for name, number in numbers.items()
            for place, k in enumerate(left)
            if number in moving and frozenset((name, names[k])) in allowed
        )
        if held < 0:
            return table, ignored, None
        joint, pose = self._held_pose(situation)
        cover, inner = (
            one._replace(start=_moved(pose, one.start), end=_moved(pose, one.end))
            for one in self.covers[held]
        )
        watched = [
            k for k in self._apart_from_tool() if frozenset((bodies[k], names[held])) not in allowed
        ]
        return table, ignored, Carried(joint, cover, inner, tuple(watched))

    def aim(
        self,
        phase: Phase,
        q: FloatArray,
        situation: Situation,
        controlled: tuple[int, FloatArray],
    ) -> Aim:
        """Return the goal of a phase that begins at posture q, as the kernels take it."""
        goal, rotation = phase.goal, IDENTITY[:9].copy()
        point, axis = np.zeros(3), np.zeros(3)
        surface, half_length, radius, half_edges = POINT, 0.0, 0.0, np.zeros(3)
        up = np.array(self.task.up)
        up = up / np.sqrt(np.sum(up * up))
        if isinstance(goal, PointGoal | PoseGoal | PlaceGoal):
            point = np.array(goal.point, dtype=np.float64)
        if isinstance(goal, PointGoal) and goal.radius > 0.0:
            surface, radius = ROD, goal.radius
        if isinstance(goal, PlaceGoal):
            surface, radius, axis = ROUND, goal.radius, up
        if isinstance(goal, PoseGoal):
            rotation = np.array(rotation_matrix(goal.rotation), dtype=np.float64).ravel()
        if isinstance(goal, ShiftGoal):
            table = self.assembly.table
            now = frame_pose(table, *controlled, q)
            way = np.array(goal.offset, dtype=np.float64)
            if goal.frame == "tool":
                tool = frame_pose(table, *self.tool, q)
                way = compose(tool, np.concatenate([IDENTITY[:9], way]))[9:] - tool[9:]
            rotation, point = now[:9].copy(), now[9:] + way
        if isinstance(goal, SurfaceGoal):
            k = self.task.names.index(goal.object)
            pose, kind, size = situation.poses[k], self.obstacles.kind[k], self.obstacles.size[k]
            rotation, point, axis = pose[:9].copy(), pose[9:].copy(), pose[[2, 5, 8]]
            if kind == BOX:
                surface, half_edges = EDGED, size.copy()
            else:
                surface, half_length, radius = ROUND if kind == CYLINDER else ROD, size[1], size[0]
        return Aim(
            rotation,
            point,
            axis,
            surface,
            float(half_length),
            float(radius),
            half_edges,
            up,
            OBJECT_UP if situation.held >= 0 else TOOL_UP,
        )

    def _held_pose(self, situation: Situation) -> tuple[int, FloatArray]:
        """Return Pinocchio's index of the tool's joint, and the held object's pose (12,) in it."""
        alignment = pose_of(self.assembly.table.alignment[self.tool[0]], np.zeros(3))
        return self.tool[0] + 1, compose(alignment, situation.grasp)

    def _apart_from_tool(self) -> list[int]:
        """Return the bodies that a held object must not touch: all that are not beside the tool."""
        joint, parents = self.tool[0] + 1, self.assembly.model.parents
        items = self.assembly.geometry.geometryObjects
        return [
            k for k, item in enumerate(items) if item.parentJoint not in (joint, parents[joint])
        ]


def _allowed(phase: Phase) -> set[frozenset[str]]:
    return {frozenset(pair) for pair in phase.contacts}


def _moved(pose: FloatArray, points: FloatArray) -> FloatArray:
    x, y, z = points.T
    rows = [
        (pose[3 * e] * x + pose[3 * e + 1] * y + pose[3 * e + 2] * z) + pose[9 + e]
        for e in range(3)
    ]
    return np.column_stack(rows)
