"""Planning scenes and requests as MoveIt writes them: what is read of them, and refusals."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from evoexp.errors import SettingError
from evoexp.numeric.convex_hull import hull_of
from evoexp.numeric.elementary import DEGREE
from evoexp.scenarios.moveit import MoveitTask, read_link_goal, read_request
from evoexp.scenarios.moveit_files import REQUEST
from evoexp.scenarios.moveit_scene import read_allowed, read_frames, read_state
from evoexp.scenarios.obstacles import BOX, obstacle_table
from moveit_samples import (
    GOAL,
    JOINTS,
    START,
    body,
    document,
    mesh,
    random_pose,
    read,
    request,
    scene,
    written,
)

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
    text = written(scene(thing)).replace("7.0", "1e-05")
    world = read(text.encode())
    assert [each.center for each in world.obstacles] == [(0.0, 0.0, 1e-5)] * 2
    assert [each.name for each in world.obstacles] == ["thing_1", "thing_2"]
    assert world.objects == ("thing", "thing")


def test_searches_take_the_box_around_a_hull() -> None:
    rng = np.random.default_rng(0)
    pose, plain = random_pose(rng)
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


def matrix(names: str, *rows: list[Any]) -> dict[str, Any]:
    return {"allowed_collision_matrix": {"entry_names": [*names], "entry_values": list(rows)}}


def state(**changes: Any) -> dict[str, Any]:
    return {"robot_state": changes}


CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
PRISM = {"type": "prism", "dimensions": [1, 1]}
FLOOR = {"id": "floor", "planes": [{"coef": [0, 0, 0, -1]}], "plane_poses": [{}]}
KINDS = "primitives that are box, .*, was"
REFUSED = [
    ("attached objects", state(attached_collision_objects=[{"link_name": "x"}])),
    ("octomaps", {"world": {"octomap": {"octomap": {"data": [1]}}}}),
    ("link_padding", {"link_padding": [{"link_name": "x", "padding": 0.01}]}),
    ("link_scale", {"link_scale": [{"link_name": "x", "scale": 1.1}]}),
    ("a part of 3 vertices in one plane", scene(mesh(CORNERS, [[0, 1, 2]]))),
    ("three of the 3 vertices of 'thing', counted from 0, was '0, 1, 3'",
     scene(mesh(CORNERS, [[0, 1, 3]]))),
    ("counted from 0, was '0.0, 1.0, 1.5'|counted from 0, was '0, 1, 1.5'",
     scene(mesh(CORNERS, [[0, 1, 1.5]]))),
    (r"a normal other than 0 of 'floor', was \[0.0, 0.0, 0.0\]", scene(FLOOR)),
    ("a pose per mesh", scene(mesh(CORNERS, [[0, 1, 2]], mesh_poses=[]))),
    ("a prism", scene({"id": "c", "primitives": [PRISM], "primitive_poses": [{}]})),
    ("frame that stands still", solid(header={"frame_id": "hand"})),
    ("dimensions above 0", solid("box", [1, 0, 1])),
    (r"1 numbers at 'thing'.primitives\[0\].dimensions, was 3", solid("sphere", [0.1, 0, 0])),
    (r"2 numbers at 'thing'.primitives\[0\].dimensions, was 1", solid("cone", [0.1])),
    (r"3 numbers at 'thing'.primitives\[0\].dimensions, was 2", solid("box", [0.1, 0.2])),
    (r"3 numbers at 'thing'.primitive_poses\[0\].position, was 2", solid(position=[0, 0])),
    *((rf'{KINDS} "\'thing\', a {named}"', solid(kind))
      for kind, named in ((None, "none"), (True, "true"), (7, "7"), ([1], r"\[1\]"))),
    ("a pose per primitive", scene({"id": "x", "primitives": [PRISM]})),
    (r"a pose per primitive of 'thing' \(1\), was 2", solid(primitive_poses=[{}, {}])),
    ("objects with a body each, was \"'x' without one\"", scene({"id": "x"})),
    ("ids differ", scene(body("sphere", [1], [0, 0, 0]), body("sphere", [1], [0, 0, 0]))),
    *((rf"'thing'.operation ADD \(0\), was {was}", solid(operation=operation))
      for operation, was in ((1, "'REMOVE'"), (3, "'MOVE"), ("\2", "'APPEND'"), (9, "9"))),
    ("at the origin", state(multi_dof_joint_state={"transforms": [{"translation": [1, 0, 0]}]})),
    (r"one position of 'j' at robot_state.joint_state, was \[1.0, 2.0\]",
     state(joint_state={"name": ["j", "j"], "position": [1, 2]})),
    ("finite numbers", solid("sphere", [float("nan")])),
    ("truth values", matrix("a", [2])),
    (r"symmetric .*, was \"two values of '.' and '.'\"", matrix("ab", [False, True], [False] * 2)),
    ("symmetric", matrix("aba", [False, True, False], [True, False, False], [False] * 3)),
]  # fmt: skip


@pytest.mark.parametrize(("named", "plain"), REFUSED)
def test_what_is_not_known_is_refused_by_its_name(named: str, plain: Any) -> None:
    with pytest.raises(SettingError, match=named) as refusal:
        read(plain)
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
    assert found.joint_goal == dict(zip(JOINTS, GOAL, strict=True))
    assert found.start == dict(zip(JOINTS, START, strict=True)) | {"finger": 0.05, "nail": 0.3}
    assert not found.link


def link_goal(turn: Any = (0, 0, 0, 1), tolerance: float = 0.1, **region: Any) -> dict[str, Any]:
    box = {"type": "box", "dimensions": [0.02, 0.04, 0.06]}
    whole = {"primitives": [box], "primitive_poses": [{"position": [0.4, 0.1, 0.5]}]} | region
    place = {"target_point_offset": [0.1, 0, 0], "constraint_region": whole}
    tolerances = {f"absolute_{axis}_axis_tolerance": tolerance for axis in "xyz"}
    oriented = {"link_name": "tip", "orientation": list(turn), **tolerances}
    return {
        "position_constraints": [place | {"link_name": "tip"}],
        "orientation_constraints": [oriented],
    }


def test_a_pose_of_a_link_has_the_tolerances_of_its_constraints() -> None:
    found, goal = asked(goal_constraints=[link_goal([0, 0, HALF, HALF])])
    assert (found.link, goal.distance) == ("tip", 0.01)
    assert goal.angle == pytest.approx(0.1 / DEGREE)
    # the point 0.1 along the link's x axis is the goal, and that axis points along y
    assert np.allclose(goal.pose.position, [0.4, 0.0, 0.5])
    assert np.allclose(goal.pose.angles, [0.0, 0.0, 90.0])


@pytest.mark.parametrize(
    ("part", "value", "named"),
    [
        ("path_constraints", {"joint_constraints": [{"joint_name": "x"}]}, "path constraints"),
        ("path_constraints", {"orientation_constraints": [{"link_name": "x"}]}, "path constraints"),
        ("trajectory_constraints", {"constraints": [{"name": "x"}]}, "trajectory constraints"),
        ("goal_constraints", [], "one goal"),
        ("goal_constraints", [{}], "a goal of joints, or of one position"),
        ("goal_constraints", [{"visibility_constraints": [{"a": 1}]}], "visibility constraints"),
        ("goal_constraints", [link_goal(tolerance=0.0)], "tolerances above 0"),
        ("goal_constraints", [link_goal(meshes=[{"vertices": [1]}])], "goals within meshes"),
        ("goal_constraints", [{"position_constraints": [{}]}], "a goal of a link"),
        ("start_state", {"joint_state": {"name": ["a"], "position": []}}, "1 numbers"),
        ("start_state", {"attached_collision_objects": [{"a": 1}]}, "attached objects"),
    ],
)
def test_requests_that_are_not_known_are_refused(part: str, value: Any, named: str) -> None:
    with pytest.raises(SettingError, match=named) as refusal:
        asked(**{part: value})
    assert str(refusal.value).startswith("scenario.request: ")


def test_paths_are_put_aside_for_contents(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match=r"scenario\.scene: must be given"):
        MoveitTask.read_files({"scene": "???"}, "scenario")
    with pytest.raises(SettingError, match=r"scenario\.scene: .*no such file"):
        MoveitTask.read_files({"scene": str(tmp_path / "none.yaml")}, "scenario")
