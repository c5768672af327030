import csv
import io
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy
import yaml

from evoexp.input_files import TableError
from evoexp.paths.motion import Motion, clamped_cubic
from evoexp.playback import trajectory as timing
from evoexp.playback.recording import Joint, Recording
from evoexp.playback.trajectory_files import fitted, parse_message, read_columns, read_message
from playback_samples import SAMPLES, recording

PATH = np.array([[0.0, 0.0], [1.0, -0.5], [1.0, -0.5], [1.01, -0.5], [0.0, 2.0]])
HALF, ONE = np.full(2, 0.5), np.full(2, 1.0)


def limits_of(shown: Recording) -> timing.JointLimits:
    """Return the limits that the command takes where nothing else is said."""
    prismatic = np.array([joint.prismatic for joint in shown.joints])
    speeds = timing.SpeedLimits().of(prismatic, shown.size)
    return timing.JointLimits(speeds, speeds / 0.5)


def uniform(name: str) -> timing.Trajectory:
    return timing.trajectory(recording(name), "uniform", limits_of(recording(name)))


def cubics(times: np.ndarray, positions: np.ndarray, velocities: np.ndarray) -> Any:
    """Return what a controller makes of the points."""
    return scipy.interpolate.CubicHermiteSpline(times, positions, velocities)


@pytest.fixture
def toppra() -> None:
    pytest.importorskip("toppra", reason="needs toppra, from evoexp[timing]")


@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_a_controller_executes_the_very_motion_that_was_judged(name: str) -> None:
    shown, found = recording(name), uniform(name)
    instants = np.linspace(0.0, shown.motion.num_segments, 301)
    at = instants * shown.seconds
    if found.velocities is None:
        columns = [np.interp(at, found.times, column) for column in found.positions.T]
        executed = np.stack(columns, axis=1)
    else:
        executed = cubics(found.times, found.positions, found.velocities)(at)
    assert np.allclose(executed, [shown.motion.at(t) for t in instants], atol=1e-9)
    assert (found.velocities is None) == (shown.motion.coefficients is None)


def test_both_formats_say_the_same() -> None:
    shown, found = recording("co-evolution"), uniform("co-evolution")
    data = json.loads(timing.as_json(shown, found))
    head, *rows = csv.reader(io.StringIO(timing.as_csv(found).decode()))
    assert data["joint_names"] == [joint.name for joint in shown.joints]
    assert data["interpolation"] == "cubic"
    assert head[:2] == ["time_s", f"{shown.joints[0].name}_rad"]
    for point, row in zip(data["points"], rows, strict=True):
        values = point["time_from_start"], *point["positions"], *point["velocities"]
        assert list(values) == [float(cell) for cell in row]


def test_lines_keep_the_limits_stay_on_the_lines_and_could_hardly_be_faster(toppra: None) -> None:
    times, positions, velocities = timing.fastest(Motion(PATH), HALF, ONE)
    assert (np.diff(times) > 0.0).all()
    curve, at = cubics(times, positions, velocities), np.linspace(0.0, times[-1], 20001)
    assert np.abs(curve(at, 1)).max() <= 0.5 * (1.0 + 1e-9)
    assert np.abs(curve(at, 2)).max() <= 1.0 * (1.0 + 1e-9)
    offsets = []
    for a, b in np.stack([PATH[:-1], PATH[1:]], axis=1)[[0, 2, 3]]:
        along = np.clip((curve(at) - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        offsets.append(np.linalg.norm(curve(at) - a - along[:, None] * (b - a), axis=1))
    assert np.min(offsets, axis=0).max() < 1e-9
    # [rad] of the joint that takes longest: to full speed in 0.5 s over 0.125 rad
    longest = [1.0, 0.01, 2.5]
    truth = sum(2.0 * np.sqrt(way) if way < 0.25 else way / 0.5 + 0.5 for way in longest)
    assert truth <= times[-1] * (1.0 + 1e-9)
    assert times[-1] == pytest.approx(truth, rel=0.03)


def test_a_motion_that_stands_still_takes_a_second(toppra: None) -> None:
    times, positions, velocities = timing.fastest(Motion(np.ones((3, 2))), ONE, ONE)
    assert (times.tolist(), positions.tolist()) == ([0.0, 1.0], [[1.0, 1.0]] * 2)
    assert not velocities.any()


def test_a_curve_is_followed_without_a_stop(toppra: None) -> None:
    motion = clamped_cubic(PATH[[0, 1, 4]])
    _, positions, velocities = timing.fastest(motion, HALF, ONE)
    assert not velocities[[0, -1]].any() and velocities[5:-5].any(axis=1).all()
    truth = np.array([motion.at(t) for t in np.linspace(0.0, 2.0, 4001)])
    assert max(np.linalg.norm(truth - point, axis=1).min() for point in positions) < 1e-3
    assert np.allclose(positions[[0, -1]], motion.q[[0, -1]], atol=1e-12)


@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_every_limit_is_kept_from_rest_to_rest(name: str, toppra: None) -> None:
    shown = recording(name)
    limits = limits_of(shown)
    found = timing.trajectory(shown, "optimal", limits)
    steps = np.diff(found.times)
    assert (steps > 0.0).all()
    assert not found.velocities[[0, -1]].any()
    assert np.allclose(found.positions[[0, -1]], shown.motion.q[[0, -1]], atol=1e-12)
    shares = np.linspace(1e-6, 1.0 - 1e-6, 41)  # from within: at the points accelerations jump
    at = (found.times[:-1, None] + steps[:, None] * shares).ravel()
    curve = cubics(found.times, found.positions, found.velocities)
    for order, said, limit in zip((1, 2), found.rates(), limits, strict=True):
        rate = np.abs(curve(at, order)).max(axis=0)
        assert (rate <= limit * (1.0 + 1e-6)).all()
        assert np.allclose(rate, said, rtol=1e-2, atol=1e-12)
    assert found.verdict.certified == shown.verdict.certified
    assert found.verdict.certified_margin or not shown.verdict.certified_margin


def test_without_toppra_one_line_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "toppra", None)
    line = r"^--timing optimal needs toppra: pip install 'evoexp\[timing\]'; --timing uniform does"
    with pytest.raises(timing.BadTiming, match=line):
        timing.fastest(Motion(PATH), ONE, ONE)


def test_ros_reads_the_message() -> None:
    rosbags = pytest.importorskip("rosbags.typesys", reason="needs rosbags")
    store = rosbags.get_typestore(rosbags.Stores.ROS2_JAZZY)
    found, types = uniform("two arms"), store.types
    data = json.loads(timing.as_ros(found))
    stamp = types["builtin_interfaces/msg/Time"](**data["header"].pop("stamp"))
    header = types["std_msgs/msg/Header"](stamp=stamp, **data.pop("header"))
    duration = types["builtin_interfaces/msg/Duration"]
    point = types["trajectory_msgs/msg/JointTrajectoryPoint"]
    points = [
        point(
            time_from_start=duration(**each.pop("time_from_start")),
            **{name: np.array(values, dtype=np.float64) for name, values in each.items()},
        )
        for each in data.pop("points")
    ]
    name = "trajectory_msgs/msg/JointTrajectory"
    message = types[name](header=header, points=points, **data)  # refuses unknown fields
    again = store.deserialize_cdr(store.serialize_cdr(message, name), name)
    assert again.joint_names == [joint.name for joint in recording("two arms").joints]
    times = [p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in again.points]
    assert np.allclose(times, found.times, atol=1e-9)
    assert np.array_equal([p.positions for p in again.points], found.positions)


def test_sliding_joints_have_the_unit_of_the_scene_and_ros_has_the_metre_alone() -> None:
    found = uniform("grid")
    assert found.units == ("unit", "unit")
    line = r"^--format ros: sliding joints must be in m, was unit$"
    with pytest.raises(timing.BadTiming, match=line):
        timing.as_ros(found)


NAMES = ("shoulder", "elbow")
DEFAULTS = np.array([1.0, 2.0]), np.array([np.inf, 3.0]), 0.5  # command line, robot, ramp
FILE = """
default_velocity_scaling_factor: 0.1
joint_limits:
  shoulder:
    has_velocity_limits: true
    max_velocity: 0.7
    has_acceleration_limits: false
    max_acceleration: 9
  finger: {has_velocity_limits: true, max_velocity: 0.1}
  elbow: {has_acceleration_limits: true, max_acceleration: 4}
"""


def test_the_file_comes_before_the_robot_and_this_one_before_the_command_line(
    tmp_path: Path,
) -> None:
    path = tmp_path / "joint_limits.yaml"
    path.write_text(FILE)
    found = timing.joint_limits(NAMES, path, *DEFAULTS)
    assert found.velocity.tolist() == [0.7, 3.0]
    assert found.acceleration.tolist() == [1.4, 4.0]
    assert timing.joint_limits(NAMES, None, *DEFAULTS).velocity.tolist() == [1.0, 3.0]


REFUSED: dict[str, Any] = yaml.safe_load(Path(__file__).with_name("refused_files.yaml").read_text())


@pytest.mark.parametrize(("text", "line"), REFUSED["joint_limits"].items())
def test_bad_files_are_refused_in_one_line(text: str | None, line: str, tmp_path: Path) -> None:
    path = tmp_path / "joint_limits.yaml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(timing.LimitsFileError) as refused:
        timing.joint_limits(NAMES, path, *DEFAULTS)
    assert line in str(refused.value) and "\n" not in str(refused.value)


JOINTS = (Joint("turn", False), Joint("turn_2", False), Joint("slide", True))
Q = [[0.0, 0.5, 0.1], [1.0, -0.5, 0.2], [0.5, 0.0, 0.0]]
DEGREES = [[float(np.degrees(a)), float(np.degrees(b)), 100.0 * c] for a, b, c in Q]


def table(head: str, rows: Any, mark: str = ",", times: bool = False) -> bytes:
    cells = ([k, *row] if times else row for k, row in enumerate(rows))
    return "\n".join([head, *(mark.join(map(str, row)) for row in cells)]).encode()


def message(points: Any, names: Any = ("turn", "turn_2", "slide"), **more: Any) -> dict[str, Any]:
    return {"joint_names": list(names), "points": points, **more}


def of_csv(content: bytes) -> tuple[Any, tuple[str, ...]]:
    return fitted(read_columns(content), JOINTS, "m")


@pytest.mark.parametrize(
    ("head", "rows", "times"),
    [
        ("turn_rad,turn_2_rad,slide_m", Q, False),
        ("time_s,turn_rad,turn_2_rad,slide_m", Q, True),
        ("time,turn,turn_2,slide", Q, True),
        ("t,turn_deg,turn_2 [deg],slide (cm)", DEGREES, True),
        ("time_from_start,turn.position,turn_2/pos,slide_position_m", Q, True),
        ("slide_m,turn_rad,turn_2_rad", [[c, a, b] for a, b, c in Q], False),
        ("turn_rad,gripper,turn_2_rad,slide_m", [[a, 7, b, c] for a, b, c in Q], False),
        ("turn,turn_vel,turn_2,slide", [[a, 9, b, c] for a, b, c in Q], False),
        ("turn,turn_2,turn_2_effort,slide", [[a, b, 9, c] for a, b, c in Q], False),
    ],
)
def test_columns_are_matched_by_name_and_unit(head: str, rows: Any, times: bool) -> None:
    motion, remarks = of_csv(table(head, rows, times=times))
    assert motion.q == pytest.approx(np.array(Q), abs=1e-15)
    assert motion.coefficients is None
    assert "straight lines between the points" in remarks
    unread = next((r.removeprefix("not read: ") for r in remarks if r.startswith("not")), "")
    words = {"gripper": "gripper", "vel": "velocities", "effort": "turn_2_effort"}
    assert unread == next((words[word] for word in words if word in head), "")
    assert any("without a unit" in r for r in remarks) is ("_rad" not in head and "deg" not in head)


@pytest.mark.parametrize("mark", [";", "\t"])
def test_spreadsheets_are_read(mark: str) -> None:
    head = mark.join(("time_s", "turn_rad", "turn_2_rad", "slide_m"))
    content = b"\xef\xbb\xbf" + table(head, Q, mark, times=True)
    assert of_csv(content)[0].q.tolist() == Q


def test_velocities_of_all_joints_make_cubics() -> None:
    head = "time_ms,turn_rad,turn_2_rad,slide_m,turn_rad_per_s,turn_2_velocity,slide_m/s"
    rows = [[1000 * k, *q, 0.5 * k, 0, 0] for k, q in enumerate(Q)]
    motion, remarks = of_csv(table(head, rows))
    assert "cubics between the points, by their velocities" in remarks
    assert motion.coefficients is not None
    assert motion.coefficients[:, 1, 0].tolist() == [0.0, 0.5]
    degrees = table(head.replace("turn_rad_per_s", "turn_deg_per_s"), rows)
    assert of_csv(degrees)[0].coefficients[1, 1, 0] == pytest.approx(np.radians(0.5))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        *((text.encode(), said) for text, said in REFUSED["tables"].items()),
        ("turn,slide\n0,0\n".encode("utf-16"), "line 1: must be text in UTF-8"),
    ],
)
def test_a_table_that_does_not_fit_is_refused(content: bytes, said: str) -> None:
    with pytest.raises((ValueError, TableError), match=said) as caught:
        of_csv(content)
    assert "\n" not in str(caught.value)


def points(**more: Any) -> list[dict[str, Any]]:
    return [{"positions": q, **more} for q in Q]


def read(data: dict[str, Any]) -> tuple[Any, tuple[str, ...]]:
    return fitted(read_message(data), JOINTS, "m")


def test_messages_are_those_of_ros_and_ours() -> None:
    moving = [{"positions": q, "velocities": [0.1 * k] * 3} for k, q in enumerate(Q)]
    ros = [each | {"time_from_start": {"sec": k, "nanosec": 0}} for k, each in enumerate(moving)]
    ours = [each | {"time_from_start": float(k)} for k, each in enumerate(moving)]
    expected, _ = read(message(ours))
    assert expected.coefficients is not None
    wrapped = {"joint_trajectory": message(ros), "multi_dof_joint_trajectory": {}}
    for data in (message(ros), wrapped, {"trajectory": message(ros)}):
        motion, remarks = read(data)
        assert np.array_equal(motion.coefficients, expected.coefficients)
        assert "values without a unit are read in rad and m" in remarks
    other = [{"positions": [c, a, b]} for a, b, c in DEGREES]
    names, units = ("slide", "turn", "turn_2"), ["cm", "deg", "deg"]
    motion, remarks = read(message(other, names, units=units))
    assert motion.q == pytest.approx(np.array(Q), abs=1e-15)
    assert remarks == ("straight lines between the points",)


def test_accelerations_are_told_not_to_be_read() -> None:
    told = read(message(points(accelerations=[0.0, 1.0, 0.0])))[1]
    assert "not read: accelerations" in told
    still = read(message(points(accelerations=[0.0] * 3, effort=[])))[1]
    assert still[-1] == "straight lines between the points"


@pytest.mark.parametrize(("data", "said"), [each.values() for each in REFUSED["messages"]])
def test_a_bad_message_is_refused_by_place(data: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said) as caught:
        read_message(data)
    assert "\n" not in str(caught.value)


def test_yaml_is_read_as_ros_prints_it() -> None:
    text = (
        "header:\n  frame_id: ''\njoint_names:\n- turn\n- turn_2\n- slide\npoints:\n"
        "- positions: [0, 5e-1, 1e-1]\n  time_from_start: {sec: 0, nanosec: 0}\n"
        "- positions: [1.0, -0.5, 0.2]\n  time_from_start: {sec: 1, nanosec: 500000000}\n---\n"
    )
    motion, _ = read(parse_message(text, is_yaml=True))
    assert motion.q.tolist() == Q[:2]
    with pytest.raises(ValueError, match="must hold one message, holds 2"):
        parse_message(text + text, is_yaml=True)
    with pytest.raises(ValueError, match="expected"):
        parse_message("a: [", is_yaml=True)
