"""Covers that touch where the bodies do not, at configurations that a task demands.

Covers that touch an obstacle are made smaller; pairs of bodies whose covers touch are no longer
tested. What a search does not see any more is left to the certifier.
"""

import numpy as np

from evoexp.collision.bodies.body_collision import BodyCollision
from evoexp.collision.bodies.body_models import BodyModel
from evoexp.collision.bodies.body_pairs import BodyPairs
from evoexp.collision.bodies.shapes import Shapes
from evoexp.collision.derived_pairs import Pair
from evoexp.records import BoolArray, FloatArray
from evoexp.scenarios.obstacles import ObstacleTable, obstacle_table

SLACK = 1e-6  # [length unit] by which covers are made smaller than it takes
SMALLEST = 1e-6  # [length unit] radius of a cover


def fitted_covers(
    bodies: BodyModel, table: ObstacleTable, ignored: tuple[Pair, ...], q: FloatArray
) -> BodyModel:
    """Return bodies whose covers do not touch at configurations where the bodies do not.

    Args:
        bodies: The bodies, covered.
        ignored: Pairs (body, obstacle) that may touch.
        q: (nq, configurations) [rad] at which nothing touches.
    """
    shapes, shrunk = _shrunk(bodies, table, ignored, q)
    left = tuple(pair for pair in bodies.pairs if _alone(bodies, shapes, pair).collides(q).any())
    tested = tuple(pair for pair in bodies.pairs if pair not in left)
    pairs = bodies.sorted_pairs._replace(tested=tested, fitted=left)
    return bodies._replace(shapes=shapes, sorted_pairs=pairs, shrunk=tuple(shrunk))


def fitting_notes(bodies: BodyModel, where: str, unit: str) -> list[str]:
    """Return a line on the covers made smaller, and one on the pairs left to the certifier."""
    lines, names = [], bodies.names
    if bodies.shrunk:
        told = ", ".join(f"{names[body]} by {size:.3g} {unit}" for body, size in bodies.shrunk)
        lines.append(
            f"covers made smaller, since they touch an obstacle at {where} where the bodies do "
            f"not: {told}"
        )
    if left := bodies.sorted_pairs.fitted:
        told = ", ".join(f"{names[a]} with {names[b]}" for a, b in left)
        lines.append(f"covers touch at {where}, left to the certifier: {told}")
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


def _alone(bodies: BodyModel, shapes: Shapes, pair: Pair) -> BodyCollision:
    """Return the model of two bodies alone."""
    own = _those(shapes, np.isin(shapes.labels, pair))
    around = obstacle_table(())
    return BodyCollision.build(bodies.assembly.model, own, around, (pair,))


def _those(shapes: Shapes, kept: BoolArray) -> Shapes:
    """Return some of the shapes."""
    return Shapes(
        shapes.joint[kept],
        shapes.start[kept],
        shapes.end[kept],
        shapes.radius[kept],
        shapes.labels[kept],
    )
