"""The world of a MoveIt planning scene: objects, frames, and which pairs may touch."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.errors import SettingError, nearest
from evoexp.scenarios.moveit_files import (
    IDENTITY,
    KINDS,
    UNKNOWN_OF_SCENE,
    Document,
    Pose,
)
from evoexp.scenarios.moveit_meshes import cone_hull, mesh_hulls
from evoexp.scenarios.obstacles import (
    BoxObstacle,
    CylinderObstacle,
    HalfSpaceObstacle,
    Obstacle,
    SphereObstacle,
)

MOST_OBJECTS = 2000  # bodies: every one is tested against every body of the robot
SINGULAR = {"primitives": "primitive", "planes": "plane", "meshes": "mesh"}
SIZES = {
    "box": 3,
    "sphere": 1,
    "cylinder": 2,
    "cone": 2,
}  # numbers of a primitive that evoexp knows
ADDED = (0, None, "add", "ADD", b"\0", "\0")  # CollisionObject.operation
KEPT_FRAMES = ("", "world", "/world")


class AllowedPairs(NamedTuple):
    """The allowed-collision matrix.

    Attributes:
        entries: Pairs of names → whether they may touch.
        defaults: Names → whether they may touch whatever no entry names.
    """

    entries: dict[frozenset[str], bool]
    defaults: dict[str, bool]

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
    """The objects that stand around the robot.

    Attributes:
        obstacles: Its bodies, in the robot's root frame [m].
        objects: (obstacles) the object that each belongs to.
        allowed: Which pairs may touch.
        state: Joint names → positions of the scene's robot [rad, m].
        frames: Frames that do not move → their poses in the root frame.
        robot: Name of the robot's model; empty: not given.
    """

    obstacles: tuple[Obstacle, ...]
    objects: tuple[str, ...]
    allowed: AllowedPairs
    state: dict[str, float]
    frames: dict[str, Pose]
    robot: str


def read_world(content: bytes) -> World:
    """Read a planning scene.

    Raises:
        SettingError: If it is none, or holds what evoexp does not know.
    """
    scene = Document(content, "scenario.scene")
    scene.refuse(UNKNOWN_OF_SCENE)
    for name, neutral in (("link_padding", 0.0), ("link_scale", 1.0)):
        for each in scene.items(scene.root.get(name), name):
            given = scene.mapping(each, name)
            size = given.get("padding", given.get("scale"))
            if size is not None and scene.number(size, name) != neutral:
                must = f"free of {name}, which evoexp does not know"
                raise SettingError(scene.field, must, str(given.get("link_name")))
    frames = {}
    for each in scene.items(scene.root.get("fixed_frame_transforms"), "fixed_frame_transforms"):
        given = scene.mapping(each, "fixed_frame_transforms")
        name = str(given.get("child_frame_id", ""))
        frames[name] = scene.pose(given.get("transform"), f"the frame '{name}'")
    world = scene.mapping(scene.root.get("world"), "world")
    obstacles: list[Obstacle] = []
    owners: list[str] = []
    for each in scene.items(world.get("collision_objects"), "world.collision_objects"):
        given = scene.mapping(each, "world.collision_objects")
        name = str(given.get("id", "")) or f"object_{len(set(owners)) + 1}"
        if name in owners:
            raise SettingError(scene.field, "objects whose ids differ", name)
        own = _bodies(scene, given, name, frames)
        obstacles += own
        owners += [name] * len(own)
    if len(obstacles) > MOST_OBJECTS:
        must = f"a scene of at most {MOST_OBJECTS} bodies"
        raise SettingError(scene.field, must, len(obstacles))
    state = read_state(scene, scene.root.get("robot_state"), "robot_state")
    robot = str(scene.root.get("robot_model_name") or "")
    return World(tuple(obstacles), tuple(owners), _allowed(scene), state, frames, robot)


def read_state(document: Document, value: Any, where: str) -> dict[str, float]:
    """Read a robot state: joint names → positions.

    Raises:
        SettingError: If names and positions do not match, or the robot stands elsewhere than its
            root.
    """
    state = document.mapping(value, where)
    joints = document.mapping(state.get("joint_state"), f"{where}.joint_state")
    names = document.names(joints.get("name"), f"{where}.joint_state.name")
    values = document.numbers(joints.get("position"), f"{where}.joint_state.position", len(names))
    several = document.mapping(state.get("multi_dof_joint_state"), where)
    for transform in document.items(several.get("transforms"), where):
        pose = document.pose(transform, f"{where}.multi_dof_joint_state")
        if not np.allclose(pose.rotation, np.eye(3), atol=1e-9) or pose.position.any():
            must = "a robot at the origin (robot.base_position moves it elsewhere)"
            at = ", ".join(f"{x:g}" for x in pose.position)
            raise SettingError(document.field, must, f"one at ({at}) by {where}")
    return dict(zip(names, map(float, values), strict=True))


def frame_pose(document: Document, header: Any, frames: dict[str, Pose]) -> Pose:
    """Return the pose of the frame that a header names.

    Raises:
        SettingError: If the frame is neither the world, a fixed frame, nor left out.
    """
    given = document.mapping(header, "header").get("frame_id") or ""
    name = str(given)
    if name in frames or name in KEPT_FRAMES:
        return frames.get(name, IDENTITY)
    names = ["world", *frames]
    must = f"frames that do not move ({', '.join(dict.fromkeys(names))})"
    raise SettingError(document.field, must, name, nearest(name, names))


def _bodies(
    scene: Document, given: dict[str, Any], name: str, frames: dict[str, Pose]
) -> list[Obstacle]:
    """Return the bodies of a collision object."""
    if given.get("operation", 0) not in ADDED:
        must = f"objects to be added ('{name}'.operation: 0)"
        raise SettingError(scene.field, must, str(given["operation"]))
    own = frame_pose(scene, given.get("header"), frames)
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
                found += mesh_hulls(scene, data, placed, where, label)
            else:
                make = _primitive if kind == "primitives" else _plane
                found.append(make(scene, data, placed, label))
    if not found:
        raise SettingError(scene.field, "objects with a body each", f"'{name}' without one")
    return found


def _primitive(scene: Document, given: dict[str, Any], pose: Pose, name: str) -> Obstacle:
    """Return a box [x, y, z], a sphere [radius], a cylinder or cone [height, radius]."""
    kind = given.get("type")
    if isinstance(kind, int) and 0 < kind < len(KINDS):
        kind = KINDS[kind]
    kind = str(kind).lower()
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


def _allowed(scene: Document) -> AllowedPairs:
    """Read the allowed-collision matrix."""
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
        entries |= {frozenset((one, two)): v for two, v in zip(names, values, strict=True)}
    known = scene.names(matrix.get("default_entry_names"), f"{where}.default_entry_names")
    values = scene.items(matrix.get("default_entry_values"), f"{where}.default_entry_values")
    if len(known) != len(values) or not all(isinstance(value, bool) for value in values):
        must = f"a truth value per name of {where}.default_entry_names"
        raise SettingError(scene.field, must, len(values))
    return AllowedPairs(entries, dict(zip(known, values, strict=True)))


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(value) + 0.0 for value in values)
    return x, y, z
