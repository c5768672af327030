"""A place and a load for the end-effector of a mobile arm, and the obstacles around it."""

from typing import Any, ClassVar

import numpy as np

from evoexp.records import FloatArray
from evoexp.scenarios.obstacles import Obstacle, obstacle_table
from evoexp.validation import Component, NonNegative

Point2 = tuple[float, float]


class Docking(Component):
    """A task of one posture (Chen & Zalzala 1995, section 4.2).

    Attributes:
        target: X_e, Y_e of the end-effector [length unit].
        force: F that acts on it (x, y).
        security_margin: Clearance between bodies that the task requires [length unit].
        length_unit: Name of the scene's unit of length.
        obstacles: What does not move; criteria measure distances to their middles.
    """

    component: ClassVar[str] = "docking"

    target: Point2
    force: Point2
    security_margin: NonNegative
    length_unit: str
    obstacles: tuple[Obstacle, ...] = ()

    def named_places(self, robot: Any) -> list[tuple[str, tuple[float, ...]]]:
        """Return names and points of the places that pictures mark [length unit]."""
        return [("target", self.target)]

    def obstacle_points(self) -> FloatArray:
        """Return the middles of the obstacles, X_o, (obstacles, 2)."""
        return np.array(obstacle_table(self.obstacles).center[:, :2])
