"""Collisions of planar arms of two links with discs, rectangles, capsules and half-planes.

A link, a boundary line of an envelope, or a circle around the tip collides where it touches the
solid. All is decided in double precision, and what only rounding may hold apart touches
(`segment_predicates.contact_tolerance`).
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.planar.link_crossings import Arm, checked
from evoexp.collision.planar.link_envelopes import EnvelopedArm
from evoexp.collision.planar.segment_predicates import contact_tolerance, squared_distance
from evoexp.numeric.compilation import kernel
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import U
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


def count_obstacle_collisions(arm: Arm, points: FloatArray, obstacles: PlanarObstacles) -> IntArray:
    """Count the configurations in which a link meets an obstacle, per individual, (N,).

    Args:
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
    return np.asarray(_hits(lines, obstacles, _size(arm)).sum(axis=0))


def count_enveloped_obstacle_collisions(
    arm: EnvelopedArm, outlines: FloatArray, obstacles: PlanarObstacles
) -> IntArray:
    """Count per individual (N,) the configurations in which its envelope meets an obstacle.

    The envelope is its boundary lines and the circle around its tip.

    Args:
        arm: The arm and its envelope.
        outlines: (K, 8, N) from `EnvelopedArm.outlines`.
        obstacles: From `planar_obstacles`.

    Raises:
        ValueError: If outlines has another shape.
    """
    size = _size(arm.arm) + arm.half_width + arm.tcp_radius
    hit = _hits(np.ascontiguousarray(arm.boundaries(outlines)), obstacles, size)
    if arm.tcp_radius > 0.0:
        tips = np.ascontiguousarray(outlines[:, 2:4].transpose(1, 0, 2))
        near = np.zeros(hit.shape, dtype=np.int64)
        _circles(tips.reshape(2, -1), arm.tcp_radius, obstacles, size, near.reshape(-1))
        hit |= near > 0
    return np.asarray(hit.sum(axis=0))


def _size(arm: Arm) -> float:
    """Return the greatest coordinate that an arm can reach."""
    return float(max(abs(arm.base[0]), abs(arm.base[1])) + arm.lengths[0] + arm.lengths[1])


def _hits(lines: FloatArray, obstacles: PlanarObstacles, arm_size: float) -> BoolArray:
    hit = np.zeros(lines.shape[2:], dtype=np.int64)
    flat = lines.reshape(len(lines), 4, -1)
    for line in flat:
        _segments(line, obstacles, arm_size, hit.reshape(-1))
    return np.asarray(hit > 0)


@kernel
def _segments(
    lines: FloatArray, obstacles: PlanarObstacles, arm_size: float, hit: IntArray
) -> None:
    """Count the obstacles that each segment meets.

    Args:
        lines: (4, n) x, y, x, y of the ends.
        arm_size: Greatest coordinate of a segment [length unit].
        hit: (n,), to which the numbers are added.
    """
    kind, center, direction, size = (
        obstacles.kind, obstacles.center, obstacles.direction, obstacles.size,
    )  # fmt: skip
    for o in range(len(kind)):
        x, y, c, s = center[o, 0], center[o, 1], direction[o, 0], direction[o, 1]
        near = contact_tolerance(arm_size + abs(x) + abs(y) + size[o, 0] + size[o, 1])
        a, b, half = size[o, 0] + near, size[o, 1] + near, size[o, 1]
        shape = kind[o]
        for m in range(lines.shape[1]):
            n = U(m)
            # in the obstacle's frame
            dx, dy = lines[U(0), n] - x, lines[U(1), n] - y
            ex, ey = lines[U(2), n] - x, lines[U(3), n] - y
            px, py, qx, qy = c * dx + s * dy, c * dy - s * dx, c * ex + s * ey, c * ey - s * ex
            if shape == SPHERE:
                met = squared_distance(dx, dy, ex, ey, 0.0, 0.0) <= a * a
            elif shape == BOX:
                met = _meets_box(px, py, qx, qy, a, b)
            elif shape == CAPSULE:
                met = _meets_capsule(px, py, qx, qy, a, half)
            else:
                met = min(px, qx) <= near
            hit[n] += met


@kernel
def _circles(
    tips: FloatArray, radius: float, obstacles: PlanarObstacles, arm_size: float, hit: IntArray
) -> None:
    """Count the obstacles that the circle around each point touches.

    Args:
        tips: (2, n) x, y of the points.
        radius: The radius [length unit].
        arm_size: Greatest coordinate of a circle [length unit].
        hit: (n,), to which the numbers are added.
    """
    kind, center, direction, size = (
        obstacles.kind, obstacles.center, obstacles.direction, obstacles.size,
    )  # fmt: skip
    for o in range(len(kind)):
        x, y, c, s = center[o, 0], center[o, 1], direction[o, 0], direction[o, 1]
        a, b = size[o, 0], size[o, 1]
        wide = radius + contact_tolerance(arm_size + abs(x) + abs(y) + a + b)
        for m in range(tips.shape[1]):
            n = U(m)
            dx, dy = tips[U(0), n] - x, tips[U(1), n] - y
            px, py = c * dx + s * dy, c * dy - s * dx
            if kind[o] == SPHERE:
                off, reach = dx * dx + dy * dy, a + wide
            elif kind[o] == BOX:
                u, v = max(abs(px) - a, 0.0), max(abs(py) - b, 0.0)
                off, reach = u * u + v * v, wide
            elif kind[o] == CAPSULE:
                u = max(abs(px) - b, 0.0)
                off, reach = u * u + py * py, a + wide
            else:
                u = max(px, 0.0)
                off, reach = u * u, wide
            hit[n] += off <= reach * reach


@kernel
def _meets_box(px: float, py: float, qx: float, qy: float, a: float, b: float) -> bool:
    """Return whether a segment and the box ± a, ± b meet, by the separating axes.

    The axes are the box's two and the segment's normal.
    """
    mx, my, ex, ey = 0.5 * (px + qx), 0.5 * (py + qy), 0.5 * (qx - px), 0.5 * (qy - py)
    beside = abs(mx * ey - my * ex) <= a * abs(ey) + b * abs(ex)
    return (abs(mx) <= a + abs(ex)) & (abs(my) <= b + abs(ey)) & beside


@kernel
def _meets_capsule(px: float, py: float, qx: float, qy: float, radius: float, half: float) -> bool:
    """Return whether a segment and the capsule around (−half, 0), (half, 0) meet."""
    ux, uy = qx - px, qy - py
    left, right = ux * (0.0 - py) - uy * (-half - px), ux * (0.0 - py) - uy * (half - px)
    crossing = (py * qy < 0.0) & (left * right < 0.0)
    u, v = max(abs(px) - half, 0.0), max(abs(qx) - half, 0.0)
    ends = min(u * u + py * py, v * v + qy * qy)
    tips = min(
        squared_distance(px, py, qx, qy, -half, 0.0), squared_distance(px, py, qx, qy, half, 0.0)
    )
    return crossing | (min(ends, tips) <= radius * radius)
