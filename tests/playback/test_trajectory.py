import csv
import io
import json

import numpy as np
import pytest
import scipy

from evoexp.paths.motion import Motion, clamped_cubic
from evoexp.playback.joint_limits import JointLimits
from evoexp.playback.optimal_timing import along_curve, along_lines
from evoexp.playback.recording import Recording
from evoexp.playback.timing import SpeedLimits
from evoexp.playback.trajectory import (
    BadTiming,
    Timing,
    Trajectory,
    as_csv,
    as_json,
    as_ros,
    trajectory,
)
from playback_samples import SAMPLES, recording, refuted


def limits_of(shown: Recording, jerk: float = np.inf) -> JointLimits:
    """Return the limits that the command takes where nothing else is said."""
    prismatic = np.array([joint.prismatic for joint in shown.joints])
    speeds = SpeedLimits().of(prismatic, shown.size)
    return JointLimits(speeds, speeds / 0.5, np.full(len(speeds), jerk))


PATH = np.array([[0.0, 0.0], [1.0, -0.5], [1.0, -0.5], [1.01, -0.5], [0.0, 2.0]])


def executed(
    times: np.ndarray, positions: np.ndarray, velocities: np.ndarray | None, at: np.ndarray
) -> np.ndarray:
    """Return what a controller makes of the points."""
    if velocities is None:
        return np.stack([np.interp(at, times, column) for column in positions.T], axis=1)
    return scipy.interpolate.CubicHermiteSpline(times, positions, velocities)(at)


@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_a_controller_executes_the_very_motion_that_was_judged(name: str) -> None:
    shown = recording(name)
    found = trajectory(shown, "uniform", limits_of(shown))
    instants = np.linspace(0.0, shown.motion.num_segments, 301)
    truth = np.array([shown.motion.at(t) for t in instants])
    assert np.allclose(
        executed(found.times, found.positions, found.velocities, instants * shown.seconds),
        truth,
        atol=1e-9,
    )
    assert (found.velocities is None) == (shown.motion.coefficients is None)


def test_both_formats_say_the_same() -> None:
    shown = recording("co-evolution")
    found = trajectory(shown, "uniform", limits_of(shown))
    data = json.loads(as_json(shown, found))
    rows = list(csv.reader(io.StringIO(as_csv(found).decode())))
    assert data["joint_names"] == [joint.name for joint in shown.joints]
    assert data["interpolation"] == "cubic"
    assert rows[0][:2] == ["time_s", f"{shown.joints[0].name}_rad"]
    for point, row in zip(data["points"], rows[1:], strict=True):
        assert [point["time_from_start"], *point["positions"], *point["velocities"]] == [
            float(cell) for cell in row
        ]


def test_sliding_joints_have_the_unit_of_the_scene() -> None:
    shown: Recording = recording("grid")
    assert trajectory(shown, "uniform", limits_of(shown)).units == ("unit", "unit")


def check_limits(
    times: np.ndarray, positions: np.ndarray, velocities: np.ndarray, slack: float
) -> None:
    curve = scipy.interpolate.CubicHermiteSpline(times, positions, velocities)
    at = np.linspace(0.0, times[-1], 20001)
    assert np.abs(curve(at, 1)).max() <= 0.5 * (1.0 + slack)
    assert np.abs(curve(at, 2)).max() <= 1.0 * (1.0 + slack)
    assert not velocities[0].any() and np.abs(velocities[-1]).max() < 1e-9


def test_optimal_lines_keep_the_limits_stay_on_the_lines_and_could_not_be_faster() -> None:
    times, positions, velocities = along_lines(Motion(PATH), np.full(2, 0.5), np.full(2, 1.0))
    assert (np.diff(times) > 0.0).all()
    check_limits(times, positions, velocities, 1e-9)
    at = scipy.interpolate.CubicHermiteSpline(times, positions, velocities)(
        np.linspace(0.0, times[-1], 2001)
    )
    ends = np.stack([PATH[:-1], PATH[1:]], axis=1)
    offsets = []
    for a, b in ends[[0, 2, 3]]:
        along = np.clip((at - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        offsets.append(np.linalg.norm(at - a - along[:, None] * (b - a), axis=1))
    assert np.min(offsets, axis=0).max() < 1e-9
    longest = [
        1.0,
        0.01,
        2.5,
    ]  # [rad] of the joint that takes longest: to full speed in 0.5 s over 0.125 rad
    truth = [2.0 * np.sqrt(way) if way < 0.25 else way / 0.5 + 0.5 for way in longest]
    assert times[-1] == pytest.approx(sum(truth), rel=1e-9)


def test_optimal_lines_of_a_motion_that_stands_still() -> None:
    times, positions, velocities = along_lines(Motion(np.ones((3, 2))), np.ones(2), np.ones(2))
    assert times.tolist() == [0.0, 1.0]
    assert positions.tolist() == [[1.0, 1.0]] * 2
    assert not velocities.any()


def test_optimal_curves_keep_the_limits_and_are_faster_than_uniform_ones() -> None:
    pytest.importorskip("toppra", reason="needs toppra, from evoexp[timing]")
    motion = clamped_cubic(PATH[[0, 1, 4]])
    found = along_curve(motion, np.full(2, 0.5), np.full(2, 1.0))
    assert found is not None
    times, positions, velocities = found
    assert np.abs(velocities).max() <= 0.5 * 1.001
    assert np.abs(np.diff(velocities, axis=0) / np.diff(times)[:, None]).max() <= 1.0 * 1.001
    assert np.abs(velocities[[0, -1]]).max() < 1e-9
    truth = np.array([motion.at(t) for t in np.linspace(0.0, 2.0, 4001)])
    assert max(np.linalg.norm(truth - point, axis=1).min() for point in positions) < 1e-3
    assert np.allclose(positions[[0, -1]], motion.q[[0, -1]], atol=1e-6)


def sampled_rates(found: Trajectory) -> list[np.ndarray]:
    """Return the rates of the polynomials that a controller puts between the points, sampled."""
    ends = [found.positions, found.velocities]
    if found.interpolation == "quintic":
        ends.append(np.zeros_like(found.positions))
    rows = np.stack([end for end in ends if end is not None], axis=1)
    curve = scipy.interpolate.BPoly.from_derivatives(found.times, rows)
    shares = np.linspace(1e-6, 1.0 - 1e-6, 41)  # from within: at the points accelerations jump
    at = (found.times[:-1, None] + np.diff(found.times)[:, None] * shares).ravel()
    return [np.abs(curve(at, order)).max(axis=0) for order in (1, 2, 3)]


@pytest.mark.parametrize("timing", ["rest", "optimal"])
@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_every_limit_is_kept_from_rest_to_rest(name: str, timing: Timing) -> None:
    shown = recording(name)
    if timing == "optimal":
        pytest.importorskip("toppra", reason="needs toppra, from evoexp[timing]")
    limits = limits_of(shown, 4.0 if timing == "rest" else np.inf)
    found = trajectory(shown, timing, limits)
    assert (np.diff(found.times) > 0.0).all()
    assert found.velocities is not None
    assert not found.velocities[[0, -1]].any()
    assert np.allclose(found.positions[[0, -1]], shown.motion.q[[0, -1]], atol=1e-12)
    sampled, stated = sampled_rates(found), found.rates()
    orders = 3 if found.interpolation == "quintic" else 2
    for rate, said, limit in list(zip(sampled, stated, limits, strict=True))[:orders]:
        assert (rate <= limit * (1.0 + 1e-6)).all()
        assert np.allclose(rate, said, rtol=1e-2, atol=1e-12)
    assert found.verdict.certified == shown.verdict.certified
    if shown.verdict.certified_margin:
        assert found.verdict.certified_margin


def test_at_rest_on_lines_what_ignores_accelerations_keeps_the_limits_too() -> None:
    shown = recording("two arms")
    limits = limits_of(shown)
    found = trajectory(shown, "rest", limits)
    assert found.interpolation == "quintic"
    rates = sampled_rates(found._replace(interpolation="cubic"))
    assert (rates[0] <= limits.velocity * (1.0 + 1e-9)).all()
    assert (rates[1] <= limits.acceleration * (1.0 + 1e-9)).all()


def test_rounded_corners_are_faster_than_stops_at_them() -> None:
    pytest.importorskip("toppra", reason="needs toppra, from evoexp[timing]")
    shown = recording("two arms")
    rounded = trajectory(shown, "optimal", limits_of(shown))
    stopping = trajectory(shown, "optimal", limits_of(shown), blend=False)
    assert rounded.num_corners > 0 and stopping.num_corners == 0
    assert rounded.times[-1] < 0.8 * stopping.times[-1]


def test_a_refuted_motion_is_not_rounded() -> None:
    shown = refuted()
    assert shown.verdict.certified is False
    found = trajectory(shown, "optimal", limits_of(shown))
    assert found.num_corners == 0 and found.verdict == shown.verdict


def test_ros_reads_the_message() -> None:
    rosbags = pytest.importorskip("rosbags.typesys", reason="needs rosbags")
    store = rosbags.get_typestore(rosbags.Stores.ROS2_JAZZY)
    shown = recording("two arms")
    found = trajectory(shown, "rest", limits_of(shown))
    data = json.loads(as_ros(found))
    types = store.types
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
    assert again.joint_names == [joint.name for joint in shown.joints]
    times = [p.time_from_start.sec + 1e-9 * p.time_from_start.nanosec for p in again.points]
    assert np.allclose(times, found.times, atol=1e-9)
    assert np.array_equal([p.positions for p in again.points], found.positions)
    assert all(len(p.accelerations) == len(again.joint_names) for p in again.points)


def test_ros_has_no_other_unit_than_the_metre() -> None:
    shown = recording("grid")
    with pytest.raises(
        BadTiming, match=r"^--format ros: joints that slide must do so in m, was unit$"
    ):
        as_ros(trajectory(shown, "rest", limits_of(shown)))
