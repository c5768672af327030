"""Building: a composed configuration, as plain data, checked and made into typed settings.

Interpolations are settings that are taken from others, `${ga}` or `${ga.num_generations}`. An
interpolation is a whole value and names one setting. No function is called, as `${oc.env:HOME}`
would: nothing of the environment, which may hold secrets, enters a condition's hash and logs.

Robot and task name parts of each other: states of an SRDF, a planning request's group and link.
Numbers take the place of states, and what a request that MoveIt wrote says of the robot enters the
robot's settings: a condition's robot is told by its own settings alone.
"""

import re
from collections.abc import Mapping
from typing import Any

from evoexp.condition import PARTS, Condition, read_files
from evoexp.configuration.experiment import Budget
from evoexp.configuration.overrides import AROUND, PLANNER_PARTS
from evoexp.configuration.search_path import chosen, folders
from evoexp.errors import SettingError, UnknownSetting, demand
from evoexp.numeric.elementary import DEGREE
from evoexp.registry import component_class
from evoexp.robots.assembly import Robot
from evoexp.robots.urdf import Urdf
from evoexp.robots.urdf_model import joint_roles
from evoexp.scenarios.moveit import MoveitTask
from evoexp.validation import TARGET, AnySettings, build, construct

MOST_REPLICATES = 1_000_000  # of one condition, each of which is a file
MARK = "${"
_WHOLE = re.compile(r"\$\{([A-Za-z_]\w*(?:\.\w+)*)\}")
_FUNCTION = re.compile(r"\$\{[^{}]*:")
_MAX_DEPTH = 100  # of settings taken from settings; deeper ones go round in circles
TURNING, SLIDING = ("revolute", "continuous"), "prismatic"
FIELDS = ("q_start", "q_goal")
OF_ARMS = {"arm_motion": True, "posture_task": False}  # whether a scenario lists arms


def condition_of(config: dict[str, Any], budget: Budget) -> tuple[Condition, bool]:
    """Build a composed configuration; return it with whether the budget capped it."""
    settings = {key: value for key, value in config.items() if key != "conditions"}
    plain, cap = fill_in(settings, settings), budget.max_generations
    asked = (plain.get("ga") or {}).get("num_generations")
    is_capped = cap is not None and isinstance(asked, int) and asked > cap
    if is_capped:  # before a planner takes it in
        settings["ga"] = settings["ga"] | {"num_generations": cap}
        plain = fill_in(settings, settings)
    built = build_condition(plain, str(config["planner"]))
    most = budget.collision_queries
    return built._replace(max_collision_queries=most), is_capped or most is not None


def build_condition(config: dict[str, Any], planner: str) -> Condition:
    """Build the condition of a configuration whose interpolations are filled in.

    The planner's settings as text, with interpolations, tell which groups the planner takes in.
    """
    beside = [folder.path / "scenario" for folder in folders()]  # where files lie
    read = read_files(_with_shared_packages(config), beside, _with_planning_group)
    plain = _with_named_states(read)
    # groups that the planner takes in, whose errors name the group, as it was typed
    for group in (group for group in PLANNER_PARTS if plain.get(group) is not None):
        is_taken = f"${{{group}" in planner
        if not is_taken and group in plain["planner"]:
            must = f"left as it is; set {group} itself"
            raise SettingError(f"planner.{group}", must, plain["planner"][group])
        demand(is_taken, group, "a part of the chosen planner", plain[group])
        build(plain[group], component_class, group)
    # a control or a reference is put around the planner
    around = [group for group in AROUND if plain.get(group) is not None]
    if len(around) > 1:
        must = f"left out beside a {around[0]}"
        raise SettingError(around[1], must, plain[around[1]].get(TARGET))
    for group in around:
        build(plain["planner"], component_class, "planner")
        if TARGET not in plain[group]:
            raise SettingError(group, chosen(group), plain[group])
        must, own = "left out: it is the chosen planner", plain[group].get("planner")
        demand("planner" not in plain[group], f"{group}.planner", must, own)
        plain["planner"] = {**plain[group], "planner": plain["planner"]}
        build(plain["planner"], component_class, group)  # its errors name the group, as typed
    return Condition.from_config({part: plain[part] for part in (*PARTS, "seed")})


def planned_replicates(count: int, budget: Budget) -> int:
    """Return the number of replicates, capped by the budget."""
    is_count = type(count) is int and count >= 1
    demand(is_count, "num_replicates", "a whole number, at least 1", count)
    demand(count <= MOST_REPLICATES, "num_replicates", f"at most {MOST_REPLICATES}", count)
    return count if budget.max_replicates is None else min(count, budget.max_replicates)


def build_settings(kind: type[AnySettings], config: dict[str, Any], group: str) -> AnySettings:
    """Build the settings of a group that is no component."""
    if TARGET in config:
        raise UnknownSetting(f"{group}.{TARGET}", kind.model_fields)
    return construct(kind, build(config, component_class, group), group)


# interpolations


def fill_in(values: Mapping[str, Any], config: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with others in the place of interpolations."""
    return {key: _filled(value, config, str(key), _MAX_DEPTH) for key, value in values.items()}


def _filled(value: Any, config: Mapping[str, Any], field: str, depth: int) -> Any:
    if isinstance(value, dict):
        return {k: _filled(v, config, f"{field}.{k}", depth) for k, v in value.items()}
    if isinstance(value, list):
        return [_filled(v, config, f"{field}[{k}]", depth) for k, v in enumerate(value)]
    if not isinstance(value, str) or MARK not in value:
        return value
    name = _WHOLE.fullmatch(value)
    if name is None:
        is_function = _FUNCTION.search(value)
        reason = "functions such as oc.env are not allowed" if is_function else "it cannot be read"
        raise _refusal(field, reason, value)
    if depth == 0:
        raise _refusal(field, "it leads back to itself", value)
    setting: Any = config
    for part in name[1].split("."):
        if isinstance(setting, list) and part.isdecimal() and int(part) < len(setting):
            setting = setting[int(part)]
        elif isinstance(setting, dict) and part in setting:
            setting = setting[part]
        elif name[1] in PLANNER_PARTS:
            raise SettingError(name[1], chosen(name[1]), None)
        else:
            raise _refusal(field, f"there is no '{name[1]}'", value)
    return _filled(setting, config, field, depth - 1)


def _refusal(field: str, reason: str, text: str) -> SettingError:
    must = f"a value, or the name of another setting in ${{…}} ({reason})"
    return SettingError(field, must, text)


# what robot and task say of each other


def _with_shared_packages(plain: dict[str, Any]) -> dict[str, Any]:
    """Return a configuration whose planning scene finds meshes in the robot's packages, too."""
    robot, scenario = (plain.get(part) for part in PARTS[:2])
    if not isinstance(scenario, dict) or scenario.get(TARGET) != MoveitTask.component:
        return plain
    shared = robot.get("packages") if isinstance(robot, dict) else None
    if not isinstance(shared, dict):
        return plain
    packages = shared | (scenario.get("packages") or {})
    return {**plain, "scenario": {**scenario, "packages": packages}}


def _with_planning_group(plain: dict[str, Any]) -> dict[str, Any]:
    """Return a configuration whose robot is as the request wants it, if a request there is."""
    robot, scenario = (plain.get(part) for part in PARTS[:2])
    if not isinstance(scenario, dict) or scenario.get(TARGET) != MoveitTask.component:
        return plain
    if not isinstance(robot, dict) or robot.get(TARGET) != "urdf" or "urdf" not in robot:
        return plain
    task: MoveitTask = build(scenario, component_class, PARTS[1])
    settings, request = dict(robot), task.plan_request
    for name, requested, what in (
        ("group", request.group, "the group of scenario.request"),
        ("tool_frame", request.link, "the link whose goal scenario.request gives"),
    ):
        typed, must = robot.get(name) or "", f"'{requested}', {what} (or left out)"
        demand(not requested or typed in ("", requested), f"robot.{name}", must, typed)
    chooses_joints = robot.get("joints") or robot.get("groups")
    if request.group and not chooses_joints and robot.get("srdf"):
        settings["group"] = request.group
    if request.link:
        settings["tool_frame"] = request.link
    settings["fixed"] = dict(robot.get("fixed") or {}) | _standing(task.state, settings)
    return {**plain, "robot": settings}


def _standing(state: dict[str, float], settings: dict[str, Any]) -> dict[str, float]:
    """Return the start state of joints that stand still, but fixed and mimicking ones [deg, m]."""
    robot: Urdf = build(settings, component_class, PARTS[0])
    moving, standing = joint_roles(robot).moving, {}
    for name, value in state.items():
        joint = robot.file.joints.get(name)
        if joint is None or joint.mimic is not None or name in moving:
            continue
        if joint.kind in TURNING:
            standing[name] = value / DEGREE
        elif joint.kind == SLIDING:
            standing[name] = value
    return standing


def _with_named_states(config: dict[str, Any]) -> dict[str, Any]:
    """Put the values of named states in the place of their names.

    `q_start: ready` counts for all arms, `q_start: [ready, folded]` for one each.
    """
    scenario = config.get("scenario")
    if not isinstance(scenario, dict) or scenario.get(TARGET) not in OF_ARMS:
        return config
    several, with_values = OF_ARMS[scenario[TARGET]], dict(scenario)
    for name in FIELDS:
        value = scenario.get(name)
        listed = several and isinstance(value, list) and any(isinstance(v, str) for v in value)
        if not isinstance(value, str) and not listed:
            continue
        robot = build(config.get("robot"), component_class, "robot")
        if not isinstance(robot, Robot):
            raise SettingError("robot", "one whose SRDF names states", None)
        states = robot.build().states
        of_arms = value if isinstance(value, list) else [value] * len(states)
        must = f"one state or list per arm of the robot ({len(states)})"
        demand(len(of_arms) == len(states), f"scenario.{name}", must, value)
        arms = [
            state.values_of(own, f"scenario.{name}") if isinstance(own, str) else own
            for own, state in zip(of_arms, states, strict=True)
        ]
        with_values[name] = arms if several else arms[0]
    return {**config, "scenario": with_values}
