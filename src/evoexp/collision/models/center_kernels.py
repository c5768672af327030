"""Kernels of sphere centres: where they are in eight configurations, and which are nearest.

Joints move the points; a point of eight configurations is three vectors side by side.
"""

import numpy as np

from evoexp.numeric.compilation import inlined
from evoexp.numeric.vectors import Vector, load, lower, store
from evoexp.records import FloatArray
from evoexp.robots.forward_kinematics import PLANAR_FRAME, SPATIAL_FRAME, VECTOR
from evoexp.robots.kinematics import U

POINT = U(3) * VECTOR
"""Numbers of a point of eight configurations: x, y, z."""


@inlined
def planar_point(
    frames: FloatArray, joint: int, x: float, y: float, points: FloatArray, place: np.uint64
) -> None:
    """Write x and y of a point that a joint of a planar robot moves.

    Args:
        frames: Of `planar_frames`.
        joint: Index into the kinematic table.
        x: In the table's frame [length unit].
        y: In the table's frame.
        points: Written.
        place: Of the point in `points`.
    """
    j = U(joint) * PLANAR_FRAME
    s, c = load(frames, j), load(frames, j + VECTOR)
    store(points, place, load(frames, j + U(2) * VECTOR) + (c * x - s * y))
    store(points, place + VECTOR, load(frames, j + U(3) * VECTOR) + (s * x + c * y))


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
    space: bool | None,
    centers: FloatArray,
    one: np.uint64,
    end: np.uint64,
    first: np.uint64,
    stop: np.uint64,
    least: Vector,
) -> Vector:
    """Lower a squared distance to the least between two ranges of spheres.

    Args:
        space: None if all centres stand at one height, else true.
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
        ax, ay, az = _center(space, centers, i)
        bx, by, bz = _center(space, centers, i + U(1))
        cx, cy, cz = _center(space, centers, i + U(2))
        dx, dy, dz = _center(space, centers, i + U(3))
        a, b, c, d = least, least, least, least
        for j in range(first, stop):
            x, y, z = _center(space, centers, U(j))
            a = lower(a, _squared(space, ax, ay, az, x, y, z))
            b = lower(b, _squared(space, bx, by, bz, x, y, z))
            c = lower(c, _squared(space, cx, cy, cz, x, y, z))
            d = lower(d, _squared(space, dx, dy, dz, x, y, z))
        least = lower(lower(a, b), lower(c, d))
        i += U(4)
    # the rest one by one
    while i < end:
        ax, ay, az = _center(space, centers, i)
        for j in range(first, stop):
            least = lower(least, _squared(space, ax, ay, az, *_center(space, centers, U(j))))
        i += U(1)
    return least


@inlined
def _center(space: bool | None, centers: FloatArray, k: np.uint64) -> tuple[Vector, Vector, Vector]:
    """Return a sphere's centre; in the plane its height is not looked at."""
    own = k * POINT
    x, y = load(centers, own), load(centers, own + VECTOR)
    return x, y, x if space is None else load(centers, own + U(2) * VECTOR)


@inlined
def _squared(
    space: bool | None, ax: Vector, ay: Vector, az: Vector, bx: Vector, by: Vector, bz: Vector
) -> Vector:
    """Return the squared distance of two points."""
    x, y = ax - bx, ay - by
    if space is None:
        return x * x + y * y
    z = az - bz
    return x * x + y * y + z * z
