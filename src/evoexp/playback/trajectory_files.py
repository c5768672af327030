"""Joint trajectories out of files, written by `export` or by others.

CSV with a column per joint (`elbow_rad`, `elbow [deg]`, `elbow`), or a
`trajectory_msgs/msg/JointTrajectory` in JSON or YAML. Joints are matched by name, in any order; a
value without a unit is in radians, or in the scene's unit of length. With velocities of all joints
a motion follows the cubics that they determine, as a controller does; else it goes straight from
point to point.
"""

import json
import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import yaml

from evoexp.errors import printable
from evoexp.input_files import NUMBER, TableError, read_table
from evoexp.numeric.elementary import DEGREE
from evoexp.paths.motion import Motion
from evoexp.playback.recording import Joint
from evoexp.playback.trajectory import hermite_motion
from evoexp.records import FloatArray

TURNS = {"rad": 1.0, "radian": 1.0, "radians": 1.0}
TURNS |= dict.fromkeys(("deg", "degree", "degrees", "°"), DEGREE)
LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
UNLIKELY = 4.0 * math.pi  # [rad] a turn beyond it, without a unit, is taken for one in degrees
LATEST = 1e11  # [s, ns] of a time
LARGEST = 1e7  # as of the numbers of robots and scenarios, in any unit

_TIME = re.compile(r"(?:t|time|timestamp|time_from_start)(?:[ _./\[(]+([a-z]+)[\])]?)?", re.I)
_REST = re.compile(r"[ _./\[(][ _./\[\]()A-Za-z°]*")  # of the head of a column, behind the joint
_WORD = re.compile(r"[A-Za-z]+|°")


class Values(NamedTuple):
    """Positions or velocities of one joint, or the numbers of a column."""

    numbers: FloatArray  # (points,) in the unit, of velocities per second
    unit: str = ""  # as the file has it; empty: it names none


class JointTrajectory(NamedTuple):
    """A joint trajectory as a file has it."""

    positions: dict[str, Values]  # by joint
    velocities: dict[str, Values]  # by joint; none if the file has none
    times: FloatArray | None  # (points,) [s]; None: the file has none
    unread: tuple[str, ...] = ()  # names of what is not read
    is_table: bool = False  # whether positions are named by heads of columns, not yet by joints


def read_columns(content: bytes) -> JointTrajectory:
    """Read a CSV file with a head; TableError is raised where it is no table of numbers."""
    rows = read_table(content)
    head = rows[0].cells if rows else []
    for name in head:
        if head.count(name) > 1 or not name or NUMBER.fullmatch(name):
            raise TableError(rows[0].line, "a header with a different name per column", name)
    for line, cells in rows[1:]:
        for name, cell in zip(head, cells, strict=True):
            if not NUMBER.fullmatch(cell):
                raise TableError(line, f"a number in column {name}", cell)
    table = np.array([cells for _, cells in rows[1:]], dtype=np.float64).reshape(-1, len(head))
    numbers, times = dict(zip(head, table.T, strict=True)), None
    for name in head:
        if times is None and (found := _TIME.fullmatch(name)):
            if (unit := (found[1] or "").lower()) not in SECONDS:
                raise TableError(rows[0].line, "a time in s, ms, us or ns", name)
            times = SECONDS[unit] * numbers.pop(name)
    columns = {name: Values(column) for name, column in numbers.items()}
    return JointTrajectory(columns, {}, times, is_table=True)


def read_message(data: dict[str, Any]) -> JointTrajectory:
    """Read a JointTrajectory message, or our JSON, which is one with units, or raise ValueError."""
    for wrapper in ("joint_trajectory", "trajectory"):  # a RobotTrajectory, a controller's goal
        data = data[wrapper] if isinstance(data.get(wrapper), dict) else data
    names, points, units = (data.get(key) for key in ("joint_names", "points", "units"))
    if not isinstance(names, list) or not isinstance(points, list):
        keys = printable(", ".join(map(str, list(data)[:8])))[:80] or "nothing"
        raise ValueError(f"must have joint_names and points, as a JointTrajectory, has {keys}")
    if not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
        raise ValueError("joint_names must be names, each once")
    units = [""] * len(names) if units is None else units
    if not isinstance(units, list) or len(units) != len(names):
        raise ValueError(f"units must be {len(names)}, one per joint")
    rows: dict[str, list[list[float]]] = {}
    for key in ("positions", "velocities", "accelerations"):
        rows[key] = []
        for k, point in enumerate(points):
            row = point.get(key, []) if isinstance(point, dict) else None
            where = f"points[{k}].{key}"
            if not isinstance(row, list):
                raise ValueError(f"{where} must be a list of numbers")
            rows[key].append([_number(value, where) for value in row])
        for k, row in enumerate(rows[key]):
            if len(row) != len(names) and (row or key == "positions" or any(rows[key])):
                must = f"points[{k}].{key} must be {len(names)} numbers, one per joint"
                raise ValueError(f"{must}, was {len(row)}")
    positions, velocities = (
        {
            name: Values(column, str(unit))  # none where no point has velocities
            for name, unit, column in zip(names, units, np.array(rows[key]).T, strict=False)
        }
        for key in ("positions", "velocities")
    )
    unread = ("accelerations",) if np.any(rows["accelerations"]) else ()
    return JointTrajectory(positions, velocities, _times(points), unread)


def _number(value: Any, where: str, most: float = LARGEST) -> float:
    if isinstance(value, str) and NUMBER.fullmatch(value):
        value = float(value)  # YAML reads 1e-5 as text
    if type(value) not in (int, float) or not abs(value) <= most:
        was = printable(str(value)[:40])
        raise ValueError(f"{where} must be finite numbers of at most {most:g}, was {was}")
    return float(value)


def _times(points: Sequence[dict[str, Any]]) -> FloatArray | None:
    times = []
    for k, point in enumerate(points):
        time, where = point.get("time_from_start"), f"points[{k}].time_from_start"
        if time is None:
            return None
        if isinstance(time, dict):  # of ROS 2, of ROS 1
            keys = ("sec", "secs"), ("nanosec", "nsecs")
            parts = (_number(time.get(a, time.get(b, 0)), where, LATEST) for a, b in keys)
            time = next(parts) + 1e-9 * next(parts)
        times.append(_number(time, where, LATEST))
    return np.array(times)


def fitted(
    given: JointTrajectory, joints: Sequence[Joint], length_unit: str
) -> tuple[Motion, tuple[str, ...]]:
    """Return a trajectory as a motion of a robot's joints, and remarks on how it was read.

    ValueError says that a joint is missing, or that a unit, a time or a number cannot be.
    """
    if given.is_table:
        given = _by_joint(given, joints, length_unit)
    if missing := [joint for joint in joints if joint.name not in given.positions]:
        has = ", ".join((*given.positions, *given.unread)) or "nothing"
        lacking = ", ".join(joint.name for joint in missing)
        example = missing[0].name + (f"_{length_unit}" if missing[0].prismatic else "_rad")
        raise ValueError(f"lacks joints {lacking} (a column is named {example}); has {has}")
    positions = [_scaled(given.positions[joint.name], joint, length_unit) for joint in joints]
    q = np.array(positions).T
    if len(q) < 2:
        raise ValueError(f"must have two points or more, has {len(q)}")
    times, remarks = given.times, []
    if times is not None and not (np.diff(times) > 0.0).all():
        k = int(np.argmin(np.diff(times) > 0.0)) + 1
        raise ValueError(f"times must grow from point to point: {times[k]:g} s at point {k + 1}")
    if any(not given.positions[joint.name].unit for joint in joints):
        remarks.append(f"values without a unit are read in rad and {length_unit}")
    names, motion = [joint.name for joint in joints], Motion(q)
    unread = [*given.unread, *(name for name in given.positions if name not in names)]
    curves = "straight lines between the points"
    if times is not None and all(name in given.velocities for name in names):
        rates = [_scaled(given.velocities[joint.name], joint, length_unit) for joint in joints]
        if np.any(rates):
            motion = hermite_motion(times, q, np.array(rates).T)
            curves = "cubics between the points, by their velocities"
    elif given.velocities:
        unread.append("velocities")  # of some joints, or without times
    remarks.append(curves)
    if unread:
        remarks.append(f"not read: {printable(', '.join(unread))}")
    return motion, tuple(remarks)


def _by_joint(table: JointTrajectory, joints: Sequence[Joint], length_unit: str) -> JointTrajectory:
    """Match columns with joints by their heads: `elbow`, `elbow_rad`, `elbow_rad_per_s`."""
    positions, velocities, unread = dict[str, Values](), dict[str, Values](), []
    names = {joint.name for joint in joints}
    for head, column in table.positions.items():
        matches = [(head, ("", False))] if head in names else []
        matches += [
            (joint.name, meaning)
            for joint in joints
            if not matches
            and head.startswith(joint.name)
            and (meaning := _meaning(head[len(joint.name) :], {*TURNS, *LENGTHS, length_unit}))
        ]
        if not matches:
            unread.append(head)
            continue
        name, (unit, is_rate) = max(matches, key=lambda match: len(match[0]))
        kind = velocities if is_rate else positions
        if name in kind:
            raise ValueError(f"{head}: a second column of joint {name}")
        kind[name] = column._replace(unit=unit)
    return JointTrajectory(positions, velocities, table.times, tuple(unread))


def _meaning(rest: str, units: set[str]) -> tuple[str, bool] | None:
    if not _REST.fullmatch(rest):
        return None
    words = _WORD.findall(rest)
    words = [word for word in words if word.lower() not in ("position", "pos")]
    slow = [word for word in words if word.lower() not in ("velocity", "vel", "speed")]
    is_rate = len(slow) < len(words)
    for behind in (["per", "s"], ["s"]):
        if len(slow) > 1 and slow[-len(behind) :] == behind:
            slow, is_rate = slow[: -len(behind)], True
    if not slow:
        return "", is_rate
    unit = slow[0] if slow[0] in units else slow[0].lower()
    return (unit, is_rate) if len(slow) == 1 and unit in units else None


def _scaled(values: Values, joint: Joint, length_unit: str) -> FloatArray:
    unit, numbers = values.unit, values.numbers
    known = {**TURNS, "": 1.0}
    if joint.prismatic:
        others = LENGTHS if length_unit in LENGTHS else {}
        known = {length_unit: 1.0, "": 1.0}
        known |= {name: value / LENGTHS[length_unit] for name, value in others.items()}
    if unit not in known:
        raise ValueError(
            f"{joint.name}: must be in {' or '.join(filter(None, known))}, was in {unit}"
        )
    greatest = float(np.abs(numbers).max(initial=0.0))
    if not greatest <= LARGEST:
        raise ValueError(f"{joint.name}: must be at most {LARGEST:g}, was {greatest:g}")
    if not unit and not joint.prismatic and greatest > UNLIKELY:
        raise ValueError(
            f"{joint.name}: {greatest:g} without a unit is hardly in rad: name its column "
            f"{joint.name}_deg or {joint.name}_rad (in JSON and YAML: units: [deg, …])"
        )
    return known[unit] * numbers


def parse_message(text: str, is_yaml: bool) -> Any:
    """Return the content of a JSON or YAML file of one document, or raise ValueError."""
    if not is_yaml:
        return json.loads(text)
    try:
        documents = [each for each in yaml.safe_load_all(text) if each is not None]
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None
    if len(documents) != 1:
        raise ValueError(f"must hold one message, holds {len(documents)}")
    return documents[0]
