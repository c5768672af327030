"""Convex bodies as solids, and spheres of different radii that cover one, as far as asked.

A ball around a point within a convex body that lies d deep may be d + i wide: no point of it is
farther than i from the body. Deep points so cover much at once. The body is cut into small cells,
and balls are chosen one after the other, each that which contains most of the cells left. A cell is
done when one ball contains all that it has of the body, so the balls contain the body.
"""

import functools
from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.body_table import UnsupportedShape
from evoexp.collision.box_support import coal, corners_of, distance
from evoexp.numeric.elementary import matrix_product
from evoexp.records import BoolArray, FloatArray

POINTS_AT_ONCE = 4000  # whose heights above all planes are found together
FINE = 0.45  # [-] of the inflation: from the middle of a cell at the surface to its corners
DEEP = 0.25  # [-] of a cell's depth: the same, of a cell within
MOST_VARIED = 300  # balls of one hull
MOST_CELLS = 120_000
OF_A_CELL = 0.3  # [-] of its edge squared: at least the surface per cell (seen: .05 to .24)
COARSER = 1.25  # [-] by which the inflation grows where balls do not suffice
CANDIDATES = 800  # middles of balls, within the body
AT_ONCE = 64  # cells that are compared with all candidates together
COAL_ERROR = 1e-5  # [-] of a body's size: more than that of its distances
LESS = 1.0 - 1e-9  # of a ball's radius: more than rounding


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
        signed = functools.partial(_box_distance, half=half)
        return Solid(-half, half, signed, signed)
    if isinstance(shape, coal.Cylinder | coal.Cone):
        half = np.array([shape.radius, shape.radius, shape.halfLength])
        if isinstance(shape, coal.Cylinder):
            signed = functools.partial(_cylinder_distance, half=half[1:])
            return Solid(-half, half, signed, signed)
        heights = functools.partial(_cone_heights, radius=half[0], half=half[2])
        return Solid(-half, half, heights, functools.partial(_farther, near=heights, shape=shape))
    if isinstance(shape, coal.Ellipsoid):
        half = np.array(shape.radii)
        return Solid(
            -half,
            half,
            functools.partial(_box_distance, half=half),
            functools.partial(_ellipsoid_bound, half=half),
        )
    if not isinstance(shape, coal.ConvexBase | coal.BVHModelBase):
        raise UnsupportedShape(
            f"robot: body '{item.name}' must be a solid, was a {type(shape).__name__}"
        )
    from scipy.spatial import ConvexHull, QhullError  # only for meshes: it takes long to load

    corners = corners_of(shape)
    try:
        hull = ConvexHull(corners)
    except (ValueError, QhullError):
        must = f"robot: body '{item.name}' must be a solid"
        raise UnsupportedShape(f"{must}, was a mesh without an inside") from None
    planes = hull.equations  # outward normals, unit length

    def near(points: FloatArray) -> FloatArray:
        return np.asarray((matrix_product(points, planes[:, :3].T) + planes[:, 3]).max(axis=1))

    far = functools.partial(_farther, near=near, shape=shape)
    return Solid(corners.min(axis=0), corners.max(axis=0), near, far, planes, hull.area)


def _box_distance(points: FloatArray, half: FloatArray) -> FloatArray:
    off = np.abs(points) - half
    outside = np.sqrt((np.maximum(off, 0.0) ** 2).sum(axis=1))
    return np.asarray(outside + np.minimum(off.max(axis=1), 0.0))


def _cylinder_distance(points: FloatArray, half: FloatArray) -> FloatArray:
    flat = np.column_stack([np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2), points[:, 2]])
    return _box_distance(flat, half)


def _cone_heights(points: FloatArray, radius: float, half: float) -> FloatArray:
    """Return how high points stand above the base or the side of a cone, whichever is more."""
    across, z = np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2), points[:, 2]
    edge = np.sqrt(radius * radius + 4.0 * half * half)
    return np.asarray(np.maximum((2.0 * half * across + radius * (z - half)) / edge, -half - z))


def _farther(points: FloatArray, near: Any, shape: Any) -> FloatArray:
    """Return heights of points above a body's planes; of those outside, distances from it."""
    found: FloatArray = near(points)
    outside = np.flatnonzero(found > 0.0)
    found[outside] = np.maximum(found[outside], _coal_distance(points[outside], shape))
    return found


def _ellipsoid_bound(points: FloatArray, half: FloatArray) -> FloatArray:
    """Return upper bounds of the signed distances of points from an ellipsoid."""
    # outside, the way toward the middle; inside, by the thinnest axis
    scale = np.sqrt(((points / half) ** 2).sum(axis=1))
    outside = np.sqrt((points**2).sum(axis=1)) * (1.0 - 1.0 / np.maximum(scale, 1.0))
    return np.asarray(np.where(scale > 1.0, outside, (scale - 1.0) * half.min()))


def _coal_distance(points: FloatArray, shape: Any) -> FloatArray:
    here, ball = coal.Transform3s(), coal.Sphere(1e-9)
    places = (coal.Transform3s(np.eye(3), point) for point in points)
    return np.array([distance(ball, place, shape, here) for place in places])


class Balls(NamedTuple):
    """Balls around a body."""

    centers: FloatArray  # (balls, 3)
    radii: FloatArray  # (balls,) [length unit]
    reach: float  # how far they reach beyond the body at most [length unit]


class _Cells(NamedTuple):
    """Balls that hold a body together, each around the part of it in one cube."""

    middles: FloatArray  # (cells, 3)
    sizes: FloatArray  # (cells,) radii


def varied_spheres(solid: Solid, inflation: float, farthest: float) -> Balls | None:
    """Cover a hull with balls that reach as far as asked, or as little more as they can.

    Args:
        inflation: How far the balls may reach beyond it [length unit]; it grows where
            `MOST_VARIED` do not suffice.
        farthest: What the inflation stays below [length unit].

    Returns:
        The balls; None if so many do not suffice, or the body is no hull.
    """
    if solid.planes is None:
        return None
    edge, cells = np.inf, None  # of the smallest cells, on which all of them depend
    while inflation < farthest:
        if edge != (edge := _cell_edge(solid, inflation)):
            cells = _cells(solid, edge)
        if cells is not None and (found := _balls(solid, inflation, cells)) is not None:
            return found
        inflation *= COARSER
    return None


def _balls(solid: Solid, inflation: float, cells: _Cells) -> Balls | None:
    """Choose balls that contain all cells together; None if so many do not suffice."""
    kept: list[tuple[FloatArray, FloatArray]] = []
    left = np.ones(len(cells.middles), dtype=np.bool_)
    # deep balls first; whatever they leave is covered by balls around the cells themselves
    for centers in (_within(solid, cells), cells.middles):
        budget = MOST_VARIED - sum(len(each) for each, _ in kept)
        if budget == 0 or not left.any():
            break
        if centers is cells.middles:
            centers = centers[left]
        radii = inflation - solid.far(centers)
        wide = radii > 0.0
        chosen = _chosen(centers[wide], radii[wide], cells, left, budget)
        kept.append((centers[wide][chosen], radii[wide][chosen]))
    if left.any():
        return None
    return Balls(
        np.vstack([centers for centers, _ in kept]),
        np.concatenate([radii for _, radii in kept]),
        inflation,
    )


def _cell_edge(solid: Solid, inflation: float) -> float:
    """Return the edge of the cells at the surface, which halves the body's longest."""
    edge = float((solid.high - solid.low).max())
    while 0.5 * edge * float(np.sqrt(3.0)) > FINE * inflation:
        edge *= 0.5
    return edge


def _cells(solid: Solid, least: float) -> _Cells | None:
    """Cut a body into cubes, the smallest at its surface; None if they are too many."""
    if solid.area > MOST_CELLS * OF_A_CELL * least * least:
        return None
    edge = float((solid.high - solid.low).max())
    slack = COAL_ERROR * edge
    middles = 0.5 * (solid.low + solid.high)[None]
    found: list[_Cells] = []
    count = 0
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.25
    while len(middles) > 0:
        half = 0.5 * edge * float(np.sqrt(3.0))
        height, normals = solid.heights(middles)
        # beyond a sharp edge a point is far from the body, however low above its planes
        distance, above = height.copy(), np.flatnonzero((height > 0.0) & (height <= half))
        distance[above] = np.maximum(height[above], solid.far(middles[above]) - slack)
        met = distance <= half
        middles, height, normals = middles[met], height[met], normals[met]
        small = (edge <= least) | (half <= -DEEP * height)
        # of a cell whose middle is outside, what lies below the plane: a cap, less than half a ball
        out = np.maximum(height[small], 0.0)
        onto = middles[small] - out[:, None] * normals[small]
        found.append(_Cells(onto, np.sqrt(np.maximum(half * half - out * out, 0.0)) / LESS))
        count += int(small.sum())
        middles = (middles[~small][:, None] + edge * corners).reshape(-1, 3)
        edge *= 0.5
        if count + len(middles) > 8 * MOST_CELLS or count > MOST_CELLS:
            return None
    return _Cells(
        np.vstack([each.middles for each in found]), np.concatenate([each.sizes for each in found])
    )


def _within(solid: Solid, cells: _Cells) -> FloatArray:
    """Return points on a lattice within a body, where deep balls have their middles."""
    edges = solid.high - solid.low
    step = float(np.prod(edges) / CANDIDATES) ** (1.0 / 3.0)
    counts = np.maximum(np.ceil(edges / max(step, 1e-300)), 1.0).astype(int)
    axes = [
        low + edge * (np.arange(n) + 0.5) / n
        for low, edge, n in zip(solid.low, edges, counts, strict=True)
    ]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(points[solid.heights(points)[0] < 0.0])


def _chosen(
    centers: FloatArray, radii: FloatArray, cells: _Cells, left: BoolArray, most: int
) -> list[int]:
    """Choose balls that contain most of the cells left, and strike these off `left`."""
    if len(centers) == 0:
        return []
    where = np.flatnonzero(left)
    middles, sizes = cells.middles[where], cells.sizes[where]
    contains = np.empty((len(where), len(centers)), dtype=np.bool_)  # a row per cell
    reached = radii * LESS
    for k in range(0, len(where), AT_ONCE):
        own = slice(k, k + AT_ONCE)
        x, y, z = (middles[own, None, e] - centers[:, e] for e in range(3))
        room = np.maximum(reached - sizes[own, None], 0.0)
        contains[own] = (x * x + y * y + z * z <= room * room) & (room > 0.0)
    counts = contains.sum(axis=0)
    found: list[int] = []
    waiting = np.ones(len(where), dtype=np.bool_)
    while len(found) < most and counts.max() > 0:
        best = int(counts.argmax())
        found.append(best)
        new = waiting & contains[:, best]
        counts -= contains[new].sum(axis=0)
        waiting &= ~new
    left[where[~waiting]] = False
    return found
