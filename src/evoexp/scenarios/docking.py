"""A place and a load for the end-effector of a mobile arm, and the obstacles around it."""

from typing import Any, ClassVar

import numpy as np

from evoexp.records import FloatArray
from evoexp.scenarios.obstacles import SceneTask, obstacle_table

Point2 = tuple[float, float]


class Docking(SceneTask):
    """A task of one posture (Chen & Zalzala 1995, section 4.2)."""

    component: ClassVar[str] = "docking"

    target: Point2  # X_e, Y_e of the end-effector [length unit]
    force: Point2  # F that acts on it (x, y)

    def named_places(self, robot: Any) -> list[tuple[str, tuple[float, ...]]]:
        """Return names and points of the places that pictures mark [length unit]."""
        return [("target", self.target)]

    def obstacle_points(self) -> FloatArray:
        """Return the middles of the obstacles, from which criteria measure: X_o, (obstacles, 2)."""
        return np.array(obstacle_table(self.obstacles).center[:, :2])
