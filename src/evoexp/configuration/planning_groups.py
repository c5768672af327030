"""Settings of the robot by a task that MoveIt wrote: its group, joints at rest, its tool's link.

The door puts it into the robot's settings, so that the robot of a condition is told by its own
settings alone.
"""

from typing import Any

from evoexp.attachments import SHA256, File
from evoexp.condition import PARTS
from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.registry import component_class
from evoexp.robots.joint_choice import joint_roles
from evoexp.robots.srdf import Srdf
from evoexp.robots.urdf_reading import UrdfJoint, urdf_file
from evoexp.scenarios.moveit import MoveitTask
from evoexp.validation import TARGET, build

TURNING, SLIDING = ("revolute", "continuous"), "prismatic"


def with_shared_packages(plain: dict[str, Any]) -> dict[str, Any]:
    """Return a configuration whose planning scene finds meshes in the robot's packages, too.

    Args:
        plain: Groups as plain data, before files are read.
    """
    robot, scenario = (plain.get(part) for part in PARTS[:2])
    if not isinstance(scenario, dict) or scenario.get(TARGET) != MoveitTask.component:
        return plain
    shared = robot.get("packages") if isinstance(robot, dict) else None
    if not isinstance(shared, dict):
        return plain
    packages = shared | (scenario.get("packages") or {})
    return {**plain, "scenario": {**scenario, "packages": packages}}


def with_planning_group(plain: dict[str, Any]) -> dict[str, Any]:
    """Return a configuration whose robot is as the request wants it, if a request there is.

    Args:
        plain: Groups as plain data, files as hashes.

    Raises:
        SettingError: If robot and request contradict each other.
    """
    robot, scenario = (plain.get(part) for part in PARTS[:2])
    if not isinstance(scenario, dict) or scenario.get(TARGET) != MoveitTask.component:
        return plain
    if not isinstance(robot, dict) or robot.get(TARGET) != "urdf" or "urdf" not in robot:
        return plain
    task: MoveitTask = build(scenario, component_class, PARTS[1])
    joints = _joints(robot)
    settings = dict(robot)
    if group := task.plan_request.group:
        given = robot.get("group") or ""
        if given and given != group:
            must = f"'{group}', the group of scenario.request (or left out)"
            raise SettingError("robot.group", must, given)
        if not robot.get("joints") and not robot.get("groups") and robot.get("srdf"):
            settings["group"] = group
    if link := task.plan_request.link:
        given = robot.get("tool_frame") or ""
        if given and given != link:
            must = f"'{link}', the link whose goal scenario.request gives (or left out)"
            raise SettingError("robot.tool_frame", must, given)
        settings["tool_frame"] = link
    standing = _standing(task.state, settings, joints)
    settings["fixed"] = dict(robot.get("fixed") or {}) | standing
    return {**plain, "robot": settings}


def _joints(robot: dict[str, Any]) -> dict[str, UrdfJoint]:
    return urdf_file(File(**robot["urdf"]).content).joints


def _standing(
    state: dict[str, float], robot: dict[str, Any], joints: dict[str, UrdfJoint]
) -> dict[str, float]:
    """Return the start state of joints that stand still [deg, m].

    A state also names joints without a value of their own, which a URDF may have fixed: those are
    left out, as are joints that follow others.
    """
    srdf = robot.get("srdf")
    tree = Srdf(File(sha256=srdf[SHA256]).content, joints) if srdf else None
    groups = tuple(robot.get("groups") or ()) or ((robot["group"],) if robot.get("group") else ())
    roles = joint_roles(
        joints,
        tree,
        tuple(robot.get("joints") or ()),
        groups,
        str(robot.get("base", "fixed")),
        several=bool(robot.get("groups")),
    )
    moving = frozenset[str]().union(*roles.arms)
    found = {}
    for name, value in state.items():
        joint = joints.get(name)
        if joint is None or joint.mimic is not None or name in moving:
            continue
        if joint.kind in TURNING:
            found[name] = value / DEGREE
        elif joint.kind == SLIDING:
            found[name] = value
    return found
