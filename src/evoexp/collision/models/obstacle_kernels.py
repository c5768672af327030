"""Kernels of static obstacles: signed distances of a robot's points to their surfaces."""

import math
from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import BLOCK, U
from evoexp.scenarios.obstacles import (
    BOX,
    CAPSULE,
    CYLINDER,
    HALF_SPACE,
    SPHERE,
    ObstacleTable,
)

ROWS = 3 * BLOCK  # x, y, z of a point in a block
MARGIN = 1.0 + 1e-9  # bounds are widened by it, so that rounding skips no contact


class LinkBalls(NamedTuple):
    """A ball around the centres of every link's spheres.

    Attributes:
        joint: (links,) index into the kinematic table.
        local: (links, 3) in the table's frames [length unit].
        radius: (links,) greatest distance of a centre.
        spheres: (links, 2) first and one-past-last sphere of each link.
        arm_links: (arms, 2) first and one-past-last link of each arm.
    """

    joint: IntArray
    local: FloatArray
    radius: FloatArray
    spheres: IntArray
    arm_links: IntArray


@kernel
def meet(one: FloatArray, i: np.uint64, two: FloatArray, j: np.uint64, within: float) -> bool:
    """Return whether the points at offsets i and j are closer than `within` in any lane."""
    squared = within * within
    count = 0
    for n in range(BLOCK):
        a, b = i + U(n), j + U(n)
        dx, dy = one[a] - two[b], one[a + U(BLOCK)] - two[b + U(BLOCK)]
        dz = one[a + U(2 * BLOCK)] - two[b + U(2 * BLOCK)]
        count += dx * dx + dy * dy + dz * dz < squared
    return count > 0


@kernel
def _below(
    rotation: FloatArray, origin: FloatArray, points: FloatArray, i: np.uint64, within: float
) -> bool:
    """Return whether the point at i is lower than `within` above a frame's z = 0 in any lane."""
    x, y, z = rotation[2], rotation[5], rotation[8]
    level = x * origin[0] + y * origin[1] + z * origin[2]
    level += within + (abs(within) + abs(level)) * (MARGIN - 1.0)
    count = 0
    for n in range(BLOCK):
        a = i + U(n)
        count += x * points[a] + y * points[a + U(BLOCK)] + z * points[a + U(2 * BLOCK)] < level
    return count > 0


@kernel
def to_obstacles(
    obstacles: ObstacleTable,
    bounds: LinkBalls,
    limit: float,
    centers: FloatArray,
    middles: FloatArray,
    scratch: FloatArray,
    place: FloatArray,
    out: FloatArray,
) -> None:
    """Lower `out` to the least signed distance of a centre from an obstacle's surface.

    Args:
        obstacles: The obstacles.
        bounds: Balls around the spheres of each link.
        limit: Above it nothing is measured [length unit].
        centers: (spheres · ROWS,) centres of the spheres.
        middles: (links · ROWS,) centres of the balls.
        scratch: (≥ ROWS,).
        place: (ROWS,) scratch.
        out: (BLOCK,), lowered.
    """
    bounds, obstacles = borrowed((bounds, obstacles))
    reach, spheres = bounds.radius, bounds.spheres
    kind, center, rotation = obstacles.kind, obstacles.center, obstacles.rotation
    size = obstacles.size
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
            # the ball around the link decides whether its spheres are measured
            at, within = U(link) * U(ROWS), limit + reach[link]
            if kind[o] == HALF_SPACE:
                near = _below(rotation[o], center[o], middles, at, within)
            else:
                near = meet(middles, at, place, U(0), (within + extent) * MARGIN)
            if near:
                for i in range(spheres[link, 0], spheres[link, 1]):
                    _into_frame(center[o], rotation[o], centers, U(i) * U(ROWS), scratch)
                    _to_obstacle(kind[o], size[o, 0], size[o, 1], size[o, 2], scratch, out)


@kernel
def _to_obstacle(
    kind: int, a: float, b: float, c: float, point: FloatArray, out: FloatArray
) -> None:
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
def _into_frame(
    center: FloatArray, rotation: FloatArray, centers: FloatArray, i: np.uint64, out: FloatArray
) -> None:
    """Write the centres at offset i as seen from a frame, (ROWS,)."""
    cx, cy, cz = center[0], center[1], center[2]
    for row in range(3):
        a, b, c, e = rotation[row], rotation[3 + row], rotation[6 + row], U(row * BLOCK)
        for n in range(BLOCK):
            lane = i + U(n)
            x, y = centers[lane] - cx, centers[lane + U(BLOCK)] - cy
            z = centers[lane + U(2 * BLOCK)] - cz
            out[e + U(n)] = a * x + b * y + c * z


@kernel
def _length(x: float, y: float, z: float) -> float:
    return math.sqrt(x * x + y * y + z * z)
