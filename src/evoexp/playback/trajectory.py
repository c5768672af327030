"""A motion as a joint trajectory, for a robot or MoveIt: names, times, positions, velocities.

A controller that interpolates the points moves as the motion that was judged. Without velocities it
goes straight from point to point. With velocities it follows the cubics that they determine: the
pieces of the spline (uniform timing), or speeding up, constant speed and slowing down on a straight
piece (optimal timing).
"""

import csv
import io
import json
from typing import Any, Literal, NamedTuple

import numpy as np

from evoexp.errors import EvoexpError
from evoexp.playback.optimal_timing import along_curve, along_lines
from evoexp.playback.recording import Recording
from evoexp.playback.timing import SpeedLimits, velocities
from evoexp.records import FloatArray

Timing = Literal["uniform", "optimal"]


class BadTiming(EvoexpError):
    """A timing that is not available."""


class Trajectory(NamedTuple):
    """The points of a motion in time.

    Attributes:
        joints: (nq) names of the joints.
        units: (nq) units of the coordinates: rad, or the scene's unit of length.
        times: (points,) from the start [s].
        positions: (points, nq) [rad or length unit].
        velocities: (points, nq) per second; None: straight from point to point.
    """

    joints: tuple[str, ...]
    units: tuple[str, ...]
    times: FloatArray
    positions: FloatArray
    velocities: FloatArray | None


def trajectory(
    recording: Recording, timing: Timing, limits: SpeedLimits, ramp: float
) -> Trajectory:
    """Return the points of a motion in time.

    Args:
        recording: The motion; its `seconds` come from the same limits.
        timing: uniform: equal times from instant to instant, as short as the speed limits permit |
            optimal: as fast as limits of speed and acceleration permit along the path, with a stop
            wherever two straight lines meet.
        limits: Limits of speed.
        ramp: Time from rest to a joint's greatest speed [s]; it limits the accelerations of the
            optimal timing.

    Raises:
        BadTiming: If the timing needs a package that is not installed.
    """
    motion = recording.motion
    prismatic = np.array([joint.prismatic for joint in recording.joints])
    if timing == "uniform":
        instants = np.arange(float(motion.num_segments + 1))
        speeds = (
            None if motion.coefficients is None else velocities(motion, instants, recording.seconds)
        )
        times, positions = recording.seconds * instants, motion.q
    else:
        speed = limits.of(prismatic, recording.size)
        along = along_lines if motion.coefficients is None else along_curve
        found = along(motion, speed, speed / ramp)
        if found is None:
            raise BadTiming(
                "--timing optimal of a curve needs toppra: pip install 'evoexp[timing]'"
            )
        times, positions, speeds = found
    names = tuple(joint.name for joint in recording.joints)
    units = tuple(recording.length_unit if slides else "rad" for slides in prismatic)
    return Trajectory(names, units, times, positions, speeds)


def as_json(recording: Recording, found: Trajectory) -> bytes:
    """Return a trajectory as JSON, with the fields of `trajectory_msgs/JointTrajectory`."""
    points = []
    for k, time in enumerate(found.times.tolist()):
        point: dict[str, Any] = {"time_from_start": time, "positions": found.positions[k].tolist()}
        if found.velocities is not None:
            point["velocities"] = found.velocities[k].tolist()
        points.append(point)
    data = {
        "condition": recording.condition_id,
        "replicate": recording.heading.replicate,
        "interpolation": "linear" if found.velocities is None else "cubic",
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
