"""Covers of bodies by spheres or capsules, which the fast kernels test in place of coal's shapes.

A cover contains its body, so it touches whatever the body touches. Its inflation is the greatest
distance by which it reaches beyond the body, bounded from above for every body.
"""

from itertools import product
from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.body_table import UnsupportedShape
from evoexp.collision.box_support import coal
from evoexp.collision.covers.varied_spheres import Balls, Solid, varied_spheres
from evoexp.numeric.ordered_sums import matrix_product
from evoexp.records import FloatArray

# of one body that is neither ball nor capsule; where they do not suffice, the inflation grows
MOST_SPHERES = 150
MOST_VARIED = 300  # of one hull for which equal spheres do not suffice
MEASURED = 24  # points along each edge of a body's box, by which given covers are measured
MOST_IN_A_ROW = 10_000  # spheres on the axis of one body
WIDER = 1.0 + 1e-9  # covers are made larger by more than rounding


class Cover(NamedTuple):
    """Spheres or capsules around a body, in its joint's frame."""

    start: FloatArray  # (shapes, 3) centre, or one end
    end: FloatArray  # (shapes, 3) the same for spheres
    radius: FloatArray  # (shapes,)
    inflation: float  # how far the cover reaches beyond the body at most [length unit]
    # how far the body was seen to stand out of it; 0 of covers that are found here, which contain
    # their bodies [length unit]
    uncovered: float = 0.0


def sphere_cover(item: Any, inflation: float) -> Cover:
    """Return spheres that cover a geometry object.

    Balls and capsules are covered by equal spheres on their axis, convex pieces of meshes by
    spheres of different radii (`varied_spheres`), everything else by spheres around the cells of a
    lattice, with as few cells as keep within the inflation. Where that takes more than
    `MOST_SPHERES`, a mesh is covered as pieces are, all else by those that reach the least beyond
    it.

    Args:
        item: A `pin.GeometryObject` with a convex coal shape or a mesh; of a mesh the convex hull
            is covered.
        inflation: How far spheres may reach beyond the body [length unit]; `Cover.inflation` says
            how far they do.

    Raises:
        UnsupportedShape: If the shape has no inside that could be covered.
    """
    shape = item.geometry
    if isinstance(shape, coal.Sphere | coal.Capsule):
        half = shape.halfLength if isinstance(shape, coal.Capsule) else 0.0
        radius = shape.radius + (inflation if half > 0.0 else 0.0)
        spacing = 2.0 * np.sqrt(max(radius * radius - shape.radius * shape.radius, 0.0)) / WIDER
        count = _in_a_row(item, 2.0 * half, spacing) + 1 if half > 0.0 else 1
        along = np.linspace(-half, half, count) if count > 1 else np.zeros(1)
        centers = np.column_stack([np.zeros((count, 2)), along])
        return _placed(item, centers, centers, np.full(count, radius), radius - shape.radius)
    solid = _solid(item)
    if isinstance(shape, coal.ConvexBase) and (found := _varied(solid, inflation, np.inf)):
        return _placed_balls(item, found)
    best = _column(item) if isinstance(shape, coal.Cylinder | coal.Cone) else None
    for counts in _lattices(solid.high - solid.low):
        centers, radius = _cells(solid, counts)
        spheres = _Spheres(centers, radius, float((solid.far(centers) + radius).max()))
        if best is None or spheres.reach < best.reach:
            best = spheres
        if best.reach <= inflation:
            break
    assert best is not None
    if best.reach > inflation and (found := _varied(solid, inflation, best.reach)):
        return _placed_balls(item, found)
    radii = np.full(len(best.centers), best.radius * WIDER)
    return _placed(item, best.centers, best.centers, radii, best.reach)


def given_cover(item: Any, spheres: FloatArray) -> Cover:
    """Return somebody's spheres as the cover of a geometry object, and measure what they leave out.

    Args:
        item: A `pin.GeometryObject`.
        spheres: (spheres, 4) middles in its frame and radii.

    Raises:
        UnsupportedShape: As `sphere_cover`.
    """
    shape, centers, radii = item.geometry, spheres[:, :3], spheres[:, 3]
    margin = 0.0
    if isinstance(shape, coal.Sphere | coal.Capsule):
        half = shape.halfLength if isinstance(shape, coal.Capsule) else 0.0
        points = np.array([[0.0, 0.0, z] for z in np.linspace(-half, half, MEASURED)])
        onto = np.clip(centers[:, 2], -half, half)
        square = centers[:, 0] ** 2 + centers[:, 1] ** 2 + (centers[:, 2] - onto) ** 2
        reach, margin = float((np.sqrt(square) + radii).max()) - shape.radius, float(shape.radius)
    else:
        solid = _solid(item)
        axes = [np.linspace(a, b, MEASURED) for a, b in zip(solid.low, solid.high, strict=True)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        within = solid.far if solid.planes is None else solid.near
        points = points[within(points) <= 0.0]
        if isinstance(shape, coal.ConvexBase):
            corners = [shape.point(k) for k in range(shape.num_points)]
            points = np.vstack([points, np.array(corners)])
        reach = float((solid.far(centers) + radii).max())
    out = np.full(len(points), np.inf)
    for center, radius in zip(centers, radii, strict=True):
        out = np.minimum(out, np.sqrt(((points - center) ** 2).sum(axis=1)) - radius)
    found = _placed(item, centers, centers, radii, max(reach, 0.0))
    return found._replace(uncovered=max(float(out.max(initial=-margin)) + margin, 0.0))


def _varied(solid: "_Solid", inflation: float, most: float) -> Balls | None:
    """Return balls of different radii around a hull, None for bodies that are no hulls."""
    if solid.planes is None:
        return None
    hull = Solid(solid.low, solid.high, solid.planes, solid.far, solid.area)
    return varied_spheres(hull, inflation, MOST_VARIED, most)


class _Spheres(NamedTuple):
    """Equal spheres, and how far they reach beyond the body at most."""

    centers: FloatArray
    radius: float
    reach: float


def _in_a_row(item: Any, length: float, spacing: float) -> int:
    """Return how many pieces of a length cover it.

    Raises:
        UnsupportedShape: If they are too many.
    """
    if not length < MOST_IN_A_ROW * spacing:
        raise UnsupportedShape(
            f"robot: body '{item.name}' must be coverable by {MOST_IN_A_ROW} spheres, was "
            f"{length:.4g} long and would need one per {spacing:.4g}"
        )
    return int(np.ceil(length / spacing))


def _column(item: Any) -> _Spheres:
    """Return spheres on the axis of a cylinder, or of one around a cone, one above the other."""
    radius, half = float(item.geometry.radius), float(item.geometry.halfLength)
    count = max(1, _in_a_row(item, half, radius))
    piece = half / count  # half of what a sphere covers
    around = float(np.sqrt(radius * radius + piece * piece))
    along = -half + piece * (2.0 * np.arange(count) + 1.0)
    reach = max(around - radius, around - piece)
    return _Spheres(np.column_stack([np.zeros((count, 2)), along]), around, reach)


def capsule_cover(item: Any) -> Cover:
    """Return one capsule, or sphere, that covers a geometry object: exact for balls and capsules.

    Raises:
        UnsupportedShape: As `sphere_cover`.
    """
    shape = item.geometry
    if isinstance(shape, coal.Sphere | coal.Capsule):
        half = shape.halfLength if isinstance(shape, coal.Capsule) else 0.0
        ends = np.array([[0.0, 0.0, -half]]), np.array([[0.0, 0.0, half]])
        return _placed(item, *ends, np.array([shape.radius]), 0.0)
    solid = _solid(item)
    edges, middle = solid.high - solid.low, 0.5 * (solid.low + solid.high)
    axis = int(np.argmax(edges))
    across = np.delete(edges, axis)
    slack = float(np.sqrt(np.sum(across * across))) / 2.0  # of the corners of a box around
    if isinstance(shape, coal.Cylinder) and axis == 2:
        slack = float(shape.radius)
    radius = slack * np.sqrt(1.25)  # at the end faces: half a radius inside the ends
    half = max(0.5 * edges[axis] - 0.5 * slack, 0.0)
    if half == 0.0:
        radius = float(np.sqrt(slack * slack + 0.25 * edges[axis] ** 2))
    start, end = middle.copy(), middle.copy()
    start[axis] -= half
    end[axis] += half
    reach = max(radius - 0.5 * float(across.min()), half + radius - 0.5 * edges[axis])
    return _placed(item, start[None], end[None], np.array([radius * WIDER]), reach)


def around_cylinder(item: Any) -> Cover:
    """Return the capsule as thick as a cylinder, its ends on the middles of both faces."""
    half, radius = float(item.geometry.halfLength), float(item.geometry.radius)
    ends = np.array([[0.0, 0.0, -half]]), np.array([[0.0, 0.0, half]])
    return _placed(item, *ends, np.array([radius * WIDER]), radius)


class _Solid(NamedTuple):
    """A convex body in its own frame."""

    low: FloatArray  # (3,) least corner of the box around it
    high: FloatArray  # (3,) greatest corner
    # function (points, 3) → (points,), at most the signed distance
    near: Any  # at most the distance
    # the same, at least the signed distance
    far: Any  # at least the distance
    # (planes, 4) of a hull: outward normals, and minus the planes' heights
    planes: FloatArray | None = None
    area: float = 0.0  # of a hull's surface [length unit²]


def _solid(item: Any) -> _Solid:
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
        return _Solid(
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

    return _Solid(corners.min(axis=0), corners.max(axis=0), near, far, planes, hull.area)


def _exact(half: FloatArray, distance: Any) -> _Solid:
    return _Solid(-half, half, distance, distance)


def _lattices(edges: FloatArray) -> list[tuple[int, ...]]:
    """Return numbers of cells along the edges, from coarse to fine, for cells near to cubes."""
    found: set[tuple[int, ...]] = set()
    size, most = float(edges.max()), 0
    while most <= MOST_SPHERES:
        counts = tuple(max(1, int(np.ceil(edge / size - 1e-9))) for edge in edges)
        most = counts[0] * counts[1] * counts[2]
        for extra in product((0, 1), repeat=3):
            found.add(tuple(n + e for n, e in zip(counts, extra, strict=True)))
        size *= 0.93  # steps that change a count by one
    few = [counts for counts in found if counts[0] * counts[1] * counts[2] <= MOST_SPHERES]
    return sorted(few, key=lambda counts: (counts[0] * counts[1] * counts[2], counts))


def _cells(solid: _Solid, counts: tuple[int, ...]) -> tuple[FloatArray, float]:
    """Return centres of the cells that meet the solid, and the radius of spheres around them."""
    cell = (solid.high - solid.low) / counts
    axes = [solid.low[k] + cell[k] * (np.arange(counts[k]) + 0.5) for k in range(3)]
    centers = np.array(list(product(*axes)))
    radius = float(np.sqrt(np.sum(cell * cell))) / 2.0
    return centers[solid.near(centers) <= radius], radius


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


def _placed_balls(item: Any, balls: Balls) -> Cover:
    return _placed(item, balls.centers, balls.centers, balls.radii * WIDER, balls.reach)


def _placed(
    item: Any, start: FloatArray, end: FloatArray, radius: FloatArray, inflation: float
) -> Cover:
    rotation, translation = np.array(item.placement.rotation), np.array(item.placement.translation)
    return Cover(
        matrix_product(start, rotation.T) + translation,
        matrix_product(end, rotation.T) + translation,
        radius,
        inflation,
    )
