"""A motion as a joint trajectory, for a robot or MoveIt: names, times, positions, velocities.

A controller that interpolates the points moves as the motion that was judged: without velocities
straight from point to point, with velocities on the cubics that they determine. The motion that is
executed is certified again where it is another curve than the stored one.

Limits of joints come from MoveIt's `joint_limits.yaml`. What it does not name comes from the robot
(the `velocity` of a URDF's joints), else from the command line: no paper prints speeds. Jerk and
effort are left aside.
"""

import json
import math
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd
import yaml

from evoexp.collision.certifier.certificate import Certificate, certificate
from evoexp.errors import EvoexpError, nearest, printable
from evoexp.input_files import read_bounded
from evoexp.paths.motion import Motion
from evoexp.playback.recording import Recording
from evoexp.playback.timing import (
    BadTiming,
    fastest,
    greatest_rates,
    hermite_motion,
    seconds_per_instant,
    velocities,
)
from evoexp.records import FloatArray

LARGEST_FILE = 1_000_000  # [B]
KINDS = ("velocity", "acceleration")
Timing = Literal["optimal", "uniform"]
Interpolation = Literal["linear", "cubic"]


class LimitsFileError(EvoexpError):
    """A file of joint limits that cannot be used."""


class JointLimits(NamedTuple):
    """Greatest rates of every joint."""

    velocity: FloatArray  # (nq,) [rad/s or length unit/s]
    acceleration: FloatArray  # (nq,) [rad/s² or length unit/s²]


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


def trajectory(recording: Recording, timing: Timing, limits: JointLimits) -> Trajectory:
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
        raise BadTiming(f"--format ros: joints that slide must do so in m, was {others[0]}")
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


def as_json(recording: Recording, found: Trajectory) -> bytes:
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
    names = [f"{joint}_{unit}" for joint, unit in zip(found.joints, found.units, strict=True)]
    table = pd.DataFrame(found.positions, columns=names)
    table.insert(0, "time_s", found.times)
    if found.velocities is not None:
        table[[f"{name}_per_s" for name in names]] = found.velocities
    return table.to_csv(index=False, lineterminator="\n").encode()


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
    """Read the limits that a file sets, per joint and kind."""
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
