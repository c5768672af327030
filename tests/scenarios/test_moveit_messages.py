"""Files without a message of MoveIt, with several, or with fields that would be lost."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from test_moveit import document, mesh

from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.numeric.convex_hull import hull_of
from evoexp.planners.moveit_tasks import arm_motion, links_of_bodies, with_allowed_pairs
from evoexp.scenarios.moveit_messages import FIELDS, REQUEST, SCENE
from evoexp.scenarios.moveit_scene import read_allowed, read_state, read_world
from evoexp.testing import conditions
from moveit_samples import COVERED, body, request, scene, write_problem, write_robot

TEXT = yaml.safe_dump(scene(body("sphere", [0.1], [3, 0, 0])))
TEXT_FORMAT = (
    b"(noname)\n* box\n0.5 0 0.5\n0 0 0 1\n1\nbox\n0.1 0.2 0.3\n0 0 0\n0 0 0 1\n0 0 0 0\n0\n.\n"
)
OTHERS = {
    "an empty file": b" \n",
    "nothing": b"# a comment\n---\n",
    "a stream of 2": f"---\n{TEXT}---\n{TEXT}---\n".encode(),
    r"MoveIt's text format \(.scene\)": TEXT_FORMAT,
    r"text format \(.scene\)": b"(noname)\r\n.\r\n",
    "a bag": b"#ROSBAG V2.0\n",
    r"'a bag'; play it": b"SQLite format 3\0\x10",
    r"'a bag'; play it: ros2 topic echo": b"\x89MCAP0\r\n",
    "a pointer of Git LFS": b"version https://git-lfs.github.com/spec/v1\noid sha256:12\n",
    "an HTML page": b"\n<!DOCTYPE html>\n<html>",
    "an octomap": b"# Octomap OcTree binary file\nid OcTree\n",
    "XML": b"<robot name='a'/>",
    "a compressed file": b"\x1f\x8b\x08\0",
    "a binary file": b"\x07abc\0",
    "the key 'world' twice in the mapping at line 1": b"world: {}\nworld: {}\n",
    "a MotionPlanRequest": yaml.safe_dump(request()).encode(),
    "one below 'scene'": yaml.safe_dump({"scene": scene()}).encode(),
    r"one with '...'.*; ros2 topic echo --once --full-length": b"name: a\nworld: ['...']\n",
    "one with '<sequence type": b"name: '<sequence type: double, length: 9>'\n",
}


@pytest.mark.parametrize("named", OTHERS)
def test_other_files_are_named(named: str) -> None:
    with pytest.raises(SettingError, match=f"^scenario.scene: must be .*, was .*{named}") as caught:
        document(OTHERS[named])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        f"---\n{TEXT}---\n",
        f"\ufeff{TEXT}",
        json.dumps(yaml.safe_load(TEXT), indent="\t"),
        TEXT.replace("\n", "\r\n"),
    ],
    ids=["topic echo", "byte order mark", "JSON with tabs", "ends of lines"],
)
def test_one_message_is_taken_however_it_is_written(text: str) -> None:
    assert document(text.encode()).value == yaml.safe_load(TEXT)


def test_the_command_line_names_the_file_and_ends_with_2(tmp_path: Path) -> None:
    words = [*write_robot(tmp_path), *write_problem(tmp_path, scene()), *COVERED]
    (tmp_path / "scene0001.yaml").write_bytes(TEXT_FORMAT)
    command = [sys.executable, "-m", "evoexp", "show", *words]
    run = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    (line,) = run.stderr.strip().splitlines()
    assert run.returncode == 2
    assert f"scenario.scene: {tmp_path / 'scene0001.yaml'}: must be YAML" in line


def test_messages_are_made_of_messages_that_are_known() -> None:
    uses = {use for fields in FIELDS.values() for use in fields.values()}
    reached = uses & FIELDS.keys() | {SCENE, REQUEST}
    assert reached == set(FIELDS)
    words = {use.partition(":")[0] for use in uses - FIELDS.keys()}
    assert words == {"read", "left out", "noted", "refused"}


def changed(plain: Any, path: str) -> Any:
    """Return a copy of plain data with a field that nobody knows at a path of keys and numbers."""
    plain = json.loads(json.dumps(plain))
    place = plain
    for key in path.split():
        place = place[int(key)] if key.isdigit() else place[key]
    place["colour"] = "red"
    return plain


WHOLE = scene(
    body("sphere", [0.1], [3, 0, 0], header={"frame_id": "world"}, pose={"position": {"x": 1}}),
    fixed_frame_transforms=[{"header": {}, "child_frame_id": "world", "transform": {}}],
    robot_state={"joint_state": {"name": []}, "multi_dof_joint_state": {"transforms": [{}]}},
)


@pytest.mark.parametrize(
    "path",
    [
        "",
        "world",
        "world collision_objects 0",
        "world collision_objects 0 header",
        "world collision_objects 0 pose",
        "world collision_objects 0 pose position",
        "world collision_objects 0 primitives 0",
        "world collision_objects 0 primitive_poses 0",
        "fixed_frame_transforms 0",
        "fixed_frame_transforms 0 transform",
        "robot_state",
        "robot_state joint_state",
        "robot_state multi_dof_joint_state transforms 0",
    ],
)
def test_a_field_that_no_message_has_is_refused_wherever_it_stands(path: str) -> None:
    place = "".join(f"[{k}]" if k.isdigit() else f".{k}" for k in [*path.split(), "colour"])
    with pytest.raises(SettingError, match="must be made of the fields of") as caught:
        document(changed(WHOLE, path))
    assert f"was '{place.lstrip('.')}'" in str(caught.value)


def test_a_slip_in_a_name_is_told_its_nearest() -> None:
    with pytest.raises(SettingError, match="did you mean 'collision_objects'") as caught:
        document({"world": {"colision_objects": []}})
    assert "was 'world.colision_objects'" in str(caught.value)


def read(plain: Any) -> None:
    file = document(plain)
    read_state(file["robot_state"])
    read_allowed(file)
    read_world(file, None)


def matrix(*rows: list[bool]) -> dict[str, Any]:
    names = ["a", "b", "a"][: len(rows)]
    return {"allowed_collision_matrix": {"entry_names": names, "entry_values": list(rows)}}


UNFIT = {
    r"symmetric .*, was \"two values of '.' and '.'\"": matrix([False, True], [False, False]),
    r"symmetric": matrix([False, True, False], [True, False, False], [False, False, False]),
    r"one position of 'j' at robot_state.joint_state, was \[1.0, 2.0\]": {
        "robot_state": {"joint_state": {"name": ["j", "j"], "position": [1, 2]}}
    },
    r"1 numbers at 'thing'.primitives\[0\].dimensions, was 3": scene(
        body("sphere", [0.1, 0, 0], [0, 0, 0])
    ),
    r"2 numbers at 'thing'.primitives\[0\].dimensions, was 1": scene(
        body("cone", [0.1], [0, 0, 0])
    ),
    r"3 numbers at 'thing'.primitives\[0\].dimensions, was 2": scene(
        body("box", [0.1, 0.2], [0, 0, 0])
    ),
    r"3 numbers at 'thing'.primitive_poses\[0\].position, was 2": scene(
        body("sphere", [0.1], [0, 0])
    ),
    r"primitives that are box, .*, was \"'thing', a none\"": scene(body(None, [1], [0, 0, 0])),
    r"primitives that are box, .*, was \"'thing', a true\"": scene(body(True, [1], [0, 0, 0])),
    r"primitives that are box, .*, was \"'thing', a 7\"": scene(body(7, [1], [0, 0, 0])),
    r"primitives that are box, .*, was \"'thing', a \[1\]\"": scene(body([1], [1], [0, 0, 0])),
    r"objects with a body each, was \"'x' without one\"": scene({"id": "x"}),
    r"operation ADD \(0\), was 'MOVE'": scene(body(2, [1], [0, 0, 0], operation=3)),
    r"operation ADD \(0\), was 'APPEND'": scene(body(2, [1], [0, 0, 0], operation="\2")),
    r"operation ADD \(0\), was 9": scene(body(2, [1], [0, 0, 0], operation=9)),
    r"a pose per primitive of 'thing' \(1\), was 2": scene(
        body(2, [1], [0, 0, 0], primitive_poses=[{}, {}])
    ),
}


@pytest.mark.parametrize("named", UNFIT)
def test_parts_that_do_not_fit_each_other_are_refused(named: str) -> None:
    with pytest.raises(SettingError, match=named):
        read(UNFIT[named])


def test_quaternions_are_normalised_within_a_hundredth_and_refused_beyond() -> None:
    def turned(length: float) -> Any:
        half = float(np.sqrt(0.5)) * length
        pose = {"orientation": [0, 0, half, half]}
        thing = body("box", [0.1, 0.2, 0.3], [1, 0, 0], pose=pose)
        return read_world(document(scene(thing)), None).obstacles[0]

    for length in (0.9901, 0.995, 1.005, 1.0099):
        assert np.allclose(turned(length).center, [0.0, 1.0, 0.0], atol=1e-12)
        assert np.allclose(turned(length).rotation, [0.0, 0.0, 90.0], atol=1e-9)
    for length in (0.98, 1.02):
        with pytest.raises(
            SettingError, match=f"quaternions of length 1 at 'thing'.pose.orientation, was {length}"
        ):
            turned(length)


def problem(folder: Path, message: Any, asked: Any = None, *words: str) -> Condition:
    given = [*write_robot(folder), *write_problem(folder, message, asked), *COVERED, *words]
    (found,) = conditions(*given).values()
    return found


def test_a_matrix_speaks_of_links_not_of_names_that_are_like_theirs(tmp_path: Path) -> None:
    """`lower_1` is a link of its own, not a body of `lower`."""
    write_robot(tmp_path)
    text = (tmp_path / "small.urdf").read_text()
    (tmp_path / "small.urdf").write_text(text.replace('"tip"', '"lower_1"'))
    words = [*write_problem(tmp_path, scene(**ALLOWED)), *COVERED, "robot=urdf"]
    (found,) = conditions(*words, f"robot.path={tmp_path / 'small.urdf'}").values()
    built = found.robot.build()  # type: ignore[attr-defined]
    assert links_of_bodies(built)["lower_1"] == "lower_1"
    disabled = with_allowed_pairs(built, found.scenario).disabled  # type: ignore[arg-type]
    assert disabled == {frozenset(("base", "lower"))}


ALLOWED = {
    "allowed_collision_matrix": {
        "entry_names": ["base", "lower"],
        "entry_values": [[False, True], [True, False]],
    }
}


def test_parts_that_are_left_out_and_may_matter_are_noted(tmp_path: Path) -> None:
    assert not [note for note in problem(tmp_path, scene()).notes() if "left out" in note]
    asked = request(max_velocity_scaling_factor=0.1, max_acceleration_scaling_factor=1.0)
    message = scene(is_diff=True) | {"robot_model_name": "tall"}
    notes = problem(tmp_path, message, asked).notes()
    assert "the scene is a change of another (is_diff): it is taken as it is" in notes
    assert "the scene is of the robot 'tall', the robot is 'small'" in notes
    left = "left out of the request: max_velocity_scaling_factor (export has its own limits)"
    assert left in notes


def named_mesh(name: str, **more: Any) -> dict[str, Any]:
    return {"id": "part", "meshes": [{"resource": name, **more}], "mesh_poses": [{}]}


def test_meshes_that_a_scene_names_are_found_as_a_urdf_s(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    corners, triangles = hull_of(np.random.default_rng(0).normal(size=(8, 3))) or (0, 0)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(corners).tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (np.asarray(triangles) + 1).tolist()]
    package = tmp_path / "parts-1.0" / "meshes"
    package.mkdir(parents=True)
    (package / "part.obj").write_text("\n".join(lines))
    far = {"pose": {"position": [5, 0, 0]}}
    inside = mesh(np.asarray(corners) * 2.0, triangles) | {"id": "part"} | far

    def points(found: Condition) -> Any:
        built = found.robot.build()  # type: ignore[attr-defined]
        (hull,) = arm_motion(built, found.scenario).obstacles  # type: ignore[arg-type]
        assert np.allclose(hull.center, [5, 0, 0])  # type: ignore[union-attr]
        return np.array(sorted(hull.points))  # type: ignore[union-attr]

    expected = points(problem(tmp_path, scene(inside)))
    by_package = scene(named_mesh("package://parts/meshes/part.obj", dimensions=[2, 2, 2]) | far)
    with pytest.raises(SettingError, match=r"a missing mesh 'package://parts.*; tried "):
        problem(tmp_path, by_package)
    where = f"packages={{parts: '{package.parent}'}}"
    for word in (f"robot.{where}", f"scenario.{where}"):
        found = problem(tmp_path, by_package, None, word)
        assert np.allclose(points(found), expected, atol=1e-6)
    again = Condition.from_json(found.to_json())  # the mesh travels with the condition
    assert again.id == found.id and len(again.scenario.meshes) == 1  # type: ignore[attr-defined]
    (tmp_path / "ros").mkdir()
    (tmp_path / "ros" / "parts").symlink_to(package.parent)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ros"))
    assert problem(tmp_path, by_package).id == found.id
    by_path = scene(named_mesh(f"file://{package / 'part.obj'}", dimensions=[2, 2, 2]) | far)
    assert np.allclose(points(problem(tmp_path, by_path)), expected, atol=1e-6)
    (package / "part.obj").write_text("no mesh")
    with pytest.raises(SettingError, match=r"scenario\.scene: .*part\.obj"):
        problem(tmp_path, by_path).prepare()


def test_the_start_of_the_request_comes_before_the_state_of_the_scene(tmp_path: Path) -> None:
    joints = {"name": ["turn", "nail"], "position": [0.7, 0.2]}
    asked = request()
    asked["start_state"]["joint_state"] = {"name": ["turn"], "position": [0.1]}
    found = problem(tmp_path, scene(robot_state={"joint_state": joints}), asked)
    assert found.scenario.state == {"turn": 0.1, "nail": 0.2}  # type: ignore[attr-defined]
