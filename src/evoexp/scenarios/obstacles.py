"""Static obstacles, and the table that kernels read them from."""

from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from evoexp.errors import SettingError
from evoexp.numerics import DEGREE, sincos
from evoexp.records import FloatArray
from evoexp.validation import Positive, Settings

Point = Annotated[tuple[float, ...], Field(min_length=2, max_length=3)]
"""(x, y), with z = 0, or (x, y, z) [length unit of the scene]."""

Angles = tuple[float, float, float]

SPHERE, BOX, CAPSULE = 0, 1, 2


class SphereObstacle(Settings):
    """A ball; in the plane a disc."""

    shape: Literal["sphere"]
    center: Point
    radius: Positive


class BoxObstacle(Settings):
    """A box, turned by roll, pitch and yaw [deg] (fixed axes x, y, z, in this order)."""

    shape: Literal["box"]
    center: Point
    size: Annotated[tuple[Positive, ...], Field(min_length=2, max_length=3)]
    rotation: Angles = (0.0, 0.0, 0.0)


class CapsuleObstacle(Settings):
    """All points within `radius` of the segment from `start` to `end`."""

    shape: Literal["capsule"]
    start: Point
    end: Point
    radius: Positive


Obstacle = Annotated[SphereObstacle | BoxObstacle | CapsuleObstacle, Field(discriminator="shape")]


class ObstacleTable(NamedTuple):
    """Obstacles as arrays.

    Attributes:
        kind: (obstacles,) SPHERE, BOX or CAPSULE.
        center: (obstacles, 3).
        rotation: (obstacles, 9) from the obstacle's frame to the world, row by row; a capsule lies along its z axis.
        size: (obstacles, 3): radius | half the edges | radius, half the length, unused.
    """

    kind: np.ndarray
    center: FloatArray
    rotation: FloatArray
    size: FloatArray


def obstacle_table(obstacles: tuple[Any, ...]) -> ObstacleTable:
    """Return obstacles as arrays.

    Raises:
        SettingError: If a capsule's ends coincide.
    """
    table = ObstacleTable(
        np.zeros(len(obstacles), dtype=np.int64),
        np.zeros((len(obstacles), 3)),
        np.tile(np.eye(3).ravel(), (len(obstacles), 1)),
        np.zeros((len(obstacles), 3)),
    )
    for k, obstacle in enumerate(obstacles):
        if isinstance(obstacle, SphereObstacle):
            table.kind[k], table.center[k], table.size[k, 0] = SPHERE, _point(obstacle.center), obstacle.radius
        elif isinstance(obstacle, BoxObstacle):
            table.kind[k], table.center[k] = BOX, _point(obstacle.center)
            table.size[k] = 0.5 * np.array([*obstacle.size, 1.0][:3])
            table.rotation[k] = rotation_matrix(obstacle.rotation).ravel()
        else:
            start, end = _point(obstacle.start), _point(obstacle.end)
            axis = end - start
            length = float(np.sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]))
            if length == 0.0:
                raise SettingError(f"scenario.obstacles[{k}].end", "another point than start", list(obstacle.end))
            table.kind[k], table.center[k] = CAPSULE, 0.5 * (start + end)
            table.size[k, :2] = obstacle.radius, 0.5 * length
            table.rotation[k] = _z_along(axis / length).ravel()
    return table


def rotation_matrix(angles: Angles) -> FloatArray:
    """Return the rotation of roll, pitch, yaw [deg]: Rz(yaw) Ry(pitch) Rx(roll), (3, 3)."""
    (sr, cr), (sp, cp), (sy, cy) = (sincos(DEGREE * angle) for angle in angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _point(coordinates: tuple[float, ...]) -> FloatArray:
    return np.array([*coordinates, 0.0][:3])


def _z_along(axis: FloatArray) -> FloatArray:
    """Return a rotation whose z axis is the given unit vector."""
    x, y, z = axis
    helper = np.array([1.0, 0.0, 0.0]) if abs(x) < 0.9 else np.array([0.0, 1.0, 0.0])
    first = np.array([helper[1] * z - helper[2] * y, helper[2] * x - helper[0] * z, helper[0] * y - helper[1] * x])
    first /= np.sqrt(first[0] * first[0] + first[1] * first[1] + first[2] * first[2])
    return np.column_stack([first, np.cross(axis, first), axis])
