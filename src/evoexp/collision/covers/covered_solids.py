"""Bodies as convex solids: what covers need to know of coal's shapes."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.body_table import UnsupportedShape
from evoexp.collision.box_support import coal
from evoexp.numeric.ordered_sums import matrix_product
from evoexp.records import FloatArray

POINTS_AT_ONCE = 4000  # whose heights above all planes are found together


class Solid(NamedTuple):
    """A convex body in its own frame."""

    low: FloatArray  # (3,) least corner of the box around it
    high: FloatArray  # (3,) greatest corner
    near: Any  # function (points, 3) → (points,), at most the signed distance
    far: Any  # function (points, 3) → (points,), at least the signed distance
    # (planes, 4) of a hull: outward normals of unit length, and minus the planes' heights
    planes: FloatArray | None = None
    area: float = 0.0  # of a hull's surface [length unit²]

    def heights(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the greatest height of points above a plane, and the normal of that plane."""
        assert self.planes is not None
        highest, normals = np.empty(len(points)), np.empty((len(points), 3))
        for k in range(0, len(points), POINTS_AT_ONCE):
            own = slice(k, k + POINTS_AT_ONCE)
            heights = matrix_product(points[own], self.planes[:, :3].T) + self.planes[:, 3]
            which = heights.argmax(axis=1)
            highest[own] = heights[np.arange(len(which)), which]
            normals[own] = self.planes[which, :3]
        return highest, normals


def solid_of(item: Any) -> Solid:
    """Return the solid of a geometry object; of a mesh its convex hull.

    Raises:
        UnsupportedShape: If the shape has no inside.
    """
    shape = item.geometry
    if isinstance(shape, coal.Box):
        half = np.array(shape.halfSide)
        return _exact(half, lambda points: _box_distance(points, half))
    if isinstance(shape, coal.Cylinder):
        half = np.array([shape.radius, shape.radius, shape.halfLength])
        return _exact(
            half, lambda points: _cylinder_distance(points, shape.radius, shape.halfLength)
        )
    if isinstance(shape, coal.Ellipsoid):
        half = np.array(shape.radii)
        return Solid(
            -half,
            half,
            lambda points: _box_distance(points, half),
            lambda p: _ellipsoid_bound(p, half),
        )
    if isinstance(shape, coal.Cone):
        half = np.array([shape.radius, shape.radius, shape.halfLength])
        around = _exact(
            half, lambda points: _cylinder_distance(points, shape.radius, shape.halfLength)
        )
        return around._replace(far=lambda points: np.maximum(_coal_distance(points, shape), 0.0))
    if isinstance(shape, coal.ConvexBase):
        corners = np.array([shape.point(i) for i in range(shape.num_points)])
    elif isinstance(shape, coal.BVHModelBase):
        corners = np.array([shape.vertex(i) for i in range(shape.num_vertices)])
    else:
        raise UnsupportedShape(
            f"robot: body '{item.name}' must be a solid, was a {type(shape).__name__}"
        )
    from scipy.spatial import (
        ConvexHull,
        QhullError,
    )  # only meshes need it, and it takes long to load

    try:
        hull = ConvexHull(corners)
    except (ValueError, QhullError):
        must = f"robot: body '{item.name}' must be a solid"
        raise UnsupportedShape(f"{must}, was a mesh without an inside") from None
    planes = hull.equations  # outward normals, unit length

    def near(points: FloatArray) -> FloatArray:
        return np.asarray((matrix_product(points, planes[:, :3].T) + planes[:, 3]).max(axis=1))

    def far(points: FloatArray) -> FloatArray:
        found: FloatArray = near(points)
        outside = np.flatnonzero(found > 0.0)
        found[outside] = np.maximum(found[outside], _coal_distance(points[outside], shape))
        return found

    return Solid(corners.min(axis=0), corners.max(axis=0), near, far, planes, hull.area)


def _exact(half: FloatArray, distance: Any) -> Solid:
    return Solid(-half, half, distance, distance)


def _box_distance(points: FloatArray, half: FloatArray) -> FloatArray:
    off = np.abs(points) - half
    outside = np.sqrt((np.maximum(off, 0.0) ** 2).sum(axis=1))
    return np.asarray(outside + np.minimum(off.max(axis=1), 0.0))


def _cylinder_distance(points: FloatArray, radius: float, half: float) -> FloatArray:
    flat = np.column_stack([np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2), points[:, 2]])
    return _box_distance(flat, np.array([radius, half]))


def _ellipsoid_bound(points: FloatArray, half: FloatArray) -> FloatArray:
    """Return upper bounds of the signed distances of points from an ellipsoid.

    Outside, the bound is the way toward the middle; inside, it follows from the thinnest axis.
    """
    scale = np.sqrt(((points / half) ** 2).sum(axis=1))
    outside = np.sqrt((points**2).sum(axis=1)) * (1.0 - 1.0 / np.maximum(scale, 1.0))
    return np.asarray(np.where(scale > 1.0, outside, (scale - 1.0) * half.min()))


def _coal_distance(points: FloatArray, shape: Any) -> FloatArray:
    """Return the distances of points from a body as coal has them."""
    here, ball, request, result = (
        coal.Transform3s(),
        coal.Sphere(1e-9),
        coal.DistanceRequest(),
        coal.DistanceResult(),
    )
    found = np.empty(len(points))
    for k, point in enumerate(points):
        result.clear()
        found[k] = coal.distance(
            ball, coal.Transform3s(np.eye(3), point), shape, here, request, result
        )
    return found
