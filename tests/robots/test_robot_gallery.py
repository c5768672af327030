"""Every robot of the gallery loads, is covered, plans a reach with two planners, is certified."""

import os
import shutil
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest

from evoexp.attachments import PREFIX
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import reproduce_log
from evoexp.errors import EvoexpError
from evoexp.robots.robot_data import ROBOT_DATA, robot_file
from evoexp.robots.urdf import Urdf
from evoexp.store.log_reader import read_log
from robot_gallery import (
    POSTURES,
    ROBOTS,
    GalleryRobot,
    find_reach,
    planned_reach,
)


def is_installed() -> bool:
    try:
        return bool(distribution(ROBOT_DATA))
    except PackageNotFoundError:
        return False


needs_robots = pytest.mark.skipif(
    not is_installed(), reason="needs the robots: pip install 'evoexp[robots]'"
)


@pytest.mark.matrix
@needs_robots
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_a_reach_is_planned_and_certified(robot: GalleryRobot) -> None:
    found = planned_reach(robot)
    _, problem = found.reach.postures.prepare()
    assert problem.bodies.num_shapes > 0
    assert found.postures is not None
    assert found.strings is not None


@pytest.mark.matrix
@needs_robots
def test_logs_reproduce_without_the_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reach = find_reach(ROBOTS[0])
    content = run_replicate(reach.postures, 0).content
    assert any(name.startswith(PREFIX) for name in read_log(content).attachments)
    log = tmp_path / "0000.mcap"
    log.write_bytes(content)

    def nothing(*_: object) -> None:
        raise AssertionError("a log names no files")

    monkeypatch.setattr("evoexp.attachments._contents", {})
    monkeypatch.setattr("evoexp.robots.robot_data.robot_file", nothing)
    monkeypatch.setattr("evoexp.robots.urdf.file_content", nothing)
    assert reproduce_log(log).matches


@pytest.mark.matrix
@needs_robots
def test_a_run_is_reproduced_when_its_robot_is_gone(tmp_path: Path) -> None:
    """By commands in processes of their own, which share nothing but what is stored."""
    urdf = Path(robot_file(f"{ROBOT_DATA}:ur_description/urdf/ur5_robot.urdf", "robot.path"))
    robots = tmp_path / ROBOT_DATA / "robots"  # as meshes are named in the file
    shutil.copytree(urdf.parents[1], robots / "ur_description")
    copy = robots / "ur_description" / "urdf" / urdf.name
    words = (f"robot.path={copy}", "robot=urdf", "budget=smoke", "num_replicates=1")
    _evoexp(tmp_path, "run", *words, *POSTURES, "runner=serial", "--no-report")
    (run,) = (tmp_path / "outputs" / "runs").iterdir()
    shutil.rmtree(robots)
    assert "MATCH" in _evoexp(tmp_path, "reproduce", run.name).splitlines()[-1]


def _evoexp(place: Path, *words: str) -> str:
    """Run a command; return what it says."""
    around = os.environ | {"EVOEXP_OUTPUTS": str(place / "outputs")}
    done = subprocess.run(
        [sys.executable, "-m", "evoexp", *words], env=around, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_name_of_the_package_is_refused_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise PackageNotFoundError(name)

    monkeypatch.setattr("evoexp.robots.robot_data.distribution", missing)
    with pytest.raises(EvoexpError) as found:
        Urdf.read_files({"path": f"{ROBOT_DATA}:ur5.urdf"}, "robot")
    assert "pip install 'evoexp[robots]'" in str(found.value)


@needs_robots
def test_a_name_that_the_package_does_not_have_is_refused() -> None:
    with pytest.raises(EvoexpError) as found:
        Urdf.read_files({"path": f"{ROBOT_DATA}:z1_description/urdf/z2.urdf"}, "robot")
    assert "did you mean 'z1_description/urdf/z1.urdf'?" in str(found.value)
    with pytest.raises(EvoexpError):
        Urdf.read_files({"path": f"{ROBOT_DATA}:../../../../x.urdf"}, "robot")
