"""A task that MoveIt wrote, in the words of planners: joints by name, pairs that may touch."""

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from evoexp.collision.scene import Scene
from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.mesh_pieces import loaded_mesh
from evoexp.robots.poses import frame_pose, local_pose
from evoexp.scenarios.arm_motion import ArmMotion
from evoexp.scenarios.moveit import Joints, MoveitTask
from evoexp.scenarios.moveit_files import Pose
from evoexp.scenarios.moveit_scene import World

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


def links_of_bodies(assembly: Assembly) -> dict[str, str]:
    """Return the link of each body: its own name, or without a number that tells bodies apart."""
    names = [str(item.name) for item in assembly.geometry.geometryObjects]
    frames = assembly.frames
    links = set() if frames is None else {*dict(frames.standing), *frames.moving}
    return {name: name if name in links else re.sub(r"_\d+$", "", name) for name in names}


def with_allowed_pairs(assembly: Assembly, task: MoveitTask) -> Assembly:
    """Return a robot whose pairs that may touch are those of the task's matrix."""
    return assembly._replace(disabled=task.disabled(links_of_bodies(assembly), assembly.disabled))


def arm_motion(assembly: Assembly, task: ArmMotion | MoveitTask) -> ArmMotion:
    """Return a task as a motion between configurations.

    Raises:
        SettingError: If its goal is a pose, or is silent about a joint.
    """
    if isinstance(task, ArmMotion):
        return task
    return task.arm_motion(moving_joints(assembly), _world(assembly, task))


def posture_task(assembly: Assembly, task: "PostureTask | MoveitTask") -> "PostureTask":
    """Return a task as one of reaching a pose of the tool.

    Raises:
        SettingError: If a joint has no start, or pairs with obstacles may touch.
    """
    if not isinstance(task, MoveitTask):
        return task
    world = _world(assembly, task)
    if pairs := touching(assembly, task):
        body = str(assembly.geometry.geometryObjects[pairs[0][0]].name)
        obstacle = world.objects[pairs[0][1]]
        must = "free of bodies that may touch objects, with this planner"
        raise SettingError("scenario.scene", must, f"'{body}' and '{obstacle}'")
    joints = moving_joints(assembly)
    goal = task.goal_configuration(joints)
    return task.posture_task(joints, world, None if goal is None else _tool_pose(assembly, goal))


def touching(assembly: Assembly, task: MoveitTask) -> tuple[tuple[int, int], ...]:
    """Return the pairs (body, obstacle) that may touch, by their numbers."""
    return task.touching(links_of_bodies(assembly), _world(assembly, task))


def without_pairs(found: Scene, task: MoveitTask, assembly: Assembly) -> Scene:
    """Return a scene without the pairs of a body and an obstacle that may touch.

    Args:
        found: Bodies first, then the obstacles.
        task: Names the pairs.
    """
    num_bodies = assembly.geometry.ngeoms
    allowed = {(body, num_bodies + k) for body, k in touching(assembly, task)}
    kept = [(int(a), int(b)) not in allowed for a, b in found.pairs]
    return found.of_pairs(np.array(kept, dtype=np.bool_)) if allowed else found


def hull_notes(names: Sequence[str]) -> tuple[str, ...]:
    """Say that a search takes obstacles to be larger than they are, if there are such."""
    if not names:
        return ()
    told = "meshes, cones and hulls: the search tests the boxes around them, the verdict is of the"
    return (f"{told} convex hulls: {', '.join(names)}",)


def _world(assembly: Assembly, task: MoveitTask) -> World:
    return task.world(assembly.frames, loaded_mesh)


def _tool_pose(assembly: Assembly, q: FloatArray) -> Pose:
    """Return the pose of the first arm's tool at q (nq,) [rad, m]."""
    tool = assembly.tools[0]
    local = local_pose(assembly.table, tool.joint, tool.rotation, tool.position)
    found = frame_pose(assembly.table, tool.joint - 1, local, q)
    return Pose(found[:9].reshape(3, 3), found[9:])
