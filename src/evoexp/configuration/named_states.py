"""Configurations that a scenario names: the states of a robot's SRDF, put in as numbers."""

from typing import Any

from evoexp.errors import SettingError
from evoexp.registry import component_class
from evoexp.robots.assembly import Robot
from evoexp.validation import TARGET, build

FIELDS = ("q_start", "q_goal")
OF_ARMS = {"arm_motion": True, "posture_task": False}  # whether a scenario lists arms


def with_named_states(config: dict[str, Any]) -> dict[str, Any]:
    """Put the values of named states in the place of their names.

    `q_start: ready` counts for all arms, `q_start: [ready, folded]` for one each.

    Raises:
        SettingError: If the robot has no such state, or not of all joints that move.
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
