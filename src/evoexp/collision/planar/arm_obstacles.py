"""Planar arms of two links among discs, rectangles, capsules and half-planes.

A link, a boundary line of an envelope, or a circle around the tip collides where it touches the
solid. All is decided in double precision, and what only rounding may hold apart touches
(`segment_predicates.contact_tolerance`).
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.planar.planar_arms import (
    OUTLINE_ROWS,
    POINT_ROWS,
    Arm,
    boundary,
    checked,
    largest_coordinate,
    num_boundaries,
)
from evoexp.collision.planar.segment_predicates import contact_tolerance, meeting, squared_distance
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.records import FloatArray, IntArray
from evoexp.scenarios.obstacles import BOX, CAPSULE, HALF_SPACE, SPHERE, ObstacleTable


class PlanarObstacles(NamedTuple):
    """Obstacles as seen in the plane z = 0."""

    kind: IntArray  # (obstacles,) SPHERE, BOX, CAPSULE or HALF_SPACE
    center: FloatArray  # (obstacles, 2); of a half-plane a point of its boundary
    # (obstacles, 2) unit vector: x axis of a box, axis of a capsule, outward normal of a half-plane
    direction: FloatArray
    # (obstacles, 2): radius, 0 | half the edges | radius, half the length of the axis | unused
    size: FloatArray


def planar_obstacles(table: ObstacleTable) -> PlanarObstacles:
    """Return the obstacles' sections by the plane.

    Raises:
        ValueError: If an obstacle is none of the kinds above, or not drawn in the plane: a ball, a
            capsule's axis or a half-space's normal that leaves it, a box that is turned about
            another axis than z, or does not reach it.
    """
    num = len(table.kind)
    out = PlanarObstacles(
        table.kind.copy(), table.center[:, :2].copy(), np.zeros((num, 2)), np.zeros((num, 2))
    )
    for k in range(num):
        kind, z, size, turn = table.kind[k], table.center[k, 2], table.size[k], table.rotation[k]
        if kind == BOX:
            flat = turn[2] == turn[5] == turn[6] == turn[7] == 0.0 and abs(z) <= size[2]
            out.direction[k], out.size[k] = (turn[0], turn[3]), size[:2]
        elif kind in (CAPSULE, HALF_SPACE):
            flat = turn[8] == 0.0 and z == 0.0
            out.direction[k], out.size[k] = (turn[2], turn[5]), size[:2]
        else:
            flat = kind == SPHERE and z == 0.0
            out.size[k, 0] = size[0]
        if not flat:
            raise ValueError(
                f"obstacles[{k}] must be a sphere, box (turned about z), capsule or half-space of "
                "the plane z = 0"
            )
    return out


def count_obstacle_collisions(
    arm: Arm, outlines: FloatArray, obstacles: PlanarObstacles
) -> IntArray:
    """Count the configurations in which an arm meets an obstacle, per individual, (N,).

    Args:
        arm: The arm, with its envelope if it has one.
        outlines: (K, 8, N) from `Arm.outlines`; without an envelope four rows are enough.
        obstacles: From `planar_obstacles`.

    Raises:
        ValueError: If outlines has another shape.
    """
    rows = (OUTLINE_ROWS,) if arm.is_enveloped else (POINT_ROWS, OUTLINE_ROWS)
    outlines = checked("outlines", outlines, *rows)
    counts = np.zeros(outlines.shape[2], dtype=np.int64)
    _count(arm.in_floats, outlines, obstacles, counts)
    return counts


class Solid(NamedTuple):
    """One of the obstacles, and the distance up to which rounding may hold an arm apart from it."""

    kind: int  # as in `PlanarObstacles`, and so are the following
    x: float
    y: float
    c: float
    s: float
    a: float
    b: float
    near: float  # [length unit]


@kernel
def _count(arm: Arm, outlines: FloatArray, obstacles: PlanarObstacles, counts: IntArray) -> None:
    outlines, (kind, center, direction, size) = borrowed((outlines, obstacles))
    num_configurations, _, num = outlines.shape
    hit = np.zeros((num_configurations, num), dtype=np.bool_)
    for o in range(len(kind)):
        x, y, a, b = center[o, 0], center[o, 1], size[o, 0], size[o, 1]
        near = contact_tolerance(largest_coordinate(arm) + abs(x) + abs(y) + a + b)
        solid = Solid(kind[o], x, y, direction[o, 0], direction[o, 1], a, b, near)
        for k in range(num_configurations):
            for n in range(num):
                hit[k, n] = hit[k, n] or _touches(arm, outlines, k, n, solid)
    for k in range(num_configurations):
        for n in range(num):
            counts[n] += hit[k, n]


@inlined
def _touches(arm: Arm, outlines: FloatArray, k: int, n: int, solid: Solid) -> bool:
    """Return whether individual n touches a solid in configuration k."""
    for line in range(num_boundaries(arm)):
        px, py, qx, qy = boundary(arm, outlines, k, n, line)
        if _meets(solid, px, py, qx, qy, solid.near):
            return True
    tip_x, tip_y, radius = outlines[k, 2, n], outlines[k, 3, n], arm.tcp_radius
    return radius > 0.0 and _meets(solid, tip_x, tip_y, tip_x, tip_y, radius + solid.near)


@inlined
def _meets(solid: Solid, px: float, py: float, qx: float, qy: float, reach: float) -> bool:
    """Return whether a segment, or the circle around a point, meets a solid.

    `reach` is what rounding may hide, for a circle its radius, too.
    """
    kind, x, y, c, s, a, b, _ = solid
    # in the solid's frame
    ax, ay = c * (px - x) + s * (py - y), c * (py - y) - s * (px - x)
    bx, by = c * (qx - x) + s * (qy - y), c * (qy - y) - s * (qx - x)
    if kind == HALF_SPACE:
        return min(ax, bx) <= reach
    if kind == BOX:
        return _meets_box(ax, ay, bx, by, a, b, reach)
    if kind == SPHERE:
        return squared_distance(px, py, qx, qy, x, y) <= (a + reach) * (a + reach)
    # a capsule, whose axis leads from (−b, 0) to (b, 0); most segments lie beside a box around it
    if not _meets_box(ax, ay, bx, by, a + b, a, reach + reach):
        return False
    return bool(meeting(ax, ay, bx, by, -b, 0.0, b, 0.0, a + reach))


@inlined
def _meets_box(
    ax: float, ay: float, bx: float, by: float, a: float, b: float, reach: float
) -> bool:
    """Return whether a segment meets the box ± a, ± b, by its two axes and the segment's normal."""
    mx, my, ex, ey = 0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (bx - ax), 0.5 * (by - ay)
    if ex == 0.0 and ey == 0.0:
        u, v = max(abs(ax) - a, 0.0), max(abs(ay) - b, 0.0)
        return u * u + v * v <= reach * reach
    beside = abs(mx * ey - my * ex) <= (a + reach) * abs(ey) + (b + reach) * abs(ex)
    return abs(mx) <= a + reach + abs(ex) and abs(my) <= b + reach + abs(ey) and beside
