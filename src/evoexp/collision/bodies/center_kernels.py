"""Kernels of sphere centres: where they are in eight configurations, and which are nearest.

Joints move the points; a point of eight configurations is three vectors side by side.
"""

import numpy as np

from evoexp.numeric.compilation import inlined
from evoexp.numeric.vectors import Vector, load, lower, store
from evoexp.records import FloatArray
from evoexp.robots.forward_kinematics import SPATIAL_FRAME, VECTOR
from evoexp.robots.kinematics import U

POINT = U(3) * VECTOR
"""Numbers of a point of eight configurations: x, y, z."""


@inlined
def spatial_point(
    frames: FloatArray,
    joint: int,
    local: FloatArray,
    points: FloatArray,
    place: np.uint64,
    stride: np.uint64,
) -> None:
    """Write a point that a joint moves.

    Args:
        frames: Of `spatial_frames`.
        joint: Index into the kinematic table.
        local: (≥ 3,) the point in the table's frame [length unit].
        points: Written.
        place: Of its x in `points`.
        stride: From x to y, and from y to z.
    """
    j, x, y, z = U(joint) * SPATIAL_FRAME, local[0], local[1], local[2]
    for row in range(3):
        a, o = j + U(3 * row) * VECTOR, j + U(9 + row) * VECTOR
        turned = (
            load(frames, a) * x + load(frames, a + VECTOR) * y + load(frames, a + U(2) * VECTOR) * z
        )
        store(points, place + U(row) * stride, load(frames, o) + turned)


@inlined
def nearest(
    centers: FloatArray,
    one: np.uint64,
    end: np.uint64,
    first: np.uint64,
    stop: np.uint64,
    least: Vector,
) -> Vector:
    """Lower a squared distance to the least between two ranges of spheres.

    Args:
        centers: (spheres · POINT,).
        one: First sphere of one range.
        end: One past its last.
        first: First sphere of the other.
        stop: One past its last.
        least: The squared distance so far [length unit²].
    """
    i = one
    # four of them are held in registers
    while i + U(3) < end:
        ax, ay, az = _center(centers, i)
        bx, by, bz = _center(centers, i + U(1))
        cx, cy, cz = _center(centers, i + U(2))
        dx, dy, dz = _center(centers, i + U(3))
        a, b, c, d = least, least, least, least
        for j in range(first, stop):
            x, y, z = _center(centers, U(j))
            a = lower(a, _squared(ax, ay, az, x, y, z))
            b = lower(b, _squared(bx, by, bz, x, y, z))
            c = lower(c, _squared(cx, cy, cz, x, y, z))
            d = lower(d, _squared(dx, dy, dz, x, y, z))
        least = lower(lower(a, b), lower(c, d))
        i += U(4)
    # the rest one by one
    while i < end:
        ax, ay, az = _center(centers, i)
        for j in range(first, stop):
            least = lower(least, _squared(ax, ay, az, *_center(centers, U(j))))
        i += U(1)
    return least


@inlined
def _center(centers: FloatArray, k: np.uint64) -> tuple[Vector, Vector, Vector]:
    """Return a sphere's centre."""
    own = k * POINT
    return load(centers, own), load(centers, own + VECTOR), load(centers, own + U(2) * VECTOR)


@inlined
def _squared(ax: Vector, ay: Vector, az: Vector, bx: Vector, by: Vector, bz: Vector) -> Vector:
    """Return the squared distance of two points."""
    x, y, z = ax - bx, ay - by, az - bz
    return x * x + y * y + z * z
