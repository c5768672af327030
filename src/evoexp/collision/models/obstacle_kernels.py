"""Kernels of static obstacles: signed distances of a robot's points to their surfaces."""

import math
from typing import NamedTuple

import numpy as np

from evoexp.collision.models.center_kernels import POINT
from evoexp.numeric.compilation import inlined, kernel
from evoexp.numeric.vectors import (
    Vector,
    any_lane,
    load,
    lower,
    magnitude,
    root,
    spread,
    upper,
)
from evoexp.records import FloatArray, IntArray
from evoexp.robots.forward_kinematics import VECTOR
from evoexp.robots.kinematics import U
from evoexp.scenarios.obstacles import (
    BOX,
    CAPSULE,
    CYLINDER,
    HALF_SPACE,
    SPHERE,
    ObstacleTable,
)

MARGIN = 1.0 + 1e-9  # bounds are widened by it, so that rounding skips no contact


class LinkBalls(NamedTuple):
    """A ball around the centres of every link's spheres."""

    joint: IntArray  # (links,) index into the kinematic table
    local: FloatArray  # (links, 3) in the table's frames [length unit]
    radius: FloatArray  # (links,) greatest distance of a centre
    spheres: IntArray  # (links, 2) first and one-past-last sphere of each link
    arm_links: IntArray  # (arms, 2) first and one-past-last link of each arm


@inlined
def meet(one: FloatArray, i: np.uint64, two: FloatArray, j: np.uint64, within: float) -> bool:
    """Return whether the points at i and j are closer than `within` in any lane."""
    x, y = load(one, i) - load(two, j), load(one, i + VECTOR) - load(two, j + VECTOR)
    z = load(one, i + U(2) * VECTOR) - load(two, j + U(2) * VECTOR)
    return any_lane(x * x + y * y + z * z < within * within)


@inlined
def _near(
    obstacles: ObstacleTable, o: int, points: FloatArray, i: np.uint64, within: float
) -> bool:
    """Return whether the point at i is nearer than `within` to the ball around an obstacle.

    Of a half-space: whether the point is lower above its surface, in any lane.
    """
    center, rotation, size = obstacles.center[o], obstacles.rotation[o], obstacles.size[o]
    x, y, z = load(points, i), load(points, i + VECTOR), load(points, i + U(2) * VECTOR)
    if obstacles.kind[o] == HALF_SPACE:
        nx, ny, nz = rotation[2], rotation[5], rotation[8]
        level = nx * center[0] + ny * center[1] + nz * center[2]
        level += within + (abs(within) + abs(level)) * (MARGIN - 1.0)
        return any_lane(nx * x + ny * y + nz * z < level)
    around = _length(size[0], size[1], size[2])
    if obstacles.kind[o] == CAPSULE:
        around = size[0] + size[1]
    reach = (within + around) * MARGIN
    x, y, z = x - center[0], y - center[1], z - center[2]
    return any_lane(x * x + y * y + z * z < reach * reach)


@inlined
def to_obstacles(
    obstacles: ObstacleTable,
    bounds: LinkBalls,
    limit: float,
    centers: FloatArray,
    middles: FloatArray,
) -> Vector:
    """Return the least signed distance of a centre from an obstacle's surface, at most the limit.

    Args:
        obstacles: The obstacles.
        bounds: Balls around the spheres of each link.
        limit: Above it nothing is measured [length unit].
        centers: (spheres · POINT,) centres of the spheres.
        middles: (links · POINT,) centres of the balls.
    """
    reach, spheres = bounds.radius, bounds.spheres
    least = spread(limit)
    for o in range(len(obstacles.kind)):
        for link in range(len(reach)):
            # the ball around the link decides whether its spheres are measured
            if _near(obstacles, o, middles, U(link) * POINT, limit + reach[link]):
                least = nearest_to_obstacle(
                    obstacles, o, centers, U(spheres[link, 0]), U(spheres[link, 1]), least
                )
    return least


@inlined
def nearest_to_obstacle(
    obstacles: ObstacleTable,
    o: int,
    centers: FloatArray,
    first: np.uint64,
    stop: np.uint64,
    least: Vector,
) -> Vector:
    """Lower a distance to the least signed one of some centres from an obstacle's surface.

    Args:
        obstacles: The obstacles.
        o: Which of them.
        centers: (spheres · POINT,).
        first: First sphere.
        stop: One past the last.
        least: The distance so far [length unit].
    """
    kind, size = obstacles.kind[o], obstacles.size[o]
    center, rotation = obstacles.center[o], obstacles.rotation[o]
    if kind == SPHERE:  # one square root for all
        square = spread(np.inf)
        for k in range(first, stop):
            own = U(k) * POINT
            x, y = load(centers, own) - center[0], load(centers, own + VECTOR) - center[1]
            z = load(centers, own + U(2) * VECTOR) - center[2]
            square = lower(square, x * x + y * y + z * z)
        return lower(least, root(square) - size[0])
    for k in range(first, stop):
        x, y, z = _seen_from(center, rotation, centers, U(k) * POINT)
        least = lower(least, _distance(kind, size[0], size[1], size[2], x, y, z))
    return least


@inlined
def _distance(kind: int, a: float, b: float, c: float, x: Vector, y: Vector, z: Vector) -> Vector:
    """Return the signed distance of points in an obstacle's frame to its surface; no sphere."""
    nothing = spread(0.0)
    distance = z  # of a half-space
    if kind == BOX:
        u, v, w = magnitude(x) - a, magnitude(y) - b, magnitude(z) - c
        inner = lower(upper(u, upper(v, w)), nothing)
        u, v, w = upper(u, nothing), upper(v, nothing), upper(w, nothing)
        distance = root(u * u + v * v + w * w) + inner
    elif kind == CAPSULE:
        along = z - lower(upper(z, spread(-b)), spread(b))
        distance = root(x * x + y * y + along * along) - a
    elif kind == CYLINDER:
        u, v = root(x * x + y * y) - a, magnitude(z) - b
        inner = lower(upper(u, v), nothing)
        u, v = upper(u, nothing), upper(v, nothing)
        distance = root(u * u + v * v) + inner
    return distance


@inlined
def _seen_from(
    center: FloatArray, rotation: FloatArray, centers: FloatArray, i: np.uint64
) -> tuple[Vector, Vector, Vector]:
    """Return the point at i as seen from a frame."""
    x, y = load(centers, i) - center[0], load(centers, i + VECTOR) - center[1]
    z = load(centers, i + U(2) * VECTOR) - center[2]
    return (
        rotation[0] * x + rotation[3] * y + rotation[6] * z,
        rotation[1] * x + rotation[4] * y + rotation[7] * z,
        rotation[2] * x + rotation[5] * y + rotation[8] * z,
    )


@kernel
def _length(x: float, y: float, z: float) -> float:
    return math.sqrt(x * x + y * y + z * z)
