"""The recording of one motion, from which pages, playable logs and trajectories are written.

Bodies are drawn with the sizes of the coal shapes that the certifier judges.
"""

from itertools import product
from typing import Any, Literal, NamedTuple

import coal
import numpy as np
import pinocchio as pin

from evoexp.collision.body_table import UnsupportedShape
from evoexp.collision.certifier.certificate import Certificate, certificate
from evoexp.collision.scene import Part, Scene
from evoexp.condition import Condition
from evoexp.errors import EvoexpError
from evoexp.paths.motion import Motion
from evoexp.playback.contacts import Clearance, clearance, part_at
from evoexp.playback.trajectory import SpeedLimits, seconds_per_instant, velocities
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly, Robot

Kind = Literal["box", "sphere", "ellipsoid", "capsule", "cylinder", "cone", "half_space", "mesh"]
Role = Literal["arm", "obstacle", "object"]
MIN_TICKS, MAX_TICKS = 240, 600  # of a whole motion
TURN = np.radians(2.0)  # [rad] of a joint between two ticks, where there may be so many
SLIDE = 0.01  # [-] of the scene's size, of a sliding joint
FAR = 3.0  # [-] obstacles larger than so many times the robot's room do not make the picture larger


class NoMotion(EvoexpError):
    """A solution without a motion: there is nothing to watch."""


class Heading(NamedTuple):
    """The title of a recording, and the search that found the motion."""

    title: str  # one line of text
    replicate: int = -1  # index of the replicate; −1: a motion of the user's own
    # (generation, best cost) of every better solution
    improvements: tuple[tuple[int, float], ...] = ()


class Outline(NamedTuple):
    """A shape in its own frame; capsules, cylinders and cones lie along z and are centred."""

    kind: Kind  # kind of the shape
    # box: the edges | sphere: radius | ellipsoid: semi-axes | capsule, cylinder, cone: radius,
    # length (that of a capsule is its segment's) | half-space (all points with z ≤ 0) and mesh:
    # nothing
    size: tuple[float, ...]
    points: FloatArray | None = None  # (points, 3) corners of a mesh; None otherwise
    triangles: np.ndarray | None = None  # (triangles, 3) indices of corners

    @property
    def is_line(self) -> bool:
        """Return whether the shape has no thickness, so that the drawing chooses a thickness."""
        return self.kind == "capsule" and self.size[0] == 0.0

    @property
    def half(self) -> FloatArray:
        """Half the edges of a box around the shape and its frame, (3,); 0 for a half-space."""
        if self.points is not None:
            return np.full(3, np.sqrt((self.points**2).sum(axis=1).max()))
        if self.kind in ("box", "ellipsoid"):
            return np.array(self.size) * (0.5 if self.kind == "box" else 1.0)
        radius, length = (*self.size, 0.0, 0.0)[:2]
        round_end = radius if self.kind in ("sphere", "capsule") else 0.0
        return np.array([radius, radius, 0.5 * length + round_end])


class Shape(NamedTuple):
    """One body."""

    name: str  # name of the body in verdicts
    frame: int  # index in `Recording.frames` of the frame that moves it; −1: the world
    pose: FloatArray  # (7,) of the outline in that frame: position, quaternion x, y, z, w
    outline: Outline  # kind and size
    # A part of an arm, an obstacle, or an object, which is an obstacle that is carried for a while
    role: Role
    arm: int  # index of its arm; −1: none


class Joint(NamedTuple):
    """One coordinate of q."""

    name: str  # name of the joint
    prismatic: bool  # whether the coordinate is a length, not an angle


class Frame(NamedTuple):
    """A frame that moves bodies: of a joint, or of an object that is carried."""

    name: str  # unique name
    parent: int  # index of the frame that carries it; −1: the world


class Poses(NamedTuple):
    """Poses of all frames over time."""

    world: FloatArray  # (ticks, frames, 7) position, quaternion x, y, z, w in the world
    local: FloatArray  # the same in the parent's frame


class Target(NamedTuple):
    """A place that a tool or a robot is to reach."""

    name: str  # name beside the mark
    point: FloatArray  # (3,) in the world [length unit]


class View(NamedTuple):
    """The room that a picture has to show."""

    center: FloatArray  # (3,) centre of the room that robot and obstacles take [length unit]
    extent: FloatArray  # (3,) half the edges of that room [length unit]
    planar: bool  # whether all bodies stay in the plane z = 0

    @property
    def radius(self) -> float:
        """Radius of a ball around the room [length unit]."""
        return float(np.sqrt((self.extent**2).sum()))


class Recording(NamedTuple):
    """A motion with its bodies, distances, contacts and verdict."""

    heading: Heading  # title and origin
    condition_id: str  # hash of the condition, 64 hex digits
    config_json: bytes  # canonical form of the condition
    length_unit: str  # unit of every length
    joints: tuple[Joint, ...]  # (nq) joints of the coordinates
    motion: Motion  # the motion itself
    times: FloatArray  # (ticks,) instants that are shown
    q: FloatArray  # (ticks, nq) [rad, length unit]
    dq: FloatArray  # (ticks, nq) [rad/s, length unit/s]
    seconds: float  # time from instant to instant [s]
    size: float  # size of the scene, by which lengths are judged [length unit]
    frames: tuple[Frame, ...]  # frames that move bodies
    poses: Poses  # poses of the frames at the ticks
    shapes: tuple[Shape, ...]  # the bodies: every coal shape once
    traces: FloatArray  # (arms, ticks, 3) paths of the tools [length unit]
    targets: tuple[Target, ...]  # places that the task names
    clearance: Clearance  # exact distances and contacts
    margin: float  # clearance that the task requires [length unit]
    verdict: Certificate  # verdict of the certifier
    view: View  # room that a picture has to show
    parts: tuple[Part, ...]  # pieces of the motion that have bodies of their own
    # (nq,) those of the robot itself [rad/s, length unit/s]; inf: it has none
    velocity_limits: FloatArray

    def world_pose(self, shape: Shape, tick: int) -> FloatArray:
        """Return the pose of a body in the world at a tick, (7,)."""
        if shape.frame < 0:
            return shape.pose
        frame = pin.XYZQUATToSE3(self.poses.world[tick, shape.frame])
        return pose(frame * pin.XYZQUATToSE3(shape.pose))


def record(
    condition: Condition, solution: FloatArray, heading: Heading, limits: SpeedLimits | None = None
) -> Recording:
    """Return the recording of a solution's motion, see `record_motion`."""
    planner, problem = condition.prepare()
    return record_motion(condition, planner.motion(problem, solution), heading, limits)


def record_motion(
    condition: Condition, motion: Motion | None, heading: Heading, limits: SpeedLimits | None = None
) -> Recording:
    """Return the recording of a motion among the bodies of a condition, timed by speed limits.

    NoMotion is raised where there is no motion, or there are no bodies.
    """
    planner, problem = condition.prepare()
    parts = [] if motion is None else list(planner.parts(problem, motion))
    if motion is None or not parts:
        raise NoMotion(
            f"{heading.title}: the answer of '{type(planner).component}' is no motion here: "
            "nothing to watch"
        )
    assert isinstance(condition.robot, Robot)
    assembly = condition.robot.build()
    margin = planner.security_margin(problem)
    model, size = parts[0].scene.model, parts[0].scene.size
    joints = joints_of(assembly)
    prismatic = np.array([joint.prismatic for joint in joints])
    frames = [Frame(model.names[k], int(model.parents[k]) - 1) for k in range(1, model.njoints)]
    carried = _carried(parts)  # their frames hang on the world
    times = ticks(motion, prismatic, size)
    where = poses(model, motion, times, parts, carried)
    seconds = seconds_per_instant(motion, (limits or SpeedLimits()).of(prismatic, size))
    shapes = _shapes(parts[0].scene, assembly, carried)
    # the places that a scenario names, by points in the plane or in space
    scenario = condition.scenario
    named = scenario.named_places(condition.robot) if hasattr(scenario, "named_places") else ()
    places = tuple(
        Target(name.replace("_", " "), np.array([*point, 0.0][:3])) for name, point in named
    )
    velocity_limits = np.array(assembly.model.velocityLimit, dtype=np.float64)
    is_limited = (velocity_limits > 0.0) & (velocity_limits < 1e6)  # Pinocchio's default is none
    return Recording(
        heading=heading,
        condition_id=condition.id,
        config_json=condition.to_json(),
        length_unit=condition.length_unit,
        joints=joints,
        motion=motion,
        times=times,
        q=np.array([motion.at(float(t)) for t in times]),
        dq=velocities(motion, times, seconds),
        seconds=seconds,
        size=size,
        frames=(*frames, *(Frame(f"object {name}", -1) for name in carried)),
        poses=where,
        shapes=shapes,
        traces=np.array(
            [points(where.world, tool.joint - 1, tool.position) for tool in assembly.tools]
        ),
        targets=places,
        clearance=clearance(parts, motion, times),
        margin=margin,
        verdict=certificate(parts, motion, margin),
        view=_view(shapes, where.world, places),
        parts=tuple(parts),
        velocity_limits=np.where(is_limited, velocity_limits, np.inf),
    )


def joints_of(assembly: Assembly) -> tuple[Joint, ...]:
    """Return the joints in the order of their coordinates."""
    return tuple(map(Joint, assembly.joint_names, assembly.table.slides.tolist()))


def _carried(parts: list[Part]) -> list[str]:
    """Return the names of bodies that change their joint, or their place on it, on the way."""
    first, carried = parts[0].scene, []
    for name, (_, joint, placement) in zip(first.names, first.shapes, strict=True):
        later = [part.scene.shapes[part.scene.names.index(name)] for part in parts[1:]]
        if any(j != joint or not place.isApprox(placement, 1e-12) for _, j, place in later):
            carried.append(name)
    return carried


def _shapes(scene: Scene, assembly: Assembly, carried: list[str]) -> tuple[Shape, ...]:
    arms, joints, shapes = assembly.body_arms, assembly.model.njoints - 1, []
    bodies = zip(scene.names, scene.shapes, strict=True)
    for k, (name, (shape, joint, placement)) in enumerate(bodies):
        drawn, shift = outline(shape)
        frame, where = int(joint) - 1, placement * shift
        if name in carried:
            frame, where = joints + carried.index(name), shift
        of_robot = k < len(arms)
        role: Role = "arm" if of_robot else "object" if name in carried else "obstacle"
        shapes.append(Shape(name, frame, pose(where), drawn, role, arms[k] if of_robot else -1))
    return tuple(shapes)


def _view(shapes: tuple[Shape, ...], world: FloatArray, places: tuple[Target, ...]) -> View:
    """Return the room of moving bodies over time, of targets, and of all but huge obstacles."""
    moving = [shape for shape in shapes if shape.role == "arm"]
    ways = [_corners(shape, world) for shape in moving]
    room = float(np.ptp(np.concatenate(ways), axis=0).max())
    flat = True
    for shape in moving:
        heights = points(world, shape.frame, shape.pose[:3])[:, 2]
        turned = world[:, shape.frame, 3:5] if shape.frame >= 0 else np.zeros(1)
        flat &= bool(np.ptp(heights) == 0.0 and np.abs(turned).max() == 0.0)
    for shape in shapes:
        if shape.role != "arm" and 0.0 < shape.outline.half.max() < FAR * room:
            ways.append(_corners(shape, world))
    ways += [place.point[None] for place in places]
    low, high = (bound(np.concatenate(ways), axis=0) for bound in (np.min, np.max))
    return View(0.5 * (low + high), 0.5 * (high - low), flat)


def _corners(shape: Shape, world: FloatArray) -> FloatArray:
    """Return points of a body at all ticks, (points, 3): its ends, its edges, its semi-axes."""
    turn, half = pin.XYZQUATToSE3(shape.pose), shape.outline.half
    corners = np.array([turn * (np.array(sign) * half) for sign in product((-1.0, 1.0), repeat=3)])
    return points(world, shape.frame, corners).reshape(-1, 3)


def ticks(motion: Motion, prismatic: np.ndarray, size: float) -> FloatArray:
    """Return the instants at which a motion is shown, (ticks,), its first and last among them.

    Every instant is shown, unless there are more than `MAX_TICKS`. `prismatic` (nq,) is true for
    coordinates that are lengths; `size` is the scene's [length unit].
    """
    segments = motion.num_segments
    if segments == 0:
        return np.zeros(1)
    if segments >= MAX_TICKS:
        return np.unique(np.round(np.linspace(0.0, segments, MAX_TICKS)))
    steps = np.where(prismatic, SLIDE * size, TURN)
    wanted = np.array([np.ceil((motion.speed_bound(k) / steps).max()) for k in range(segments)])
    wanted = np.maximum(wanted, np.ceil(MIN_TICKS / segments))
    if wanted.sum() > MAX_TICKS:
        wanted = np.maximum(np.floor(wanted * (MAX_TICKS / wanted.sum())), 1.0)
    pieces = [k + np.arange(count) / count for k, count in enumerate(wanted.astype(int))]
    return np.concatenate([*pieces, [float(segments)]])


def poses(
    model: Any, motion: Motion, times: FloatArray, parts: list[Part], carried: list[str]
) -> Poses:
    """Return the poses of all frames at times (ticks,) [instants].

    Each part of the motion places the carried objects, which have frames of their own.
    """
    data, count = model.createData(), model.njoints - 1 + len(carried)
    world, local = np.empty((2, len(times), count, 7))
    places = {  # of each carried object: its joint, and its placement in the joint's frame
        id(part): [part.scene.shapes[part.scene.names.index(name)][1:] for name in carried]
        for part in parts
    }
    for k, t in enumerate(times):
        pin.forwardKinematics(model, data, motion.at(float(t)))
        for joint in range(1, model.njoints):
            world[k, joint - 1], local[k, joint - 1] = pose(data.oMi[joint]), pose(data.liMi[joint])
        for c, (joint, placement) in enumerate(places[id(part_at(parts, t))]):
            world[k, model.njoints - 1 + c] = local[k, model.njoints - 1 + c] = pose(
                data.oMi[joint] * placement
            )
    return Poses(_continuous(world), _continuous(local))


def points(world: FloatArray, frame: int, point: FloatArray) -> FloatArray:
    """Return the positions of a point (3,) of a frame (−1: the world) over time, (ticks, 3).

    Of points (points, 3), the positions are (points, ticks, 3). `world` is (ticks, frames, 7).
    """
    ticks = len(world)
    rows = np.broadcast_to(point[..., None, :], (*point.shape[:-1], ticks, 3))
    if frame < 0:
        return rows.copy()
    x, y, z, w = world[:, frame, 3:].T
    vector = np.stack([x, y, z], axis=1)
    twice = 2.0 * np.cross(vector, rows)
    return np.asarray(world[:, frame, :3] + rows + w[:, None] * twice + np.cross(vector, twice))


def _continuous(rows: FloatArray) -> FloatArray:
    """Choose between q and −q, which are one rotation: the sign nearer to the tick before."""
    signs = np.sign((rows[1:, :, 3:] * rows[:-1, :, 3:]).sum(axis=-1))
    flips = np.cumprod(np.where(signs < 0.0, -1.0, 1.0), axis=0)
    rows[1:, :, 3:] *= flips[:, :, None]
    return rows


def outline(shape: Any) -> tuple[Outline, Any]:
    """Return the outline of a coal shape, and the `pin.SE3` of its frame in that of the shape."""
    here = pin.SE3.Identity()
    if isinstance(shape, coal.Box):
        return Outline("box", tuple(2.0 * float(half) for half in shape.halfSide)), here
    if isinstance(shape, coal.Sphere):
        return Outline("sphere", (float(shape.radius),)), here
    if isinstance(shape, coal.Ellipsoid):
        return Outline("ellipsoid", tuple(float(axis) for axis in shape.radii)), here
    names: dict[Any, Kind] = {coal.Capsule: "capsule", coal.Cylinder: "cylinder", coal.Cone: "cone"}
    if type(shape) in names:
        sizes = float(shape.radius), 2.0 * float(shape.halfLength)
        return Outline(names[type(shape)], sizes), here
    if isinstance(shape, coal.Halfspace):
        normal = np.array(shape.n)
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), normal).toRotationMatrix()
        return Outline("half_space", ()), pin.SE3(turn, float(shape.d) * normal)
    points, triangles = _mesh(shape)
    return Outline("mesh", (), points, triangles), here


def _mesh(shape: Any) -> tuple[FloatArray, np.ndarray]:
    """Return corners and triangles of a mesh, each triangle counter-clockwise seen from outside."""
    convex = hasattr(shape, "polygons")
    if convex:
        points = np.array([shape.point(k) for k in range(shape.num_points)])
        faces = [shape.polygons(k) for k in range(shape.num_polygons)]
    elif hasattr(shape, "tri_indices"):
        points = np.array([shape.vertex(k) for k in range(shape.num_vertices)])
        faces = [shape.tri_indices(k) for k in range(shape.num_tris)]
    else:
        raise UnsupportedShape(f"body: a {type(shape).__name__} cannot be drawn")
    triangles = np.array([[int(face[k]) for k in range(3)] for face in faces], dtype=np.int64)
    a, b, c = points[triangles].transpose(1, 0, 2)
    volumes = (np.cross(b - a, c - a) * (a - points.mean(axis=0))).sum(axis=1)
    inward = volumes < 0.0 if convex else np.full(len(volumes), volumes.sum() < 0.0)
    triangles[inward] = triangles[inward, ::-1]
    return points, triangles


def pose(placement: Any) -> FloatArray:
    """Return a `pin.SE3` as position and quaternion x, y, z, w, (7,)."""
    return np.asarray(pin.SE3ToXYZQUAT(placement))
