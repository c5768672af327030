"""A task that MoveIt wrote, in the words of planners: joints by name, pairs that may touch."""

import re
from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.kinematics import frame_pose, local_pose
from evoexp.robots.meshes import loaded_mesh
from evoexp.scenarios.motion_tasks import ArmMotion
from evoexp.scenarios.moveit import LinkGoal, MoveitTask
from evoexp.scenarios.moveit_files import Pose
from evoexp.scenarios.posture_task import Phase, PointGoal, PoseGoal, PostureTask


def links_of_bodies(assembly: Assembly) -> dict[str, str]:
    """Return the link of each body: its own name, or without a number that tells bodies apart."""
    names = [str(item.name) for item in assembly.geometry.geometryObjects]
    frames = assembly.frames
    links = set() if frames is None else {*dict(frames.standing), *frames.moving}
    return {name: name if name in links else re.sub(r"_\d+$", "", name) for name in names}


def with_allowed_pairs(assembly: Assembly, task: MoveitTask) -> Assembly:
    """Return a robot with the pairs that may touch: the task's matrix has the last word."""
    allowed, disabled = task.allowed, set(assembly.disabled)
    for (one, link), (two, other) in combinations(links_of_bodies(assembly).items(), 2):
        may_touch = allowed.may_touch(link, other)
        if may_touch is not None and link != other:
            (disabled.add if may_touch else disabled.discard)(frozenset((one, two)))
    return assembly._replace(disabled=frozenset(disabled))


def arm_motion(assembly: Assembly, task: ArmMotion | MoveitTask) -> ArmMotion:
    """Return a task as a motion between configurations; refuse a goal that is a pose."""
    if isinstance(task, ArmMotion):
        return task
    q_goal = task.goal_configuration(assembly.joint_names)
    if q_goal is None:
        must = "a goal of joints for this planner (posture_es plans to poses)"
        raise SettingError("scenario.request", must, f"a pose of '{task.plan_request.link}'")
    world = task.world(assembly.frames, loaded_mesh)
    start, goal = (
        tuple(tuple(_typed(assembly, q)[a:b].tolist()) for a, b in assembly.arm_slices)
        for q in (task.start_configuration(assembly.joint_names), q_goal)
    )
    return as_motion(task, start, goal, world.obstacles)


def as_motion(
    task: Any, start: Sequence[Any], goal: Sequence[Any], obstacles: Sequence[Any]
) -> ArmMotion:
    """Return a motion between two configurations [deg], arm by arm, with the margin of a task."""
    return ArmMotion(
        q_start=tuple(start),
        q_goal=tuple(goal),
        security_margin=task.security_margin,
        length_unit=task.length_unit,
        obstacles=tuple(obstacles),
    )


def posture_task(assembly: Assembly, task: PostureTask | MoveitTask) -> PostureTask:
    """Return a task as one of reaching a pose; refuse one whose pairs with obstacles may touch."""
    if not isinstance(task, MoveitTask):
        return task
    world, names = task.world(assembly.frames, loaded_mesh), assembly.joint_names
    if pairs := touching(assembly, task):
        body = str(assembly.geometry.geometryObjects[pairs[0][0]].name)
        obstacle = world.objects[pairs[0][1]]
        must = "free of bodies that may touch objects, with this planner"
        raise SettingError("scenario.scene", must, f"'{body}' and '{obstacle}'")
    q_goal = task.goal_configuration(names)
    if q_goal is None:
        link = task.link_goal(world.frames)
    else:
        tool = assembly.tools[0]
        local = local_pose(assembly.table, tool.joint, tool.rotation, tool.position)
        pose = frame_pose(assembly.table, tool.joint - 1, local, q_goal)
        place = Pose(pose[:9].reshape(3, 3), pose[9:])
        link = LinkGoal(place, task.position_tolerance, task.angle_tolerance)
    x, y, z = link.pose.position.tolist()
    goal: PoseGoal | PointGoal = PointGoal(kind="point", point=(x, y, z))
    if link.angle is not None:
        goal = PoseGoal(kind="pose", point=(x, y, z), rotation=link.pose.angles)
    # a goal that is a point only is rated without the term of the orientation
    terms = () if link.angle is not None else ("goal_distance", "limit_margin", "collision")
    return PostureTask(
        q_start=tuple(_typed(assembly, task.start_configuration(names)).tolist()),
        phases=(Phase(name="goal", goal=goal, terms=terms),),
        position_tolerance=link.distance,
        angle_tolerance=task.angle_tolerance if link.angle is None else link.angle,
        security_margin=task.security_margin,
        length_unit=task.length_unit,
        obstacles=world.obstacles,
    )


def touching(assembly: Assembly, task: MoveitTask) -> tuple[tuple[int, int], ...]:
    """Return the pairs (body, obstacle) that may touch, by their numbers."""
    allowed, objects = task.allowed, task.world(assembly.frames, loaded_mesh).objects
    return tuple(
        (body, obstacle)
        for body, link in enumerate(links_of_bodies(assembly).values())
        for obstacle, name in enumerate(objects)
        if allowed.may_touch(link, name)
    )


def hull_notes(names: Sequence[str]) -> tuple[str, ...]:
    """Say that a search takes obstacles to be larger than they are, if there are such."""
    if not names:
        return ()
    note = "meshes, cones and hulls: the search tests the boxes around them, the verdict is of the"
    return (f"{note} convex hulls: {', '.join(names)}",)


def _typed(assembly: Assembly, q: FloatArray) -> FloatArray:
    """Return q (nq,) [rad, m] as scenarios give it [deg, m]."""
    return np.where(assembly.table.slides, q, q / DEGREE)
