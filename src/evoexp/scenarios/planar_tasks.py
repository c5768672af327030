"""Tasks of the tips of planar arms among obstacles: a place to dock, places to pass and reach."""

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from evoexp.records import FloatArray
from evoexp.scenarios.grid_motion import GridMotion
from evoexp.scenarios.obstacles import ObstacleTable, SceneTask, obstacle_table
from evoexp.validation import Component, Limits, Vector

Point2 = tuple[float, float]


class Docking(SceneTask):
    """A place and a load for the tip of a mobile arm (Chen & Zalzala 1995, section 4.2)."""

    component: ClassVar[str] = "docking"

    target: Point2  # X_e, Y_e of the end-effector [length unit]
    force: Point2  # F that acts on it (x, y)

    def named_places(self, robot: Any) -> list[tuple[str, tuple[float, ...]]]:
        """Return names and points of the places that pictures mark [length unit]."""
        return [("target", self.target)]

    def obstacle_points(self) -> FloatArray:
        """Return the middles of the obstacles, from which criteria measure: X_o, (obstacles, 2)."""
        return np.array(obstacle_table(self.obstacles).center[:, :2])


class Mission(Component):
    """Both examples of Chen & Zalzala 1995: a platform drives over a grid, then its arm docks."""

    component: ClassVar[str] = "mission"

    grid: GridMotion  # the floor; its goal is where the platform is expected to dock
    docking: Docking  # the task of the arm, in a plane whose origin is at `task_origin`
    # where on the floor the task's X = 0 is (x, y); X points along x, the task's Y = 0 is the
    # height of the arm's first joint [length unit]
    task_origin: Point2
    travel_posture: tuple[float, float, float]  # θ1, θ2, θ3 while the platform drives [deg]

    @property
    def length_unit(self) -> str:
        """Of the grid."""
        return self.grid.length_unit

    def named_places(self, robot: Any) -> list[tuple[str, tuple[float, ...]]]:
        """Return names and points of the places that pictures mark [length unit]."""
        (x, y), (along, up) = self.task_origin, self.docking.target
        return [("target", (x + along, y, robot.body_height + up))]


class PickAndPlace(SceneTask):
    """Start posture, via point and goal point of a planar arm's tip (Lavoie & Boudreau 2001, 4)."""

    component: ClassVar[str] = "pick_and_place"

    # posture at the start, joint angles relative to the link before [rad]
    q_start: Annotated[Vector, Field(min_length=1)]
    # where the tip shall be at the end of the first sub-path (x, y) [length unit]
    via_point: Point2
    goal_point: Point2  # where it shall be at the end of the second one
    # of the box in which the tip must be at the end of the second sub-path
    box_x: Limits
    box_y: Limits
    obstacle_shift: Point2  # by how much obstacles and box are moved together (dx, dy)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Least x, greatest x, least y, greatest y of the box where it stands."""
        (dx, dy), (left, right), (bottom, top) = self.obstacle_shift, self.box_x, self.box_y
        return left + dx, right + dx, bottom + dy, top + dy

    def named_places(self, robot: Any) -> list[tuple[str, tuple[float, ...]]]:
        """Return names and points of the places that pictures mark [length unit]."""
        return [("via point", self.via_point), ("goal point", self.goal_point)]

    def obstacle_table(self) -> ObstacleTable:
        """Return the obstacles where they stand."""
        table = obstacle_table(self.obstacles)
        table.center[:, :2] += self.obstacle_shift
        return table
