"""Bodies as they are drawn, with the sizes of the coal shapes that the certifier judges."""

from typing import Any, Literal, NamedTuple

import coal
import numpy as np
import pinocchio as pin

from evoexp.collision.body_table import UnsupportedShape
from evoexp.records import FloatArray

Kind = Literal["box", "sphere", "ellipsoid", "capsule", "cylinder", "cone", "half_space", "mesh"]
Role = Literal["arm", "obstacle", "object"]


class Outline(NamedTuple):
    """A shape in its own frame; capsules, cylinders and cones lie along z and are centred."""

    kind: Kind  # kind of the shape
    # box: the edges | sphere: radius | ellipsoid: semi-axes | capsule, cylinder, cone: radius,
    # length (that of a capsule is its segment's) | half-space (all points with z ≤ 0) and mesh:
    # nothing
    size: tuple[float, ...]
    points: FloatArray | None = None  # (points, 3) corners of a mesh; None otherwise
    triangles: np.ndarray | None = None  # (triangles, 3) indices of corners

    @property
    def is_line(self) -> bool:
        """Return whether the shape has no thickness, so that the drawing chooses a thickness."""
        return self.kind == "capsule" and self.size[0] == 0.0

    @property
    def half(self) -> FloatArray:
        """Half the edges of a box around the shape and its frame, (3,); 0 for a half-space."""
        if self.points is not None:
            return np.full(3, np.sqrt((self.points**2).sum(axis=1).max()))
        if self.kind in ("box", "ellipsoid"):
            return np.array(self.size) * (0.5 if self.kind == "box" else 1.0)
        radius, length = (*self.size, 0.0, 0.0)[:2]
        round_end = radius if self.kind in ("sphere", "capsule") else 0.0
        return np.array([radius, radius, 0.5 * length + round_end])


class Shape(NamedTuple):
    """One body."""

    name: str  # name of the body in verdicts
    frame: int  # index in `Recording.frames` of the frame that moves it; −1: the world
    pose: FloatArray  # (7,) of the outline in that frame: position, quaternion x, y, z, w
    outline: Outline  # kind and size
    # A part of an arm, an obstacle, or an object, which is an obstacle that is carried for a while
    role: Role
    arm: int  # index of its arm; −1: none


def outline(shape: Any) -> tuple[Outline, Any]:
    """Return the outline of a coal shape, and the `pin.SE3` of its frame in that of the shape."""
    here = pin.SE3.Identity()
    if isinstance(shape, coal.Box):
        return Outline("box", tuple(2.0 * float(half) for half in shape.halfSide)), here
    if isinstance(shape, coal.Sphere):
        return Outline("sphere", (float(shape.radius),)), here
    if isinstance(shape, coal.Ellipsoid):
        return Outline("ellipsoid", tuple(float(axis) for axis in shape.radii)), here
    names: dict[Any, Kind] = {coal.Capsule: "capsule", coal.Cylinder: "cylinder", coal.Cone: "cone"}
    if type(shape) in names:
        sizes = float(shape.radius), 2.0 * float(shape.halfLength)
        return Outline(names[type(shape)], sizes), here
    if isinstance(shape, coal.Halfspace):
        normal = np.array(shape.n)
        turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), normal).toRotationMatrix()
        return Outline("half_space", ()), pin.SE3(turn, float(shape.d) * normal)
    points, triangles = _mesh(shape)
    return Outline("mesh", (), points, triangles), here


def _mesh(shape: Any) -> tuple[FloatArray, np.ndarray]:
    """Return corners and triangles of a mesh, each triangle counter-clockwise seen from outside."""
    convex = hasattr(shape, "polygons")
    if convex:
        points = np.array([shape.point(k) for k in range(shape.num_points)])
        faces = [shape.polygons(k) for k in range(shape.num_polygons)]
    elif hasattr(shape, "tri_indices"):
        points = np.array([shape.vertex(k) for k in range(shape.num_vertices)])
        faces = [shape.tri_indices(k) for k in range(shape.num_tris)]
    else:
        raise UnsupportedShape(f"body: a {type(shape).__name__} cannot be drawn")
    triangles = np.array([[int(face[k]) for k in range(3)] for face in faces], dtype=np.int64)
    a, b, c = points[triangles].transpose(1, 0, 2)
    volumes = (np.cross(b - a, c - a) * (a - points.mean(axis=0))).sum(axis=1)
    inward = volumes < 0.0 if convex else np.full(len(volumes), volumes.sum() < 0.0)
    triangles[inward] = triangles[inward, ::-1]
    return points, triangles


def pose(placement: Any) -> FloatArray:
    """Return a `pin.SE3` as position and quaternion x, y, z, w, (7,)."""
    return np.asarray(pin.SE3ToXYZQUAT(placement))
