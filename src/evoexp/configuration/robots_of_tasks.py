"""Robot and task name parts of each other: states of an SRDF, a planning request's group and link.

The door puts numbers in the place of states, and what a request that MoveIt wrote says of the robot
into the robot's settings: a condition's robot is told by its own settings alone.
"""

from typing import Any

from evoexp.condition import PARTS
from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.registry import component_class
from evoexp.robots.assembly import Robot
from evoexp.robots.joint_choice import joint_roles
from evoexp.robots.urdf import Urdf
from evoexp.scenarios.moveit import MoveitTask
from evoexp.validation import TARGET, build

TURNING, SLIDING = ("revolute", "continuous"), "prismatic"
FIELDS = ("q_start", "q_goal")
OF_ARMS = {"arm_motion": True, "posture_task": False}  # whether a scenario lists arms


def with_shared_packages(plain: dict[str, Any]) -> dict[str, Any]:
    """Return a configuration whose planning scene finds meshes in the robot's packages, too."""
    robot, scenario = (plain.get(part) for part in PARTS[:2])
    if not isinstance(scenario, dict) or scenario.get(TARGET) != MoveitTask.component:
        return plain
    shared = robot.get("packages") if isinstance(robot, dict) else None
    if not isinstance(shared, dict):
        return plain
    packages = shared | (scenario.get("packages") or {})
    return {**plain, "scenario": {**scenario, "packages": packages}}


def with_planning_group(plain: dict[str, Any]) -> dict[str, Any]:
    """Return a configuration whose robot is as the request wants it, if a request there is."""
    robot, scenario = (plain.get(part) for part in PARTS[:2])
    if not isinstance(scenario, dict) or scenario.get(TARGET) != MoveitTask.component:
        return plain
    if not isinstance(robot, dict) or robot.get(TARGET) != "urdf" or "urdf" not in robot:
        return plain
    task: MoveitTask = build(scenario, component_class, PARTS[1])
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
    settings["fixed"] = dict(robot.get("fixed") or {}) | _standing(task.state, settings)
    return {**plain, "robot": settings}


def _standing(state: dict[str, float], settings: dict[str, Any]) -> dict[str, float]:
    """Return the start state of joints that stand still, but fixed and mimicking ones [deg, m]."""
    robot: Urdf = build(settings, component_class, PARTS[0])
    moving, found = joint_roles(robot).moving, {}
    for name, value in state.items():
        joint = robot.file.joints.get(name)
        if joint is None or joint.mimic is not None or name in moving:
            continue
        if joint.kind in TURNING:
            found[name] = value / DEGREE
        elif joint.kind == SLIDING:
            found[name] = value
    return found


def with_named_states(config: dict[str, Any]) -> dict[str, Any]:
    """Put the values of named states in the place of their names.

    `q_start: ready` counts for all arms, `q_start: [ready, folded]` for one each.
    """
    scenario = config.get("scenario")
    if not isinstance(scenario, dict) or scenario.get(TARGET) not in OF_ARMS:
        return config
    several, found = OF_ARMS[scenario[TARGET]], dict(scenario)
    for name in FIELDS:
        value = scenario.get(name)
        listed = several and isinstance(value, list) and any(isinstance(v, str) for v in value)
        if not isinstance(value, str) and not listed:
            continue
        robot = build(config.get("robot"), component_class, "robot")
        if not isinstance(robot, Robot):
            raise SettingError("robot", "one whose SRDF names states", None)
        states = robot.build().states
        given = value if isinstance(value, list) else [value] * len(states)
        if len(given) != len(states):
            must = f"one state or list per arm of the robot ({len(states)})"
            raise SettingError(f"scenario.{name}", must, value)
        arms = [
            state.values_of(own, f"scenario.{name}") if isinstance(own, str) else own
            for own, state in zip(given, states, strict=True)
        ]
        found[name] = arms if several else arms[0]
    return {**config, "scenario": found}
