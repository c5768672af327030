"""Paths of robots whose bodies are covered: arms, their own bodies, and obstacles.

Covers reach beyond bodies. Where they touch at the start or the goal of a task although the bodies
do not, the covers of that body are made as much smaller as it takes, and pairs of bodies are left
to the certifier: the search then sees a little less, and the certifier has the last word.
"""

from typing import Any, ClassVar, NamedTuple

import numpy as np

from evoexp.collision.derived_pairs import Pair
from evoexp.collision.models.body_models import BodyModel, CollisionModel
from evoexp.collision.models.body_pairs import BodyPairs
from evoexp.collision.models.primitive_tables import Shapes
from evoexp.collision.models.primitives import PrimitiveCollision
from evoexp.collision.models.touching_spheres import Clearance
from evoexp.numeric.elementary import DEGREE
from evoexp.records import BoolArray, FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.scenarios.obstacles import ObstacleTable, obstacle_table
from evoexp.validation import Component, LayoutCount

SLACK = 1e-6  # [length unit] by which covers are made smaller than it takes
SMALLEST = 1e-6  # [length unit] radius of a cover


class CoveredBodies(Component):
    """Bodies covered by spheres or capsules, tested at and between the via-points of a path.

    Attributes:
        covers: How bodies are covered.
        collision_substeps: Configurations tested per segment of a path.
    """

    component: ClassVar[str] = "covered_bodies"

    covers: CollisionModel
    collision_substeps: LayoutCount

    def bind(
        self,
        assembly: Assembly,
        obstacles: tuple[Any, ...],
        ends: FloatArray,
        ignored: tuple[Pair, ...] = (),
    ) -> "CoveredCollision":
        """Return the model of a robot among obstacles.

        Args:
            assembly: The robot.
            obstacles: What does not move.
            ends: (nq, ends) start and goal [deg], which the model lets be free.
            ignored: Pairs (body, obstacle) that may touch.

        Raises:
            SettingError: If an obstacle is an ellipse.
            UnsupportedShape: If a body cannot be covered.
        """
        table = obstacle_table(obstacles).without_ellipses()
        bodies, q = self.covers.bind(assembly), DEGREE * ends
        shapes, shrunk = _shrunk(bodies, table, ignored, q)
        left = tuple(
            pair for pair in bodies.pairs if _alone(bodies, shapes, pair).collides(q).any()
        )
        pairs = tuple(pair for pair in bodies.pairs if pair not in left)
        fitted = bodies._replace(
            shapes=shapes, sorted_pairs=bodies.sorted_pairs._replace(tested=pairs)
        )
        collision = fitted.collision(table, ignored)
        return CoveredCollision(assembly, fitted, collision, table, tuple(shrunk), left)


class CoveredCollision(NamedTuple):
    """Covered bodies of one robot, and the obstacles around it.

    Attributes:
        assembly: The robot.
        bodies: Its bodies, covered.
        collision: The kernels' tables.
        obstacles: The obstacle table.
        shrunk: Bodies whose covers were made smaller, and by how much [length unit].
        left: Pairs of bodies that are left to the certifier.
    """

    assembly: Assembly
    bodies: BodyModel
    collision: PrimitiveCollision
    obstacles: ObstacleTable
    shrunk: tuple[tuple[int, float], ...]
    left: tuple[Pair, ...]

    def clearance(self, q: FloatArray) -> Clearance:
        """Return the clearances of a batch of configurations (nq, configurations) [deg]."""
        found = self.collision.clearance(DEGREE * q)
        return Clearance(np.minimum(found.between_arms, found.to_self), found.to_obstacles)

    def collides(self, q: FloatArray) -> BoolArray:
        """Return which configurations (nq, configurations) [deg] collide."""
        return self.collision.collides(DEGREE * q)

    def notes(self, unit: str) -> list[str]:
        """Describe the covers, and what is left to the certifier."""
        names = self.bodies.names
        lines = [
            f"{len(names)} bodies covered by {self.bodies.num_shapes} spheres and capsules, "
            f"which reach at most {self.bodies.inflation:.3g} {unit} beyond them"
        ]
        if self.shrunk:
            told = ", ".join(f"{names[body]} by {size:.3g} {unit}" for body, size in self.shrunk)
            lines.append(
                "covers made smaller, since they touch an obstacle at the start or the goal where "
                f"the bodies do not: {told}"
            )
        if self.left:
            told = ", ".join(f"{names[a]} with {names[b]}" for a, b in self.left)
            lines.append(f"covers touch at the start or the goal, left to the certifier: {told}")
        return lines


def _shrunk(
    bodies: BodyModel, table: ObstacleTable, ignored: tuple[Pair, ...], q: FloatArray
) -> tuple[Shapes, list[tuple[int, float]]]:
    """Make covers smaller that touch obstacles at q (nq, ends) [rad].

    Returns:
        The shapes, and the bodies whose covers became smaller, with the lengths.
    """
    shapes, radius, shrunk = bodies.shapes, bodies.shapes.radius.copy(), []
    for body in range(len(bodies.covers)):
        own = shapes.labels == body
        if not shapes.joint[own].all():  # what stands still is not tested
            continue
        model = bodies._replace(shapes=_those(shapes, own), sorted_pairs=BodyPairs((), ()))
        kept = tuple(pair for pair in ignored if pair[0] == body)
        least = float(model.collision(table, kept).clearance(q).to_obstacles.min())
        if least < 0.0:
            size = SLACK - least
            radius[own] = np.maximum(radius[own] - size, SMALLEST)
            shrunk.append((body, size))
    return shapes._replace(radius=radius), shrunk


def _alone(bodies: BodyModel, shapes: Shapes, pair: Pair) -> PrimitiveCollision:
    """Return the model of two bodies alone."""
    own = _those(shapes, np.isin(shapes.labels, pair))
    around = obstacle_table(())
    return PrimitiveCollision.build(bodies.assembly.model, own, around, (pair,))


def _those(shapes: Shapes, kept: BoolArray) -> Shapes:
    """Return some of the shapes."""
    return Shapes(
        shapes.joint[kept],
        shapes.start[kept],
        shapes.end[kept],
        shapes.radius[kept],
        shapes.labels[kept],
    )
