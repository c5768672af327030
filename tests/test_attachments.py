"""Files of a condition: identity by content, found again from a log or a stored run alone."""

from pathlib import Path

import pytest

from evoexp import attachments
from evoexp.attachments import MissingFile, mesh_content, package_folders
from evoexp.batch.jobs import Job, run_jobs
from evoexp.batch.replicate import run_replicate
from evoexp.batch.reproduction import reproduce_log
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory
from evoexp.testing import conditions
from robots.robot_samples import REACH

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


# Where meshes are looked for: beside a file, in packages, and the message if none is there

ROBOT = (
    '<robot name="r"><link name="a"/><joint name="j" type="continuous"><parent link="a"/>'
    '<child link="b"/><axis xyz="0 0 1"/></joint><link name="b"><collision><geometry>'
    '<mesh filename="package://hand/meshes/part.obj"/></geometry></collision></link></robot>'
)
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def mesh(folder: Path, text: str = TETRAHEDRON) -> Path:
    (folder / "meshes").mkdir(parents=True)
    (folder / "meshes" / "part.obj").write_text(text)
    return folder


@pytest.fixture(autouse=True)
def no_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)


def sought(file: Path, packages: dict[str, Path]) -> bytes:
    return mesh_content("package://hand/meshes/part.obj", file, packages, "robot.path")


def test_the_setting_precedes_folders_above_which_precede_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "lab" / "urdf" / "arm.urdf"
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"/nowhere:{tmp_path / 'ros'}")
    mesh(tmp_path / "ros" / "hand", "ros")
    assert sought(file, {}) == b"ros"
    mesh(tmp_path / "lab" / "hand", "above")
    assert sought(file, {}) == b"above"
    mesh(tmp_path / "hand-1.0", "setting")
    assert sought(file, {"hand": tmp_path / "hand-1.0"}) == b"setting"


def test_packages_of_a_workspace_go_by_the_names_in_their_manifests(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "lab" / "arm.urdf"
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    for name, folder in (("other", "hand_of_others"), (" hand ", "hand_description")):
        with pytest.raises(SettingError):
            sought(file, {})
        package = mesh(tmp_path / "src" / "hands" / folder, "workspace")
        (package / "package.xml").write_text(f"<package>\n<name>{name}</name></package>")
    assert sought(file, {}) == b"workspace"
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(package))
    assert sought(file, {}) == b"workspace"


def test_the_message_lists_the_places_that_were_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, ros, part = tmp_path / "lab" / "arm.urdf", tmp_path / "ros", "meshes/part.obj"
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(ros))
    with pytest.raises(SettingError) as refusal:
        sought(file, {})
    folders = [*(folder / "hand" for folder in file.parents), tmp_path, ros / "hand"]
    assert all(f"{folder / part}" in str(refusal.value) for folder in folders)
    assert "robot.packages={NAME: FOLDER}" in str(refusal.value)
    for name, packages, message in (
        (f"package://hand/{part}", {"hand": tmp_path}, f"tried {tmp_path / part};"),
        ("part.obj", {}, f"tried {file.with_name('part.obj')}$"),
        ("package://" + 9000 * "x", {}, "a missing mesh"),
    ):
        with pytest.raises(SettingError, match=message):
            mesh_content(name, file, packages, "robot.path")


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("hand", "robot.packages: must be folders of packages by their names"),
        ({"hand": "/nowhere"}, "robot.packages.hand: must be the folder of the package 'hand'"),
        ({"hand": 3}, "robot.packages.hand: must be the folder"),
    ],
)
def test_settings_that_are_no_packages(setting: object, message: str) -> None:
    with pytest.raises(SettingError, match=message):
        package_folders(setting, "robot.packages")


def test_where_a_package_lies_is_no_part_of_the_identity(tmp_path: Path) -> None:
    (tmp_path / "lab").mkdir()
    file = tmp_path / "lab" / "arm.urdf"
    file.write_text(ROBOT)
    ids = set()
    for place in ("lab/hand", "one", "two"):
        packages = f"robot.packages={{hand: {mesh(tmp_path / place)}}}"
        words = (*REACH, f"robot.path={file}", *([packages] if "/" not in place else []))
        (condition,) = conditions(*words).values()
        ids.add(condition.id)
    assert len(ids) == 1
    two = ("robot=two_urdf", *REACH[1:], f"robot.path={file}", packages)
    (condition,) = conditions(*two).values()
    meshes = [arm["meshes"] for arm in condition.robot.canonical()["arms"]]
    assert len(meshes) == 2
