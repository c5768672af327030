"""Paths of robots whose bodies are covered: arms, their own bodies, and obstacles.

Covers reach beyond bodies. Where they touch at the start or the goal of a task although the bodies
do not, the covers of that body are made as much smaller as it takes, and pairs of bodies are left
to the certifier: the search then sees a little less, and the certifier has the last word.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from evoexp.collision.bodies.body_collision import BodyCollision, Clearances, FreeTest, Shapes
from evoexp.collision.bodies.body_models import BodyModel, CollisionModel
from evoexp.collision.derived_pairs import Pair
from evoexp.numeric.elementary import DEGREE
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import ObstacleTable, obstacle_table
from evoexp.validation import Component, LayoutCount


class CoveredBodies(Component):
    """Bodies covered by spheres or capsules, tested at and between the via-points of a path."""

    revision: ClassVar[int] = 2

    covers: CollisionModel  # how bodies are covered
    collision_substeps: LayoutCount  # configurations tested per segment of a path

    def bind(
        self,
        assembly: Assembly,
        obstacles: tuple[Any, ...],
        ends: FloatArray,
        ignored: tuple[Pair, ...] = (),
    ) -> "CoveredCollision":
        """Return the model of a robot among obstacles.

        Args:
            obstacles: What does not move.
            ends: (nq, ends) start and goal [deg], which the model lets be free.
            ignored: Pairs (body, obstacle) that may touch.
        """
        table = obstacle_table(obstacles).without_ellipses()
        bodies, q = self.covers.bind(assembly).with_maps(), DEGREE * ends
        fitted = bodies.fitted(table, ignored, q)
        collision = fitted.collision(table, ignored)
        shapes, pairs = fitted.shapes, fitted.pairs
        return CoveredCollision(assembly, shapes, pairs, table, collision, fitted)


@dataclass(frozen=True)
class ArmCollision:
    """The shapes of one robot, and the obstacles around it."""

    assembly: Assembly  # the robot
    shapes: Shapes  # spheres and capsules of all bodies
    pairs: Sequence[Pair]  # of bodies that are tested against each other
    obstacles: ObstacleTable  # the obstacle table
    collision: BodyCollision  # the kernels' tables

    @property
    def num_tests(self) -> int:
        """Pairs of shapes that one configuration has: of two bodies, and with obstacles."""
        own = dict(zip(*np.unique(self.shapes.body, return_counts=True), strict=True))
        between = sum(own[a] * own[b] for a, b in self.pairs)
        return int(between + sum(own.values()) * len(self.obstacles.kind))

    def clearance(self, q: FloatArray) -> Clearances:
        """Return the clearances of a batch (nq, configurations) [deg]; links of one arm count."""
        to_obstacles, between_arms, to_self = self.collision.clearance(DEGREE * q)
        return Clearances(to_obstacles, np.minimum(between_arms, to_self))

    def collides(self, q: FloatArray) -> BoolArray:
        """Return which configurations (nq, configurations) [deg] collide."""
        return self.collision.collides(DEGREE * q)

    @property
    def free_test(self) -> FreeTest:
        """The test of configurations for kernels of other rooms."""
        return self.collision.free_test


@dataclass(frozen=True)
class CoveredCollision(ArmCollision):
    """Covered bodies of one robot, and the obstacles around it."""

    bodies: BodyModel  # its bodies, covered

    def notes(self, unit: str) -> list[str]:
        """Describe the covers, and what is left to the certifier."""
        return self.bodies.notes(unit)
