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


MAPPING = "must map joints under 'joint_limits', as MoveIt's file, was "
LIMIT = "joint_limits.elbow.max_{} must be a number above 0, was {}"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (None, "must be a file that can be read"),
        ("joint_limits: [1, 2]", MAPPING),
        ("- 1", MAPPING),
        ("joint_limits: {a: 1}", MAPPING),
        ("a: {b", "must be YAML, was "),
        ("!!python/object/apply:os.system [ls]", "must be YAML, was "),
        (
            "joint_limits: {elbo: {max_velocity: 1}, wrist: {max_velocity: 1}}",
            "joints of the robot (shoulder, elbow), was elbo, wrist; did you mean 'elbow'?",
        ),
        ("joint_limits: {elbow: {max_velocity: 0}}", LIMIT.format("velocity", "0")),
        ("joint_limits: {elbow: {max_velocity: .nan}}", LIMIT.format("velocity", "nan")),
        (
            "joint_limits: {elbow: {has_acceleration_limits: true}}",
            LIMIT.format("acceleration", "None"),
        ),
    ],
)
def test_bad_files_are_refused_in_one_line(text: str | None, line: str, tmp_path: Path) -> None:
    path = tmp_path / "joint_limits.yaml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(LimitsFileError) as refused:
        joint_limits(NAMES, path, *DEFAULTS)
    assert line in str(refused.value) and "\n" not in str(refused.value)
