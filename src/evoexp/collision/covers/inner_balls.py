"""Balls and capsules inside a body, by which a pair that may touch is kept from overlapping deep.

A cover reaches beyond its body, so covers of bodies that touch overlap by far more than the bodies.
Where a contact is allowed up to some depth, the body is replaced by shapes inside it, which must
stay free: everything of a ball or capsule that lies deeper than the allowed depth, and of boxes and
cylinders points below their edges. Against a plane, whatever the body's tilt, free points mean that
the body overlaps by no more than the allowed depth; the exact verdict has the last word.
"""

from itertools import product
from typing import Any

import coal
import numpy as np

from evoexp.collision.body_table import UnsupportedShape
from evoexp.collision.covers.body_covers import Cover
from evoexp.numeric.elementary import sincos
from evoexp.records import FloatArray

AROUND = 24  # points around the axis of a cylinder
SPACING = 0.02  # [length unit] of points along edges and on faces, at most
MOST_RINGS = 100_000  # of a cylinder
MOST = 12  # points along one edge of a box, at most


def inner_balls(item: Any, depth: float) -> Cover | None:
    """Return balls, capsules and points inside a body, in its joint's frame.

    Args:
        item: A `pin.GeometryObject`.
        depth: How deep the body may overlap another one [length unit].

    Returns:
        The shapes; None if the body is no ball, capsule, box or cylinder: only the exact verdict
        bounds how deep such a body overlaps another one.
    """
    shape = item.geometry
    if isinstance(shape, coal.Sphere | coal.Capsule):
        half = shape.halfLength if isinstance(shape, coal.Capsule) else 0.0
        ends = np.array([[0.0, 0.0, -half]]), np.array([[0.0, 0.0, half]])
        return Cover.placed(item, *ends, np.array([max(shape.radius - depth, 0.0)]))
    if isinstance(shape, coal.Cylinder):
        points = _of_cylinder(float(shape.radius), float(shape.halfLength), depth / np.sqrt(2.0))
        return Cover.placed(item, points, points, np.zeros(len(points)))
    if isinstance(shape, coal.Box):
        points = _of_box(np.array(shape.halfSide), depth / np.sqrt(3.0))
        return Cover.placed(item, points, points, np.zeros(len(points)))
    return None


def _of_cylinder(radius: float, half: float, inset: float) -> FloatArray:
    """Return points of a cylinder around z that is smaller on all sides, rings and two middles."""
    radius, half = max(radius - inset, 0.0), max(half - inset, 0.0)
    turns = [sincos(2.0 * np.pi * k / AROUND) for k in range(AROUND)]
    ring = radius * np.array([(cosine, sine) for sine, cosine in turns])
    if not 2.0 * half < MOST_RINGS * SPACING:
        raise UnsupportedShape(
            f"scenario: a cylinder that is grasped must be at most {MOST_RINGS * SPACING:g} long, "
            f"was {2.0 * half:.4g}"
        )
    heights = np.linspace(-half, half, int(np.ceil(2.0 * half / SPACING)) + 1)
    rings = [np.column_stack([ring, np.full(AROUND, height)]) for height in heights]
    return np.vstack([*rings, [[0.0, 0.0, -half], [0.0, 0.0, half]]])


def _of_box(half: FloatArray, inset: float) -> FloatArray:
    """Return points on the surface of a box that is smaller on all sides, corners included."""
    half = np.maximum(half - inset, 0.0)
    counts = np.minimum(np.ceil(2.0 * half / SPACING).astype(int) + 1, MOST)
    axes = [np.linspace(-h, h, max(int(n), 2)) for h, n in zip(half, counts, strict=True)]
    points = np.array(list(product(*axes)))
    return np.asarray(points[(np.abs(points) >= half - 1e-12).any(axis=1)])
