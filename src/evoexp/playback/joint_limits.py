"""Limits of joints that an exported trajectory keeps: from a file, the robot, or the command line.

The file is MoveIt's `joint_limits.yaml`. What it does not name comes from the robot (the `velocity`
of a URDF's joints), else from the command line: no paper prints speeds. Jerk and effort are left
aside.
"""

import math
from pathlib import Path
from typing import Any, NamedTuple

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


class Defaults(NamedTuple):
    """Limits of the joints that neither the file nor the robot limits."""

    velocity: FloatArray  # (nq,) greatest |dq/dt| [rad/s or length unit/s]
    robot: FloatArray  # (nq,) the robot's own velocity limits; inf where it has none
    ramp: float  # time from rest to the greatest speed [s], which limits accelerations


def joint_limits(names: tuple[str, ...], path: Path | None, defaults: Defaults) -> JointLimits:
    """Collect the limits of joints.

    Args:
        names: Names of the joints, (nq).
        path: MoveIt's `joint_limits.yaml`; None: there is none.
        defaults: Limits where the file has none.

    Raises:
        LimitsFileError: If the file cannot be read, is no such file, or names none of the joints.
    """
    given = _read(path, names) if path is not None else {}
    found = np.array(
        [[given.get(name, {}).get(kind, math.nan) for kind in KINDS] for name in names]
    )
    velocity, acceleration = found.T
    from_robot = np.where(np.isfinite(defaults.robot), defaults.robot, defaults.velocity)
    velocity = np.where(np.isnan(velocity), from_robot, velocity)
    acceleration = np.where(np.isnan(acceleration), velocity / defaults.ramp, acceleration)
    return JointLimits(velocity, acceleration)


def _read(path: Path, names: tuple[str, ...]) -> dict[str, dict[str, float]]:
    """Read the limits that a file sets, per joint and kind."""
    shown = printable(str(path))
    try:
        data = yaml.safe_load(read_bounded(path, LARGEST_FILE))
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise LimitsFileError(
            f"--limits: must be a file that can be read, was {shown} ({reason})"
        ) from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        first = printable(str(error).splitlines()[0])
        raise LimitsFileError(f"--limits: must be YAML, was {shown} ({first})") from None
    joints = data.get("joint_limits") if isinstance(data, dict) else None
    if not isinstance(joints, dict) or not all(isinstance(each, dict) for each in joints.values()):
        raise LimitsFileError(
            f"--limits: must map joints under 'joint_limits', as MoveIt's file, was {shown}"
        )
    known = [str(name) for name in joints]
    if not set(known) & set(names):
        hint = nearest(known[0], list(names)) if known else ""
        raise LimitsFileError(
            f"--limits: must name joints of the robot ({', '.join(names)}), "
            f"was {printable(', '.join(known[:8])) or 'none'}{hint}"
        )
    return {
        str(name): {kind: _limit(each, kind, str(name)) for kind in KINDS if _has(each, kind)}
        for name, each in joints.items()
        if str(name) in names
    }


def _has(joint: dict[str, Any], kind: str) -> bool:
    """Whether a joint's entry limits a rate; a value without its `has_` flag counts, too."""
    return bool(joint.get(f"has_{kind}_limits", f"max_{kind}" in joint))


def _limit(joint: dict[str, Any], kind: str, name: str) -> float:
    value = joint.get(f"max_{kind}")
    number = float(value) if isinstance(value, int | float) and abs(value) < 1e300 else math.nan
    if not number > 0.0:
        field = f"--limits: joint_limits.{printable(name)}.max_{kind}"
        raise LimitsFileError(f"{field} must be a number above 0, was {printable(str(value))}")
    return number
