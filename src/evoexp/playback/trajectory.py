"""A motion as a joint trajectory, for a robot or MoveIt: names, times, positions, velocities.

A controller that interpolates the points moves as the motion that was judged: without velocities
straight from point to point, with velocities on the cubics that they determine. The motion that is
executed is certified again where it is another curve than the stored one.

Times are equal from instant to instant, or as short as a robot permits: the fastest timing is
toppra's (Pham & Pham 2018), within limits of speed and acceleration, from rest to rest; it stops
where the direction of the motion jumps, as where two straight lines meet.

Limits of joints come from MoveIt's `joint_limits.yaml`. What it does not name comes from the robot
(the `velocity` of a URDF's joints), else from the command line: no paper prints speeds. Jerk and
effort are left aside.
"""

import csv
import io
import json
import math
import warnings
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import yaml

from evoexp.collision.certifier.certificate import Certificate, certificate
from evoexp.errors import EvoexpError, nearest, printable
from evoexp.input_files import read_bounded
from evoexp.paths.motion import Motion, top_speeds
from evoexp.records import FloatArray

if TYPE_CHECKING:
    from evoexp.playback.recording import Recording

TICK = 0.01  # [s] between points of the fastest timing, at most
POINTS_PER_SECTION = 20  # points of the fastest timing between two stops, at least
GRID = 200  # points per segment at which toppra keeps to the limits
SMOOTH = 1e-9  # [-] of the greatest derivative, by which it may jump without a stop
LARGEST_FILE = 1_000_000  # [B]
KINDS = ("velocity", "acceleration")
Timing = Literal["optimal", "uniform"]
Interpolation = Literal["linear", "cubic"]


class LimitsFileError(EvoexpError):
    """A file of joint limits that cannot be used."""


class BadTiming(EvoexpError):
    """A timing that is not available."""


class SpeedLimits(NamedTuple):
    """Speed limits of joints, which no paper prints."""

    turn: float = np.pi / 4.0  # limit of revolute joints [rad/s]
    # limit of prismatic joints [length unit/s]; None: a quarter of the scene's size per second
    slide: float | None = None

    def of(self, prismatic: np.ndarray, size: float) -> FloatArray:
        """Return the limit of every coordinate (nq,), in a scene of a size [length unit]."""
        slide = 0.25 * size if self.slide is None else self.slide
        return np.where(prismatic, slide, self.turn)


class JointLimits(NamedTuple):
    """Greatest rates of every joint."""

    velocity: FloatArray  # (nq,) [rad/s or length unit/s]
    acceleration: FloatArray  # (nq,) [rad/s² or length unit/s²]


class TimedPoints(NamedTuple):
    """Points of a motion in time; a controller puts cubics between them."""

    times: FloatArray  # (points,) from the start [s]
    positions: FloatArray  # (points, nq) [rad or length unit]
    velocities: FloatArray  # (points, nq) per second


class Trajectory(NamedTuple):
    """The points of a motion in time."""

    joints: tuple[str, ...]  # (nq) names of the joints
    units: tuple[str, ...]  # (nq) units of the coordinates: rad, or the scene's unit of length
    times: FloatArray  # (points,) from the start [s]
    positions: FloatArray  # (points, nq) [rad or length unit]
    velocities: FloatArray | None  # (points, nq) per second; None: straight from point to point
    verdict: Certificate  # verdict of the certifier on the motion that is executed

    @property
    def interpolation(self) -> Interpolation:
        """Curves that a controller puts between the points."""
        return "linear" if self.velocities is None else "cubic"

    def rates(self) -> tuple[FloatArray, FloatArray]:
        """Return the greatest speed and acceleration of every joint, each (nq,).

        Where the speed of a motion jumps, accelerations are not counted.
        """
        executed = Motion(self.positions)
        if self.velocities is not None:
            executed = hermite_motion(self.times, self.positions, self.velocities)
        return greatest_rates(executed, np.diff(self.times))


def trajectory(recording: "Recording", timing: Timing, limits: JointLimits) -> Trajectory:
    """Return the points of a motion in time.

    Optimal timing rests at both ends and wherever two straight lines meet; uniform timing has equal
    times from instant to instant, as short as the limits of speed permit.
    """
    motion, verdict = recording.motion, recording.verdict
    names = tuple(joint.name for joint in recording.joints)
    units = tuple(recording.length_unit if joint.prismatic else "rad" for joint in recording.joints)
    straight = motion.coefficients is None or motion.num_segments == 0
    if timing == "uniform":
        instants = np.arange(float(motion.num_segments + 1))
        seconds = seconds_per_instant(motion, limits.velocity)
        rates = None if straight else velocities(motion, instants, seconds)
        return Trajectory(names, units, seconds * instants, motion.q, rates, verdict)
    timed = fastest(motion, limits.velocity, limits.acceleration)
    if not straight:  # the cubics between points of a line stay on it; those on a curve are judged
        executed, parts = hermite_motion(*timed), recording.parts
        borders = [motion.q[part.last] for part in parts[:-1]]
        places = [int(np.argmin(((timed.positions - q) ** 2).sum(axis=1))) for q in borders]
        pieces = zip(parts, pairwise([0, *places, executed.num_segments]), strict=True)
        moved = [part._replace(first=first, last=last) for part, (first, last) in pieces]
        verdict = certificate(moved, executed, recording.margin)
    return Trajectory(names, units, *timed, verdict)


def as_ros(found: Trajectory) -> bytes:
    """Return a trajectory as a `trajectory_msgs/msg/JointTrajectory` in JSON, a part of YAML."""
    others = sorted(set(found.units) - {"rad", "m"})
    if others:
        raise BadTiming(f"--format ros: sliding joints must be in m, was {others[0]}")
    nanoseconds = np.rint(found.times * 1e9).astype(np.int64)
    rates = [[]] * len(found.times) if found.velocities is None else found.velocities.tolist()
    points = [
        {
            "positions": q,
            "velocities": dq,
            "accelerations": [],
            "effort": [],
            "time_from_start": {"sec": time // 10**9, "nanosec": time % 10**9},
        }
        for time, q, dq in zip(nanoseconds.tolist(), found.positions.tolist(), rates, strict=True)
    ]
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    data = {"header": header, "joint_names": list(found.joints), "points": points}
    return json.dumps(data, indent=1, allow_nan=False).encode() + b"\n"


def as_json(recording: "Recording", found: Trajectory) -> bytes:
    """Return a trajectory as JSON, with its origin, its units and its verdict."""
    points = []
    for k, time in enumerate(found.times.tolist()):
        point: dict[str, Any] = {"time_from_start": time, "positions": found.positions[k].tolist()}
        if found.velocities is not None:
            point["velocities"] = found.velocities[k].tolist()
        points.append(point)
    data = {
        "condition": recording.condition_id,
        "replicate": recording.heading.replicate,
        "interpolation": found.interpolation,
        "certified": found.verdict.certified,
        "certified_margin": found.verdict.certified_margin,
        "joint_names": list(found.joints),
        "units": list(found.units),
        "points": points,
    }
    return json.dumps(data, indent=1, allow_nan=False).encode() + b"\n"


def as_csv(found: Trajectory) -> bytes:
    """Return a trajectory as CSV: time, positions, and velocities if there are any."""
    heads = [f"{joint}_{unit}" for joint, unit in zip(found.joints, found.units, strict=True)]
    columns = [found.times[:, None], found.positions]
    if found.velocities is not None:
        heads += [f"{head}_per_s" for head in heads]
        columns.append(found.velocities)
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerows([["time_s", *heads], *np.hstack(columns).tolist()])
    return file.getvalue().encode()


def joint_limits(
    names: tuple[str, ...], path: Path | None, speeds: FloatArray, robot: FloatArray, ramp: float
) -> JointLimits:
    """Collect the limits of joints (nq).

    Args:
        path: MoveIt's `joint_limits.yaml`; None: there is none.
        speeds: (nq,) greatest |dq/dt| where nothing else limits it [rad/s or length unit/s].
        robot: (nq,) the robot's own velocity limits; inf where it has none.
        ramp: Time from rest to the greatest speed [s], where the file limits no acceleration.
    """
    limits = _read(path, names) if path is not None else {}
    rows = [[limits.get(name, {}).get(kind, math.nan) for kind in KINDS] for name in names]
    velocity, acceleration = np.array(rows).T
    velocity = np.where(np.isnan(velocity), np.where(np.isfinite(robot), robot, speeds), velocity)
    return JointLimits(velocity, np.where(np.isnan(acceleration), velocity / ramp, acceleration))


def _read(path: Path, names: tuple[str, ...]) -> dict[str, dict[str, float]]:
    was = printable(str(path))
    must, data = "map joints under 'joint_limits', as MoveIt's file", None
    try:
        data = yaml.safe_load(read_bounded(path, LARGEST_FILE))
    except OSError as error:
        must = "be a file that can be read"
        was += f" ({(error.strerror or str(error)).lower()})"
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        must = "be YAML"
        was += f" ({printable(str(error).splitlines()[0])})"
    joints = data.get("joint_limits") if isinstance(data, dict) else None
    if not isinstance(joints, dict) or not all(isinstance(own, dict) for own in joints.values()):
        raise LimitsFileError(f"--limits: must {must}, was {was}")
    known = [str(name) for name in joints]
    if not set(known) & set(names):
        hint = nearest(known[0], list(names)) if known else ""
        raise LimitsFileError(
            f"--limits: must name joints of the robot ({', '.join(names)}), "
            f"was {printable(', '.join(known[:8])) or 'none'}{hint}"
        )
    limits: dict[str, dict[str, float]] = {}
    for name, joint in zip(known, joints.values(), strict=True):
        limits[name] = {}
        for kind in KINDS if name in names else ():
            # a value without its flag counts, too
            if not joint.get(f"has_{kind}_limits", f"max_{kind}" in joint):
                continue
            value = joint.get(f"max_{kind}")
            if not (isinstance(value, int | float) and 0.0 < value < 1e300):
                must = f"joint_limits.{printable(name)}.max_{kind} must be a number above 0"
                raise LimitsFileError(f"--limits: {must}, was {printable(str(value))}")
            limits[name][kind] = float(value)
    return limits


def seconds_per_instant(motion: Motion, limits: FloatArray) -> float:
    """Return the least time from instant to instant within limits (nq,) of joints' speeds [s]."""
    if motion.num_segments == 0:
        return 1.0
    return float((top_speeds(motion) / limits).max()) or 1.0


def velocities(motion: Motion, times: FloatArray, seconds: float) -> FloatArray:
    """Return dq/dt at times (ticks,) [instants] that are seconds apart, (ticks, nq) [per s].

    Where two straight lines meet, the velocity on the later one is taken.
    """
    if motion.num_segments == 0:
        return np.zeros((len(times), motion.q.shape[1]))
    segments = np.minimum(times.astype(int), motion.num_segments - 1)
    u = (times - segments)[:, None]
    _, c1, c2, c3 = motion.polynomials[segments].transpose(1, 0, 2)
    return np.asarray((c1 + u * (2.0 * c2 + 3.0 * u * c3)) / seconds)


def fastest(motion: Motion, speeds: FloatArray, accelerations: FloatArray) -> TimedPoints:
    """Time a motion as fast as limits of speed and acceleration (nq,) permit, from rest to rest.

    BadTiming is raised where toppra is not installed.
    """
    try:
        with warnings.catch_warnings():  # Python warns of its docstrings when it compiles them
            warnings.simplefilter("ignore")
            import toppra
    except ImportError:
        raise BadTiming(
            "--timing optimal needs toppra: pip install 'evoexp[timing]'; --timing uniform does not"
        ) from None
    toppra.setup_logging("ERROR")
    polynomials = motion.polynomials[motion.polynomials[:, 1:].any(axis=(1, 2))]
    if not len(polynomials):  # it stands still
        return TimedPoints(np.array([0.0, 1.0]), motion.q[[0, 0]], 0.0 * motion.q[[0, 0]])
    # it stops where the direction jumps
    _, c1, c2, c3 = polynomials.transpose(1, 0, 2)
    jumps = np.abs((c1 + 2.0 * c2 + 3.0 * c3)[:-1] - c1[1:]).max(axis=1)
    stops = 1 + np.flatnonzero(jumps > SMOOTH * np.abs(c1).max())
    parts: list[TimedPoints] = []
    for first, last in pairwise([0, *stops.tolist(), len(polynomials)]):
        section = _section(toppra, polynomials[first:last], speeds, accelerations)
        if parts:  # it begins at the last point of the one before
            begin = parts[-1].times[-1]
            section = TimedPoints(*(column[1:] for column in section))
            section = section._replace(times=begin + section.times)
        parts.append(section)
    return TimedPoints(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _section(
    toppra: Any, polynomials: FloatArray, speeds: FloatArray, accelerations: FloatArray
) -> TimedPoints:
    """Time cubics (segments, 4, nq) without a stop between them from rest to rest."""
    count, constraint = len(polynomials), toppra.constraint
    limits = [
        constraint.JointVelocityConstraint(np.stack([-speeds, speeds], axis=1)),
        constraint.JointAccelerationConstraint(
            np.stack([-accelerations, accelerations], axis=1),
            # limits are kept between the points of the grid, too
            constraint.DiscretizationType.Interpolation,
        ),
    ]
    c0, c1, c2, c3 = polynomials.transpose(1, 0, 2)
    ends = np.vstack([c0, polynomials[-1].sum(axis=0)])
    slopes = np.vstack([c1, c1[-1] + 2.0 * c2[-1] + 3.0 * c3[-1]])
    path = toppra.SimplePath(np.arange(count + 1.0), ends, slopes)
    solver = toppra.algorithm.TOPPRA(
        limits,
        path,
        gridpoints=np.linspace(0.0, count, GRID * count + 1),
        parametrizer="ParametrizeConstAccel",
    )
    timed = solver.compute_trajectory(0.0, 0.0)
    duration = float(timed.duration)
    points = max(POINTS_PER_SECTION, int(np.ceil(duration / TICK)))
    times = np.linspace(0.0, duration, points + 1)
    positions, rates = np.asarray(timed(times)), np.asarray(timed(times, 1))
    positions[[0, -1]], rates[[0, -1]] = ends[[0, -1]], 0.0
    # stretched until the cubics between the points keep the limits, too
    executed = hermite_motion(times, positions, rates)
    speed, acceleration = greatest_rates(executed, np.diff(times))
    excess = (speed / speeds).max(), np.sqrt((acceleration / accelerations).max())
    stretch = max(1.0, *map(float, excess))
    return TimedPoints(times * stretch, positions, rates / stretch)


def hermite_motion(times: FloatArray, positions: FloatArray, velocities: FloatArray) -> Motion:
    """Return the cubics that a controller puts between points, see `TimedPoints`."""
    widths = np.diff(times)[:, None]
    before, after = widths * velocities[:-1], widths * velocities[1:]
    way = positions[1:] - positions[:-1]
    powers = [positions[:-1], before, 3.0 * way - 2.0 * before - after, before + after - 2.0 * way]
    return Motion(positions, np.stack(powers, axis=1))


def greatest_rates(motion: Motion, widths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the greatest speed and acceleration of every joint, each (nq,).

    The segments of the motion take widths (segments,) [s].
    """
    _, c1, c2, c3 = motion.polynomials.transpose(1, 0, 2)
    w = widths[:, None]
    u = np.divide(-c2, 3.0 * c3, out=np.zeros_like(c2), where=c3 != 0.0)
    instants = np.zeros_like(c1), np.ones_like(c1), np.clip(u, 0.0, 1.0)
    speeds = [np.abs(c1 + x * (2.0 * c2 + 3.0 * x * c3)) / w for x in instants]
    accelerations = [np.abs(2.0 * c2 + 6.0 * x * c3) / w**2 for x in instants[:2]]
    return np.max(speeds, axis=(0, 1)), np.max(accelerations, axis=(0, 1))
