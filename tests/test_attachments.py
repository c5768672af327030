"""Files of a condition: identity by content, found again from a log or a stored run alone."""

from pathlib import Path

import pytest

from evoexp import attachments
from evoexp.attachments import MissingFile
from evoexp.batch.jobs import Job, run_jobs
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import reproduce_log
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from evoexp.testing import conditions

MAP = "....\n.##.\n....\n....\n"
GROUPS = ("robot=floor_platform", "scenario=chen", "planner=grid_path_ga", "collision=chen")
OVERRIDES = [*GROUPS, "objective=chen_path_a", "ga=chen_path", "budget=smoke"]
OVERRIDES += ["scenario.size=[4,4]", "scenario.start=[0,0]", "scenario.goal=[3,3]"]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "first.txt"
    path.write_text(MAP)
    return path


def condition_with(path: Path) -> Condition:
    words = (*OVERRIDES, "scenario.obstacles=[]", f"scenario.map={{file: '{path}'}}")
    return next(iter(conditions(*words).values()))


def forget() -> None:
    attachments._contents.clear()


def test_identity_is_that_of_the_content(path: Path, tmp_path: Path) -> None:
    (tmp_path / "other_name.map").write_text(MAP)
    one, same = condition_with(path), condition_with(tmp_path / "other_name.map")
    assert one.id == same.id
    (tmp_path / "other_name.map").write_text(MAP.replace("#", "."))
    assert condition_with(tmp_path / "other_name.map").id != one.id
    assert list(one.files().values()) == [MAP.encode()]


def test_a_log_carries_its_files_and_is_reproduced_from_them(path: Path, tmp_path: Path) -> None:
    content = run_replicate(condition_with(path), 0).content
    assert list(read_log(content).attachments.values()) == [MAP.encode()]
    log = tmp_path / "0000.mcap"
    log.write_bytes(content)
    path.unlink()
    forget()
    assert reproduce_log(log).matches


def test_files_travel_with_jobs(path: Path) -> None:
    condition = condition_with(path)
    job = Job(condition.id, condition.to_json(), 3, tuple(condition.files().values()))
    forget()
    assert not run_jobs([job])[0].reason


def test_a_stored_run_has_its_files(path: Path, tmp_path: Path) -> None:
    condition = condition_with(path)
    run = RunDirectory(tmp_path, condition.id)
    run.create(condition.to_json(), {}, condition.files())
    forget()
    with pytest.raises(MissingFile, match="give the file again"):
        _ = condition.scenario.map.content
    again = Condition.from_json(run.config_json())
    assert again.prepare().problem.fields.grid.free.sum() == 14


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    refusal = r"scenario\.map\.file: must be a file that can be read "
    with pytest.raises(SettingError, match=refusal + ".*, was .*nowhere"):
        condition_with(tmp_path / "nowhere.txt")
    with pytest.raises(SettingError, match=refusal + r"\(is a directory\)"):
        condition_with(tmp_path)
