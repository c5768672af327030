"""The triangles of a mesh that can be the nearest ones during a short part of a motion.

Within such a part a distance changes by little, so that triangles which are far from the other body
in its middle decide no distance in it: coal is asked with the others alone, and answers the same.
"""

import functools
from typing import Any, NamedTuple

import coal
import numpy as np

from evoexp.numeric.ordered_sums import matrix_product
from evoexp.records import FloatArray, IntArray

LARGE = 0.7  # [-] of a mesh's triangles: as many are not worth a mesh of their own


class Surface(NamedTuple):
    """A mesh as arrays, in its own frame."""

    corners: FloatArray  # (corners, 3)
    triangles: IntArray  # (triangles, 3) their corners
    centers: FloatArray  # (triangles, 3) of balls that hold the triangles
    radii: FloatArray  # (triangles,) of the balls


class _Core(NamedTuple):
    """A box, widened about z and then swept by a ball, which holds a shape."""

    low: FloatArray  # (3,) least coordinates of the box in the shape's frame
    high: FloatArray  # (3,) greatest coordinates
    around: float  # by how much it is widened in the plane of x and y: the radius of a cylinder
    swept: float  # radius of the ball


class NearPart(NamedTuple):
    """A mesh without the triangles that are too far from the other body in a part of a motion."""

    pair: int  # the pair of bodies
    begin: float  # where the part begins [instant]
    end: float  # where it ends
    way: float  # by how much the distance can change in it [length unit]
    mesh: Any  # coal's, of the triangles that are left
    kept: IntArray  # indices of these triangles

    def holds(self, pair: int, begin: float, end: float) -> bool:
        """Return whether it answers for a pair from begin to end."""
        return pair == self.pair and self.begin <= begin and end <= self.end


@functools.lru_cache(maxsize=512)
def surface_of(mesh: Any) -> Surface:
    """Return a coal mesh as arrays."""
    corners = np.array(mesh.vertices())
    faces = (mesh.tri_indices(k) for k in range(mesh.num_tris))
    triangles = np.array([(face[0], face[1], face[2]) for face in faces], dtype=np.int64)
    points = corners[triangles]  # (triangles, 3, 3)
    centers = 0.5 * (points.min(axis=1) + points.max(axis=1))
    squares = ((points - centers[:, None]) ** 2).sum(axis=2)
    return Surface(corners, triangles, centers, np.sqrt(squares.max(axis=1)))


def near_triangles(
    mesh: Any, other: Any, into: Any, reach: float, known: IntArray | None = None
) -> IntArray:
    """Return the triangles of a mesh that may be within reach of another body.

    Args:
        mesh: Coal's.
        other: A convex shape of coal's.
        into: The mesh's placement in the other's frame, a `pin.SE3`.
        reach: Distance [length unit]; no triangle that is closer is left out.
        known: Indices of the triangles that are looked at; None: all.
    """
    surface = surface_of(mesh)
    kept = np.arange(len(surface.triangles)) if known is None else known
    core = _core(other)
    # balls around the triangles, then boxes
    centers = _moved(into, surface.centers[kept])
    kept = kept[_apart(centers, centers, core) - surface.radii[kept] <= reach]
    corners = _moved(into, surface.corners[surface.triangles[kept].ravel()]).reshape(-1, 3, 3)
    apart = _apart(corners.min(axis=1), corners.max(axis=1), core)
    return np.asarray(kept[apart <= reach])


def mesh_of(mesh: Any, kept: IntArray) -> Any:
    """Return a coal mesh with some of its triangles alone; the mesh itself if they are most."""
    if len(kept) > LARGE * mesh.num_tris:
        return mesh
    surface = surface_of(mesh)
    used, corners = np.unique(surface.triangles[kept], return_inverse=True)
    found = coal.BVHModelOBBRSS()
    found.beginModel(len(kept), len(used))
    found.addVertices(np.ascontiguousarray(surface.corners[used]))
    found.addTriangles(np.ascontiguousarray(corners.reshape(-1, 3), dtype=np.int64))
    found.endModel()
    return found


def _core(shape: Any) -> _Core:
    """Return a core of a shape in its frame: exact, or a box around the shape."""
    swept, none = float(shape.getSweptSphereRadius()), np.zeros(3)
    if isinstance(shape, coal.Sphere):
        return _Core(none, none, 0.0, shape.radius + swept)
    if isinstance(shape, (coal.Capsule, coal.Cylinder)):
        end = np.array([0.0, 0.0, shape.halfLength])
        if isinstance(shape, coal.Capsule):
            return _Core(-end, end, 0.0, shape.radius + swept)
        return _Core(-end, end, shape.radius, swept)
    shape.computeLocalAABB()
    return _Core(shape.aabb_local.min_, shape.aabb_local.max_, 0.0, swept)


def _moved(into: Any, points: FloatArray) -> FloatArray:
    return np.asarray(matrix_product(points, into.rotation.T) + into.translation)


def _apart(low: FloatArray, high: FloatArray, core: _Core) -> FloatArray:
    """Return lower bounds (n,) of the distances of boxes, by their corners (n, 3), from a core."""
    outside = np.maximum(np.maximum(core.low - high, low - core.high), 0.0)
    beside = np.sqrt((outside[:, :2] ** 2).sum(axis=1))
    beside = np.maximum(beside - core.around, 0.0)
    return np.asarray(np.sqrt(beside**2 + outside[:, 2] ** 2) - core.swept)
