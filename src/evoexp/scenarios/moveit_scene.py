"""The world of a MoveIt planning scene: objects, and which pairs may touch."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evoexp.errors import SettingError, nearest
from evoexp.scenarios.moveit_files import IDENTITY, Document, Pose, primitive_kind
from evoexp.scenarios.moveit_frames import Frames, read_frames
from evoexp.scenarios.moveit_meshes import Mesh, cone_hull, mesh_hulls
from evoexp.scenarios.obstacles import (
    BoxObstacle,
    CylinderObstacle,
    HalfSpaceObstacle,
    Obstacle,
    SphereObstacle,
)

if TYPE_CHECKING:
    from evoexp.robots.assembly import LinkFrames

MOST_OBJECTS = 2000  # bodies: every one is tested against every body of the robot
SINGULAR = {"primitives": "primitive", "planes": "plane", "meshes": "mesh"}
SIZES = {
    "box": 3,
    "sphere": 1,
    "cylinder": 2,
    "cone": 2,
}  # numbers of a primitive that evoexp knows
# CollisionObject.operation, a byte: as ROS 1 writes it, ROS 2, and robowflex
OPERATIONS = {
    form: name
    for k, name in enumerate(("ADD", "REMOVE", "APPEND", "MOVE"))
    for form in (str(k), chr(k), str(bytes([k])), name.lower())
}


class AllowedPairs(NamedTuple):
    """The allowed-collision matrix."""

    entries: dict[frozenset[str], bool]  # pairs of names → whether they may touch
    defaults: dict[str, bool]  # names → whether they may touch whatever no entry names

    @property
    def names(self) -> set[str]:
        """All names that the matrix knows."""
        return {name for pair in self.entries for name in pair} | set(self.defaults)

    def may_touch(self, one: str, two: str) -> bool | None:
        """Return whether two things may touch; None: the matrix does not say."""
        known = self.entries.get(frozenset((one, two)))
        if known is not None:
            return known
        found = [self.defaults[name] for name in (one, two) if name in self.defaults]
        return all(found) if found else None


class World(NamedTuple):
    """The objects that stand around the robot."""

    obstacles: tuple[Obstacle, ...]  # its bodies, in the world [m]
    objects: tuple[str, ...]  # (obstacles) the object that each belongs to
    frames: Frames  # in which places are given


def read_world(scene: Document, links: "LinkFrames | None", meshes: Mapping[str, Mesh]) -> World:
    """Read the objects of a planning scene.

    Args:
        links: Of the robot; None: they have no names.
        meshes: Corners and triangles of meshes that the scene names, by these names.

    Raises:
        SettingError: If it holds what evoexp does not know.
    """
    for name, neutral in (("link_padding", 0.0), ("link_scale", 1.0)):
        for item in scene.items(scene.root.get(name), name):
            given = scene.mapping(item, name)
            size = given.get("padding", given.get("scale"))
            if size is not None and scene.number(size, name) != neutral:
                must = f"free of {name}, which evoexp does not know"
                raise SettingError(scene.field, must, str(given.get("link_name")))
    frames = read_frames(scene, links)
    check_robot_place(scene, scene.root.get("robot_state"), "robot_state", frames)
    obstacles: list[Obstacle] = []
    owners: list[str] = []
    world = scene.mapping(scene.root.get("world"), "world")
    for item in scene.items(world.get("collision_objects"), "world.collision_objects"):
        given = scene.mapping(item, "world.collision_objects")
        name = str(given.get("id", "")) or f"object_{len(set(owners)) + 1}"
        if name in owners:
            raise SettingError(scene.field, "objects whose ids differ", name)
        bodies = _bodies(scene, given, name, frames, meshes)
        obstacles += bodies
        owners += [name] * len(bodies)
    if len(obstacles) > MOST_OBJECTS:
        must = f"a scene of at most {MOST_OBJECTS} bodies"
        raise SettingError(scene.field, must, len(obstacles))
    return World(tuple(obstacles), tuple(owners), frames)


def read_state(document: Document, value: Any, where: str) -> dict[str, float]:
    """Read a robot state: joint names → positions.

    Raises:
        SettingError: If names and positions do not match, or a joint has two positions.
    """
    state = document.mapping(value, where)
    joints = document.mapping(state.get("joint_state"), f"{where}.joint_state")
    names = document.names(joints.get("name"), f"{where}.joint_state.name")
    values = document.numbers(joints.get("position"), f"{where}.joint_state.position", len(names))
    positions: dict[str, float] = {}
    for name, position in zip(names, map(float, values), strict=True):
        if positions.setdefault(name, position) != position:
            must = f"one position of '{name}' at {where}.joint_state"
            raise SettingError(document.field, must, [positions[name], position])
    return positions


def check_robot_place(document: Document, value: Any, where: str, frames: Frames) -> None:
    """Refuse a state in which joints of several coordinates move the robot.

    Raises:
        SettingError: If the robot stands elsewhere than its root.
    """
    state = document.mapping(value, where)
    where = f"{where}.multi_dof_joint_state"
    joints = document.mapping(state.get("multi_dof_joint_state"), where)
    names = document.names(joints.get("joint_names"), where)
    transforms = document.items(joints.get("transforms"), where)
    if names and len(transforms) != len(names):
        raise SettingError(document.field, f"a transform per joint of {where}", len(transforms))
    planning = frames.poses[frames.planning]
    for transform in transforms:
        # MoveIt takes the transform to lead from the frame of the header
        frame = frames.of_header(document, joints.get("header"), where)
        pose = document.pose(transform, where).times(planning.inverse.times(frame).inverse)
        if not pose.is_near(IDENTITY, 1e-9):
            must = "a robot at the origin (robot.base_position moves it elsewhere)"
            raise SettingError(document.field, must, f"one {pose.text} by {where}")


def _bodies(
    scene: Document,
    given: dict[str, Any],
    name: str,
    frames: Frames,
    meshes: Mapping[str, Mesh],
) -> list[Obstacle]:
    """Return the bodies of a collision object."""
    operation = OPERATIONS.get(str(given.get("operation", 0)).lower(), given.get("operation"))
    if operation not in (None, "ADD"):
        must = f"a scene whose objects are there, '{name}'.operation ADD (0)"
        raise SettingError(scene.field, must, operation)
    own = frames.of_header(scene, given.get("header"), f"'{name}'")
    own = own.times(scene.pose(given.get("pose"), f"'{name}'"))
    found: list[Obstacle] = []
    for kind, singular in SINGULAR.items():
        bodies = scene.items(given.get(kind), f"'{name}'.{kind}")
        poses = scene.items(given.get(f"{singular}_poses"), f"'{name}'.{singular}_poses")
        if len(poses) != len(bodies):
            must = f"a pose per {singular} of '{name}' ({len(bodies)})"
            raise SettingError(scene.field, must, len(poses))
        several = len(bodies) > 1
        for k, (body, pose) in enumerate(zip(bodies, poses, strict=True)):
            label = f"{name}_{len(found) + 1}" if several else name
            placed = own.times(scene.pose(pose, f"'{name}'.{singular}_poses[{k}]"))
            where = f"'{name}'.{kind}[{k}]"
            data = scene.mapping(body, where)
            if kind == "meshes":
                found += mesh_hulls(scene, data, meshes, placed, where, label)
            else:
                make = _primitive if kind == "primitives" else _plane
                found.append(make(scene, data, placed, label))
    if not found:
        raise SettingError(scene.field, "objects with a body each", f"'{name}' without one")
    return found


def _primitive(scene: Document, given: dict[str, Any], pose: Pose, name: str) -> Obstacle:
    """Return a box [x, y, z], a sphere [radius], a cylinder or cone [height, radius]."""
    kind = primitive_kind(given.get("type"))
    if kind not in SIZES:
        must = f"primitives that are {', '.join(SIZES)}"
        raise SettingError(scene.field, must, f"'{name}', a {kind}", nearest(kind, SIZES))
    sizes = scene.numbers(given.get("dimensions"), f"'{name}'.dimensions", SIZES[kind])
    if not sizes.min() > 0.0:
        must = f"dimensions above 0 of '{name}'"
        raise SettingError(scene.field, must, [float(size) for size in sizes])
    center = _three(pose.position)
    if kind == "box":
        size, angles = _three(sizes), pose.angles
        return BoxObstacle(shape="box", name=name, center=center, size=size, rotation=angles)
    if kind == "sphere":
        return SphereObstacle(shape="sphere", name=name, center=center, radius=float(sizes[0]))
    if kind == "cone":
        return cone_hull(float(sizes[0]), float(sizes[1]), pose, name)
    along = 0.5 * float(sizes[0]) * pose.rotation[:, 2]
    ends = _three(pose.position - along), _three(pose.position + along)
    radius = float(sizes[1])
    return CylinderObstacle(shape="cylinder", name=name, start=ends[0], end=ends[1], radius=radius)


def _plane(scene: Document, given: dict[str, Any], pose: Pose, name: str) -> Obstacle:
    """Return the half-space behind a plane ax + by + cz + d = 0: its normal points to free space.

    A thin plane and the half-space behind it are the same to a robot that stands before it.
    """
    a, b, c, d = scene.numbers(given.get("coef"), f"'{name}'.coef", 4)
    normal = np.array([a, b, c])
    size = float(a * a + b * b + c * c)
    if size == 0.0:
        raise SettingError(
            scene.field, f"a normal other than 0 of '{name}'", [float(a), float(b), float(c)]
        )
    point = pose.of_point(-d / size * normal)
    direction = Pose(pose.rotation, np.zeros(3)).of_point(normal)
    return HalfSpaceObstacle(
        shape="half_space", name=name, point=_three(point), normal=_three(direction)
    )


def read_allowed(scene: Document) -> AllowedPairs:
    """Read the allowed-collision matrix.

    Raises:
        SettingError: If it is no square of truth values, or says two things of a pair.
    """
    where = "allowed_collision_matrix"
    matrix = scene.mapping(scene.root.get(where), where)
    names = scene.names(matrix.get("entry_names"), f"{where}.entry_names")
    rows = scene.items(matrix.get("entry_values"), f"{where}.entry_values")
    if len(rows) != len(names):
        raise SettingError(scene.field, f"a row per name of {where} ({len(names)})", len(rows))
    entries: dict[frozenset[str], bool] = {}
    for one, row in zip(names, rows, strict=True):
        values = row.get("enabled") if isinstance(row, dict) else row
        values = scene.items(values, f"{where}.entry_values")
        if len(values) != len(names) or not all(isinstance(value, bool) for value in values):
            must = f"{len(names)} truth values in every row of {where}"
            raise SettingError(scene.field, must, f"the row of '{one}'")
        for two, value in zip(names, values, strict=True):
            if one != two and entries.setdefault(frozenset((one, two)), value) != value:
                must = f"a symmetric {where}"
                raise SettingError(scene.field, must, f"two values of '{one}' and '{two}'")
    known = scene.names(matrix.get("default_entry_names"), f"{where}.default_entry_names")
    values = scene.items(matrix.get("default_entry_values"), f"{where}.default_entry_values")
    if len(known) != len(values) or not all(isinstance(value, bool) for value in values):
        must = f"a truth value per name of {where}.default_entry_names"
        raise SettingError(scene.field, must, len(values))
    return AllowedPairs(entries, dict(zip(known, values, strict=True)))


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(value) + 0.0 for value in values)
    return x, y, z
