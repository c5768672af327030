"""Where objects of planning scenes stand, judged by a slow reader after MoveIt's own code."""

import json
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
import yaml

import evoexp
import moveit_samples as samples
from coal_shapes import distance_of_point, placed
from composed import composed
from evoexp.collision.scene import obstacle_shapes
from evoexp.condition import Condition
from evoexp.errors import SettingError
from evoexp.numeric.convex_hull import hull_of
from evoexp.planners.arm_tasks import posture_task
from evoexp.robots.meshes import convex_shape
from evoexp.scenarios.obstacles import obstacle_hulls, obstacle_table
from evoexp.testing import conditions
from moveit_samples import COVERED, body, mesh, obstacles_of, problem, random_pose, request, scene
from moveit_semantics import MoveitScene, PlacedShape

ASSETS = Path(evoexp.__file__).parent / "assets" / "motionbenchmaker"
MOUNT = """<link name="plate"/><joint name="mount" type="fixed"><parent link="base"/>
<child link="plate"/><origin xyz="0.3 -0.2 0.5" rpy="0.3 0.4 0.5"/></joint></robot>"""


def solid(shape: PlacedShape) -> Any:
    """Return a shape of the slow reader as coal's."""
    if shape.kind == "plane":
        *normal, offset = np.array(shape.sizes) / np.linalg.norm(shape.sizes[:3])
        return coal.Halfspace(np.array(normal), -offset)
    if shape.kind in ("cylinder", "cone"):
        height, radius = shape.sizes
        return (coal.Cylinder if shape.kind == "cylinder" else coal.Cone)(radius, height)
    if shape.kind == "mesh":
        return convex_shape(*(hull_of(shape.corners) or ()))
    return {"box": coal.Box, "sphere": coal.Sphere}[shape.kind](*shape.sizes)


def judge(message: dict[str, Any], judged: MoveitScene, world: Any, obstacles: Any) -> None:
    """Compare every obstacle with the slow reader's; `world`: its planning frame in evoexp's."""
    expected = judged.shapes(message)
    shapes = obstacle_shapes(obstacle_table(obstacles), obstacle_hulls(obstacles))
    assert len(shapes) == len(expected)
    for one, (shape, pose) in zip(expected, shapes, strict=True):
        bodies = placed(shape, pose), placed(solid(one), world * one.pose)
        points = pose.translation + np.random.default_rng(0).normal(size=(30, 3))
        away, exact = np.array([[distance_of_point(p, body) for p in points] for body in bodies])
        slack = 0.005 * one.sizes[1] if one.kind == "cone" else 1e-6  # of the pyramid around it
        farther = np.where(exact > 0.0, exact - away, 0.0)
        assert (away[exact <= 0.0] <= 1e-6).all(), one
        assert ((farther >= -1e-6) & (farther <= slack)).all() and (exact > 0.0).any(), one


@pytest.mark.parametrize(
    "problem", sorted(path.name for path in (ASSETS / "problems").iterdir()), ids=str
)
def test_every_object_of_motionbenchmaker_stands_where_moveit_puts_it(problem: str) -> None:
    condition = composed("experiment=motionbenchmaker", label=problem)
    message = yaml.safe_load((ASSETS / "problems" / problem / "scene0001.yaml").read_text())
    robot = problem.rpartition("_")[2]
    urdf = (ASSETS / robot / f"{robot}.urdf").read_text()
    slow = MoveitScene(urdf, "world", pin.SE3.Identity())
    judge(message, slow, pin.SE3.Identity(), obstacles_of(condition))


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
        primitives = [
            {"type": "box", "dimensions": [0.1, 0.2, 0.3]},
            {"type": 2, "dimensions": [0.07], "polygon": {"points": []}},
            {"type": 3, "dimensions": [0.5, 0.06]},
            {"type": "CONE", "dimensions": [0.4, 0.1]},
        ]
        planes, subframes = [{"coef": [1.0, 2.0, -2.0, 0.7]}], {"subframe_names": ["grip"]}
        parts = {"primitives": primitives, "planes": planes}
        poses = {
            f"{name}_poses": [placed() for _ in range(count)]
            for name, count in (("primitive", 4), ("plane", 1), ("mesh", 1), ("subframe", 1))
        }
        header = {"frame_id": frame, "stamp": {"sec": 0, "nanosec": 0}}
        whole = {"id": f"thing_{k}", "header": header, "operation": 0} | parts | subframes | poses
        own = {"pose": placed()} if rng.random() < 0.7 else {}
        found.append(mesh(corners, triangles) | whole | own)
        found.append(body("sphere", [0.1], [1.0, 2.0, 3.0], name=f"ball_{k}", header=header))
    return found


def moved(name: str, child: str, *place: float, **transform: Any) -> dict[str, Any]:
    """Return a transform of `fixed_frame_transforms`."""
    plain = {"translation": [*place, 0, 0, 0][:3], "rotation": [0, 0, 0, 1]} | transform
    return {"header": {"frame_id": name}, "child_frame_id": child, "transform": plain}


def as_transform(pose: dict[str, Any]) -> dict[str, Any]:
    return {"translation": pose["position"], "rotation": pose["orientation"]}


@pytest.mark.parametrize("planning", ["world", "base"])
@pytest.mark.parametrize("seed", range(3))
def test_every_object_stands_where_moveit_puts_it(planning: str, seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    transforms = [
        moved(name, child, **as_transform(of_length(rng, random_pose(rng)[1])))
        for name, child in (("camera", planning), ("/shelf", f"/{planning}"))
    ]
    transforms.append({"header": {"frame_id": planning}, "child_frame_id": planning})
    names = ["", planning, "camera", "/camera", "shelf", "base", "/base", "plate", "/plate"]
    message = scene(*random_objects(rng, names), fixed_frame_transforms=transforms)
    words = [*samples.write_robot(tmp_path), *samples.write_problem(tmp_path, message), *COVERED]
    urdf = (tmp_path / "small.urdf").read_text().replace("</robot>", MOUNT)
    (tmp_path / "small.urdf").write_text(urdf)
    at = "robot.base_position=[0.4,-0.3,0.2]", "robot.base_rotation=[20,-30,70]"
    base = pin.SE3(pin.rpy.rpyToMatrix(*np.deg2rad([20, -30, 70])), np.array([0.4, -0.3, 0.2]))
    (condition,) = conditions(*words, *at).values()
    root, world = (base, pin.SE3.Identity()) if planning == "world" else (pin.SE3.Identity(), base)
    judge(message, MoveitScene(urdf, planning, root), world, obstacles_of(condition))


SELF = moved("world", "world")


def ball(frame: str, *transforms: dict[str, Any]) -> dict[str, Any]:
    """Return a scene of one ball in a frame."""
    thing = body("sphere", [0.1], [3, 0, 0], name="o", header={"frame_id": frame})
    return scene(thing, fixed_frame_transforms=list(transforms))


@pytest.mark.parametrize("case", samples.REFUSED_MESSAGES["frames"])
def test_frames_that_would_be_guessed_are_refused(case: str, tmp_path: Path) -> None:
    row = samples.REFUSED_MESSAGES["frames"][case]
    transforms = [moved(*each) for each in row["transforms"]]
    with pytest.raises(SettingError, match=row["named"]) as refusal:
        problem(tmp_path, ball(row["ball"], *transforms)).prepare()
    line = str(refusal.value)
    assert line.startswith(f"scenario.scene: {tmp_path}") and "\n" not in line


def test_runs_that_took_frames_the_wrong_way_round_are_refused_not_taken(tmp_path: Path) -> None:
    """Their identity is another, and whoever opens one is told to run it again."""
    after = problem(tmp_path, ball("world", SELF, moved("camera", "world", 1, 0, 0)))
    plain = json.loads(after.to_json())
    assert plain["scenario"].pop("frame_names") == "header"
    before = Condition.from_json(json.dumps(plain).encode())
    assert before.id != after.id
    with pytest.raises(SettingError, match=r"frame_names: must be header, .* run it again"):
        before.prepare()
    alone = problem(tmp_path, ball("world"))
    assert "frame_names" not in json.loads(alone.to_json())["scenario"]


def test_a_scene_of_one_frame_needs_no_transform_and_a_virtual_joint_names_it(
    tmp_path: Path,
) -> None:
    def place(frame: str, *transforms: dict[str, Any]) -> tuple[float, ...]:
        (condition,) = conditions(
            *words, *samples.write_problem(tmp_path, ball(frame, *transforms))
        ).values()
        (obstacle,) = obstacles_of(condition)
        return tuple(obstacle.center)

    words = [*samples.write_robot(tmp_path), *COVERED, "robot.base_position=[0,1,0]"]
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


PLACE = {"translation": [1, 0, 0], "rotation": [0, 0, 0.6, 0.8]}
SHELF = {"header": {"frame_id": "shelf"}}


@pytest.mark.parametrize("file", ["scene", "request"])
@pytest.mark.parametrize(
    ("joints", "named"),
    [
        ({}, ""),
        ({"header": {"frame_id": "/world"}}, ""),
        (SHELF | {"transforms": [PLACE]}, ""),  # it stands at the origin
        ({"transforms": [PLACE]}, r"a robot at the origin .*, was 'one at \(1, 0, 0\) m"),
        (SHELF, r"was 'one at \(-0.28, 0.96, 0\) m"),
        ({"header": {"frame_id": "odd"}}, "stands still .* was 'odd'"),
        ({"transforms": []}, "a transform per joint of .*, was 0"),
    ],
)
def test_a_robot_that_its_virtual_joint_moves_is_refused(
    file: str, joints: dict[str, Any], named: str, tmp_path: Path
) -> None:
    virtual = {"joint_names": ["virtual"], "transforms": [{}]} | joints
    transforms = [SELF, moved("shelf", "world", **PLACE)]
    asked, message = request(), scene(fixed_frame_transforms=transforms)
    robot = message.setdefault("robot_state", {}) if file == "scene" else asked["start_state"]
    robot["multi_dof_joint_state"] = virtual
    if not named:
        problem(tmp_path, message, asked).prepare()
        return
    with pytest.raises(SettingError, match=named) as refusal:
        problem(tmp_path, message, asked).prepare()
    assert str(refusal.value).startswith(f"scenario.{file}: ")


def test_the_goal_of_a_link_may_be_given_in_any_frame_that_stands_still(tmp_path: Path) -> None:
    """Its position and its orientation each in a frame of their own; quaternions are normalised."""
    rng = np.random.default_rng(5)
    (camera, camera_plain), (shelf, shelf_plain), (place, place_plain), (turn, turn_plain) = (
        random_pose(rng) for _ in range(4)
    )
    frames = {"camera": camera_plain, "shelf": shelf_plain}
    transforms = [moved(name, "world", **as_transform(pose)) for name, pose in frames.items()]
    region = {"primitives": [{"type": 2, "dimensions": [0.02]}], "primitive_poses": [place_plain]}
    position = {"header": {"frame_id": "/camera"}, "link_name": "tip", "constraint_region": region}
    longer = [1.005 * part for part in turn_plain["orientation"]]
    orientation = {"header": {"frame_id": "shelf"}, "link_name": "tip", "orientation": longer}
    orientation |= {f"absolute_{axis}_axis_tolerance": 0.1 for axis in "xyz"}
    goal = {"position_constraints": [position], "orientation_constraints": [orientation]}
    message = scene(fixed_frame_transforms=[SELF, *transforms])
    condition = problem(tmp_path, message, request(goal_constraints=[goal]))
    (phase,) = posture_task(condition.robot.build(), condition.scenario).phases
    assert np.allclose(phase.goal.point, (camera * place).translation, atol=1e-9)
    angles = np.deg2rad(phase.goal.rotation)
    assert np.allclose(pin.rpy.rpyToMatrix(*angles), (shelf * turn).rotation, atol=1e-9)
