"""A robot cell: the arm, the objects around it, and the bodies that move or stand in a phase."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.bodies.body_collision import BodyCollision
from evoexp.collision.bodies.body_models import BodyModel, Carried
from evoexp.collision.covers.body_covers import Cover
from evoexp.collision.scene import AllowedContact, Scene, geometry_scene, obstacle_shapes
from evoexp.numeric.rotations import rotation_matrix
from evoexp.objectives.posture_cost import EDGED, POINT, ROD, ROUND, Aim
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.poses import IDENTITY, compose, frame_pose, pose_of
from evoexp.scenarios.obstacles import (
    BOX,
    CYLINDER,
    ObstacleTable,
    obstacle_hulls,
)
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


class Situation(NamedTuple):
    """The places of all objects."""

    poses: FloatArray  # (obstacles, 12) in the world; a held object stands where it was taken
    held: int  # index of the held object; −1: none
    # (12,) of the held object, in the table's frame of the joint that moves the tool
    grasp: FloatArray


@dataclass(frozen=True)
class Cell:
    """Robot and objects."""

    assembly: Assembly  # the robot, built
    bodies: BodyModel  # its bodies, covered
    task: PostureTask  # the scenario
    obstacles: ObstacleTable  # the obstacles at the start
    # covers of the objects that are grasped, by index, in their own frames, and shapes inside
    # them
    covers: dict[int, tuple[Cover, Cover]]
    # index into the kinematic table of the joint that moves the tool; its local pose (12,)
    tool: tuple[int, FloatArray]

    @property
    def first_situation(self) -> Situation:
        """All objects where the scenario puts them."""
        table = self.obstacles
        return Situation(np.hstack([table.rotation, table.center]), -1, IDENTITY)

    def placed_obstacles(self, situation: Situation) -> ObstacleTable:
        """Return the obstacles in a situation; a held object stands where it was taken."""
        poses = situation.poses
        return self.obstacles._replace(rotation=poses[:, :9].copy(), center=poses[:, 9:].copy())

    def shapes(self, situation: Situation) -> list[tuple[Any, Any]]:
        """Return the exact shapes of the obstacles in a situation, and their placements."""
        hulls = obstacle_hulls(self.task.objects)
        return obstacle_shapes(self.placed_obstacles(situation), hulls)

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
        for k, (shape, placement) in enumerate(self.shapes(situation)):
            joint, where = 0, placement
            if k == situation.held:
                joint = self.tool[0] + 1
                alignment = pose_of(assembly.table.alignment[joint - 1], np.zeros(3))
                pose = compose(alignment, situation.grasp)
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

    def collisions(
        self, phase: Phase, situation: Situation
    ) -> tuple[BodyCollision, BodyCollision | None]:
        """Return the collision models of pairs that must not touch, and of those that may."""
        obstacles, allowed, carried = self.surroundings(phase, situation)
        depth = self.allowed_penetration
        return (
            self.bodies.collision(obstacles, allowed, carried),
            self.bodies.touching(obstacles, allowed, depth, carried),
        )

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
        grasp = situation.grasp
        joint = self.tool[0] + 1
        pose = compose(pose_of(self.assembly.table.alignment[joint - 1], np.zeros(3)), grasp)
        cover, inner = (_moved_cover(pose, one) for one in self.covers[held])
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

    def _apart_from_tool(self) -> list[int]:
        """Return the bodies that a held object must not touch: all that are not beside the tool."""
        joint, parents = self.tool[0] + 1, self.assembly.model.parents
        items = self.assembly.geometry.geometryObjects
        return [
            k for k, item in enumerate(items) if item.parentJoint not in (joint, parents[joint])
        ]


def _allowed(phase: Phase) -> set[frozenset[str]]:
    return {frozenset(pair) for pair in phase.contacts}


def _moved_cover(pose: FloatArray, cover: Cover) -> Cover:
    return cover._replace(start=_moved(pose, cover.start), end=_moved(pose, cover.end))


def _moved(pose: FloatArray, points: FloatArray) -> FloatArray:
    x, y, z = points.T
    rows = [
        (pose[3 * e] * x + pose[3 * e + 1] * y + pose[3 * e + 2] * z) + pose[9 + e]
        for e in range(3)
    ]
    return np.column_stack(rows)
