"""Static obstacles, and the table that kernels read them from."""

from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from evoexp.errors import SettingError, demand
from evoexp.numeric.elementary import length, matrix_product, rotation_matrix
from evoexp.records import FloatArray
from evoexp.validation import Component, NonNegative, Positive, Settings

Point = Annotated[tuple[float, ...], Field(min_length=2, max_length=3)]
"""(x, y), with z = 0, or (x, y, z) [length unit of the scene]."""

Angles = tuple[float, float, float]

SPHERE, BOX, CAPSULE, CYLINDER, HALF_SPACE, ELLIPSE = range(6)


class NamedObstacle(Settings):
    """Base of all obstacles."""

    # by which contacts, objects and verdicts speak of it; without one it is `obstacle_1` and
    # so on
    name: str = ""


class SphereObstacle(NamedObstacle):
    """A ball; in the plane a disc."""

    shape: Literal["sphere"]
    center: Point
    radius: Positive


class BoxObstacle(NamedObstacle):
    """A box, turned by roll, pitch and yaw [deg] (fixed axes x, y, z, in this order)."""

    shape: Literal["box"]
    center: Point
    size: Annotated[tuple[Positive, ...], Field(min_length=2, max_length=3)]
    rotation: Angles = (0.0, 0.0, 0.0)


class RodObstacle(NamedObstacle):
    """A segment from `start` to `end`, thickened.

    A capsule is all points within `radius` of it, a cylinder has flat ends.
    """

    shape: Literal["capsule", "cylinder"]
    start: Point
    end: Point
    radius: Positive


class HalfSpaceObstacle(NamedObstacle):
    """All points on one side of a plane (in the plane: of a line): a floor, a wall."""

    shape: Literal["half_space"]
    point: Point  # any point of the boundary
    normal: Point  # points out of the solid, of any length but 0


class EllipseObstacle(NamedObstacle):
    """An ellipse in the plane with its inside.

    In space it is an ellipsoid whose third semi-axis, along z, is the second one. It decides
    nothing for links that move in the plane of the centre, a plane of symmetry.
    """

    shape: Literal["ellipse"]
    center: Point  # of the ellipse
    semi_axes: tuple[Positive, Positive]  # both, of any order
    angle: float = 0.0  # of the first semi-axis, from +x [deg]


class HullObstacle(NamedObstacle):
    """The convex hull of points, turned by roll, pitch and yaw [deg] as a box is.

    Searches test the box around it, along the axes of its frame; verdicts are of the hull.
    """

    shape: Literal["hull"]
    # (points, 3) in its frame [length unit], not all in one plane
    points: Annotated[tuple[tuple[float, float, float], ...], Field(min_length=4)]
    center: Point = (0.0, 0.0, 0.0)  # origin of its frame
    rotation: Angles = (0.0, 0.0, 0.0)  # of its frame

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Middle and half the edges of the box around it, (3,) each, in its frame."""
        points = np.array(self.points)
        low, high = points.min(axis=0), points.max(axis=0)
        return 0.5 * (low + high), 0.5 * (high - low)


Obstacle = Annotated[
    SphereObstacle | BoxObstacle | RodObstacle | HalfSpaceObstacle | EllipseObstacle | HullObstacle,
    Field(discriminator="shape"),
]


class SceneTask(Component, is_base=True):
    """Base of tasks among obstacles."""

    security_margin: NonNegative  # clearance between bodies that the task requires [length unit]
    length_unit: str  # name of the scene's unit of length
    obstacles: tuple[Obstacle, ...] = ()  # what does not move


class ObstacleTable(NamedTuple):
    """Obstacles as arrays."""

    # (obstacles,) SPHERE, BOX (of a hull, too), CAPSULE, CYLINDER, HALF_SPACE or ELLIPSE
    kind: np.ndarray
    center: FloatArray  # (obstacles, 3); of a half-space a point of its boundary
    # (obstacles, 9) from the obstacle's frame to the world, row by row; capsules and cylinders lie
    # along their z axis, a half-space is all points with z ≤ 0
    rotation: FloatArray
    # (obstacles, 3): radius | half the edges | radius, half the length, 0 (capsules and cylinders;
    # the length of a capsule is that of its segment) | unused (half-spaces) | semi-axes
    size: FloatArray

    def without_ellipses(self) -> "ObstacleTable":
        """Return the table itself, for collision models that know no ellipses."""
        if ELLIPSE in self.kind:
            field = f"scenario.obstacles[{int(np.argmax(self.kind == ELLIPSE))}].shape"
            raise SettingError(field, "any but an ellipse with this collision model", "ellipse")
        return self


def obstacle_table(obstacles: tuple[Any, ...]) -> ObstacleTable:
    """Return obstacles as arrays."""
    rows = [_row(obstacle, f"scenario.obstacles[{k}]") for k, obstacle in enumerate(obstacles)]
    kinds, *columns = zip(*rows, strict=True) if rows else ((), (), (), ())
    center, rotation, size = (
        np.array(column, dtype=np.float64).reshape(len(rows), width)
        for column, width in zip(columns, (3, 9, 3), strict=True)
    )
    return ObstacleTable(np.array(kinds, dtype=np.int64), center, rotation, size)


def _row(obstacle: Any, field: str) -> tuple[int, FloatArray, FloatArray, Any]:
    """Return kind, center, rotation and size of an obstacle, see `ObstacleTable`."""
    match obstacle:
        case SphereObstacle():
            return SPHERE, _point(obstacle.center), np.eye(3), (obstacle.radius, 0.0, 0.0)
        case BoxObstacle():
            half = 0.5 * np.array([*obstacle.size, 1.0][:3])
            return BOX, _point(obstacle.center), rotation_matrix(obstacle.rotation), half
        case EllipseObstacle():
            turn, (one, two) = rotation_matrix((0.0, 0.0, obstacle.angle)), obstacle.semi_axes
            return ELLIPSE, _point(obstacle.center), turn, (one, two, two)
        case HullObstacle():
            turn, (middle, half) = rotation_matrix(obstacle.rotation), obstacle.box
            must = "points that lie in no plane"
            demand(half.min() > 0.0, f"{field}.points", must, list(2.0 * half))
            return BOX, _point(obstacle.center) + matrix_product(turn, middle), turn, half
        case HalfSpaceObstacle():
            axis = _point(obstacle.normal)
            if (size := length(axis)) == 0.0:
                raise SettingError(f"{field}.normal", "a direction", list(obstacle.normal))
            return HALF_SPACE, _point(obstacle.point), _z_along(axis / size), (0.0, 0.0, 0.0)
    start, end = _point(obstacle.start), _point(obstacle.end)
    if (size := length(end - start)) == 0.0:
        raise SettingError(f"{field}.end", "another point than start", list(obstacle.end))
    kind, turn = CYLINDER if obstacle.shape == "cylinder" else CAPSULE, end - start
    return kind, 0.5 * (start + end), _z_along(turn / size), (obstacle.radius, 0.5 * size, 0.0)


def obstacle_hulls(obstacles: tuple[Any, ...]) -> dict[int, FloatArray]:
    """Return row → points (points, 3) in the frame of the box, of obstacles that are hulls."""
    return {
        k: np.array(obstacle.points) - obstacle.box[0]
        for k, obstacle in enumerate(obstacles)
        if isinstance(obstacle, HullObstacle)
    }


def _point(coordinates: tuple[float, ...]) -> FloatArray:
    return np.array([*coordinates, 0.0][:3])


def _z_along(axis: FloatArray) -> FloatArray:
    """Return a rotation whose z axis is the given unit vector."""
    first = np.cross(np.eye(3)[0 if abs(axis[0]) < 0.9 else 1], axis)
    first /= length(first)
    return np.column_stack([first, np.cross(axis, first), axis])
