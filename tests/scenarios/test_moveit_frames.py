"""Where objects of planning scenes stand, judged by a slow reader after MoveIt's own code."""

import copy
import json
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
import yaml
from test_moveit import mesh, random_pose

import evoexp
from composed import composed
from evoexp.collision.scene import obstacle_shapes
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.numeric.convex_hull import hull_of
from evoexp.planners.moveit_tasks import arm_motion
from evoexp.scenarios.obstacles import obstacle_hulls, obstacle_table
from evoexp.testing import conditions
from moveit_samples import COVERED, body, request, scene, write_problem, write_robot
from moveit_semantics import MoveitScene, PlacedShape

ASSETS = Path(evoexp.__file__).parent / "assets" / "motionbenchmaker"
MOUNT = """<link name="plate"/><joint name="mount" type="fixed"><parent link="base"/>
<child link="plate"/><origin xyz="0.3 -0.2 0.5" rpy="0.3 0.4 0.5"/></joint></robot>"""


def agrees(expected: PlacedShape, shape: Any, pose: Any) -> bool:
    """Whether a coal shape is of the kind and size that is expected, and stands there."""
    moved, rng = expected.pose, np.random.default_rng(0)
    near = np.allclose(pose.translation, moved.translation, atol=1e-9)
    if expected.kind == "plane":
        *normal, offset = expected.sizes
        local = moved.actInv(pose.translation)
        outwards = moved.rotation @ normal / np.linalg.norm(normal)
        is_plane = isinstance(shape, coal.Halfspace) and abs(normal @ local + offset) < 1e-9
        return bool(is_plane and np.allclose(pose.rotation[:, 2], outwards, atol=1e-9))
    if expected.kind == "box":
        size = isinstance(shape, coal.Box) and np.allclose(2 * shape.halfSide, expected.sizes)
        return bool(near and size and np.allclose(pose.rotation, moved.rotation, atol=1e-9))
    if expected.kind == "sphere":
        return bool(near and isinstance(shape, coal.Sphere) and shape.radius == expected.sizes[0])
    if expected.kind == "cylinder":
        size = isinstance(shape, coal.Cylinder) and np.allclose(
            [2 * shape.halfLength, shape.radius], expected.sizes
        )
        along = abs(float(pose.rotation[:, 2] @ moved.rotation[:, 2]))
        return bool(near and size and abs(along - 1.0) < 1e-12)
    assert isinstance(shape, coal.ConvexBase)
    own = np.array([pose.act(shape.point(k)) for k in range(shape.num_points)])
    for direction in rng.normal(size=(50, 3)):
        direction /= np.linalg.norm(direction)
        if expected.kind == "mesh":
            corners = expected.corners @ moved.rotation.T + moved.translation
            farthest, slack = float(np.max(corners @ direction)), 1e-9
        else:
            height, radius = expected.sizes
            axis = moved.rotation[:, 2]
            slope = np.linalg.norm(direction - (direction @ axis) * axis)
            ends = 0.5 * height * float(axis @ direction)
            farthest = float(moved.translation @ direction) + max(ends, radius * slope - ends)
            slack = 0.005 * radius  # of the pyramid around the cone
        if not -1e-9 <= float(np.max(own @ direction)) - farthest <= slack:
            return False
    return True


def judge(message: dict[str, Any], judged: MoveitScene, world: Any, obstacles: Any) -> None:
    """Compare every obstacle with the slow reader's, which stands in the planning frame.

    Args:
        message: The scene.
        judged: The slow reader.
        world: `pin.SE3` of the planning frame in evoexp's world.
        obstacles: Of evoexp's reader.
    """
    expected = judged.shapes(message)
    shapes = obstacle_shapes(obstacle_table(obstacles), obstacle_hulls(obstacles))
    assert len(shapes) == len(expected)
    for one, (shape, pose) in zip(expected, shapes, strict=True):
        assert agrees(one._replace(pose=world * one.pose), shape, pose), one


@pytest.mark.parametrize(
    "problem", sorted(path.name for path in (ASSETS / "problems").iterdir()), ids=str
)
def test_every_object_of_motionbenchmaker_stands_where_moveit_puts_it(problem: str) -> None:
    condition = composed("experiment=motionbenchmaker", label=problem)
    message = yaml.safe_load((ASSETS / "problems" / problem / "scene0001.yaml").read_text())
    robot = problem.rpartition("_")[2]
    urdf = (ASSETS / robot / f"{robot}.urdf").read_text()
    slow = MoveitScene(urdf, "world", pin.SE3.Identity())
    built = condition.robot.build()  # type: ignore[attr-defined]
    task = arm_motion(built, condition.scenario)  # type: ignore[arg-type]
    judge(message, slow, pin.SE3.Identity(), task.obstacles)


def of_length(rng: np.random.Generator, pose: dict[str, Any]) -> dict[str, Any]:
    """Return a pose with a quaternion that was rounded, as a list or by names."""
    x, y, z, w = (np.array(pose["orientation"]) * rng.choice([0.995, 1.0, 1.005])).tolist()
    if rng.random() < 0.5:
        return {"position": pose["position"], "orientation": [x, y, z, w]}
    place = dict(zip("xyz", pose["position"], strict=True))
    return {"position": place, "orientation": {"x": x, "y": y, "z": z, "w": w}}


def random_objects(rng: np.random.Generator, frames: list[str]) -> list[dict[str, Any]]:
    """Return objects of all kinds in given frames, some without a pose of their own."""

    def placed() -> dict[str, Any]:
        return of_length(rng, random_pose(rng)[1])

    found = []
    for k, frame in enumerate(frames):
        corners, triangles = hull_of(rng.normal(size=(6, 3))) or (np.eye(3), np.eye(3))
        thing = {
            "id": f"thing_{k}",
            "header": {"frame_id": frame, "stamp": {"sec": 0, "nanosec": 0}},
            "primitives": [
                {"type": "box", "dimensions": [0.1, 0.2, 0.3]},
                {"type": 2, "dimensions": [0.07], "polygon": {"points": []}},
                {"type": 3, "dimensions": [0.5, 0.06]},
                {"type": "CONE", "dimensions": [0.4, 0.1]},
            ],
            "primitive_poses": [placed() for _ in range(4)],
            "planes": [{"coef": [1.0, 2.0, -2.0, 0.7]}],
            "plane_poses": [placed()],
            "subframe_names": ["grip"],
            "subframe_poses": [placed()],
            "operation": 0,
        } | {key: mesh(corners, triangles)[key] for key in ("meshes",)}
        thing["mesh_poses"] = [placed()]
        found.append(thing | ({"pose": placed()} if rng.random() < 0.7 else {}))
        found.append(
            body("sphere", [0.1], [1.0, 2.0, 3.0], name=f"ball_{k}", header={"frame_id": frame})
        )
    return found


@pytest.mark.parametrize("planning", ["world", "base"])
@pytest.mark.parametrize("seed", range(3))
def test_every_object_stands_where_moveit_puts_it(planning: str, seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    transforms = []
    for name, child in (("camera", planning), ("/shelf", f"/{planning}"), (planning, planning)):
        pose = of_length(rng, random_pose(rng)[1])
        moved = {"translation": pose["position"], "rotation": pose["orientation"]}
        transforms.append(
            {"header": {"frame_id": name}, "child_frame_id": child}
            | ({"transform": moved} if name != planning else {})
        )
    names = ["", planning, "camera", "/camera", "shelf", "base", "/base", "plate", "/plate"]
    message = scene(*random_objects(rng, names), fixed_frame_transforms=transforms)
    words = [*write_robot(tmp_path), *write_problem(tmp_path, copy.deepcopy(message)), *COVERED]
    urdf = (tmp_path / "small.urdf").read_text().replace("</robot>", MOUNT)
    (tmp_path / "small.urdf").write_text(urdf)
    at = "robot.base_position=[0.4,-0.3,0.2]", "robot.base_rotation=[20,-30,70]"
    base = pin.SE3(pin.rpy.rpyToMatrix(*np.deg2rad([20, -30, 70])), np.array([0.4, -0.3, 0.2]))
    (found,) = conditions(*words, *at).values()
    built = found.robot.build()  # type: ignore[attr-defined]
    task = arm_motion(built, found.scenario)  # type: ignore[arg-type]
    root, world = (base, pin.SE3.Identity()) if planning == "world" else (pin.SE3.Identity(), base)
    judge(message, MoveitScene(urdf, planning, root), world, task.obstacles)


def moved(name: str, child: str, *place: float) -> dict[str, Any]:
    return {
        "header": {"frame_id": name},
        "child_frame_id": child,
        "transform": {"translation": list(place or (0, 0, 0)), "rotation": [0, 0, 0, 1]},
    }


SELF = moved("world", "world")
REFUSED = {
    "a transform twice": ([SELF, moved("a", "world", 1, 0, 0), moved("a", "world", 2, 0, 0)],
        "", r"one transform of 'a' in fixed_frame_transforms, was 'at \(1, 0, 0\) m"),
    "a chain": ([SELF, moved("a", "world", 1, 0, 0), moved("b", "a", 1, 0, 0)],
        "b", r"one planning frame for all of fixed_frame_transforms, the child_frame_id 'world'"),
    "the wrong way round, as in tf": ([moved("world", "camera", 1, 0, 0)],
        "camera", r"child_frame_id is the planning frame \(base, world\), was 'camera'"),
    "a planning frame that moves": ([moved("tip", "tip")],
        "tip", r"child_frame_id is the planning frame \(base, world\), was 'tip'"),
    "a planning frame away from itself": ([moved("world", "world", 1, 0, 0)],
        "", r"a frame other than 'world' at fixed_frame_transforms\[0\]\.header\.frame_id"),
    "a transform of no frame": ([moved("", "world", 1, 0, 0)],
        "", r"a frame other than 'world' at fixed_frame_transforms\[0\]\.header\.frame_id"),
    "a transform to no frame": ([moved("a", "", 1, 0, 0)],
        "", r"the planning frame at fixed_frame_transforms\[0\]\.child_frame_id, was ''"),
    "a link elsewhere": ([SELF, moved("base", "world", 1, 0, 0)],
        "", r"transform of 'base' is that of the robot's link.*; the link stands at \(0, 0, 0\)"),
    "a link that moves": ([SELF], "tip", r"stands still \(base, world\) at 'o', was \"'tip', a"),
    "a link that moves, with a transform": ([SELF, moved("tip", "world", 1, 0, 0)],
        "tip", r"stands still \(base, world\) at 'o', was \"'tip', a link that moves"),
    "an unknown frame": ([SELF, moved("shelf", "world")],
        "shelv", r"stands still \(base, world, shelf\) at 'o', was 'shelv'; did you mean 'shelf'"),
    "a world that is not the planning frame": ([moved("base", "base")],
        "world", r"stands still \(base\) at 'o', was 'world'"),
    "another object": ([SELF], "o", r"stands still \(base, world\) at 'o', was 'o'"),
}  # fmt: skip


def prepare(words: list[str]) -> None:
    (found,) = conditions(*words).values()
    found.prepare()


@pytest.mark.parametrize("case", REFUSED)
def test_frames_that_would_be_guessed_are_refused(case: str, tmp_path: Path) -> None:
    transforms, frame, named = REFUSED[case]
    thing = body("sphere", [0.1], [3, 0, 0], name="o", header={"frame_id": frame})
    message = scene(thing, fixed_frame_transforms=transforms)
    words = [*write_robot(tmp_path), *write_problem(tmp_path, message), *COVERED]
    with pytest.raises(SettingError, match=named) as caught:
        prepare(words)
    line = str(caught.value)
    assert line.startswith(f"scenario.scene: {tmp_path}") and "\n" not in line


def test_runs_that_took_frames_the_wrong_way_round_are_refused_not_taken(tmp_path: Path) -> None:
    """Their identity is another, and whoever opens one is told to run it again."""
    thing = body("sphere", [0.1], [3, 0, 0], name="o", header={"frame_id": "world"})
    message = scene(thing, fixed_frame_transforms=[SELF, moved("camera", "world", 1, 0, 0)])
    words = [*write_robot(tmp_path), *COVERED]
    (found,) = conditions(*words, *write_problem(tmp_path, message)).values()
    plain = json.loads(found.to_json())
    assert plain["scenario"].pop("frame_names") == "header"
    before = Condition.from_json(json.dumps(plain).encode())
    assert before.id != found.id
    with pytest.raises(SettingError, match=r"frame_names: must be header, .* run it again"):
        before.prepare()
    (alone,) = conditions(*words, *write_problem(tmp_path, scene(thing))).values()
    assert "frame_names" not in json.loads(alone.to_json())["scenario"]


def test_a_scene_of_one_frame_needs_no_transform_and_a_virtual_joint_names_it(
    tmp_path: Path,
) -> None:
    def place(frame: str, *transforms: dict[str, Any]) -> tuple[float, ...]:
        thing = body("sphere", [0.1], [3, 0, 0], name="o", header={"frame_id": frame})
        message = scene(thing, fixed_frame_transforms=list(transforms))
        (found,) = conditions(*words, *write_problem(tmp_path, message)).values()
        built = found.robot.build()  # type: ignore[attr-defined]
        (ball,) = arm_motion(built, found.scenario).obstacles  # type: ignore[arg-type]
        return tuple(ball.center)  # type: ignore[union-attr]

    words = [*write_robot(tmp_path), *COVERED, "robot.base_position=[0,1,0]"]
    assert place("") == place("world") == (3.0, 0.0, 0.0)
    assert place("base") == place("/base") == (3.0, 1.0, 0.0)
    srdf = tmp_path / "small.srdf"
    joint = '<virtual_joint name="v" type="{}" parent_frame="odom" child_link="base"/></robot>'
    srdf.write_text(srdf.read_text().replace("</robot>", joint.format("floating")))
    assert place("odom") == place("") == (3.0, 0.0, 0.0)
    assert place("camera", moved("camera", "odom", 0, 0, 1)) == (3.0, 0.0, 1.0)
    srdf.write_text(srdf.read_text().replace("floating", "fixed"))  # MoveIt forgets its frame
    with pytest.raises(SettingError, match=r"stands still \(base, world\)"):
        place("odom")


def state(**joints: Any) -> dict[str, Any]:
    plain = {"joint_names": ["virtual"], "transforms": [{}], **joints}
    return {"multi_dof_joint_state": plain}


@pytest.mark.parametrize("file", ["scene", "request"])
def test_a_robot_that_its_virtual_joint_moves_is_refused(file: str, tmp_path: Path) -> None:
    def prepare_with(own: dict[str, Any]) -> None:
        transforms = [SELF, moved("shelf", "world") | {"transform": copy.deepcopy(place)}]
        asked, message = request(), scene(fixed_frame_transforms=transforms)
        if file == "scene":
            message["robot_state"] = own
        else:
            asked["start_state"] |= own
        (found,) = conditions(*words, *write_problem(tmp_path, message, asked)).values()
        found.prepare()

    words = [*write_robot(tmp_path), *COVERED]
    place = {"translation": [1, 0, 0], "rotation": [0, 0, 0.6, 0.8]}
    prepare_with(state())
    prepare_with(state(header={"frame_id": "/world"}))
    prepare_with(state(header={"frame_id": "shelf"}, transforms=[place]))  # it stands at the origin
    for own, named in (
        (state(transforms=[place]), r"a robot at the origin .*, was 'one at \(1, 0, 0\) m"),
        (state(header={"frame_id": "shelf"}), r"was 'one at \(-0.28, 0.96, 0\) m"),
        (state(header={"frame_id": "odd"}), r"stands still .* was 'odd'"),
        (state(transforms=[]), r"a transform per joint of .*, was 0"),
    ):
        with pytest.raises(SettingError, match=named) as caught:
            prepare_with(own)
        assert str(caught.value).startswith(f"scenario.{file}: ")


def test_the_goal_of_a_link_may_be_given_in_any_frame_that_stands_still(tmp_path: Path) -> None:
    """Its position and its orientation each in a frame of their own; quaternions are normalised."""
    rng = np.random.default_rng(5)
    frames = {name: random_pose(rng) for name in ("camera", "shelf")}
    (place, place_plain), (turn, turn_plain) = random_pose(rng), random_pose(rng)
    transforms = [SELF] + [
        {
            "header": {"frame_id": name},
            "child_frame_id": "world",
            "transform": {"translation": p["position"], "rotation": p["orientation"]},
        }
        for name, (_, p) in frames.items()
    ]
    region = {"primitives": [{"type": 2, "dimensions": [0.02]}], "primitive_poses": [place_plain]}
    position = {"header": {"frame_id": "/camera"}, "link_name": "tip", "constraint_region": region}
    longer = [1.005 * part for part in turn_plain["orientation"]]
    tolerances = {f"absolute_{axis}_axis_tolerance": 0.1 for axis in "xyz"}
    orientation = {"header": {"frame_id": "shelf"}, "link_name": "tip", "orientation": longer}
    goal = {
        "position_constraints": [position],
        "orientation_constraints": [orientation | tolerances],
    }
    asked = request(goal_constraints=[goal])
    words = [*write_robot(tmp_path), *COVERED]
    message = scene(fixed_frame_transforms=transforms)
    (found,) = conditions(*words, *write_problem(tmp_path, message, asked)).values()
    from evoexp.planners.moveit_tasks import posture_task

    task = posture_task(found.robot.build(), found.scenario)  # type: ignore[attr-defined, arg-type]
    (phase,) = task.phases
    assert np.allclose(phase.goal.point, (frames["camera"][0] * place).translation, atol=1e-9)  # type: ignore[union-attr]
    expected = (frames["shelf"][0] * turn).rotation
    angles = np.deg2rad(phase.goal.rotation)  # type: ignore[union-attr]
    assert np.allclose(pin.rpy.rpyToMatrix(*angles), expected, atol=1e-9)
