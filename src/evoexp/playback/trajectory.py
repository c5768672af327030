"""A motion as a joint trajectory, for a robot or MoveIt: names, times, positions, rates.

A controller that interpolates the points moves as the motion that was judged. Without velocities it
goes straight from point to point. With velocities it follows the cubics that they determine; with
accelerations, too, polynomials of fifth degree along straight lines. The motion that is executed is
certified again wherever it is another curve than the stored one.
"""

import csv
import io
import json
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from evoexp.collision.certifier.certificate import Certificate, certificate
from evoexp.collision.scene import Part
from evoexp.errors import EvoexpError
from evoexp.paths.motion import Motion
from evoexp.playback.blending import BlendedMotion, blended
from evoexp.playback.joint_limits import JointLimits
from evoexp.playback.optimal_timing import (
    Timed,
    along_curve,
    along_lines,
    greatest_rates,
    hermite_motion,
)
from evoexp.playback.recording import Recording
from evoexp.playback.rest_timing import rest_on_curve, rest_on_lines
from evoexp.playback.timing import seconds_per_instant, velocities
from evoexp.records import FloatArray

Timing = Literal["rest", "optimal", "uniform"]
Interpolation = Literal["linear", "cubic", "quintic"]


class BadTiming(EvoexpError):
    """A timing that is not available."""


class Trajectory(NamedTuple):
    """The points of a motion in time."""

    joints: tuple[str, ...]  # (nq) names of the joints
    units: tuple[str, ...]  # (nq) units of the coordinates: rad, or the scene's unit of length
    times: FloatArray  # (points,) from the start [s]
    positions: FloatArray  # (points, nq) [rad or length unit]
    velocities: FloatArray | None  # (points, nq) per second; None: straight from point to point
    # Degree of the polynomials that a controller puts between the points; quintic: accelerations
    # are 0 at every point
    interpolation: Interpolation
    verdict: Certificate  # the certifier's, on the motion that is executed
    num_corners: int = 0  # corners that were rounded

    def rates(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the greatest speed, acceleration and jerk of every joint, each (nq,).

        Where the speed of a motion jumps, accelerations are not counted.
        """
        widths = np.diff(self.times)
        if self.interpolation == "quintic":
            ways, w = np.abs(np.diff(self.positions, axis=0)), widths[:, None]
            factors = (1.875, 10.0 / np.sqrt(3.0), 60.0)  # of s = 10 u³ − 15 u⁴ + 6 u⁵
            speed, acceleration, jerk = (
                (factor * ways / w ** (k + 1)).max(axis=0) for k, factor in enumerate(factors)
            )
            return speed, acceleration, jerk
        if self.velocities is None:
            return greatest_rates(Motion(self.positions), widths)
        return greatest_rates(hermite_motion(self.times, self.positions, self.velocities), widths)


def trajectory(
    recording: Recording, timing: Timing, limits: JointLimits, blend: bool = True
) -> Trajectory:
    """Return the points of a motion in time.

    Args:
        recording: The motion.
        timing: rest: at rest at both ends, and wherever two straight lines meet, within limits of
            speed, acceleration and jerk | optimal: as fast as limits of speed and acceleration
            permit | uniform: equal times from instant to instant, as short as the limits of speed
            permit; its speed jumps.
        limits: Limits of the joints.
        blend: Whether the optimal timing rounds the corners of a certified motion, as far as the
            rounded motion is certified; if not, it stops at each.

    Raises:
        BadTiming: If the timing needs a package that is not installed.
    """
    motion = recording.motion
    names = tuple(joint.name for joint in recording.joints)
    units = tuple(recording.length_unit if joint.prismatic else "rad" for joint in recording.joints)
    straight = motion.coefficients is None or motion.num_segments == 0
    rounded: BlendedMotion | None = None
    if timing == "uniform":
        times, positions, speeds = _uniform(motion, limits.velocity)
        kind: Interpolation = "linear" if straight else "cubic"
        rates = None if straight else speeds
        return Trajectory(names, units, times, positions, rates, kind, recording.verdict)
    if timing == "rest" and straight:
        return Trajectory(
            names, units, *rest_on_lines(motion, limits), "quintic", recording.verdict
        )
    if timing == "rest":
        found: Timed | None = rest_on_curve(motion, limits)
    elif not straight:
        found = along_curve(motion, limits.velocity, limits.acceleration)
    elif blend and recording.verdict.certified and (motion.q != motion.q[0]).any():
        rounded = blended(motion, recording.parts, recording.margin, limits.velocity)
        found = along_curve(
            rounded.motion, limits.velocity, limits.acceleration, rounded.lengths, rounded.stops
        )
    else:
        points = along_lines(motion, limits.velocity, limits.acceleration)
        return Trajectory(names, units, *points, "cubic", recording.verdict)
    if found is None:
        must = "--timing optimal of a curve needs toppra: pip install 'evoexp[timing]'"
        raise BadTiming(must + ("; --no-blend stops at corners, without it" if rounded else ""))
    parts = recording.parts if rounded is None else rounded.parts
    path = motion if rounded is None else rounded.motion
    verdict = _executed_verdict(found, path, parts, recording.margin)
    corners = 0 if rounded is None else rounded.num_corners
    return Trajectory(names, units, *found, "cubic", verdict, corners)


def _uniform(motion: Motion, speeds: FloatArray) -> Timed:
    """Time a motion by equal times from instant to instant."""
    instants = np.arange(float(motion.num_segments + 1))
    seconds = seconds_per_instant(motion, speeds)
    return seconds * instants, motion.q, velocities(motion, instants, seconds)


def _executed_verdict(
    timed: Timed, path: Motion, parts: Sequence[Part], margin: float
) -> Certificate:
    """Certify the cubics that a controller puts between points on a path."""
    executed = hermite_motion(*timed)
    places = [_point_at(timed[1], path.q[part.last]) for part in parts[:-1]]
    borders = [0, *places, executed.num_segments]
    moved = [
        part._replace(first=first, last=last)
        for part, first, last in zip(parts, borders[:-1], borders[1:], strict=True)
    ]
    return certificate(moved, executed, margin)


def _point_at(positions: FloatArray, q: FloatArray) -> int:
    """Return the point at a configuration."""
    return int(np.argmin(((positions - q) ** 2).sum(axis=1)))


def as_ros(found: Trajectory) -> bytes:
    """Return a trajectory as a `trajectory_msgs/msg/JointTrajectory`, in JSON, which is YAML, too.

    Raises:
        BadTiming: If joints slide by another unit of length than ROS's metre.
    """
    others = sorted(set(found.units) - {"rad", "m"})
    if others:
        raise BadTiming(f"--format ros: joints that slide must do so in m, was {others[0]}")
    nothing = [0.0] * len(found.joints)
    points = []
    nanoseconds = np.rint(found.times * 1e9).astype(np.int64)
    for k, time in enumerate(nanoseconds.tolist()):
        rates = [] if found.velocities is None else found.velocities[k].tolist()
        points.append(
            {
                "positions": found.positions[k].tolist(),
                "velocities": rates,
                "accelerations": nothing if found.interpolation == "quintic" else [],
                "effort": [],
                "time_from_start": {"sec": time // 10**9, "nanosec": time % 10**9},
            }
        )
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
    columns = [found.times[:, None], found.positions]
    names = [
        "time_s",
        *(f"{joint}_{unit}" for joint, unit in zip(found.joints, found.units, strict=True)),
    ]
    if found.velocities is not None:
        columns.append(found.velocities)
        names += [
            f"{joint}_{unit}_per_s" for joint, unit in zip(found.joints, found.units, strict=True)
        ]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([repr(value) for value in row] for row in np.hstack(columns).tolist())
    return text.getvalue().encode()
