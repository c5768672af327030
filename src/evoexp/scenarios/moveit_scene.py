"""The world of a MoveIt planning scene: frames, objects, and which pairs may touch.

Meshes and cones become convex hulls that contain them. MoveIt names a frame of its own in
`header.frame_id` of a fixed transform and the planning frame in `child_frame_id`; the transform
takes coordinates in the named frame to the planning frame (`Transforms::setTransform` and
`copyTransforms` in moveit_core's `transforms.cpp`). A frame that is a link comes before a transform
(`PlanningScene::getFrameTransform`).
"""

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from evoexp.attachments import File
from evoexp.errors import nearest
from evoexp.numeric.convex_hull import hull_of
from evoexp.numeric.elementary import sincos
from evoexp.records import FloatArray, IntArray
from evoexp.scenarios import obstacles as solids
from evoexp.scenarios.moveit_files import IDENTITY, MessagePart, Pose, primitive_kind
from evoexp.scenarios.obstacles import HullObstacle, Obstacle, RodObstacle, SphereObstacle
from evoexp.validation import Settings

if TYPE_CHECKING:
    from evoexp.robots.assembly import LinkFrames

MOST_OBJECTS = 2000  # bodies: every one is tested against every body of the robot
WORLD = "world"  # the planning frame where nothing else names it
SAME = 1e-6  # [m, -] by which two descriptions of one frame may differ: they are rounded
SINGULAR = {"primitives": "primitive", "planes": "plane", "meshes": "mesh"}
SIZES = {"box": 3, "sphere": 1, "cylinder": 2, "cone": 2}  # numbers of a primitive
# CollisionObject.operation, a byte: as ROS 1 writes it, ROS 2, and robowflex
OPERATIONS = {
    form: name
    for k, name in enumerate(("ADD", "REMOVE", "APPEND", "MOVE"))
    for form in (str(k), chr(k), str(bytes([k])), name.lower())
}


Mesh = tuple[FloatArray, IntArray]
"""Corners (corners, 3) [m] and triangles (triangles, 3) of corners' numbers."""

AROUND = 32  # corners of a cone's base; they stand out of it by half a hundredth of its radius


class SceneMesh(Settings):
    """A mesh that a scene names by its file."""

    name: str  # as the scene names it
    file: File  # its content


LoadMesh = Callable[[bytes, str, str], Mesh]
"""Reads a mesh out of a file's content, the ending of its name, and a field for errors."""


class AllowedPairs(NamedTuple):
    """The allowed-collision matrix."""

    entries: dict[frozenset[str], bool]  # pairs of names → whether they may touch
    defaults: dict[str, bool]  # names → whether they may touch whatever no entry names

    def may_touch(self, one: str, two: str) -> bool | None:
        """Return whether two things may touch; None: the matrix does not say."""
        known = self.entries.get(frozenset((one, two)))
        if known is not None:
            return known
        found = [self.defaults[name] for name in (one, two) if name in self.defaults]
        return all(found) if found else None


class Frames(NamedTuple):
    """Frames by their names, without a slash before them."""

    planning: str  # the planning frame
    poses: dict[str, Pose]  # frames that stand still → their poses in the world
    moving: frozenset[str]  # links that move

    def of_header(self, part: MessagePart) -> Pose:
        """Return the pose of the frame that the header of a part names, or the planning frame's."""
        name = frame_name(part["header"]["frame_id"])
        must = f"given in a frame that stands still ({', '.join(self.poses)}) at {part.where}"
        if name in self.moving:
            raise part.refusal(must, f"'{name}', a link that moves")
        if (name := name or self.planning) not in self.poses:
            raise part.refusal(must, name, nearest(name, self.poses))
        return self.poses[name]


def frame_name(part: MessagePart) -> str:
    """Return the name of a frame; `/base` and `base` are one."""
    return part.text.strip().lstrip("/")


def read_frames(scene: MessagePart, links: "LinkFrames | None") -> Frames:
    """Read the fixed transforms of a scene beside the links of a robot, if these have names."""
    root, standing, moving, ground = links or ("", (), frozenset[str](), "")
    named, planning, is_certain = _fixed_transforms(scene)
    known = dict.fromkeys(filter(None, (ground, root, WORLD)))
    if planning in moving or (planning and not is_certain and planning not in known):
        must = f"of transforms whose child_frame_id is the planning frame ({', '.join(known)})"
        hint = "; header.frame_id names the frame that a transform places"
        raise scene.refusal(must, planning, hint)
    planning = planning or ground or WORLD
    poses = {}
    for name, numbers in standing:  # the rotation row by row, then the position
        poses[name] = Pose(np.array(numbers[:9]).reshape(3, 3), np.array(numbers[9:]))
    origin = poses.setdefault(planning, IDENTITY)
    if ground:
        poses.setdefault(ground, IDENTITY)
    for name in (name for name in named if name not in moving):
        pose = origin.times(named[name])
        if not pose.is_near(poses.setdefault(name, pose), SAME):
            must = f"a scene whose transform of '{name}' is that of the robot's link"
            raise scene.refusal(must, pose.text, f"; the link stands {poses[name].text}")
    return Frames(planning, poses, moving)


def has_other_frames(scene: MessagePart) -> bool:
    """Whether a scene has fixed transforms of frames other than the planning frame."""
    poses = _fixed_transforms(scene)[0].values()
    return not all(pose.is_near(IDENTITY, SAME) for pose in poses)


def _fixed_transforms(scene: MessagePart) -> tuple[dict[str, Pose], str, bool]:
    """Return the transforms, in the planning frame; its name, if given; whether it is sure."""
    # it is sure where MoveIt wrote it: with a transform into itself
    named: dict[str, Pose] = {}
    planning, is_certain = "", False
    transforms = scene["fixed_frame_transforms"]
    for transform in transforms:
        name = frame_name(transform["header"]["frame_id"])
        target, pose = frame_name(transform["child_frame_id"]), transform["transform"].pose
        is_identity = pose.is_near(IDENTITY, SAME)
        where = f"{transform.where}.header.frame_id"
        must = f"a frame other than '{target}' at {where}, or no transform"
        scene.require(is_identity or name not in ("", target), must, name)
        must = f"the planning frame at {transform.where}.child_frame_id"
        scene.require(target or not name, must, "")
        must = f"one planning frame for all of {transforms.where}, the child_frame_id '{planning}'"
        is_same = not planning or target in ("", planning)
        scene.require(is_same, must, f"'{name}' in '{target}'")
        planning = target or planning
        is_certain |= bool(target) and name in ("", target)
        if name and not pose.is_near(named.setdefault(name, pose), SAME):
            must = f"one transform of '{name}' in {transforms.where}"
            raise scene.refusal(must, f"{named[name].text} and {pose.text}")
    return named, planning, is_certain


class World(NamedTuple):
    """The objects that stand around the robot."""

    obstacles: tuple[Obstacle, ...]  # its bodies, in the world [m]
    objects: tuple[str, ...]  # (obstacles) the object that each belongs to
    frames: Frames  # in which places are given


@functools.lru_cache(maxsize=64)
def read_world(
    scene: MessagePart, links: "LinkFrames | None", meshes: tuple[SceneMesh, ...], load: LoadMesh
) -> World:
    """Read the objects of a planning scene, among a robot's links if these have names."""
    loaded = {}
    for mesh in meshes:
        field = f"{scene.field}: the mesh '{mesh.name}'"
        loaded[mesh.name] = load(mesh.file.content, Path(mesh.name).suffix, field)
    for name, size, neutral in (("link_padding", "padding", 0.0), ("link_scale", "scale", 1.0)):
        for link in scene[name]:
            is_neutral = link[size].number(neutral) == neutral
            must = f"free of {name}, which evoexp does not know"
            link.require(is_neutral, must, link["link_name"].text)
    frames = read_frames(scene, links)
    check_robot_place(scene["robot_state"], frames)
    obstacles: list[Obstacle] = []
    owners: list[str] = []
    for thing in scene["world"]["collision_objects"]:
        name = thing["id"].text or f"object_{len(set(owners)) + 1}"
        thing.require(name not in owners, "objects whose ids differ", name)
        bodies = _bodies(thing.called(f"'{name}'"), name, frames, loaded)
        obstacles += bodies
        owners += [name] * len(bodies)
    must = f"a scene of at most {MOST_OBJECTS} bodies"
    scene.require(len(obstacles) <= MOST_OBJECTS, must, len(obstacles))
    return World(tuple(obstacles), tuple(owners), frames)


def read_state(state: MessagePart) -> dict[str, float]:
    """Read a robot state: joint names → positions."""
    joints = state["joint_state"]
    names = joints["name"].names
    positions: dict[str, float] = {}
    for name, value in zip(names, joints["position"].numbers(len(names)), strict=True):
        both = [positions.setdefault(name, float(value)), float(value)]
        joints.require(both[0] == both[1], f"one position of '{name}' at {joints.where}", both)
    return positions


def check_robot_place(state: MessagePart, frames: Frames) -> None:
    """Refuse a state in which joints of several coordinates move the robot off its root."""
    joints = state["multi_dof_joint_state"]
    names, transforms = joints["joint_names"].names, list(joints["transforms"])
    is_complete = not names or len(transforms) == len(names)
    joints.require(is_complete, f"a transform per joint of {joints.where}", len(transforms))
    planning = frames.poses[frames.planning]
    for transform in transforms:
        # MoveIt takes the transform to lead from the frame of the header
        frame = planning.inverse.times(frames.of_header(joints))
        pose = transform.pose.times(frame.inverse)
        must = "a robot at the origin (robot.base_position moves it elsewhere)"
        joints.require(pose.is_near(IDENTITY, 1e-9), must, f"one {pose.text} by {joints.where}")


def _bodies(
    thing: MessagePart, name: str, frames: Frames, meshes: Mapping[str, Mesh]
) -> list[Obstacle]:
    number = thing["operation"].value
    operation = OPERATIONS.get(str(number).lower(), number)
    must = f"a scene whose objects are there, '{name}'.operation ADD (0)"
    thing.require(operation in (None, "ADD"), must, operation)
    own = frames.of_header(thing).times(thing["pose"].pose)
    obstacles: list[Obstacle] = []
    for kind, singular in SINGULAR.items():
        bodies, poses = list(thing[kind]), list(thing[f"{singular}_poses"])
        must = f"a pose per {singular} of '{name}' ({len(bodies)})"
        thing.require(len(poses) == len(bodies), must, len(poses))
        for body, pose in zip(bodies, poses, strict=True):
            label = f"{name}_{len(obstacles) + 1}" if len(bodies) > 1 else name
            placed = own.times(pose.pose)
            if kind == "meshes":
                obstacles += _mesh_hulls(body, meshes, placed, label)
            else:
                make = _primitive if kind == "primitives" else _plane
                obstacles.append(make(body, placed, label))
    thing.require(obstacles, "objects with a body each", f"'{name}' without one")
    return obstacles


def _primitive(primitive: MessagePart, pose: Pose, name: str) -> Obstacle:
    """Return a box [x, y, z], a sphere [radius], a cylinder or cone [height, radius]."""
    kind = primitive_kind(primitive["type"].value)
    if kind not in SIZES:
        must = f"primitives that are {', '.join(SIZES)}"
        raise primitive.refusal(must, f"'{name}', a {kind}", nearest(kind, SIZES))
    sizes = primitive["dimensions"].numbers(SIZES[kind])
    primitive.require(sizes.min() > 0.0, f"dimensions above 0 of '{name}'", sizes.tolist())
    center = _three(pose.position)
    if kind == "box":
        size, angles = _three(sizes), pose.angles
        return solids.BoxObstacle(shape="box", name=name, center=center, size=size, rotation=angles)
    if kind == "sphere":
        return SphereObstacle(shape="sphere", name=name, center=center, radius=float(sizes[0]))
    if kind == "cone":  # a pyramid around it, its axis z, its middle half way up
        turns = [sincos(2.0 * np.pi * k / AROUND) for k in range(AROUND)]
        height, wide = float(sizes[0]), float(sizes[1]) / sincos(np.pi / AROUND)[1]
        base = [[wide * cos, wide * sin, -0.5 * height] for sin, cos in turns]
        return _hull(np.array([*base, [0.0, 0.0, 0.5 * height]]), pose, name)
    along = 0.5 * float(sizes[0]) * pose.rotation[:, 2]
    ends = _three(pose.position - along), _three(pose.position + along)
    radius = float(sizes[1])
    return RodObstacle(shape="cylinder", name=name, start=ends[0], end=ends[1], radius=radius)


def _plane(plane: MessagePart, pose: Pose, name: str) -> Obstacle:
    """Return the half-space behind a plane ax + by + cz + d = 0, against its normal (a, b, c)."""
    a, b, c, d = plane["coef"].numbers(4)
    normal = np.array([a, b, c])
    size = float(a * a + b * b + c * c)
    plane.require(size, f"a normal other than 0 of '{name}'", normal.tolist())
    point = pose.of_point(-d / size * normal)
    direction = Pose(pose.rotation, np.zeros(3)).of_point(normal)
    return solids.HalfSpaceObstacle(
        shape="half_space", name=name, point=_three(point), normal=_three(direction)
    )


@functools.lru_cache(maxsize=64)
def read_allowed(scene: MessagePart) -> AllowedPairs:
    """Read the allowed-collision matrix."""
    matrix = scene["allowed_collision_matrix"]
    names, rows = matrix["entry_names"].names, list(matrix["entry_values"])
    must = f"a row per name of {matrix.where} ({len(names)})"
    matrix.require(len(rows) == len(names), must, len(rows))
    entries: dict[frozenset[str], bool] = {}
    for one, row in zip(names, rows, strict=True):
        values = [item.value for item in (row["enabled"] if isinstance(row.value, dict) else row)]
        must = f"{len(names)} truth values in every row of {matrix.where}"
        matrix.require(_are_truths(values, len(names)), must, f"the row of '{one}'")
        for two, value in zip(names, values, strict=True):
            if one != two and entries.setdefault(frozenset((one, two)), value) != value:
                must = f"a symmetric {matrix.where}"
                raise matrix.refusal(must, f"two values of '{one}' and '{two}'")
    known = matrix["default_entry_names"].names
    values = [item.value for item in matrix["default_entry_values"]]
    must = f"a truth value per name of {matrix.where}.default_entry_names"
    matrix.require(_are_truths(values, len(known)), must, len(values))
    return AllowedPairs(entries, dict(zip(known, values, strict=True)))


def _are_truths(values: list[Any], count: int) -> bool:
    return len(values) == count and all(isinstance(value, bool) for value in values)


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(value) + 0.0 for value in values)
    return x, y, z


def _mesh_hulls(
    mesh: MessagePart, loaded: Mapping[str, Mesh], pose: Pose, name: str
) -> list[HullObstacle]:
    """Return the convex hulls of the parts of a mesh that hang together, numbered if several."""
    if resource := mesh["resource"].text:
        has_own = mesh["vertices"].value or mesh["triangles"].value
        mesh.require(not has_own, f"a resource or triangles at {mesh.where}, not both", name)
        corners, triangles = loaded[resource]
        if mesh["dimensions"]:
            corners = corners * mesh["dimensions"].numbers(3)
    else:
        corners, triangles = _own_triangles(mesh, name)
    hulls, parts = [], _parts(corners, triangles)
    for k, part in enumerate(parts):
        hull = hull_of(part)
        if hull is None:
            must = f"meshes with an inside ('{name}')"
            raise mesh.refusal(must, f"a part of {len(part)} vertices in one plane")
        hulls.append(_hull(hull[0], pose, f"{name}_{k + 1}" if len(parts) > 1 else name))
    return hulls


def _own_triangles(mesh: MessagePart, name: str) -> Mesh:
    must = f"a mesh whose dimensions scale a resource at {mesh.where}"
    mesh.require(not mesh["dimensions"].value, must, name)
    corners = np.array([vertex.point for vertex in mesh["vertices"]])
    faces = [
        # robowflex writes the list alone
        (face if isinstance(face.value, list) else face["vertex_indices"]).numbers(3)
        for face in mesh["triangles"]
    ]
    triangles, count = np.array(faces).reshape(-1, 3), len(corners)
    is_corner = (triangles == np.floor(triangles)) & (triangles >= 0.0) & (triangles < count)
    wrong = triangles[~is_corner.all(axis=1)]
    must = f"triangles of three of the {count} vertices of '{name}', counted from 0"
    was = ", ".join(f"{k:g}" for k in wrong[0]) if len(wrong) else "none"
    mesh.require(len(triangles) and not len(wrong), must, was)
    return corners, triangles.astype(np.int64)


def _hull(points: FloatArray, pose: Pose, name: str) -> HullObstacle:
    corners, center = tuple(map(_three, points)), _three(pose.position)
    return HullObstacle(
        shape="hull", name=name, points=corners, center=center, rotation=pose.angles
    )


def _parts(corners: FloatArray, triangles: IntArray) -> list[FloatArray]:
    """Return the corners of the parts of a mesh; corners at one place are one."""
    from scipy.sparse import coo_array, csgraph  # few scenes have meshes

    places, same = np.unique(corners, axis=0, return_inverse=True)
    linked = same.reshape(-1)[triangles]
    ends = np.repeat(linked[:, 0], 2), linked[:, 1:].ravel()
    graph = coo_array((np.ones(len(ends[0])), ends), shape=(len(places),) * 2)
    _, part = csgraph.connected_components(graph, directed=False)
    used = np.unique(linked)  # parts are numbered by their first corners
    return [places[used[part[used] == own]] for own in np.unique(part[used])]
