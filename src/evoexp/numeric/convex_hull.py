"""Convex hulls of points in space."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def hull_of(points: FloatArray) -> tuple[FloatArray, IntArray] | None:
    """Return the corners (corners, 3) of the convex hull of points, in their order, and triangles.

    The triangles (triangles, 3) are turned outward. None if the points have no inside.
    """
    from scipy.spatial import ConvexHull, QhullError  # only meshes need it, and it loads for long

    try:
        hull: Any = ConvexHull(points)
    except (ValueError, QhullError):
        return None
    kept = np.unique(hull.simplices)
    number = np.full(len(points), -1, dtype=np.int64)
    number[kept] = np.arange(len(kept))
    triangles = number[hull.simplices]
    a, b, c = (points[hull.simplices[:, k]] for k in range(3))
    inward = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(axis=1) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return points[kept], triangles
