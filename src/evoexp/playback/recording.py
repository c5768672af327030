"""One motion, ready to be watched.

The neutral record that pages, playable logs and trajectories are written from.
"""

from itertools import product
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.collision.certifier.certificate import Certificate, certificate
from evoexp.collision.scene import Part, Scene
from evoexp.condition import Condition
from evoexp.errors import EvoexpError
from evoexp.paths.motion import Motion
from evoexp.playback.body_poses import Frame, Poses, frames_of, points, poses, ticks
from evoexp.playback.contacts import Clearance, clearance
from evoexp.playback.shapes import Role, Shape, outline, pose
from evoexp.playback.targets import Target, targets
from evoexp.playback.timing import SpeedLimits, seconds_per_instant, velocities
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly, Robot

FAR = 3.0  # [-] obstacles larger than so many times the robot's room do not make the picture larger


class NoMotion(EvoexpError):
    """A solution that is no motion, so that there is nothing to watch."""


class Heading(NamedTuple):
    """What a recording is of.

    Attributes:
        title: One line.
        replicate: Its index; −1: a motion of the user's own.
        improvements: (generation, best cost) whenever a better solution was found.
    """

    title: str
    replicate: int = -1
    improvements: tuple[tuple[int, float], ...] = ()


class Joint(NamedTuple):
    """One coordinate of q.

    Attributes:
        name: The joint's.
        prismatic: Whether it is a length, not an angle.
    """

    name: str
    prismatic: bool


class View(NamedTuple):
    """What a picture has to show.

    Attributes:
        center: (3,) of the room that robot and obstacles take.
        extent: (3,) half the edges of that room [length unit].
        planar: Whether nothing ever leaves the plane z = 0, or turns out of it.
    """

    center: FloatArray
    extent: FloatArray
    planar: bool

    @property
    def radius(self) -> float:
        """Of a ball around the room [length unit]."""
        return float(np.sqrt((self.extent**2).sum()))


class Recording(NamedTuple):
    """A motion with everything that is to be seen of it.

    Attributes:
        heading: What it is of.
        condition_id: 64 hex digits.
        config_json: The condition's canonical form.
        length_unit: Of every length.
        joints: (nq).
        motion: The motion itself.
        times: (ticks,) at which it is shown [instants].
        q: (ticks, nq) [rad, length unit].
        dq: (ticks, nq) [rad/s, length unit/s].
        seconds: From instant to instant.
        size: Of the scene, by which lengths are judged [length unit].
        frames: What moves bodies.
        poses: Of the frames, at the ticks.
        shapes: The bodies: every coal shape once.
        traces: (arms, ticks, 3) ways of the tools.
        targets: Places that the task names.
        clearance: Exact distances and contacts.
        margin: Clearance that the task requires.
        verdict: The certifier's.
        view: What a picture has to show.
    """

    heading: Heading
    condition_id: str
    config_json: bytes
    length_unit: str
    joints: tuple[Joint, ...]
    motion: Motion
    times: FloatArray
    q: FloatArray
    dq: FloatArray
    seconds: float
    size: float
    frames: tuple[Frame, ...]
    poses: Poses
    shapes: tuple[Shape, ...]
    traces: FloatArray
    targets: tuple[Target, ...]
    clearance: Clearance
    margin: float
    verdict: Certificate
    view: View


def record(
    condition: Condition, solution: FloatArray, heading: Heading, limits: SpeedLimits | None = None
) -> Recording:
    """Return a solution's motion, ready to be watched.

    Args:
        condition: Whose solution it is.
        solution: Flat, of the planner's documented shape.
        heading: What to call it.
        limits: Speeds of the joints, for the timing.

    Raises:
        NoMotion: If the planner's answer is no motion.
    """
    planner, problem = condition.prepare()
    motion = planner.motion(problem, solution)
    parts = [] if motion is None else list(planner.parts(problem, motion))
    if motion is None or not parts:
        raise NoMotion(
            f"{heading.title}: the answer of '{type(planner).component}' is no motion here: "
            "nothing to watch"
        )
    robot = condition.robot
    assert isinstance(robot, Robot)
    assembly = robot.build()
    margin = planner.security_margin(problem)
    model, size = parts[0].scene.model, parts[0].scene.size
    prismatic = np.zeros(model.nq, dtype=bool)
    prismatic[assembly.table.index_q[assembly.table.prismatic]] = True
    carried = _carried(parts)
    times = ticks(motion, prismatic, size)
    where = poses(model, motion, times, parts, carried)
    seconds = seconds_per_instant(motion, (limits or SpeedLimits()).of(prismatic, size))
    shapes = _shapes(parts[0].scene, assembly, carried)
    places = targets(condition.scenario, robot)
    names = [str(model.names[int(joint)]) for joint in np.argsort(assembly.table.index_q) + 1]
    return Recording(
        heading=heading,
        condition_id=condition.id,
        config_json=condition.to_json(),
        length_unit=condition.length_unit,
        joints=tuple(
            Joint(name, bool(slides)) for name, slides in zip(names, prismatic, strict=True)
        ),
        motion=motion,
        times=times,
        q=np.array([motion.at(float(t)) for t in times]),
        dq=velocities(motion, times, seconds),
        seconds=seconds,
        size=size,
        frames=frames_of(model, carried),
        poses=where,
        shapes=shapes,
        traces=np.array([points(where.world, *tool) for tool in _tools(assembly)]),
        targets=places,
        clearance=clearance(parts, motion, times),
        margin=margin,
        verdict=certificate(parts, motion, margin),
        view=_view(shapes, where.world, places),
    )


def _carried(parts: list[Part]) -> list[str]:
    """Return the bodies that are not always in the same place of the same joint."""
    first, found = parts[0].scene, []
    for name, (_, joint, placement) in zip(first.names, first.shapes, strict=True):
        for part in parts[1:]:
            _, other, there = part.scene.shapes[part.scene.names.index(name)]
            if other != joint or not there.isApprox(placement, 1e-12):
                found.append(name)
                break
    return found


def _shapes(scene: Scene, assembly: Assembly, carried: list[str]) -> tuple[Shape, ...]:
    arms = assembly.body_arms or (0,) * assembly.geometry.ngeoms
    joints = assembly.model.njoints - 1
    found = []
    for k, (name, (shape, joint, placement)) in enumerate(
        zip(scene.names, scene.shapes, strict=True)
    ):
        drawn, shift = outline(shape)
        frame, where = int(joint) - 1, placement * shift
        if name in carried:
            frame, where = joints + carried.index(name), shift
        of_robot = k < len(arms)
        role: Role = "arm" if of_robot else "object" if name in carried else "obstacle"
        found.append(Shape(name, frame, pose(where), drawn, role, arms[k] if of_robot else -1))
    return tuple(found)


def _tools(assembly: Assembly) -> list[tuple[int, FloatArray]]:
    """Return the frame and the point in it of every arm's tool.

    Of a robot without tools its last link's end.
    """
    if assembly.tools:
        return [(tool.joint - 1, tool.position) for tool in assembly.tools]
    last = assembly.links[-1]
    return [(last.joint - 1, last.end)]


def _view(shapes: tuple[Shape, ...], world: FloatArray, places: tuple[Target, ...]) -> View:
    """Return what has to be seen.

    What moves, wherever it goes, obstacles that are not too large, targets.
    """
    moving = [shape for shape in shapes if shape.role == "arm"]
    ways = [_corners(shape, world) for shape in moving]
    room = float(np.ptp(np.concatenate(ways), axis=0).max())
    flat = True
    for shape in moving:
        heights = points(world, shape.frame, shape.pose[:3])[:, 2]
        turned = world[:, shape.frame, 3:5] if shape.frame >= 0 else np.zeros(1)
        flat &= bool(np.ptp(heights) == 0.0 and np.abs(turned).max() == 0.0)
    for shape in shapes:
        if shape.role != "arm" and 0.0 < shape.outline.reach < FAR * room:
            ways.append(_corners(shape, world))
    ways += [place.point[None] for place in places]
    low, high = (bound(np.concatenate(ways), axis=0) for bound in (np.min, np.max))
    return View(0.5 * (low + high), 0.5 * (high - low), flat)


def _corners(shape: Shape, world: FloatArray) -> FloatArray:
    """Return points of a body at all ticks, (points, 3): its ends, its edges, its semi-axes."""
    outline, turn = shape.outline, pin.XYZQUATToSE3(shape.pose)
    half = np.full(3, outline.size[0]) if outline.size else np.full(3, outline.reach)
    if outline.kind == "box":
        half = 0.5 * np.array(outline.size)
    elif outline.kind == "ellipsoid":
        half = np.array(outline.size)
    elif len(outline.size) == 2:
        half[2] = 0.5 * outline.size[1] + (outline.size[0] if outline.kind == "capsule" else 0.0)
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    return np.concatenate([points(world, shape.frame, turn * (sign * half)) for sign in signs])
