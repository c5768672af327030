"""Robots out of URDFs, tasks in which they move, and the poses of their parts."""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.kinematics import IDENTITY, KinematicTable, frame_pose, frame_poses, local_pose
from evoexp.robots.urdf import Urdf

UR5_LIKE = Path(__file__).parent / "data" / "ur5_like"
REACH = (
    *("robot=urdf", "scenario=urdf_reach", "planner=posture_es", "ga=corsepius"),
    *("objective=corsepius_reach", "collision=corsepius_spheres"),
)
TWO = (
    *("robot=two_urdf", "scenario=urdf_two_arms", "planner=rana_puma", "ga=rana_puma"),
    *("objective=rana_puma", "collision=urdf_two_arms"),
)


def task(
    *overrides: str, base: tuple[str, ...] = REACH, path: Path = UR5_LIKE / "ur5_like.urdf"
) -> Any:
    """Return the condition of a URDF's task: to reach a point, unless another is given."""
    paths = (
        [] if any(word.startswith("robot.path=") for word in overrides) else [f"robot.path={path}"]
    )
    condition: Condition = compose.expand([*base, *paths, *overrides])[0].conditions[0].condition
    return condition


def urdf(path: Path, **settings: Any) -> Urdf:
    """Return the robot of a file."""
    found = Urdf.read_files({"path": str(path), **settings}, "robot")
    return Urdf.model_validate(found, strict=False)


def urdf_of(folder: Path, text: str, **settings: Any) -> Urdf:
    """Return the robot of a text, written to `r.urdf`."""
    (folder / "r.urdf").write_text(text)
    return urdf(folder / "r.urdf", **settings)


def placements(robot: Assembly, q: FloatArray) -> tuple[Any, Any]:
    """Return Pinocchio's placements of joints and of bodies."""
    data, places = robot.model.createData(), robot.geometry.createData()
    pin.updateGeometryPlacements(robot.model, data, robot.geometry, places, np.asarray(q))
    return data.oMi, places.oMg


def tool_pose(robot: Assembly, q: FloatArray) -> FloatArray:
    """Return evoexp's pose of the first tool: rotation by rows, then position (12,)."""
    tool = robot.tools[0]
    local = local_pose(robot.table, tool.joint, tool.rotation, tool.position)
    return frame_pose(robot.table, tool.joint - 1, local, np.asarray(q))


def forward_kinematics(table: KinematicTable, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotations (joints, 3, 3, configurations) and origins (joints, 3, configurations)."""
    poses, q = np.empty((len(table.chain.parent), 12, q.shape[1])), np.ascontiguousarray(q)
    for joint, own in enumerate(poses):
        frame_poses(table.chain, joint, IDENTITY, q, own)
    return poses[:, :9].reshape(len(poses), 3, 3, -1), poses[:, 9:]


def random_tree(rng: np.random.Generator, size: int, is_chain: bool = False) -> pin.Model:
    """Return a model of random axes and placements, turning and sliding, in branches or a chain."""
    model = pin.Model()
    for k in range(size):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        kinds = [getattr(pin, f"JointModel{name}")() for name in ("RX", "RY", "RZ", "PX", "PZ")]
        kinds += [pin.JointModelRevoluteUnaligned(axis), pin.JointModelPrismaticUnaligned(axis)]
        parent = k if is_chain else int(rng.integers(0, k + 1))
        turn = pin.Quaternion(rng.normal(size=4)).normalized().toRotationMatrix()
        place = pin.SE3(turn if rng.random() < 0.7 else np.eye(3), rng.uniform(-0.5, 0.5, size=3))
        model.addJoint(parent, kinds[rng.integers(len(kinds))], place, f"joint_{k}")
    return model
