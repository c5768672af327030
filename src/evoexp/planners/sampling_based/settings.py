"""Settings of planners of straight edges between random configurations."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from evoexp.collision.models.covered_bodies import CoveredBodies
from evoexp.collision.models.link_ellipses import LinkEllipses
from evoexp.collision.models.touching_spheres import TouchingSpheres
from evoexp.planners.proofs import Acceptance
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


class EdgeSettings(Settings):
    """Settings of every planner of straight edges.

    Distances are Euclidean over all joints of all arms, in degrees; a metre of a sliding joint
    counts as a radian, 57.3 degrees.

    Attributes:
        range: Length of a step, the longest edge of a tree [deg].
        num_shortcuts: Attempts to shorten the path that was found; 0: none.
        free_turn: How far joints without limits may go beyond start and goal [deg].
        collision: The touching circles or spheres, or covers of the bodies. An edge as long as
            `range` is tested at `collision_substeps` configurations, other edges as densely.
        acceptance: Which edges are free: those whose tested configurations are (`model`), or those
            of them that the exact certifier proves free of contact all along (`certified`), or
            free by the task's margins (`margin`). An edge that is refuted counts as colliding.
        num_smoothings: How often all corners of the path are cut behind the shortcuts; 0: never.
    """

    range: Positive
    num_shortcuts: NonNegativeCount
    free_turn: Positive
    collision: TouchingSpheres | CoveredBodies
    acceptance: Acceptance = "model"
    num_smoothings: Annotated[int, Field(ge=0, le=8)] = 0

    @property
    def resolution(self) -> float:
        """Greatest distance between configurations that are tested on an edge [deg]."""
        return self.range / self.collision.collision_substeps

    @property
    def num_improvements(self) -> int:
        """Attempts to make a path better: shortcuts, then passes over all of its corners."""
        return self.num_shortcuts + self.num_smoothings


class RrtSettings(EdgeSettings):
    """Hyperparameters of RRT-Connect and of the shortcuts behind it.

    Attributes:
        max_iterations: Random configurations after which the search for a path is given up.
        ga: Iterations per record, and records.
        num_restarts: How often both trees are grown anew once a path is shortened or given up; the
            shortest path of all is the answer.
    """

    max_iterations: Count
    ga: TreeGrowth
    num_restarts: NonNegativeCount = 0


class ReachingSettings(Settings):
    """Hyperparameters of trees toward postures whose tip is at a given place.

    Distances are Euclidean over all joints, in degrees.

    Attributes:
        range: Length of a step, the longest edge of a tree [deg].
        resolution: Greatest distance between configurations that are tested on an edge [deg].
        num_postures: Free postures drawn for a place of the tip, of which the nearest one is taken.
        max_iterations: Draws after which the search for postures, or for a path to the one taken,
            is given up.
        num_shortcuts: Attempts to shorten the path to a posture; 0: none.
        num_restarts: How often all is begun anew; the shortest path of all is the answer.
        ga: Iterations per record, and records.
        collision: Links as lines among ellipses, tested at single configurations.
        acceptance: Which plans are an answer: those whose tested configurations are free, or those
            of them that the exact certifier proves.
    """

    range: Positive
    resolution: Positive
    num_postures: Count
    max_iterations: Count
    num_shortcuts: NonNegativeCount
    num_restarts: NonNegativeCount
    ga: TreeGrowth
    collision: LinkEllipses
    acceptance: Acceptance = "model"


class QueryChunks(Component):
    """How long a planner of a library searches per record, and in all.

    Attributes:
        queries_per_generation: Configurations that are asked for between two records; an edge that
            is being tested is tested to its end.
        num_generations: Records after the first, at most.
    """

    component: ClassVar[str] = "query_chunks"

    queries_per_generation: Count
    num_generations: NonNegativeCount


class OmplSettings(EdgeSettings):
    """Hyperparameters of a planner of OMPL.

    Attributes:
        algorithm: Its name in OMPL; all of its settings but `range` are OMPL's own.
        ga: Configurations asked for per record, and records.
    """

    algorithm: Literal["RRTConnect", "RRTstar", "InformedRRTstar", "BITstar", "AITstar", "PRMstar"]
    ga: QueryChunks
