"""The places that a task names, to be marked in pictures."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.records import FloatArray
from evoexp.scenarios.docking import Docking
from evoexp.scenarios.mission import Mission
from evoexp.scenarios.pick_and_place import PickAndPlace
from evoexp.scenarios.posture_task import PointGoal, PoseGoal, PostureTask


class Target(NamedTuple):
    """A place that a tool or a robot is to reach.

    Attributes:
        name: Name beside the mark.
        point: (3,) in the world [length unit].
    """

    name: str
    point: FloatArray


def targets(scenario: Any, robot: Any) -> tuple[Target, ...]:
    """Return the places that a scenario names for a robot; none if it names configurations."""
    if isinstance(scenario, PickAndPlace):
        return (
            _target("via point", scenario.via_point),
            _target("goal point", scenario.goal_point),
        )
    if isinstance(scenario, Docking):
        return (_target("target", scenario.target),)
    if isinstance(scenario, Mission):
        (x, y), (along, up) = scenario.task_origin, scenario.docking.target
        return (_target("target", (x + along, y, robot.body_height + up)),)
    if isinstance(scenario, PostureTask):
        goals = ((phase.name, phase.goal) for phase in scenario.all_phases)
        return tuple(
            _target(name, goal.point)
            for name, goal in goals
            if isinstance(goal, PointGoal | PoseGoal)
        )
    return ()


def _target(name: str, point: tuple[float, ...]) -> Target:
    return Target(name.replace("_", " "), np.array([*point, 0.0][:3]))
