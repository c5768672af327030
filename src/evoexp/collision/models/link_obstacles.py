"""Collisions of planar arms of two links with static obstacles of the plane.

Discs, rectangles, capsules, half-planes.

A link, or a boundary line of an envelope, collides where it has a point in common with the solid; a
circle around the tip where it is nearer than its radius. Decided in double precision: right away
from touching.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.models.link_crossings import Arm, IntArray, checked
from evoexp.collision.models.link_envelopes import EnvelopedArm
from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray
from evoexp.robots.kinematics import U
from evoexp.scenarios.obstacles import BOX, CAPSULE, HALF_SPACE, SPHERE, ObstacleTable


class PlanarObstacles(NamedTuple):
    """Obstacles as seen in the plane z = 0.

    Attributes:
        kind: (obstacles,) SPHERE, BOX, CAPSULE or HALF_SPACE.
        center: (obstacles, 2); of a half-plane a point of its boundary.
        direction: (obstacles, 2) unit vector: x axis of a box, axis of a capsule, outward normal of
            a half-plane.
        size: (obstacles, 2): radius, 0 | half the edges | radius, half the length of the axis |
            unused.
    """

    kind: IntArray
    center: FloatArray
    direction: FloatArray
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


def count_obstacle_collisions(arm: Arm, points: FloatArray, obstacles: PlanarObstacles) -> IntArray:
    """Count the configurations in which a link meets an obstacle, per individual, (N,).

    Args:
        arm: The arm.
        points: (K, 4, N) from `Arm.points`.
        obstacles: From `planar_obstacles`.

    Raises:
        ValueError: If points has another shape.
    """
    points = checked("points", points, 4)
    lines = np.empty((2, 4, points.shape[0], points.shape[2]))
    lines[0, 0], lines[0, 1] = arm.base
    lines[0, 2], lines[0, 3] = points[:, 0], points[:, 1]
    lines[1] = points.transpose(1, 0, 2)
    return np.asarray(_hits(lines, obstacles).sum(axis=0))


def count_enveloped_obstacle_collisions(
    arm: EnvelopedArm, outlines: FloatArray, obstacles: PlanarObstacles
) -> IntArray:
    """Count the configurations in which a boundary line or the circle meets an obstacle.

    Per individual, (N,).

    Args:
        arm: The arm and its envelope.
        outlines: (K, 8, N) from `EnvelopedArm.outlines`.
        obstacles: From `planar_obstacles`.

    Raises:
        ValueError: If outlines has another shape.
    """
    hit = _hits(np.ascontiguousarray(arm.boundaries(outlines)), obstacles)
    if arm.tcp_radius > 0.0:
        tips = np.ascontiguousarray(outlines[:, 2:4].transpose(1, 0, 2))
        near = np.zeros(hit.shape, dtype=np.int64)
        _circles(tips.reshape(2, -1), arm.tcp_radius, *obstacles, near.reshape(-1))
        hit |= near > 0
    return np.asarray(hit.sum(axis=0))


def _hits(lines: FloatArray, obstacles: PlanarObstacles) -> NDArray[np.bool_]:
    hit = np.zeros(lines.shape[2:], dtype=np.int64)
    flat = lines.reshape(len(lines), 4, -1)
    for line in flat:
        _segments(line, *obstacles, hit.reshape(-1))
    return np.asarray(hit > 0)


@kernel
def _segments(lines, kind, center, direction, size, hit):  # type: ignore[no-untyped-def]
    """Add the obstacles that each segment meets: lines (4, n), hit (n,)."""
    for o in range(len(kind)):
        x, y, c, s, a, b = (
            center[o, 0],
            center[o, 1],
            direction[o, 0],
            direction[o, 1],
            size[o, 0],
            size[o, 1],
        )
        what = kind[o]
        for m in range(lines.shape[1]):
            n = U(m)
            # in the obstacle's frame
            dx, dy, ex, ey = (
                lines[U(0), n] - x,
                lines[U(1), n] - y,
                lines[U(2), n] - x,
                lines[U(3), n] - y,
            )
            px, py, qx, qy = c * dx + s * dy, c * dy - s * dx, c * ex + s * ey, c * ey - s * ex
            if what == SPHERE:
                met = _squared_distance(dx, dy, ex, ey, 0.0, 0.0) <= a * a
            elif what == BOX:
                met = _meets_box(px, py, qx, qy, a, b)
            elif what == CAPSULE:
                met = _meets_capsule(px, py, qx, qy, a, b)
            else:
                met = min(px, qx) <= 0.0
            hit[n] += met


@kernel
def _circles(tips, radius, kind, center, direction, size, hit):  # type: ignore[no-untyped-def]
    """Add the obstacles that are nearer to each point than a radius: tips (2, n), hit (n,)."""
    for o in range(len(kind)):
        x, y, c, s, a, b = (
            center[o, 0],
            center[o, 1],
            direction[o, 0],
            direction[o, 1],
            size[o, 0],
            size[o, 1],
        )
        for m in range(tips.shape[1]):
            n = U(m)
            dx, dy = tips[U(0), n] - x, tips[U(1), n] - y
            px, py = c * dx + s * dy, c * dy - s * dx
            if kind[o] == SPHERE:
                off, reach = dx * dx + dy * dy, a + radius
            elif kind[o] == BOX:
                u, v = max(abs(px) - a, 0.0), max(abs(py) - b, 0.0)
                off, reach = u * u + v * v, radius
            elif kind[o] == CAPSULE:
                u = max(abs(px) - b, 0.0)
                off, reach = u * u + py * py, a + radius
            else:
                u = max(px, 0.0)
                off, reach = u * u, radius
            hit[n] += off < reach * reach


@kernel
def _meets_box(px, py, qx, qy, a, b):  # type: ignore[no-untyped-def]
    """Whether a segment and the box ± a, ± b meet.

    No axis, and not the segment's normal, keeps them apart.
    """
    mx, my, ex, ey = 0.5 * (px + qx), 0.5 * (py + qy), 0.5 * (qx - px), 0.5 * (qy - py)
    beside = abs(mx * ey - my * ex) <= a * abs(ey) + b * abs(ex)
    return (abs(mx) <= a + abs(ex)) & (abs(my) <= b + abs(ey)) & beside


@kernel
def _meets_capsule(px, py, qx, qy, radius, half):  # type: ignore[no-untyped-def]
    """Whether a segment and the capsule around (−half, 0), (half, 0) meet."""
    ux, uy = qx - px, qy - py
    left, right = ux * (0.0 - py) - uy * (-half - px), ux * (0.0 - py) - uy * (half - px)
    crossing = (py * qy < 0.0) & (left * right < 0.0)
    u, v = max(abs(px) - half, 0.0), max(abs(qx) - half, 0.0)
    ends = min(u * u + py * py, v * v + qy * qy)
    tips = min(
        _squared_distance(px, py, qx, qy, -half, 0.0), _squared_distance(px, py, qx, qy, half, 0.0)
    )
    return crossing | (min(ends, tips) <= radius * radius)


@kernel
def _squared_distance(ax, ay, bx, by, x, y):  # type: ignore[no-untyped-def]
    """Of a point from a segment."""
    ux, uy, x, y = bx - ax, by - ay, x - ax, y - ay
    squared = ux * ux + uy * uy
    t = min(max((ux * x + uy * y) / (squared if squared > 0.0 else 1.0), 0.0), 1.0)
    x, y = x - t * ux, y - t * uy
    return x * x + y * y
