"""Covers of bodies by spheres or capsules, which the fast kernels test in place of coal's shapes.

A cover contains its body, so it touches whatever the body touches. Its inflation is the greatest
distance by which it reaches beyond the body, bounded from above for every body. Those of a robot's
hulls take seconds, and change with nothing: spheres that were found are kept on disk.

Covers of bodies that touch overlap by far more than the bodies. Where a contact is allowed up to
some depth, the body is replaced by shapes inside it (`inner_balls`), which must stay free:
everything of a ball or capsule that lies deeper than the allowed depth, and of boxes and cylinders
points below their edges. Against a plane, whatever the body's tilt, free points mean that the body
overlaps by no more than the allowed depth; the exact verdict has the last word.
"""

import json
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.body_table import UnsupportedShape, geometry_key
from evoexp.collision.box_support import coal, corners_of
from evoexp.collision.covers.solid_balls import Balls, Solid, solid_of, varied_spheres
from evoexp.numeric.cache_folder import cache_root, kept
from evoexp.numeric.elementary import matrix_product, sincos
from evoexp.records import FloatArray

# of one body that is neither ball nor capsule; where they do not suffice, the inflation grows
MOST_SPHERES = 150
MEASURED = 24  # points along each edge of a body's box, by which given covers are measured
MOST_IN_A_ROW = 10_000  # spheres on the axis of one body
WIDER = 1.0 + 1e-9  # covers are made larger by more than rounding

AROUND = 24  # points around the axis of a cylinder, inside it
SPACING = 0.02  # [length unit] of points along edges and on faces, inside a body, at most
MOST_RINGS = 100_000  # of a cylinder
MOST = 12  # points along one edge of a box, at most


class Cover(NamedTuple):
    """Spheres or capsules around a body, in its joint's frame."""

    start: FloatArray  # (shapes, 3) centre, or one end
    end: FloatArray  # (shapes, 3) the same for spheres
    radius: FloatArray  # (shapes,)
    inflation: float  # how far the cover reaches beyond the body at most [length unit]
    # how far the body was seen to stand out of it; 0 of covers that are found here, which contain
    # their bodies [length unit]
    uncovered: float = 0.0

    @classmethod
    def placed(
        cls,
        item: Any,
        start: FloatArray,
        end: FloatArray,
        radius: FloatArray,
        inflation: float = 0.0,
    ) -> "Cover":
        """Return a cover in the frame of a geometry object as one in its joint's frame."""
        rotation = np.array(item.placement.rotation)
        translation = np.array(item.placement.translation)
        return cls(
            matrix_product(start, rotation.T) + translation,
            matrix_product(end, rotation.T) + translation,
            radius,
            inflation,
        )


def sphere_cover(item: Any, inflation: float) -> Cover:
    """Return spheres that cover a geometry object.

    Balls and capsules are covered by equal spheres on their axis, convex pieces of meshes by
    spheres of different radii (`varied_spheres`), everything else by spheres around the cells of a
    lattice, with as few cells as keep within the inflation. Where that takes more than
    `MOST_SPHERES`, a mesh is covered as pieces are, all else by the spheres that reach the least
    beyond it.

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
        half = _half_axis(shape)
        radius = shape.radius + (inflation if half > 0.0 else 0.0)
        spacing = 2.0 * np.sqrt(max(radius * radius - shape.radius * shape.radius, 0.0)) / WIDER
        count = _in_a_row(item, 2.0 * half, spacing) + 1 if half > 0.0 else 1
        along = np.linspace(-half, half, count) if count > 1 else np.zeros(1)
        centers = np.column_stack([np.zeros((count, 2)), along])
        return Cover.placed(item, centers, centers, np.full(count, radius), radius - shape.radius)
    solid = solid_of(item)
    if isinstance(shape, coal.ConvexBase) and (balls := varied_spheres(solid, inflation, np.inf)):
        return _placed_balls(item, balls)
    best = _column(item, solid) if isinstance(shape, coal.Cylinder | coal.Cone) else None
    for counts in _lattices(solid.high - solid.low):
        balls = _cells(solid, counts)
        if best is None or balls.reach < best.reach:
            best = balls
        if best.reach <= inflation:
            break
    assert best is not None
    if best.reach > inflation and (balls := varied_spheres(solid, inflation, best.reach)):
        best = balls
    return _placed_balls(item, best)


def _half_axis(shape: Any) -> float:
    return float(shape.halfLength) if isinstance(shape, coal.Capsule) else 0.0


def _ends(half: float) -> tuple[FloatArray, FloatArray]:
    return np.array([[0.0, 0.0, -half]]), np.array([[0.0, 0.0, half]])


def _placed_balls(item: Any, balls: Balls) -> Cover:
    return Cover.placed(item, balls.centers, balls.centers, balls.radii * WIDER, balls.reach)


def given_cover(item: Any, spheres: FloatArray) -> Cover:
    """Return somebody's spheres as the cover of a geometry object, and measure what they leave out.

    Args:
        spheres: (spheres, 4) middles in its frame and radii.
    """
    shape, centers, radii = item.geometry, spheres[:, :3], spheres[:, 3]
    margin = 0.0
    if isinstance(shape, coal.Sphere | coal.Capsule):
        half = _half_axis(shape)
        points = np.array([[0.0, 0.0, z] for z in np.linspace(-half, half, MEASURED)])
        onto = np.clip(centers[:, 2], -half, half)
        square = centers[:, 0] ** 2 + centers[:, 1] ** 2 + (centers[:, 2] - onto) ** 2
        reach, margin = float((np.sqrt(square) + radii).max()) - shape.radius, float(shape.radius)
    else:
        solid = solid_of(item)
        axes = [np.linspace(a, b, MEASURED) for a, b in zip(solid.low, solid.high, strict=True)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        within = solid.far if solid.planes is None else solid.near
        points = points[within(points) <= 0.0]
        if isinstance(shape, coal.ConvexBase):
            points = np.vstack([points, corners_of(shape)])
        reach = float((solid.far(centers) + radii).max())
    out = np.full(len(points), np.inf)
    for center, radius in zip(centers, radii, strict=True):
        out = np.minimum(out, np.sqrt(((points - center) ** 2).sum(axis=1)) - radius)
    found = Cover.placed(item, centers, centers, radii, max(reach, 0.0))
    return found._replace(uncovered=max(float(out.max(initial=-margin)) + margin, 0.0))


def _in_a_row(item: Any, length: float, spacing: float) -> int:
    """Return how many pieces of a length cover it."""
    if not length < MOST_IN_A_ROW * spacing:
        raise UnsupportedShape(
            f"robot: body '{item.name}' must be coverable by {MOST_IN_A_ROW} spheres, was "
            f"{length:.4g} long and would need one per {spacing:.4g}"
        )
    return int(np.ceil(length / spacing))


def _column(item: Any, solid: Solid) -> Balls:
    """Return spheres on the axis of a cylinder, or of one around a cone, one above the other."""
    radius, half = float(item.geometry.radius), float(item.geometry.halfLength)
    count = max(1, _in_a_row(item, half, radius))
    piece = half / count  # half of what a sphere covers
    around = float(np.sqrt(radius * radius + piece * piece))
    along = -half + piece * (2.0 * np.arange(count) + 1.0)
    centers = np.column_stack([np.zeros((count, 2)), along])
    reach = max(around - radius, around - piece)
    if isinstance(item.geometry, coal.Cone):
        reach = float(solid.far(centers).max()) + around
    return Balls(centers, np.full(count, around), reach)


def capsule_cover(item: Any) -> Cover:
    """Return one capsule, or sphere, that covers a geometry object: exact for these."""
    shape = item.geometry
    if isinstance(shape, coal.Sphere | coal.Capsule):
        ends = _ends(_half_axis(shape))
        return Cover.placed(item, *ends, np.array([shape.radius]), 0.0)
    solid = solid_of(item)
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
    if not isinstance(shape, coal.Box | coal.Cylinder):  # by the ends: signed distances are convex
        reach = float(solid.far(np.array([start, end])).max()) + float(radius)
    return Cover.placed(item, start[None], end[None], np.array([radius * WIDER]), reach)


def around_cylinder(item: Any) -> Cover:
    """Return the capsule as thick as a cylinder, its ends on the middles of both faces."""
    radius, ends = float(item.geometry.radius), _ends(float(item.geometry.halfLength))
    return Cover.placed(item, *ends, np.array([radius * WIDER]), radius)


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


def _cells(solid: Solid, counts: tuple[int, ...]) -> Balls:
    """Return equal spheres around the cells that meet the solid."""
    cell = (solid.high - solid.low) / counts
    axes = [solid.low[k] + cell[k] * (np.arange(counts[k]) + 0.5) for k in range(3)]
    centers = np.array(list(product(*axes)))
    radius = float(np.sqrt(np.sum(cell * cell))) / 2.0
    centers = centers[solid.near(centers) <= radius]
    reach = float((solid.far(centers) + radius).max())
    return Balls(centers, np.full(len(centers), radius), reach)


def inner_balls(item: Any, depth: float) -> Cover | None:
    """Return balls, capsules and points inside a body, in its joint's frame.

    The body may overlap another one by a depth [length unit]. Of bodies that are no balls,
    capsules, boxes or cylinders, None: only the exact verdict bounds how deep they overlap.
    """
    shape = item.geometry
    if isinstance(shape, coal.Sphere | coal.Capsule):
        ends = _ends(_half_axis(shape))
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


def kept_sphere_cover(item: Any, inflation: float) -> Cover:
    """Return the cover of `sphere_cover`, from where it is kept if it was found before."""
    if isinstance(item.geometry, coal.Sphere | coal.Capsule):
        return sphere_cover(item, inflation)

    def found() -> bytes:
        *arrays, reach, _ = sphere_cover(item, inflation)
        return json.dumps([*(array.tolist() for array in arrays), float(reach)]).encode()

    path = cache_root() / "covers" / geometry_key([item], inflation)
    start, end, radius, reach = json.loads(kept(path, found))
    return Cover(np.array(start), np.array(end), np.array(radius), reach)
