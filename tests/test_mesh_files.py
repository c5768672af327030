"""Where meshes are looked for: beside a file, in packages, and the message if none is there."""

from pathlib import Path

import pytest

from evoexp.errors import SettingError
from evoexp.mesh_files import mesh_content, package_folders
from evoexp.testing import conditions

ROBOT = (
    '<robot name="r"><link name="a"/><joint name="j" type="continuous"><parent link="a"/>'
    '<child link="b"/><axis xyz="0 0 1"/></joint><link name="b"><collision><geometry>'
    '<mesh filename="package://hand/meshes/part.obj"/></geometry></collision></link></robot>'
)
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
REACH = (
    *("robot=urdf", "scenario=urdf_reach", "planner=posture_es", "ga=corsepius"),
    *("objective=corsepius_reach", "collision=corsepius_spheres"),
)


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
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    other = mesh(tmp_path / "src" / "hands" / "hand_of_others", "other")
    (other / "package.xml").write_text("<package><name>other</name></package>")
    with pytest.raises(SettingError):
        sought(tmp_path / "lab" / "arm.urdf", {})
    package = mesh(tmp_path / "src" / "hands" / "hand_description", "workspace")
    (package / "package.xml").write_text("<package>\n<name> hand </name></package>")
    assert sought(tmp_path / "lab" / "arm.urdf", {}) == b"workspace"
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(package))
    assert sought(tmp_path / "lab" / "arm.urdf", {}) == b"workspace"


def test_the_message_lists_the_places_that_were_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, ros = tmp_path / "lab" / "arm.urdf", tmp_path / "ros"
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(ros))
    with pytest.raises(SettingError) as refusal:
        sought(file, {})
    above = [folder / "hand" / "meshes" / "part.obj" for folder in file.parents]
    for place in [*above, tmp_path / "meshes" / "part.obj", ros / "hand" / "meshes" / "part.obj"]:
        assert str(place) in str(refusal.value)
    assert "robot.packages={NAME: FOLDER}" in str(refusal.value)
    with pytest.raises(SettingError) as refusal:
        sought(file, {"hand": tmp_path})
    assert f"tried {tmp_path / 'meshes' / 'part.obj'};" in str(refusal.value)
    with pytest.raises(SettingError, match=f"tried {tmp_path / 'part.obj'}$"):
        mesh_content("part.obj", tmp_path / "arm.urdf", {}, "robot.path")
    with pytest.raises(SettingError, match="a missing mesh"):
        mesh_content("package://" + 9000 * "x", file, {}, "robot.path")


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
