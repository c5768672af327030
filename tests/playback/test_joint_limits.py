from pathlib import Path

import numpy as np
import pytest
import yaml

from evoexp.playback.trajectory import LimitsFileError, joint_limits

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


REFUSED: dict[str | None, str] = yaml.safe_load(
    Path(__file__).with_name("refused_files.yaml").read_text()
)["joint_limits"]


@pytest.mark.parametrize(("text", "line"), REFUSED.items())
def test_bad_files_are_refused_in_one_line(text: str | None, line: str, tmp_path: Path) -> None:
    path = tmp_path / "joint_limits.yaml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(LimitsFileError) as refused:
        joint_limits(NAMES, path, *DEFAULTS)
    assert line in str(refused.value) and "\n" not in str(refused.value)
