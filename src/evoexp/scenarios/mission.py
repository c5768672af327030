"""A platform drives over a grid to where its arm has a task."""

from typing import Any, ClassVar

from evoexp.scenarios.docking import Docking
from evoexp.scenarios.grid_motion import GridMotion
from evoexp.validation import Component


class Mission(Component):
    """Both examples of Chen & Zalzala 1995 together."""

    component: ClassVar[str] = "mission"

    grid: GridMotion  # the floor; its goal is where the platform is expected to dock
    docking: Docking  # the task of the arm, in a plane whose origin is at `task_origin`
    # where on the floor the task's X = 0 is (x, y); X points along x, the task's Y = 0 is the
    # height of the arm's first joint [length unit]
    task_origin: tuple[float, float]
    travel_posture: tuple[float, float, float]  # θ1, θ2, θ3 while the platform drives [deg]

    @property
    def length_unit(self) -> str:
        """Of the grid."""
        return self.grid.length_unit

    def named_places(self, robot: Any) -> list[tuple[str, tuple[float, ...]]]:
        """Return names and points of the places that pictures mark [length unit]."""
        (x, y), (along, up) = self.task_origin, self.docking.target
        return [("target", (x + along, y, robot.body_height + up))]
