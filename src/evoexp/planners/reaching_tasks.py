"""Tasks of one planar arm among ellipses: its tip passes a via point and ends at a goal point."""

from typing import NamedTuple

import numpy as np

from evoexp.collision.planar.link_ellipses import EllipseCollision, LinkEllipses
from evoexp.collision.scene import Scene, scene
from evoexp.errors import SettingError, demand
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly, Robot
from evoexp.scenarios.motion_tasks import PickAndPlace

ANYWHERE = np.array([-np.inf, np.inf, -np.inf, np.inf])  # the box of the first sub-path


class Problem(NamedTuple):
    """Robot and scenario, prepared for the search."""

    assembly: Assembly  # the robot, built
    collision: EllipseCollision  # the paper's collision model on it
    start: FloatArray  # (joints,) [rad]
    joint_limits: FloatArray  # (joints, 2) [rad]
    targets: FloatArray  # (2, 2) via point and goal point
    boxes: FloatArray  # (2, 4) where the tip must end: least and greatest x, y
    scene: Scene  # the bodies themselves, for the exact verdict on a motion
    security_margin: float  # clearance that the task requires [length unit]


def reaching_problem(robot: Robot, scenario: PickAndPlace, model: LinkEllipses) -> Problem:
    """Build the robot; a SettingError refuses a start that does not fit it, or collides."""
    assembly = robot.build()
    table = scenario.obstacle_table()
    collision = model.bind(assembly, table)
    arm, start = assembly.model, np.array(scenario.q_start)
    limits = np.column_stack([arm.lowerPositionLimit, arm.upperPositionLimit])
    is_limited = (np.abs(limits) < 1e6).all()
    demand(is_limited, "robot.joint_limits", "given: postures are drawn between them", None)
    count = f"one angle per joint ({arm.nq})"
    demand(len(start) == arm.nq, "scenario.q_start", count, len(start))
    for k, (angle, (least, greatest)) in enumerate(zip(start, limits, strict=True)):
        must = f"within the joint's limits, {least:g} to {greatest:g} rad"
        demand(least <= angle <= greatest, f"scenario.q_start[{k}]", must, float(angle))
    if contact := collision.contact(start, start):
        must = f"free of collision (link {contact.link} touches obstacle {contact.obstacle})"
        raise SettingError("scenario.q_start", must, list(scenario.q_start))
    targets = np.array([scenario.via_point, scenario.goal_point])
    boxes = np.array([ANYWHERE, scenario.box])
    bodies, margin = scene(assembly, table), scenario.security_margin
    return Problem(assembly, collision, start, limits, targets, boxes, bodies, margin)
