"""A task that MoveIt wrote, in the words of planners: joints by name, pairs that may touch."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from evoexp.collision.scene import Scene
from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.poses import frame_pose, local_pose
from evoexp.scenarios.arm_motion import ArmMotion
from evoexp.scenarios.moveit import Joints, MoveitTask
from evoexp.scenarios.moveit_files import Pose

if TYPE_CHECKING:
    from evoexp.scenarios.posture_task import PostureTask


def moving_joints(assembly: Assembly) -> Joints:
    """Return the joints of a robot that move."""
    model = assembly.model
    own = [joint for joint in range(1, model.njoints) if model.nqs[joint] > 0]
    own.sort(key=lambda joint: int(model.idx_qs[joint]))
    slides = np.zeros(len(own), dtype=np.bool_)
    slides[assembly.table.index_q[assembly.table.prismatic]] = True
    return Joints(tuple(str(model.names[joint]) for joint in own), slides, assembly.arm_slices)


def with_allowed_pairs(assembly: Assembly, task: MoveitTask) -> Assembly:
    """Return a robot whose pairs that may touch are those of the task's matrix."""
    names = tuple(item.name for item in assembly.geometry.geometryObjects)
    return assembly._replace(disabled=task.disabled(names, assembly.disabled))


def arm_motion(assembly: Assembly, task: ArmMotion | MoveitTask) -> ArmMotion:
    """Return a task as a motion between configurations.

    Raises:
        SettingError: If its goal is a pose, or is silent about a joint.
    """
    return task if isinstance(task, ArmMotion) else task.arm_motion(moving_joints(assembly))


def posture_task(assembly: Assembly, task: "PostureTask | MoveitTask") -> "PostureTask":
    """Return a task as one of reaching a pose of the tool.

    Raises:
        SettingError: If a joint has no start, or pairs with obstacles may touch.
    """
    if not isinstance(task, MoveitTask):
        return task
    names = tuple(item.name for item in assembly.geometry.geometryObjects)
    if pairs := task.touching(names):
        body, obstacle = names[pairs[0][0]], task.world.objects[pairs[0][1]]
        must = "free of bodies that may touch objects, with this planner"
        raise SettingError("scenario.scene", must, f"'{body}' and '{obstacle}'")
    joints = moving_joints(assembly)
    goal = task.goal_configuration(joints)
    return task.posture_task(joints, None if goal is None else _tool_pose(assembly, goal))


def without_pairs(found: Scene, task: MoveitTask, num_bodies: int) -> Scene:
    """Return a scene without the pairs of a body and an obstacle that may touch.

    Args:
        found: Bodies first, then the obstacles.
        task: Names the pairs.
        num_bodies: Of the robot.
    """
    touching = {(body, num_bodies + k) for body, k in task.touching(found.names[:num_bodies])}
    kept = [(int(a), int(b)) not in touching for a, b in found.pairs]
    return found.of_pairs(np.array(kept, dtype=np.bool_)) if touching else found


def hull_notes(names: Sequence[str]) -> tuple[str, ...]:
    """Say that a search takes obstacles to be larger than they are, if there are such."""
    if not names:
        return ()
    told = "meshes, cones and hulls: the search tests the boxes around them, the verdict is of the"
    return (f"{told} convex hulls: {', '.join(names)}",)


def _tool_pose(assembly: Assembly, q: FloatArray) -> Pose:
    """Return the pose of the first arm's tool at q (nq,) [rad, m]."""
    tool = assembly.tools[0]
    local = local_pose(assembly.table, tool.joint, tool.rotation, tool.position)
    found = frame_pose(assembly.table, tool.joint - 1, local, q)
    return Pose(found[:9].reshape(3, 3), found[9:])
