"""A small arm, and scenes and requests for it as MoveIt writes them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import yaml

from evoexp.condition import Condition
from evoexp.planners.arm_tasks import arm_motion
from evoexp.robots.meshes import loaded_mesh
from evoexp.scenarios.moveit_files import REQUEST, SCENE, MessagePart, read_document
from evoexp.scenarios.moveit_scene import World, read_allowed, read_state, read_world
from evoexp.testing import conditions

SAMPLES = Path(__file__).parent / "scenarios"
REFUSED_MESSAGES = yaml.safe_load((SAMPLES / "refused_messages.yaml").read_text(encoding="utf-8"))

# three turning joints, a passive finger that slides, and one that a URDF left as fixed
URDF = """<robot name="small">
  <link name="base"><collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision></link>
  {links}
  {joints}
  <joint name="finger" type="prismatic"><parent link="lower"/><child link="tip"/>
    <origin xyz="0 0 0.4"/><axis xyz="1 0 0"/><limit lower="0" upper="0.1" effort="1" velocity="1"/>
  </joint>
  <link name="tip"><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
  <joint name="nail" type="fixed"><parent link="tip"/><child link="point"/></joint>
  <link name="point"/>
</robot>"""
LINK = """<link name="{}"><collision><origin xyz="0 0 0.2"/><geometry>
  <cylinder radius="0.04" length="0.36"/></geometry></collision></link>"""
JOINT = """<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/>
  <origin xyz="0 0 {}"/><axis xyz="{}"/>
  <limit lower="-2.5" upper="2.5" effort="1" velocity="1"/></joint>"""
CHAIN = (
    ("turn", "base", "column", 0.1, "0 0 1"),
    ("lean", "column", "upper", 0.4, "0 1 0"),
    ("bend", "upper", "lower", 0.4, "0 1 0"),
)
SRDF = """<robot name="small"><group name="arm"><chain base_link="base" tip_link="lower"/></group>
<disable_collisions link1="column" link2="lower" reason="Never"/></robot>"""
START, GOAL = (0.0, 0.6, 0.8), (1.5, 0.6, 0.8)
JOINTS = ("turn", "lean", "bend")


def write_robot(folder: Path) -> list[str]:
    """Write URDF and SRDF; return the overrides that choose them."""
    links = "".join(LINK.format(child) for _, _, child, *_ in CHAIN)
    joints = "".join(JOINT.format(*row) for row in CHAIN)
    (folder / "small.urdf").write_text(URDF.format(links=links, joints=joints))
    (folder / "small.srdf").write_text(SRDF)
    paths = (f"robot.{k}={folder / f'small.{e}'}" for k, e in (("path", "urdf"), ("srdf", "srdf")))
    return ["robot=urdf", *paths]


def body(kind: Any, dimensions: list[float], position: list[float], **more: Any) -> dict[str, Any]:
    """Return a collision object of one primitive."""
    pose = {"position": position, "orientation": [0, 0, 0, 1]}
    name = more.pop("name", "thing")
    primitives = [{"type": kind, "dimensions": dimensions}]
    return {"id": name, "primitives": primitives, "primitive_poses": [pose], **more}


def scene(*objects: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return a planning scene."""
    return {"robot_model_name": "small", "world": {"collision_objects": list(objects)}, **more}


def request(**changes: Any) -> dict[str, Any]:
    """Return a request from `START` to `GOAL`; the finger stands at 0.05."""
    goal = [{"joint_name": n, "position": q} for n, q in zip(JOINTS, GOAL, strict=True)]
    names, values = [*JOINTS, "finger", "nail"], [*START, 0.05, 0.3]
    plain = {
        "group_name": "arm",
        "start_state": {"joint_state": {"name": names, "position": values}},
        "goal_constraints": [{"joint_constraints": goal}],
    }
    return plain | changes


def written(plain: Any) -> str:
    """Return plain data as YAML without aliases."""
    return str(yaml.safe_dump(json.loads(json.dumps(plain))))


def write_problem(
    folder: Path, world: dict[str, Any], asked: dict[str, Any] | None = None, number: str = "0001"
) -> list[str]:
    """Write a problem; return the overrides that choose it."""
    paths = {"scene": world, "request": request() if asked is None else asked}
    for name, plain in paths.items():
        (folder / f"{name}{number}.yaml").write_text(written(plain))
    return [
        "scenario=moveit",
        *(f"scenario.{name}={folder / f'{name}{number}.yaml'}" for name in paths),
    ]


PLANNER = ["planner=via_points", "ga=via_points", "objective=via_points"]
COVERED = [*PLANNER, "collision=covered_bodies", "budget=smoke"]


def document(plain: Any, message: str = SCENE) -> MessagePart:
    """Read a scene or a request out of plain data, or out of the text of its file."""
    text = plain if isinstance(plain, bytes) else written(plain).encode()
    return read_document(text, f"scenario.{'request' if message == REQUEST else 'scene'}", message)


def read(plain: Any) -> World:
    """Read all of a scene."""
    file = document(plain)
    read_state(file["robot_state"])
    read_allowed(file)
    return read_world(file, None, (), loaded_mesh)


def problem(folder: Path, message: Any, asked: Any = None, *words: str) -> Condition:
    """Return the condition of a scene and a request."""
    given = [*write_robot(folder), *write_problem(folder, message, asked), *COVERED, *words]
    (condition,) = conditions(*given).values()
    return condition


def obstacles_of(condition: Any) -> Any:
    """Return the obstacles of a condition's motion."""
    return arm_motion(condition.robot.build(), condition.scenario).obstacles


def random_pose(rng: np.random.Generator) -> tuple[pin.SE3, dict[str, Any]]:
    """Return a pose, also as it is written."""
    quaternion, position = rng.normal(size=4), rng.normal(size=3)
    quaternion /= np.linalg.norm(quaternion)
    x, y, z, w = quaternion
    plain = {"position": position.tolist(), "orientation": quaternion.tolist()}
    return pin.SE3(pin.Quaternion(w, x, y, z).toRotationMatrix(), position), plain


def mesh(corners: Any, triangles: Any, **changes: Any) -> dict[str, Any]:
    """Return a collision object of one mesh."""
    data = {
        "vertices": [dict(zip("xyz", map(float, corner), strict=True)) for corner in corners],
        "triangles": [{"vertex_indices": np.asarray(face).tolist()} for face in triangles],
    }
    return {"id": "thing", "meshes": [data], "mesh_poses": [{}]} | changes
