"""An arm whose tip shall pass a via point and end at a goal point inside a box, among obstacles."""

from typing import Annotated, Any, ClassVar

from pydantic import Field

from evoexp.scenarios.obstacles import ObstacleTable, SceneTask, obstacle_table
from evoexp.validation import Limits, Vector

Point2 = tuple[float, float]


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
