"""Robots of two links and their scenario, prepared for co-evolution."""

from typing import NamedTuple

from evoexp.collision.planar.link_collision import LinkCollision
from evoexp.collision.scene import Scene
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.assembly import Assembly

NOT_FINITE = "points and bases must be finite and below 1e70"


class Problem(NamedTuple):
    """Robots and their scenario, prepared."""

    assembly: Assembly  # the robots, built
    collision: LinkCollision  # the paper's collision model on them
    arms: FloatArray  # (robots, 4) base x, base y, lengths of both links [length unit]
    start: FloatArray  # (robots, 2) absolute link angles [rad]
    goal: FloatArray  # (robots, 2) [rad]
    moving: BoolArray  # (robots,) false for robots that stand still
    scene: Scene  # the bodies themselves, for the exact verdict on a motion
    security_margin: float  # clearance that the task requires [length unit]
