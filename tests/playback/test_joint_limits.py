from pathlib import Path

import numpy as np
import pytest

from evoexp.playback.joint_limits import LimitsFileError, joint_limits

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
    found = joint_limits(NAMES, path, *DEFAULTS)
    assert found.velocity.tolist() == [0.7, 3.0]
    assert found.acceleration.tolist() == [1.4, 4.0]
    assert joint_limits(NAMES, None, *DEFAULTS).velocity.tolist() == [1.0, 3.0]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("joint_limits: [1, 2]", "must map joints under 'joint_limits', as MoveIt's file, was "),
        ("- 1", "must map joints under 'joint_limits', as MoveIt's file, was "),
        ("joint_limits: {a: 1}", "must map joints under 'joint_limits', as MoveIt's file, was "),
        ("a: {b", "must be YAML, was "),
        ("!!python/object/apply:os.system [ls]", "must be YAML, was "),
        (
            "joint_limits: {elbo: {max_velocity: 1}}",
            "must name joints of the robot (shoulder, elbow), was elbo; did you mean 'elbow'?",
        ),
        (
            "joint_limits: {elbo: {max_velocity: 1}, wrist: {max_velocity: 1}}",
            "(shoulder, elbow), was elbo, wrist; did you mean 'elbow'?",
        ),
        (
            "joint_limits: {elbow: {max_velocity: 0}}",
            "joint_limits.elbow.max_velocity must be a number above 0, was 0",
        ),
        (
            "joint_limits: {elbow: {max_velocity: -1}}",
            "joint_limits.elbow.max_velocity must be a number above 0, was -1",
        ),
        (
            "joint_limits: {elbow: {has_acceleration_limits: true}}",
            "joint_limits.elbow.max_acceleration must be a number above 0, was None",
        ),
        (
            "joint_limits: {elbow: {max_velocity: .nan}}",
            "joint_limits.elbow.max_velocity must be a number above 0, was nan",
        ),
    ],
)
def test_bad_files_are_refused_in_one_line(text: str, line: str, tmp_path: Path) -> None:
    path = tmp_path / "joint_limits.yaml"
    path.write_text(text)
    with pytest.raises(LimitsFileError) as refused:
        joint_limits(NAMES, path, *DEFAULTS)
    assert line in str(refused.value) and "\n" not in str(refused.value)


def test_a_missing_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(LimitsFileError, match="must be a file that can be read"):
        joint_limits(NAMES, tmp_path / "none.yaml", *DEFAULTS)
