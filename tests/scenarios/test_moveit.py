"""Planning scenes and requests as MoveIt writes them: poses against Pinocchio's, and refusals."""

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import yaml

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.scenarios.moveit import read_link_goal, read_request
from evoexp.scenarios.moveit_files import MessagePart, read_document
from evoexp.scenarios.moveit_frames import read_frames
from evoexp.scenarios.moveit_messages import REQUEST, SCENE
from evoexp.scenarios.moveit_scene import World, read_allowed, read_state, read_world
from evoexp.scenarios.obstacles import BOX, CYLINDER, HALF_SPACE, SPHERE, obstacle_table
from moveit_samples import GOAL, JOINTS, START, body, request, scene


def document(plain: Any, message: str = SCENE) -> MessagePart:
    text = plain if isinstance(plain, bytes) else yaml.safe_dump(plain).encode()
    return read_document(
        text, "scenario.scene" if message == SCENE else "scenario.request", message
    )


def read(plain: Any) -> World:
    """Read all of a scene."""
    file = document(plain)
    read_state(file["robot_state"])
    read_allowed(file)
    return read_world(file, None)


def random_pose(rng: np.random.Generator) -> tuple[pin.SE3, dict[str, Any]]:
    quaternion, position = rng.normal(size=4), rng.normal(size=3)
    quaternion /= np.linalg.norm(quaternion)
    x, y, z, w = quaternion
    plain = {"position": position.tolist(), "orientation": quaternion.tolist()}
    return pin.SE3(pin.Quaternion(w, x, y, z).toRotationMatrix(), position), plain


@pytest.mark.parametrize("seed", range(10))
def test_an_object_stands_at_its_pose_times_the_primitive_s(seed: int) -> None:
    rng = np.random.default_rng(seed)
    (frame, frame_plain), (own, own_plain), (inner, inner_plain) = (
        random_pose(rng) for _ in range(3)
    )
    transform = {"translation": frame_plain["position"], "rotation": frame_plain["orientation"]}
    world = read(
        scene(
            {
                "id": "things",
                "header": {"frame_id": "shelf"},
                "pose": own_plain,
                "primitives": [
                    {"type": "box", "dimensions": [0.1, 0.2, 0.3]},
                    {"type": "cylinder", "dimensions": [0.5, 0.06]},
                    {"type": 2, "dimensions": [0.07]},
                ],
                "primitive_poses": [copy.deepcopy(inner_plain) for _ in range(3)],
            },
            fixed_frame_transforms=[
                {
                    "header": {"frame_id": "shelf"},
                    "child_frame_id": "world",
                    "transform": transform,
                }
            ],
        )
    )
    expected, table = frame * own * inner, obstacle_table(world.obstacles)
    assert table.kind.tolist() == [BOX, CYLINDER, SPHERE]
    assert np.allclose(table.center, expected.translation, atol=1e-12)
    assert np.allclose(table.rotation[0].reshape(3, 3), expected.rotation, atol=1e-12)
    axis = table.rotation[1].reshape(3, 3)[:, 2]  # a cylinder may turn about its axis
    assert np.allclose(axis, expected.rotation[:, 2], atol=1e-12)
    assert np.allclose(table.size, [[0.05, 0.1, 0.15], [0.06, 0.25, 0], [0.07, 0, 0]])
    assert world.objects == ("things",) * 3
    assert [each.name for each in world.obstacles] == ["things_1", "things_2", "things_3"]


def test_upright_boxes_keep_their_orientation() -> None:
    """Where x points up or down, roll and yaw are not told apart."""
    for sign in (-1.0, 1.0):
        half = np.sqrt(0.5)
        turned = pin.Quaternion(half, 0.0, sign * half, 0.0)
        for yaw in (0.0, 0.7):
            q = pin.Quaternion(pin.rpy.rpyToMatrix(0.0, 0.0, yaw)) * turned
            thing = body("box", [0.1, 0.2, 0.3], [0, 0, 0])
            thing["primitive_poses"][0]["orientation"] = [q.x, q.y, q.z, q.w]
            table = obstacle_table(read(scene(thing)).obstacles)
            assert np.allclose(table.rotation[0].reshape(3, 3), q.toRotationMatrix(), atol=1e-9)


def test_a_plane_is_the_half_space_behind_it() -> None:
    plane = {"id": "floor", "planes": [{"coef": [0, 0, 2, -1]}], "plane_poses": [{}]}
    table = obstacle_table(read(scene(plane)).obstacles)
    assert table.kind.tolist() == [HALF_SPACE]
    assert table.center[0].tolist() == [0.0, 0.0, 0.5]
    assert table.rotation[0].reshape(3, 3)[:, 2].tolist() == [0.0, 0.0, 1.0]


def test_small_numbers_without_a_point_are_numbers() -> None:
    """YAML takes 1e-05 for a text."""
    text = yaml.safe_dump(scene(body("sphere", [0.1], [0.0, 0.0, 7.0]))).replace("7.0", "1e-05")
    (ball,) = read(text.encode()).obstacles
    assert ball.center == (0.0, 0.0, 1e-5)  # type: ignore[union-attr]


def test_the_matrix_says_which_pairs_may_touch() -> None:
    matrix = {
        "entry_names": ["a", "b"],
        "entry_values": [[False, True], [True, False]],
        "default_entry_names": ["c", "d"],
        "default_entry_values": [True, False],
    }
    allowed = read_allowed(document(scene(allowed_collision_matrix=matrix)))
    assert allowed.may_touch("a", "b") is True
    assert allowed.may_touch("a", "x") is None
    assert allowed.may_touch("a", "c") is True  # a default counts where no entry does
    assert allowed.may_touch("c", "d") is False  # and both must allow it


PRISM = {"type": "prism", "dimensions": [1, 1]}


def mesh(corners: Any, triangles: Any, **changes: Any) -> dict[str, Any]:
    """Return a collision object of one mesh."""
    data = {
        "vertices": [dict(zip("xyz", map(float, corner), strict=True)) for corner in corners],
        "triangles": [{"vertex_indices": [int(k) for k in face]} for face in triangles],
    }
    return {"id": "thing", "meshes": [data], "mesh_poses": [{}]} | changes


FLAT = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
LOST = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 3]])
HALF = mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], mesh_poses=[])
FRACTION = {
    "vertices": [{"x": 0, "y": 0, "z": k} for k in range(3)],
    "triangles": [{"vertex_indices": [0, 1, 1.5]}],
}
REFUSED = {
    "attached objects": {"robot_state": {"attached_collision_objects": [{"link_name": "x"}]}},
    "octomaps": {"world": {"octomap": {"octomap": {"data": [1]}}}},
    "link_padding": {"link_padding": [{"link_name": "x", "padding": 0.01}]},
    "link_scale": {"link_scale": [{"link_name": "x", "scale": 1.1}]},
    "a part of 3 vertices in one plane": scene(FLAT),
    "three of the 3 vertices of 'thing', counted from 0, was '0, 1, 3'": scene(LOST),
    "counted from 0, was '0, 1, 1.5'": scene(
        mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]) | {"meshes": [FRACTION]}
    ),
    r"'thing'.operation ADD \(0\), was 'REMOVE'": scene(
        body("sphere", [1], [0, 0, 0], operation=1)
    ),
    r"a normal other than 0 of 'floor', was \[0.0, 0.0, 0.0\]": scene(
        {"id": "floor", "planes": [{"coef": [0, 0, 0, -1]}], "plane_poses": [{}]}
    ),
    "a pose per mesh": scene(HALF),
    "a prism": scene({"id": "c", "primitives": [PRISM], "primitive_poses": [{}]}),
    "frame that stands still": scene(body("sphere", [1], [0, 0, 0], header={"frame_id": "hand"})),
    "dimensions above 0": scene(body("box", [1, 0, 1], [0, 0, 0])),
    "2 numbers": scene(body("cylinder", [1], [0, 0, 0])),
    "a pose per primitive": scene({"id": "x", "primitives": [PRISM]}),
    "ids differ": scene(body("sphere", [1], [0, 0, 0]), body("sphere", [1], [0, 0, 0])),
    "at the origin": {
        "robot_state": {"multi_dof_joint_state": {"transforms": [{"translation": [1, 0, 0]}]}}
    },
    "finite numbers": scene(body("sphere", [float("nan")], [0, 0, 0])),
    "quaternions of length 1": scene(
        body("sphere", [1], [0, 0, 0], pose={"orientation": [1, 1, 1, 1]})
    ),
    "truth values": {"allowed_collision_matrix": {"entry_names": ["a"], "entry_values": [[2]]}},
}


@pytest.mark.parametrize("named", REFUSED)
def test_what_is_not_known_is_refused_by_its_name(named: str) -> None:
    with pytest.raises(SettingError, match=named) as caught:
        read(REFUSED[named])
    assert str(caught.value).startswith("scenario.scene: ")
    assert "\n" not in str(caught.value)


def test_empty_parts_are_no_parts() -> None:
    empty = {"attached_collision_objects": [], "joint_state": {"name": [], "position": []}}
    scale = [{"link_name": "x", "scale": 1.0}]
    read(scene(robot_state=empty, link_scale=scale, link_padding=[{"padding": 0}]))


@pytest.mark.parametrize(
    "text",
    [b"a: &x [1]\nb: *x", b"[1, 2]", b"a: [", b"!!python/object:os.system {}", b"{" * 200, b""],
)
def test_no_other_yaml_is_read(text: bytes) -> None:
    with pytest.raises(SettingError, match=r"^scenario\.scene: must be YAML"):
        document(text)


def asked(**changes: Any) -> Any:
    file = document(request(**changes), REQUEST)
    read_state(file["start_state"])
    return read_request(file)


def read_goal(changes: dict[str, Any]) -> None:
    if asked(**changes).link:
        file = document(request(**changes), REQUEST)
        read_link_goal(file, read_frames(document(scene()), None))


def test_a_request_names_group_start_and_goal() -> None:
    found = asked()
    assert found.group == "arm"
    assert found.joint_goal == dict(zip(JOINTS, GOAL, strict=True))
    assert found.start == dict(zip(JOINTS, START, strict=True)) | {"finger": 0.05, "nail": 0.3}
    assert not found.link


def link_goal(
    turn: list[float], tolerance: float, offset: list[float], **region: Any
) -> dict[str, Any]:
    place = {
        "link_name": "tip",
        "target_point_offset": offset,
        "constraint_region": {
            "primitives": [{"type": "box", "dimensions": [0.02, 0.04, 0.06]}],
            "primitive_poses": [{"position": [0.4, 0.1, 0.5]}],
        }
        | region,
    }
    tolerances = {f"absolute_{axis}_axis_tolerance": tolerance for axis in "xyz"}
    oriented = {"link_name": "tip", "orientation": turn, **tolerances}
    return {"position_constraints": [place], "orientation_constraints": [oriented]}


def test_a_pose_of_a_link_has_the_tolerances_of_its_constraints() -> None:
    half = float(np.sqrt(0.5))
    file = document(
        request(goal_constraints=[link_goal([0, 0, half, half], 0.1, [0.1, 0, 0])]), REQUEST
    )
    assert read_request(file).link == "tip"
    goal = read_link_goal(file, read_frames(document(scene()), None))
    assert (goal.link, goal.distance) == ("tip", 0.01)
    assert goal.angle == pytest.approx(0.1 / DEGREE)
    # the point 0.1 along the link's x axis is the goal, and that axis points along y
    assert np.allclose(goal.pose.position, [0.4, 0.0, 0.5])
    assert np.allclose(goal.pose.angles, [0.0, 0.0, 90.0])


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"path_constraints": {"joint_constraints": [{"joint_name": "x"}]}}, "path constraints"),
        (
            {
                "path_constraints": {
                    "joint_constraints": [],
                    "orientation_constraints": [{"link_name": "x"}],
                }
            },
            "path constraints",
        ),
        ({"trajectory_constraints": {"constraints": [{"name": "x"}]}}, "trajectory constraints"),
        ({"goal_constraints": []}, "one goal"),
        ({"goal_constraints": [{}]}, "a goal of joints, or of one position"),
        ({"goal_constraints": [{"visibility_constraints": [{"a": 1}]}]}, "visibility constraints"),
        ({"goal_constraints": [link_goal([0, 0, 0, 1], 0.0, [0, 0, 0])]}, "tolerances above 0"),
        (
            {
                "goal_constraints": [
                    link_goal([0, 0, 0, 1], 0.1, [0, 0, 0], meshes=[{"vertices": [1]}])
                ]
            },
            "goals within meshes",
        ),
        ({"goal_constraints": [{"position_constraints": [{}]}]}, "a goal of a link"),
        ({"start_state": {"joint_state": {"name": ["a"], "position": []}}}, "1 numbers"),
        ({"start_state": {"attached_collision_objects": [{"a": 1}]}}, "attached objects"),
    ],
)
def test_requests_that_are_not_known_are_refused(changes: dict[str, Any], named: str) -> None:
    with pytest.raises(SettingError, match=named) as caught:
        read_goal(changes)
    assert str(caught.value).startswith("scenario.request: ")


def test_paths_are_put_aside_for_contents(tmp_path: Path) -> None:
    from evoexp.scenarios.moveit import MoveitTask

    with pytest.raises(SettingError, match=r"scenario\.scene: must be given"):
        MoveitTask.read_files({"scene": "???"}, "scenario")
    with pytest.raises(SettingError, match=r"scenario\.scene: .*no such file"):
        MoveitTask.read_files({"scene": str(tmp_path / "none.yaml")}, "scenario")
