"""Files without a message of MoveIt, with several, or with fields that would be lost."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.numeric.convex_hull import hull_of
from evoexp.planners.arm_tasks import links_of_bodies, with_allowed_pairs
from evoexp.scenarios.moveit_files import FIELDS, REQUEST, SCENE
from evoexp.testing import conditions
from moveit_samples import (
    COVERED,
    REFUSED_MESSAGES,
    body,
    document,
    mesh,
    obstacles_of,
    problem,
    request,
    scene,
    write_problem,
    write_robot,
)

TEXT = yaml.safe_dump(scene(body("sphere", [0.1], [3, 0, 0])))
OTHERS = REFUSED_MESSAGES["files"] | {
    "a stream of 2": f"---\n{TEXT}---\n{TEXT}---\n",
    "a MotionPlanRequest": yaml.safe_dump(request()),
    "one below 'scene'": yaml.safe_dump({"scene": scene()}),
}


@pytest.mark.parametrize("named", OTHERS)
def test_other_files_are_named(named: str) -> None:
    with pytest.raises(SettingError, match=f"^scenario.scene: must be .*, was .*{named}") as caught:
        document(OTHERS[named].encode("latin-1"))
    assert "\n" not in str(caught.value)


FORMS = {
    "topic echo": f"---\n{TEXT}---\n",
    "byte order mark": f"\ufeff{TEXT}",
    "JSON with tabs": json.dumps(yaml.safe_load(TEXT), indent="\t"),
    "ends of lines": TEXT.replace("\n", "\r\n"),
}


@pytest.mark.parametrize("form", FORMS)
def test_one_message_is_taken_however_it_is_written(form: str) -> None:
    assert document(FORMS[form].encode()).value == yaml.safe_load(TEXT)


@pytest.mark.parametrize(
    "text",
    [b"a: &x [1]\nb: *x", b"[1, 2]", b"a: [", b"!!python/object:os.system {}", b"{" * 200, b""],
)
def test_no_other_yaml_is_read(text: bytes) -> None:
    with pytest.raises(SettingError, match=r"^scenario\.scene: must be YAML"):
        document(text)


def test_messages_are_made_of_messages_that_are_known() -> None:
    uses = {use for fields in FIELDS.values() for use in fields.values()}
    reached = uses & FIELDS.keys() | {SCENE, REQUEST}
    assert reached == set(FIELDS)
    words = {use.partition(":")[0] for use in uses - FIELDS.keys()}
    assert words == {"read", "left out", "noted", "refused"}


WHOLE = scene(
    body("sphere", [0.1], [3, 0, 0], header={"frame_id": "world"}, pose={"position": {"x": 1}}),
    fixed_frame_transforms=[{"header": {}, "child_frame_id": "world", "transform": {}}],
    robot_state={"joint_state": {"name": []}, "multi_dof_joint_state": {"transforms": [{}]}},
)


OBJECT = "world.collision_objects[0]"


@pytest.mark.parametrize(
    "path",
    [
        *("", "world", OBJECT, f"{OBJECT}.header", f"{OBJECT}.pose", f"{OBJECT}.pose.position"),
        *(f"{OBJECT}.primitives[0]", f"{OBJECT}.primitive_poses[0]", "fixed_frame_transforms[0]"),
        *("fixed_frame_transforms[0].transform", "robot_state", "robot_state.joint_state"),
        "robot_state.multi_dof_joint_state.transforms[0]",
    ],
)
def test_a_field_that_no_message_has_is_refused_wherever_it_stands(path: str) -> None:
    whole = json.loads(json.dumps(WHOLE))
    place = whole
    for key in path.replace("[0]", ".0").split(".") if path else []:
        place = place[int(key)] if key.isdigit() else place[key]
    place["colour"] = "red"
    with pytest.raises(SettingError, match="must be made of the fields of") as refusal:
        document(whole)
    assert f"was '{path}.colour'".replace("'.", "'") in str(refusal.value)


def test_a_slip_in_a_name_is_told_its_nearest() -> None:
    with pytest.raises(SettingError, match="did you mean 'collision_objects'") as caught:
        document({"world": {"colision_objects": []}})
    assert "was 'world.colision_objects'" in str(caught.value)


def test_a_matrix_speaks_of_links_not_of_names_that_are_like_theirs(tmp_path: Path) -> None:
    """`lower_1` is a link of its own, not a body of `lower`."""
    write_robot(tmp_path)
    text = (tmp_path / "small.urdf").read_text()
    (tmp_path / "small.urdf").write_text(text.replace('"tip"', '"lower_1"'))
    allowed = {"entry_names": ["base", "lower"], "entry_values": [[False, True], [True, False]]}
    words = write_problem(tmp_path, scene(allowed_collision_matrix=allowed))
    path = f"robot.path={tmp_path / 'small.urdf'}"
    (condition,) = conditions(*words, *COVERED, "robot=urdf", path).values()
    built = condition.robot.build()
    assert links_of_bodies(built)["lower_1"] == "lower_1"
    disabled = with_allowed_pairs(built, condition.scenario).disabled
    assert disabled == {frozenset(("base", "lower"))}


def test_parts_that_are_left_out_and_may_matter_are_noted(tmp_path: Path) -> None:
    assert not [note for note in problem(tmp_path, scene()).notes() if "left out" in note]
    asked = request(max_velocity_scaling_factor=0.1, max_acceleration_scaling_factor=1.0)
    message = scene(is_diff=True) | {"robot_model_name": "tall"}
    notes = problem(tmp_path, message, asked).notes()
    assert "the scene is a change of another (is_diff): it is taken as it is" in notes
    assert "the scene is of the robot 'tall', the robot is 'small'" in notes
    left = "left out of the request: max_velocity_scaling_factor (export has its own limits)"
    assert left in notes


def test_meshes_that_a_scene_names_are_found_as_a_urdf_s(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROS_PACKAGE_PATH", raising=False)
    corners, triangles = map(np.asarray, hull_of(np.random.default_rng(0).normal(size=(8, 3))))
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in corners.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (triangles + 1).tolist()]
    package = tmp_path / "parts-1.0" / "meshes"
    package.mkdir(parents=True)
    (package / "part.obj").write_text("\n".join(lines))

    def named(resource: str) -> dict[str, Any]:
        part = {"id": "part", "meshes": [{"resource": resource, "dimensions": [2, 2, 2]}]}
        return scene(part | {"mesh_poses": [{}], "pose": {"position": [5, 0, 0]}})

    def points(condition: Condition) -> Any:
        (hull,) = obstacles_of(condition)
        assert np.allclose(hull.center, [5, 0, 0])
        return np.array(sorted(hull.points))

    inside = mesh(corners * 2.0, triangles, id="part", pose={"position": [5, 0, 0]})
    expected = points(problem(tmp_path, scene(inside)))
    by_package = named("package://parts/meshes/part.obj")
    with pytest.raises(SettingError, match=r"a missing mesh 'package://parts.*; tried "):
        problem(tmp_path, by_package)
    for owner in ("robot", "scenario"):
        word = f"{owner}.packages={{parts: '{package.parent}'}}"
        found = problem(tmp_path, by_package, None, word)
        assert np.allclose(points(found), expected, atol=1e-6)
    again = Condition.from_json(found.to_json())  # the mesh travels with the condition
    assert again.id == found.id and len(again.scenario.meshes) == 1
    (package / "part.obj").write_text("no mesh")
    with pytest.raises(SettingError, match=r"scenario\.scene: .*part\.obj"):
        problem(tmp_path, named(f"file://{package / 'part.obj'}")).prepare()


def test_the_start_of_the_request_comes_before_the_state_of_the_scene(tmp_path: Path) -> None:
    joints = {"name": ["turn", "nail"], "position": [0.7, 0.2]}
    asked = request()
    asked["start_state"]["joint_state"] = {"name": ["turn"], "position": [0.1]}
    found = problem(tmp_path, scene(robot_state={"joint_state": joints}), asked)
    assert found.scenario.state == {"turn": 0.1, "nail": 0.2}
