"""The bodies of a scene as arrays, for the certifier's kernels; and hashes by which they are known.

Every shape is a core, swept by a ball: a sphere is a point and a radius, a capsule a segment and a
radius. The core is given by its support function (the farthest point in a direction), see
`convex_distance`.
"""

import functools
import hashlib
import json
from collections.abc import Iterable
from importlib import metadata
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.box_support import EXACT, coal, corners_of
from evoexp.errors import EvoexpError
from evoexp.numeric.compilation import sources_key
from evoexp.numeric.convex_hull import hull_of
from evoexp.numeric.elementary import matrix_product
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import KinematicTable

SEGMENT, BOX, CYLINDER, CONE, ELLIPSOID, HULL, HALF_SPACE = range(7)
"""Kinds of cores. A segment lies along z, of length 0 for a point; a half-space holds z ≤ 0."""

FLAT_TOLERANCE = 1e-10
"""[-] of the scene's size, for pairs of which coal's distance is a closed form or ends after
finitely many steps (its error is ≤ 1e-13)."""

ROUND_TOLERANCE = 1e-6
"""[-] of the scene's size, for pairs of which coal approaches a curved surface by steps (errors up
to 4e-8 were seen)."""

_LIBRARIES = ("numpy", "scipy", "coal")  # that work on bodies
_SIZES = ("radius", "halfLength", "halfSide", "radii")  # of coal's shapes


class UnsupportedShape(EvoexpError):
    """A body that the certifier cannot bound."""


class BodyTable(NamedTuple):
    """Bodies as arrays."""

    joint: IntArray  # (bodies,) index into the kinematic table, −1 for the world
    kind: IntArray  # (bodies,) the core
    # (bodies,) false where the arrays describe a larger body than coal's: the convex hull of a mesh
    exact: BoolArray
    # (bodies, 9) from the core's frame to the joint's frame in the table, row by row
    rotation: FloatArray
    translation: FloatArray  # (bodies, 3)
    # (bodies, 3) half a segment's length | half the edges | radius, half the height | semi-axes
    size: FloatArray
    radius: FloatArray  # (bodies,) of the ball that sweeps the core
    corners: IntArray  # (bodies, 2) first and one-past-last corner of a hull
    corner_points: FloatArray  # (corners, 3) in the frames of their hulls
    # (bodies,) greatest distance of a body's points from its joint's origin; inf for half-spaces
    from_origin: FloatArray
    from_axis: FloatArray  # (bodies,) the same from its joint's axis
    # (bodies,) radius of a ball around the core's origin that holds the body; inf for half-spaces
    ball: FloatArray

    def tolerance(self, one: int, two: int) -> float:
        """Return the part of the scene's size at which the distance of two bodies is a touch."""
        flat = all(
            self.exact[k] and self.kind[k] in (SEGMENT, BOX, HULL, HALF_SPACE) for k in (one, two)
        )
        closed = any(
            self.kind[k] == HALF_SPACE or (self.kind[k] == SEGMENT and self.size[k, 0] == 0.0)
            for k in (one, two)
        )
        plain = all(self.kind[k] in (SEGMENT, BOX, CYLINDER, HALF_SPACE) for k in (one, two))
        half_space = (
            HALF_SPACE in (self.kind[one], self.kind[two]) and self.exact[one] and self.exact[two]
        )
        return FLAT_TOLERANCE if flat or half_space or (closed and plain) else ROUND_TOLERANCE


NO_CORNERS = np.empty((0, 3))


class _Core(NamedTuple):
    kind: int
    size: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius: float = 0.0
    corners: FloatArray = NO_CORNERS  # (corners, 3) of a hull
    exact: bool = True


def body_table(table: KinematicTable, items: list[Any]) -> BodyTable:
    """Return geometry objects (`pin.GeometryObject`) as arrays.

    Raises:
        UnsupportedShape: If a shape is neither convex nor a mesh, or a half-space moves.
    """
    count = len(items)
    bodies = BodyTable(
        joint=np.array([item.parentJoint - 1 for item in items], dtype=np.int64),
        kind=np.zeros(count, dtype=np.int64),
        exact=np.ones(count, dtype=np.bool_),
        rotation=np.zeros((count, 9)),
        translation=np.zeros((count, 3)),
        size=np.zeros((count, 3)),
        radius=np.zeros(count),
        corners=np.zeros((count, 2), dtype=np.int64),
        corner_points=np.empty((0, 3)),
        from_origin=np.full(count, np.inf),
        from_axis=np.full(count, np.inf),
        ball=np.full(count, np.inf),
    )
    corners = [NO_CORNERS]  # of the bodies so far
    for k, item in enumerate(items):
        core, rotation, translation = _core(item)
        if item.parentJoint > 0:
            alignment = table.alignment[item.parentJoint - 1].T
            rotation, translation = (
                matrix_product(alignment, rotation),
                matrix_product(alignment, translation),
            )
            if core.kind == HALF_SPACE:
                raise UnsupportedShape(
                    f"scene: half-space '{item.name}' must stand still, moves with a joint"
                )
        begin = sum(map(len, corners))
        corners.append(core.corners)
        bodies.kind[k], bodies.size[k], bodies.radius[k] = core.kind, core.size, core.radius
        bodies.exact[k] = core.exact
        bodies.rotation[k], bodies.translation[k] = rotation.ravel(), translation
        bodies.corners[k] = begin, begin + len(core.corners)
        if core.kind != HALF_SPACE:
            bodies.from_origin[k], bodies.from_axis[k] = _reach(core, rotation, translation)
            bodies.ball[k], _ = _reach(core, rotation, np.zeros(3))
    return bodies._replace(corner_points=np.vstack(corners))


def _core(item: Any) -> tuple[_Core, FloatArray, FloatArray]:
    """Return a geometry object's core, and the core's rotation and origin in the joint's frame."""
    shape, placement = item.geometry, item.placement
    rotation, translation = np.array(placement.rotation), np.array(placement.translation)
    swept = float(shape.getSweptSphereRadius()) if isinstance(shape, coal.ShapeBase) else 0.0
    if isinstance(shape, coal.Halfspace):
        normal = matrix_product(rotation, shape.n)
        # a rotation whose third column is the normal
        x = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
        x /= np.sqrt((x * x).sum())
        rotation = np.column_stack([x, np.cross(normal, x), normal])
        return _Core(HALF_SPACE, radius=swept), rotation, translation + normal * shape.d
    if isinstance(shape, coal.Sphere):
        core = _Core(SEGMENT, radius=shape.radius + swept)
    elif isinstance(shape, coal.Capsule):
        core = _Core(SEGMENT, (shape.halfLength, 0.0, 0.0), shape.radius + swept)
    elif isinstance(shape, coal.Box):
        core = _Core(BOX, tuple(shape.halfSide), swept)
    elif isinstance(shape, coal.Cylinder):
        core = _Core(CYLINDER, (shape.radius, shape.halfLength, 0.0), swept)
    elif isinstance(shape, coal.Cone):
        core = _Core(CONE, (shape.radius, shape.halfLength, 0.0), swept)
    elif isinstance(shape, coal.Ellipsoid):
        core = _Core(ELLIPSOID, tuple(shape.radii), swept)
    elif isinstance(shape, coal.ConvexBase):
        core = _Core(HULL, radius=swept, corners=corners_of(shape))
    elif isinstance(shape, coal.TriangleP):
        core = _Core(HULL, radius=swept, corners=np.array([shape.a, shape.b, shape.c]))
    elif isinstance(shape, coal.BVHModelBase):
        points = corners_of(shape)
        hull = hull_of(points)  # None of a flat mesh
        core = _Core(HULL, corners=points if hull is None else hull[0], exact=False)
    else:
        raise UnsupportedShape(
            f"scene: '{item.name}' must be a convex shape, a half-space or a mesh, was a "
            f"{type(shape).__name__}"
        )
    if core.kind == HULL:
        # the ball around a hull is small where the core's origin is its middle
        middle = 0.5 * (core.corners.min(axis=0) + core.corners.max(axis=0))
        core = core._replace(corners=core.corners - middle)
        translation = translation + matrix_product(rotation, middle)
    return core, rotation, translation


def _reach(core: _Core, rotation: FloatArray, translation: FloatArray) -> tuple[float, float]:
    """Return the greatest distances of a body's points from its joint's origin and z axis."""
    # by the corners of the core or of a box around it, or by a ball around it
    a, b, c = core.size
    ball = np.inf
    if core.kind == HULL:
        corners = core.corners
    else:
        half = {SEGMENT: (0.0, 0.0, a), CYLINDER: (a, a, b), CONE: (a, a, b)}.get(
            core.kind, core.size
        )
        corners = np.array(list(product(*((-e, e) for e in half))))
        if core.kind == ELLIPSOID:
            ball = max(a, b, c)
        elif core.kind in (CYLINDER, CONE):
            ball = float(np.sqrt(a * a + b * b))
    squares = (matrix_product(corners, rotation.T) + translation) ** 2
    x, y, z = translation**2
    from_origin = min(float(np.sqrt(squares.sum(axis=1).max())), float(np.sqrt(x + y + z)) + ball)
    from_axis = min(float(np.sqrt(squares[:, :2].sum(axis=1).max())), float(np.sqrt(x + y)) + ball)
    return from_origin + core.radius, from_axis + core.radius


def geometry_key(items: Iterable[Any], *numbers: Any) -> str:
    """Return a hash of bodies and numbers, and of the code and the libraries that work on them.

    Of a `pin.GeometryObject` its shape, placement and joint count.
    """
    digest = hashlib.sha256(_code())
    for item in items:
        digest.update(f"{type(item.geometry).__name__} {item.parentJoint}".encode())
        numbers = (*numbers, *_numbers_of(item.geometry), item.placement.homogeneous)
    for part in numbers:
        digest.update(np.ascontiguousarray(part, dtype=np.float64).tobytes())
    return digest.hexdigest()[:32]


def _numbers_of(shape: Any) -> list[Any]:
    if isinstance(shape, coal.ConvexBase):
        faces = range(shape.num_polygons if hasattr(shape, "polygons") else 0)
        return [corners_of(shape), [_corners(shape.polygons(k)) for k in faces]]
    if isinstance(shape, coal.BVHModelBase):
        faces = range(shape.num_tris)
        return [corners_of(shape), [_corners(shape.tri_indices(k)) for k in faces]]
    return [getattr(shape, name) for name in _SIZES if hasattr(shape, name)]


def _corners(triangle: Any) -> list[int]:
    return [int(triangle[k]) for k in range(3)]


@functools.cache
def _code() -> bytes:
    versions = [*map(metadata.version, _LIBRARIES)]
    return hashlib.sha256(json.dumps([*versions, EXACT, sources_key()]).encode()).digest()
