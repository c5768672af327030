"""Settings of the planner of two trees."""

from typing import ClassVar

from evoexp.collision.models.covered_bodies import CoveredBodies
from evoexp.collision.models.touching_spheres import TouchingSpheres
from evoexp.validation import (
    Component,
    Count,
    LayoutCount,
    NonNegativeCount,
    Positive,
    Settings,
)


class TreeGrowth(Component):
    """How much is searched per record, and in all.

    Attributes:
        iterations_per_generation: Iterations between two records: random configurations that the
            trees grow toward, and, once there is a path, attempts to shorten it.
        num_generations: Records after the first, at most.
    """

    component: ClassVar[str] = "tree_growth"

    iterations_per_generation: LayoutCount
    num_generations: NonNegativeCount


class RrtSettings(Settings):
    """Hyperparameters of RRT-Connect and of the shortcuts behind it.

    Distances are Euclidean over all joints of all arms, in degrees; a metre of a sliding joint
    counts as a radian, 57.3 degrees.

    Attributes:
        range: Length of a step, the longest edge of a tree [deg].
        max_iterations: Random configurations after which the search for a path is given up.
        num_shortcuts: Attempts to shorten the path that was found; 0: none.
        free_turn: How far joints without limits may go beyond start and goal [deg].
        ga: Iterations per record, and records.
        collision: The touching circles or spheres, or covers of the bodies. An edge as long as
            `range` is tested at `collision_substeps` configurations, other edges as densely.
    """

    range: Positive
    max_iterations: Count
    num_shortcuts: NonNegativeCount
    free_turn: Positive
    ga: TreeGrowth
    collision: TouchingSpheres | CoveredBodies

    @property
    def resolution(self) -> float:
        """Greatest distance between configurations that are tested on an edge [deg]."""
        return self.range / self.collision.collision_substeps
