"""Distances of a body's spheres from an obstacle, or from another body's, in eight configurations.

Everything here is seen from the obstacle's frame or from the other body's frame: then the shapes of
one side are constants, and only one rigid motion is needed for the other side. The motions and the
least clearances of eight configurations stay in registers while the shapes pass by.

A sphere, a capsule and a box are one shape: a box (with edges of length 0 where needed), thickened
by a radius.
"""

import numpy as np

from evoexp.collision.bodies.center_kernels import POINT
from evoexp.numeric.compilation import inlined
from evoexp.numeric.vectors import Vector, load, lower, magnitude, root, spread, store, upper
from evoexp.records import FloatArray, IntArray
from evoexp.robots.forward_kinematics import VECTOR
from evoexp.robots.kinematics import U

Row = tuple[Vector, Vector, Vector, Vector]
Motion = tuple[Row, Row, Row]
"""Eight rigid motions: per coordinate a row of the rotation, and the translation."""

Place = tuple[Vector, Vector, Vector]
"""Eight points or directions: x, y, z."""

Core = tuple[Vector, Vector, Vector, Vector]
"""Of obstacles: half the edges and the thickness of a box.

Radius and half the length of a cylinder.
"""


@inlined
def turned(row: Row, x: float, y: float, z: float) -> Vector:
    """Return a coordinate of a constant direction after a motion."""
    return row[0] * x + row[1] * y + row[2] * z


@inlined
def moved(row: Row, x: float, y: float, z: float) -> Vector:
    """Return a coordinate of a constant point after a motion."""
    return turned(row, x, y, z) + row[3]


@inlined
def moved_point(motion: Motion, x: float, y: float, z: float) -> Place:
    """Return a constant point after a motion."""
    return moved(motion[0], x, y, z), moved(motion[1], x, y, z), moved(motion[2], x, y, z)


@inlined
def spheres_to_boxes(
    motion: Motion,
    core: Core,
    runs: IntArray,
    spheres: FloatArray,
    first: int,
    stop: int,
    least: Vector,
) -> Vector:
    """Lower a clearance to the signed distances of a body's spheres from thickened boxes.

    Args:
        motion: From the body's frame to the boxes'.
        runs: (runs, 2) first and one-past-last sphere of equal radius.
        spheres: (spheres, 4) centres in the body's frame, and radii.
        first: First run of the body.
        stop: One past its last.
        least: The clearance so far [length unit].
    """
    zero = spread(0.0)
    for run in range(first, stop):
        outside, deepest = spread(np.inf), zero
        for i in range(runs[run, 0], runs[run, 1]):
            x, y, z = moved_point(motion, spheres[i, 0], spheres[i, 1], spheres[i, 2])
            u, v, w = magnitude(x) - core[0], magnitude(y) - core[1], magnitude(z) - core[2]
            deepest = lower(deepest, upper(upper(u, v), w))
            u, v, w = upper(u, zero), upper(v, zero), upper(w, zero)
            outside = lower(outside, u * u + v * v + w * w)
        radius = spheres[runs[run, 0], 3]
        least = lower(least, root(outside) + deepest - (core[3] + radius))
    return least


@inlined
def spheres_to_cylinders(
    motion: Motion,
    core: Core,
    runs: IntArray,
    spheres: FloatArray,
    first: int,
    stop: int,
    least: Vector,
) -> Vector:
    """Lower a clearance to the signed distances of a body's spheres from cylinders."""
    zero = spread(0.0)
    for i in range(runs[first, 0], runs[stop - 1, 1]):
        x, y, z = moved_point(motion, spheres[i, 0], spheres[i, 1], spheres[i, 2])
        u, w = root(x * x + y * y) - core[0], magnitude(z) - core[1]
        inside = lower(upper(u, w), zero)
        u, w = upper(u, zero), upper(w, zero)
        least = lower(least, root(u * u + w * w) + inside - spheres[i, 3])
    return least


@inlined
def spheres_to_half_spaces(
    motion: Motion, runs: IntArray, spheres: FloatArray, first: int, stop: int, least: Vector
) -> Vector:
    """Lower a clearance to the signed distances of a body's spheres from half-spaces, z ≤ 0."""
    for i in range(runs[first, 0], runs[stop - 1, 1]):
        height = moved(motion[2], spheres[i, 0], spheres[i, 1], spheres[i, 2])
        least = lower(least, height - spheres[i, 3])
    return least


@inlined
def move_spheres(
    motion: Motion, spheres: FloatArray, begin: int, end: int, centers: FloatArray
) -> None:
    """Write the moved centres of some spheres, one behind the other.

    Args:
        motion: From their body's frame to the other's.
        spheres: See `spheres_to_boxes`.
        begin: First sphere.
        end: One past the last.
        centers: (≥ spheres · POINT,) written.
    """
    for j in range(begin, end):
        x, y, z = moved_point(motion, spheres[j, 0], spheres[j, 1], spheres[j, 2])
        o = U(j - begin) * POINT
        store(centers, o, x)
        store(centers, o + VECTOR, y)
        store(centers, o + U(2) * VECTOR, z)


@inlined
def center_at(centers: FloatArray, k: int) -> Place:
    """Return a centre that `move_spheres` wrote."""
    o = U(k) * POINT
    return load(centers, o), load(centers, o + VECTOR), load(centers, o + U(2) * VECTOR)


@inlined
def spheres_to_spheres(
    runs: IntArray,
    spheres: FloatArray,
    one: int,
    other: int,
    other_stop: int,
    centers: FloatArray,
    least: Vector,
) -> Vector:
    """Lower a clearance to the distances of a run of constant spheres from moved ones.

    Args:
        runs: See `spheres_to_boxes`.
        spheres: See `spheres_to_boxes`.
        other: First run of the other body.
        other_stop: One past its last.
        centers: Of `move_spheres`, of the other body.
        least: The clearance so far [length unit].
    """
    base = runs[other, 0] if other < other_stop else 0
    for two in range(other, other_stop):
        square = spread(np.inf)
        for j in range(runs[two, 0], runs[two, 1]):
            square = _nearest_constant(
                spheres, runs[one, 0], runs[one, 1], center_at(centers, j - base), square
            )
        both = spheres[runs[one, 0], 3] + spheres[runs[two, 0], 3]
        least = lower(least, root(square) - both)
    return least


@inlined
def _nearest_constant(
    spheres: FloatArray, first: int, stop: int, center: Place, square: Vector
) -> Vector:
    """Lower a squared distance to the least of a moved centre from constant ones."""
    i = first
    # two chains of minima: the next does not wait for the last
    other = square
    while i + 1 < stop:
        square = lower(square, _squared(spheres, i, center))
        other = lower(other, _squared(spheres, i + 1, center))
        i += 2
    if i < stop:
        square = lower(square, _squared(spheres, i, center))
    found: Vector = lower(square, other)
    return found


@inlined
def _squared(spheres: FloatArray, i: int, center: Place) -> Vector:
    """Return the squared distance of a moved centre from a constant one."""
    x, y, z = center[0] - spheres[i, 0], center[1] - spheres[i, 1], center[2] - spheres[i, 2]
    square: Vector = x * x + y * y + z * z
    return square
