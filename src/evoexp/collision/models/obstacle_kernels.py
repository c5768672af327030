"""Kernels of static obstacles: signed distances of a robot's points to their surfaces."""

import numpy as np

from evoexp.collision.bodies.center_kernels import POINT
from evoexp.numeric.compilation import inlined
from evoexp.numeric.vectors import (
    Vector,
    load,
    lower,
    magnitude,
    root,
    spread,
    upper,
)
from evoexp.records import FloatArray
from evoexp.robots.forward_kinematics import VECTOR
from evoexp.robots.kinematics import U
from evoexp.scenarios.obstacles import (
    BOX,
    CAPSULE,
    CYLINDER,
    SPHERE,
    ObstacleTable,
)

MARGIN = 1.0 + 1e-9  # bounds are widened by it, so that rounding skips no contact


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
