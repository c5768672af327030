"""Kernels of static obstacles.

Signed distances of points of a robot to their surfaces, a block at a time.
"""

import numpy as np

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.robots.kinematics import BLOCK, U
from evoexp.scenarios.obstacles import BOX, CAPSULE, CYLINDER, HALF_SPACE, SPHERE

ROWS = 3 * BLOCK  # x, y, z of a point in a block
MARGIN = 1.0 + 1e-9  # bounds are widened by it, so that rounding cannot skip what touches


@kernel
def meet(one, i, two, j, within):  # type: ignore[no-untyped-def]
    """Whether the points at offsets i and j are closer than `within` in any lane."""
    squared = within * within
    count = 0
    for n in range(BLOCK):
        a, b = i + U(n), j + U(n)
        dx, dy = one[a] - two[b], one[a + U(BLOCK)] - two[b + U(BLOCK)]
        dz = one[a + U(2 * BLOCK)] - two[b + U(2 * BLOCK)]
        count += dx * dx + dy * dy + dz * dz < squared
    return count > 0


@kernel
def _below(rotation, origin, points, i, within):  # type: ignore[no-untyped-def]
    """Whether the point at offset i is lower than `within` above a frame's z = 0 in any lane."""
    x, y, z = rotation[2], rotation[5], rotation[8]
    level = x * origin[0] + y * origin[1] + z * origin[2]
    level += within + (abs(within) + abs(level)) * (MARGIN - 1.0)
    count = 0
    for n in range(BLOCK):
        a = i + U(n)
        count += x * points[a] + y * points[a + U(BLOCK)] + z * points[a + U(2 * BLOCK)] < level
    return count > 0


@kernel
def to_obstacles(obstacles, bounds, limit, centers, middles, scratch, place, out):  # type: ignore[no-untyped-def]
    """Lower `out` (BLOCK,), the limit.

    To the signed distance of any centre to any obstacle's surface.
    """
    _, _, reach, spheres, _ = borrowed(bounds)
    kind, center, rotation, size = borrowed(obstacles)
    centers, middles, scratch, place, out = borrowed((centers, middles, scratch, place, out))
    for o in range(len(kind)):
        for row in range(3):
            place[row * BLOCK : (row + 1) * BLOCK] = center[o, row]
        extent = (
            size[o, 0] + size[o, 1]
            if kind[o] == CAPSULE
            else _length(size[o, 0], size[o, 1], size[o, 2])
        )
        for link in range(len(reach)):
            if kind[o] == HALF_SPACE:
                near = _below(
                    rotation[o], center[o], middles, U(link) * U(ROWS), limit + reach[link]
                )
            else:
                near = meet(
                    middles, U(link) * U(ROWS), place, U(0), (limit + reach[link] + extent) * MARGIN
                )
            if near:
                for i in range(spheres[link, 0], spheres[link, 1]):
                    _into_frame(center[o], rotation[o], centers, U(i) * U(ROWS), scratch)
                    _to_obstacle(kind[o], size[o, 0], size[o, 1], size[o, 2], scratch, out)


@kernel
def _to_obstacle(kind, a, b, c, point, out):  # type: ignore[no-untyped-def]
    """Lower `out` to the signed distance of points in an obstacle's frame to its surface."""
    for n in range(BLOCK):
        lane = U(n)
        x, y, z = point[lane], point[U(BLOCK) + lane], point[U(2 * BLOCK) + lane]
        if kind == SPHERE:
            distance = _length(x, y, z) - a
        elif kind == BOX:
            u, v, w = abs(x) - a, abs(y) - b, abs(z) - c
            distance = _length(max(u, 0.0), max(v, 0.0), max(w, 0.0)) + min(max(u, max(v, w)), 0.0)
        elif kind == CAPSULE:
            distance = _length(x, y, z - min(max(z, -b), b)) - a
        elif kind == CYLINDER:
            u, v = np.sqrt(x * x + y * y) - a, abs(z) - b
            distance = _length(max(u, 0.0), max(v, 0.0), 0.0) + min(max(u, v), 0.0)
        else:
            distance = z
        out[lane] = min(out[lane], distance)


@kernel
def _into_frame(center, rotation, centers, i, out):  # type: ignore[no-untyped-def]
    """Centres at offset i seen from a frame, (ROWS,)."""
    cx, cy, cz = center[0], center[1], center[2]
    for row in range(3):
        a, b, c, e = rotation[row], rotation[3 + row], rotation[6 + row], U(row * BLOCK)
        for n in range(BLOCK):
            lane = i + U(n)
            x, y, z = (
                centers[lane] - cx,
                centers[lane + U(BLOCK)] - cy,
                centers[lane + U(2 * BLOCK)] - cz,
            )
            out[e + U(n)] = a * x + b * y + c * z


@kernel
def _length(x, y, z):  # type: ignore[no-untyped-def]
    return np.sqrt(x * x + y * y + z * z)
