"""Bodies of links: plain shapes fixed to joints, as coal knows them."""

from typing import Annotated, Any, Literal

import coal
import numpy as np
import pinocchio as pin
from pydantic import Field

from evoexp.errors import SettingError
from evoexp.numeric.ordered_sums import length, rotation_matrix
from evoexp.records import FloatArray
from evoexp.validation import Positive, Settings

Point3 = tuple[float, float, float]


class Body(Settings):
    """Base of all bodies."""

    name: str  # by which contacts and verdicts speak of it
    # the joint that moves it, counted from 1; 0: it stands still on the base
    joint: Annotated[int, Field(ge=0)]


class SphereBody(Body):
    """A ball."""

    shape: Literal["sphere"]
    center: Point3
    radius: Positive


class BoxBody(Body):
    """A box with edges along the joint's axes."""

    shape: Literal["box"]
    center: Point3
    size: tuple[Positive, Positive, Positive]


class RodBody(Body):
    """A segment from `start` to `end`, thickened.

    A capsule is all points within `radius` of it, a cylinder has flat ends.
    """

    shape: Literal["capsule", "cylinder"]
    start: Point3
    end: Point3
    radius: Positive


AnyBody = Annotated[SphereBody | BoxBody | RodBody, Field(discriminator="shape")]


def body_geometry(body: AnyBody, field: str) -> tuple[Any, Any]:
    """Return a body as a coal shape and its placement in the joint's frame, a `pin.SE3`."""
    if isinstance(body, SphereBody | BoxBody):
        shape = coal.Sphere(body.radius) if isinstance(body, SphereBody) else coal.Box(*body.size)
        return shape, pin.SE3(np.eye(3), np.array(body.center))
    start, end = np.array(body.start), np.array(body.end)
    reach = length(end - start)
    if reach == 0.0:
        raise SettingError(f"{field}.end", "another point than start", list(body.end))
    kind = coal.Capsule if body.shape == "capsule" else coal.Cylinder
    return kind(body.radius, reach), along(start, end)


def along(start: FloatArray, end: FloatArray) -> Any:
    """Return the `pin.SE3` of a capsule or cylinder (coal draws them along z) on a segment."""
    direction = end - start
    reach = length(direction)
    rotation = np.eye(3)
    if reach > 0.0:
        upright = np.array([0.0, 0.0, 1.0])
        rotation = pin.Quaternion.FromTwoVectors(upright, direction / reach).toRotationMatrix()
    return pin.SE3(rotation, 0.5 * (start + end))


def placed(position: Point3, angles: Point3) -> Any:
    """Return the `pin.SE3` of a position and roll, pitch, yaw [deg] about fixed axes."""
    return pin.SE3(rotation_matrix(angles), np.array(position))
