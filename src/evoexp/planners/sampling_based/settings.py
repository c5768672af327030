"""Settings of planners of straight edges between random configurations."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from evoexp.collision.bodies.covered_bodies import CoveredBodies
from evoexp.collision.bodies.touching_spheres import TouchingSpheres
from evoexp.collision.planar.link_ellipses import LinkEllipses
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
    """How much is searched per record, and in all."""

    component: ClassVar[str] = "tree_growth"

    # iterations between two records: random configurations that the trees grow toward, and,
    # once there is a path, attempts to shorten it
    iterations_per_generation: LayoutCount
    num_generations: NonNegativeCount  # records after the first, at most


class EdgeSettings(Settings):
    """Settings of every planner of straight edges.

    Distances are Euclidean over all joints of all arms, in degrees; a metre of a sliding joint
    counts as a radian, 57.3 degrees.
    """

    range: Positive  # length of a step, the longest edge of a tree [deg]
    num_shortcuts: NonNegativeCount  # attempts to shorten the path that was found; 0: none
    free_turn: Positive  # how far joints without limits may go beyond start and goal [deg]
    # the touching circles or spheres, or covers of the bodies. An edge as long as `range` is
    # tested at `collision_substeps` configurations, other edges as densely
    collision: TouchingSpheres | CoveredBodies
    # which edges are free: those whose tested configurations are (`model`), or those of them
    # that the exact certifier proves free of contact all along (`certified`), or free by the
    # task's margins (`margin`). An edge that is refuted counts as colliding
    acceptance: Acceptance = "model"
    # how often all corners of the path are cut behind the shortcuts; 0: never
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
    """Hyperparameters of RRT-Connect and of the shortcuts behind it."""

    max_iterations: Count  # random configurations after which the search for a path is given up
    ga: TreeGrowth  # iterations per record, and records
    # how often both trees are grown anew once a path is shortened or given up; the shortest
    # path of all is the answer
    num_restarts: NonNegativeCount = 0


class ReachingSettings(Settings):
    """Hyperparameters of trees toward postures whose tip is at a given place.

    Distances are Euclidean over all joints, in degrees.
    """

    range: Positive  # length of a step, the longest edge of a tree [deg]
    # greatest distance between configurations that are tested on an edge [deg]
    resolution: Positive
    # free postures drawn for a place of the tip, of which the nearest one is taken
    num_postures: Count
    # draws after which the search for postures, or for a path to the one taken, is given up
    max_iterations: Count
    num_shortcuts: NonNegativeCount  # attempts to shorten the path to a posture; 0: none
    # how often all is begun anew; the shortest path of all is the answer
    num_restarts: NonNegativeCount
    ga: TreeGrowth  # iterations per record, and records
    collision: LinkEllipses  # links as lines among ellipses, tested at single configurations
    # which plans are an answer: those whose tested configurations are free, or those of them
    # that the exact certifier proves
    acceptance: Acceptance = "model"


class QueryChunks(Component):
    """How long a planner of a library searches per record, and in all."""

    component: ClassVar[str] = "query_chunks"

    # configurations that are asked for between two records; an edge that is being tested is
    # tested to its end
    queries_per_generation: Count
    num_generations: NonNegativeCount  # records after the first, at most


class OmplSettings(EdgeSettings):
    """Hyperparameters of a planner of OMPL."""

    # its name in OMPL; all of its settings but `range` are OMPL's own
    algorithm: Literal["RRTConnect", "RRTstar", "InformedRRTstar", "BITstar", "AITstar", "PRMstar"]
    ga: QueryChunks  # configurations asked for per record, and records
