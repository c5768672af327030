"""The phases of a task: goals, held objects, permitted contacts, and the bodies of each phase.

A phase ends at the first posture that meets its goal, so a list of postures alone says which phase
each of them belongs to.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.bodies.body_models import BodyModel, Carried
from evoexp.collision.covers.body_covers import Cover
from evoexp.collision.scene import AllowedContact, Scene, geometry_scene, obstacle_shapes
from evoexp.numeric.elementary import DEGREE, rotation_matrix
from evoexp.objectives.posture_cost import EDGED, POINT, ROD, ROUND, Aim, PostureCost
from evoexp.planners.posture_es import kernels
from evoexp.planners.posture_es.kernels import COST, ROWS, Judging
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.kinematics import IDENTITY, compose, frame_pose, invert, pose_of
from evoexp.scenarios import motion_tasks
from evoexp.scenarios.obstacles import BOX, CYLINDER, ObstacleTable, obstacle_hulls

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


class Stage(NamedTuple):
    """One phase, begun."""

    number: int  # of the phase, from 0
    phase: motion_tasks.Phase  # the phase
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
        found = Judged(np.empty((ROWS, q.shape[1])), *np.empty((2, q.shape[1]), dtype=np.bool_))
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
    task: motion_tasks.PostureTask  # the scenario
    obstacles: ObstacleTable  # the obstacles at the start
    # covers of the objects that are grasped, by index, in their own frames, and shapes inside
    # them
    covers: dict[int, tuple[Cover, Cover]]
    # index into the kinematic table of the joint that moves the tool; its local pose (12,)
    tool: tuple[int, FloatArray]
    phases: tuple[motion_tasks.Phase, ...]  # the phases of the task, subgoals included
    weights: FloatArray  # (phases, terms) of the cost
    objective: PostureCost  # the cost
    start: FloatArray  # (nq,) [rad]
    limits: FloatArray  # (nq, 2) [rad]
    scope: FloatArray  # (nq,) of a step [rad]
    security_margin: float  # clearance that the task requires [length unit]
    memory: dict[Any, Any]  # stages that begin with nothing moved, made once

    def begin(self, index: int, q: FloatArray, situation: Situation) -> Stage:
        """Begin a phase at posture q (nq,); stages are kept, verdict and terms need them again."""
        phase, (joint, local) = self.phases[index], self.tool
        place = q.tobytes() if isinstance(phase.goal, motion_tasks.ShiftGoal) else b""
        key = index, situation.held, situation.poses.tobytes(), situation.grasp.tobytes(), place
        if key in self.memory:
            stage: Stage = self.memory[key]
            return stage
        if len(self.memory) > KEPT:
            self.memory.clear()
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
            frame = frame_pose(self.assembly.table, self.tool[0], IDENTITY, q)
            grasp = compose(invert(frame), situation.poses[held])
            return situation._replace(held=held, grasp=grasp)
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
            count = stop - first + 1
            own = Judged(judged.rows[:, :count], judged.feasible[:count], judged.met[:count])
            found.append(Span(stage, first, stop, own, bool(len(where))))
            if not len(where):
                break
            situation, first = self.finish(stage, postures[stop]), stop
        return found

    def scene_of(self, stage: Stage) -> Scene:
        """Return the bodies of a phase, for the exact verdict."""
        phase, situation = stage.phase, stage.situation
        poses, held, grasp = situation
        key = phase.contacts, held, grasp.tobytes(), poses.tobytes()
        if key in self.memory:
            scene: Scene = self.memory[key]
            return scene
        assembly, names = self.assembly, [*self.bodies.names, *self.task.names]
        geometry, items = pin.GeometryModel(), assembly.geometry.geometryObjects
        placed = [(item.parentJoint, item.placement, item.geometry) for item in items]
        hulls, obstacles = obstacle_hulls(self.task.objects), self.placed_obstacles(situation)
        pairs, first = list(self.bodies.sorted_pairs.judged), len(placed)
        for k, (shape, place) in enumerate(obstacle_shapes(obstacles, hulls)):
            if k == situation.held:
                joint, pose = self._held_pose(situation)
                placed.append((joint, pin.SE3(pose[:9].reshape(3, 3), pose[9:]), shape))
                others = [first + j for j in range(len(self.task.names)) if j != k]
                watched = [*self._apart_from_tool(), *others]
            else:
                placed.append((0, place, shape))
                watched = self._moving
            pairs += [(body, first + k) for body in watched]
        for name, (joint, place, shape) in zip(names, placed, strict=True):
            geometry.addGeometryObject(pin.GeometryObject(name, joint, 0, place, shape))
        contacts = []
        for a, b in pairs:
            if _are_among(phase, names[a], names[b]):
                contacts.append(AllowedContact(a, b, self.allowed_penetration))
            else:
                geometry.addCollisionPair(pin.CollisionPair(a, b))
        scene = geometry_scene(assembly.model, geometry, assembly.table)
        scene = self.memory[key] = scene._replace(contacts=tuple(contacts))
        return scene

    @property
    def first_stage(self) -> Stage:
        """The first phase, begun at the start."""
        return self.begin(0, self.start, self.first_situation)

    @property
    def scene(self) -> Scene:
        """The bodies themselves in the first phase."""
        return self.scene_of(self.first_stage)

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

    def surroundings(
        self, phase: motion_tasks.Phase, situation: Situation
    ) -> tuple[ObstacleTable, tuple[tuple[int, int], ...], Carried | None]:
        """Return the obstacles, the pairs (body, obstacle) that may touch, the carried object."""
        names, bodies, held = self.task.names, self.bodies.names, situation.held
        left, table = [k for k in range(len(names)) if k != held], self.placed_obstacles(situation)
        table = ObstacleTable(*(np.ascontiguousarray(column[left]) for column in table))
        moving = [(k, bodies[k]) for k in self._moving]
        moving += [(len(bodies), names[held])] if held >= 0 else []
        ignored = tuple(
            (number, place)
            for number, name in moving
            for place, k in enumerate(left)
            if _are_among(phase, name, names[k])
        )
        if held < 0:
            return table, ignored, None
        joint, pose = self._held_pose(situation)
        cover, inner = (
            one._replace(start=_moved(pose, one.start), end=_moved(pose, one.end))
            for one in self.covers[held]
        )
        apart = self._apart_from_tool()
        watched = [k for k in apart if not _are_among(phase, bodies[k], names[held])]
        return table, ignored, Carried(joint, cover, inner, tuple(watched))

    @property
    def _moving(self) -> list[int]:
        items = self.assembly.geometry.geometryObjects
        return [k for k, item in enumerate(items) if item.parentJoint > 0]

    def aim(
        self,
        phase: motion_tasks.Phase,
        q: FloatArray,
        situation: Situation,
        controlled: tuple[int, FloatArray],
    ) -> Aim:
        """Return the goal of a phase that begins at posture q, as the kernels take it."""
        goal, up = phase.goal, np.array(self.task.up)
        up = up / np.sqrt(np.sum(up * up))
        own_up = OBJECT_UP if situation.held >= 0 else TOOL_UP
        turn, zero = IDENTITY[:9].copy(), np.zeros(3)
        if isinstance(goal, motion_tasks.ShiftGoal):
            table = self.assembly.table
            now, way = frame_pose(table, *controlled, q), np.array(goal.offset, dtype=np.float64)
            if goal.frame == "tool":
                tool = frame_pose(table, *self.tool, q)
                way = compose(tool, np.concatenate([turn, way]))[9:] - tool[9:]
            return Aim(now[:9].copy(), now[9:] + way, zero, POINT, 0.0, 0.0, zero, up, own_up)
        if isinstance(goal, motion_tasks.SurfaceGoal):
            k = self.task.names.index(goal.object)
            pose, kind, size = situation.poses[k], self.obstacles.kind[k], self.obstacles.size[k]
            place = pose[:9].copy(), pose[9:].copy(), pose[[2, 5, 8]]
            if kind == BOX:
                return Aim(*place, EDGED, 0.0, 0.0, size.copy(), up, own_up)
            surface = ROUND if kind == CYLINDER else ROD
            return Aim(*place, surface, float(size[1]), float(size[0]), zero, up, own_up)
        point = np.array(goal.point, dtype=np.float64)
        if isinstance(goal, motion_tasks.PoseGoal):
            turn = np.array(rotation_matrix(goal.rotation), dtype=np.float64).ravel()
            return Aim(turn, point, zero, POINT, 0.0, 0.0, zero, up, own_up)
        if isinstance(goal, motion_tasks.PlaceGoal):
            return Aim(turn, point, up, ROUND, 0.0, goal.radius, zero, up, own_up)
        surface = ROD if goal.radius > 0.0 else POINT
        return Aim(turn, point, zero, surface, 0.0, goal.radius, zero, up, own_up)

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


def _are_among(phase: motion_tasks.Phase, one: str, two: str) -> bool:
    return any({one, two} == set(pair) for pair in phase.contacts)


def _moved(pose: FloatArray, points: FloatArray) -> FloatArray:
    x, y, z = points.T
    turned = [pose[e] * x + pose[e + 1] * y + pose[e + 2] * z for e in (0, 3, 6)]
    return np.column_stack([row + shift for row, shift in zip(turned, pose[9:], strict=True)])
