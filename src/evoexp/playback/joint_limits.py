"""Limits of joints that an exported trajectory keeps: from a file, the robot, or the command line.

The file is MoveIt's `joint_limits.yaml`. What it does not name comes from the robot (the `velocity`
of a URDF's joints), else from the command line: no paper prints speeds. Jerk and effort are left
aside.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from evoexp.errors import EvoexpError, nearest, printable
from evoexp.input_files import read_bounded
from evoexp.records import FloatArray

LARGEST_FILE = 1_000_000  # [B]
KINDS = ("velocity", "acceleration")


class LimitsFileError(EvoexpError):
    """A file of joint limits that cannot be used."""


class JointLimits(NamedTuple):
    """Greatest rates of every joint."""

    velocity: FloatArray  # (nq,) [rad/s or length unit/s]
    acceleration: FloatArray  # (nq,) [rad/s² or length unit/s²]


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
