"""Planning scenes and requests as MoveIt writes them: what is read of them, and refusals."""

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import yaml

import moveit_samples as samples
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.numeric.convex_hull import hull_of
from evoexp.numeric.elementary import DEGREE
from evoexp.planners.arm_tasks import links_of_bodies, with_allowed_pairs
from evoexp.scenarios.moveit import MoveitTask, read_link_goal, read_request
from evoexp.scenarios.moveit_files import FIELDS, REQUEST, SCENE
from evoexp.scenarios.moveit_scene import read_allowed, read_frames, read_state
from evoexp.scenarios.obstacles import BOX, obstacle_table
from evoexp.testing import conditions
from moveit_samples import REFUSED_MESSAGES, body, document, mesh, problem, read, request, scene

HALF = float(np.sqrt(0.5))
CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))


def solid(
    kind: Any = "sphere", dimensions: Any = (1,), position: Any = (0, 0, 0), **more: Any
) -> Any:
    """Return a scene of one primitive."""
    return scene(body(kind, list(dimensions), list(position), **more))


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_upright_boxes_keep_their_orientation(sign: float, yaw: float) -> None:
    """Where x points up or down, roll and yaw are not told apart."""
    upright = pin.Quaternion(HALF, 0.0, sign * HALF, 0.0)
    q = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, yaw)) * upright
    world = read(solid("box", [0.1, 0.2, 0.3], pose={"orientation": [q.x, q.y, q.z, q.w]}))
    turn = obstacle_table(world.obstacles).rotation[0].reshape(3, 3)
    assert np.allclose(turn, q.toRotationMatrix(), atol=1e-9)


def test_bodies_of_an_object_are_counted_and_small_numbers_read() -> None:
    """YAML takes 1e-05 for a text."""
    thing = body("sphere", [0.1], [0.0, 0.0, 7.0])
    thing = {key: 2 * value if isinstance(value, list) else value for key, value in thing.items()}
    text = samples.written(scene(thing)).replace("7.0", "1e-05")
    world = read(text.encode())
    assert [each.center for each in world.obstacles] == [(0.0, 0.0, 1e-5)] * 2
    assert [each.name for each in world.obstacles] == ["thing_1", "thing_2"]
    assert world.objects == ("thing", "thing")


def test_searches_take_the_box_around_a_hull() -> None:
    rng = np.random.default_rng(0)
    pose, plain = samples.random_pose(rng)
    corners, triangles = hull_of(rng.normal(size=(20, 3))) or (CUBE, CUBE)
    table = obstacle_table(read(scene(mesh(corners, triangles, mesh_poses=[plain]))).obstacles)
    assert table.kind.tolist() == [BOX]
    points = corners @ pose.rotation.T + pose.translation
    inside = (points - table.center[0]) @ table.rotation[0].reshape(3, 3)
    assert np.abs(inside).max(axis=0) == pytest.approx(table.size[0], abs=1e-9)


def test_parts_that_do_not_hang_together_are_bodies_of_their_own() -> None:
    corners, triangles = hull_of(CUBE) or (CUBE, CUBE)
    split = corners[triangles].reshape(-1, 3)  # every triangle with corners of its own
    both = np.vstack([split, split + np.array([5.0, 0.0, 0.0])])
    obstacles = read(scene(mesh(both, np.arange(len(both)).reshape(-1, 3)))).obstacles
    assert [each.name for each in obstacles] == ["thing_1", "thing_2"]
    assert [len(each.points) for each in obstacles] == [8, 8]
    table = obstacle_table(obstacles)
    assert np.allclose(np.sort(table.center[:, 0]), [0.0, 5.0]) and np.allclose(table.size, 1.0)


def test_the_matrix_says_which_pairs_may_touch() -> None:
    entries = {"entry_names": ["a", "b"], "entry_values": [[False, True], [True, False]]}
    defaults = {"default_entry_names": ["c", "d"], "default_entry_values": [True, False]}
    allowed = read_allowed(document(scene(allowed_collision_matrix=entries | defaults)))
    assert allowed.may_touch("a", "b") is True
    assert allowed.may_touch("a", "x") is None
    assert allowed.may_touch("a", "c") is True  # a default counts where no entry does
    assert allowed.may_touch("c", "d") is False  # and both must allow it


@pytest.mark.parametrize("length", [0.98, 0.9901, 0.995, 1.005, 1.0099, 1.02])
def test_quaternions_are_normalised_within_a_hundredth_and_refused_beyond(length: float) -> None:
    turned = solid(
        "box",
        [0.1, 0.2, 0.3],
        [1, 0, 0],
        pose={"orientation": [0, 0, HALF * length, HALF * length]},
    )
    if abs(length - 1.0) > 0.01:
        where = "at 'thing'.pose.orientation"
        with pytest.raises(SettingError, match=f"quaternions of length 1 {where}, was {length}"):
            read(turned)
    else:
        (box,) = read(turned).obstacles
        assert np.allclose(box.center, [0.0, 1.0, 0.0], atol=1e-12)
        assert np.allclose(box.rotation, [0.0, 0.0, 90.0], atol=1e-9)


@pytest.mark.parametrize(("named", "plain"), REFUSED_MESSAGES["scenes"].items())
def test_what_is_not_known_is_refused_by_its_name(named: str, plain: dict[str, Any]) -> None:
    objects = plain.get("objects", [])
    with pytest.raises(SettingError, match=named) as refusal:
        read(scene(*objects, **{key: plain[key] for key in plain.keys() - {"objects"}}))
    assert str(refusal.value).startswith("scenario.scene: ")
    assert "\n" not in str(refusal.value)


def test_empty_parts_are_no_parts() -> None:
    empty = {"attached_collision_objects": [], "joint_state": {"name": [], "position": []}}
    scale = [{"link_name": "x", "scale": 1.0}]
    read(scene(robot_state=empty, link_scale=scale, link_padding=[{"padding": 0}]))


def asked(**changes: Any) -> Any:
    """Read all of a request."""
    file = document(request(**changes), REQUEST)
    read_state(file["start_state"])
    found = read_request(file)
    if found.link:
        return found, read_link_goal(file, read_frames(document(scene()), None))
    return found, None


def test_a_request_names_group_start_and_goal() -> None:
    found, _ = asked()
    assert found.group == "arm"
    assert found.joint_goal == dict(zip(samples.JOINTS, samples.GOAL, strict=True))
    assert found.start == dict(zip(samples.JOINTS, samples.START, strict=True)) | {
        "finger": 0.05,
        "nail": 0.3,
    }
    assert not found.link


def test_a_pose_of_a_link_has_the_tolerances_of_its_constraints() -> None:
    box = {"type": "box", "dimensions": [0.02, 0.04, 0.06]}
    region = {"primitives": [box], "primitive_poses": [{"position": [0.4, 0.1, 0.5]}]}
    place = {"target_point_offset": [0.1, 0, 0], "constraint_region": region}
    tolerances = {f"absolute_{axis}_axis_tolerance": 0.1 for axis in "xyz"}
    turn = {"link_name": "tip", "orientation": [0, 0, HALF, HALF], **tolerances}
    places = {"position_constraints": [place | {"link_name": "tip"}]}
    found, goal = asked(goal_constraints=[places | {"orientation_constraints": [turn]}])
    assert (found.link, goal.distance) == ("tip", 0.01)
    assert goal.angle == pytest.approx(0.1 / DEGREE)
    # the point 0.1 along the link's x axis is the goal, and that axis points along y
    assert np.allclose(goal.pose.position, [0.4, 0.0, 0.5])
    assert np.allclose(goal.pose.angles, [0.0, 0.0, 90.0])


@pytest.mark.parametrize("changes", REFUSED_MESSAGES["requests"], ids=lambda row: row["named"])
def test_requests_that_are_not_known_are_refused(changes: dict[str, Any]) -> None:
    named = changes["named"]
    with pytest.raises(SettingError, match=named) as refusal:
        asked(**{part: changes[part] for part in changes.keys() - {"named"}})
    assert str(refusal.value).startswith("scenario.request: ")


def test_paths_are_put_aside_for_contents(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"scenario\.scene: must be given"):
        MoveitTask.read_files({"scene": "???"}, "scenario")
    with pytest.raises(SettingError, match=r"scenario\.scene: .*no such file"):
        MoveitTask.read_files({"scene": str(tmp_path / "none.yaml")}, "scenario")


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
    samples.write_robot(tmp_path)
    text = (tmp_path / "small.urdf").read_text()
    (tmp_path / "small.urdf").write_text(text.replace('"tip"', '"lower_1"'))
    allowed = {"entry_names": ["base", "lower"], "entry_values": [[False, True], [True, False]]}
    words = samples.write_problem(tmp_path, scene(allowed_collision_matrix=allowed))
    path = f"robot.path={tmp_path / 'small.urdf'}"
    (condition,) = conditions(*words, *samples.COVERED, "robot=urdf", path).values()
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
        (hull,) = samples.obstacles_of(condition)
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
