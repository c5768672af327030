import csv
import io
import json

import numpy as np
import pytest
import scipy
from playback_samples import SAMPLES, recording

from evoexp.paths.motion import Motion, clamped_cubic
from evoexp.playback.optimal_timing import along_curve, along_lines
from evoexp.playback.recording import Recording
from evoexp.playback.timing import SpeedLimits
from evoexp.playback.trajectory import as_csv, as_json, trajectory

LIMITS = SpeedLimits()
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
    found = trajectory(shown, "uniform", LIMITS, 0.5)
    instants = np.linspace(0.0, shown.motion.num_segments, 301)
    truth = np.array([shown.motion.at(t) for t in instants])
    assert np.allclose(executed(*found[2:], instants * shown.seconds), truth, atol=1e-9)
    assert (found.velocities is None) == (shown.motion.coefficients is None)


def test_both_formats_say_the_same() -> None:
    shown = recording("co-evolution")
    found = trajectory(shown, "uniform", LIMITS, 0.5)
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
    assert trajectory(shown, "uniform", LIMITS, 0.5).units == ("unit", "unit")


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
