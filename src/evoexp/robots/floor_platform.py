"""A platform that moves over a floor without turning; or a body that moves through space."""

from typing import Any, ClassVar, Literal

import coal
import numpy as np
import pinocchio as pin

from evoexp.robots.assembly import ArmParts, Chain, Link
from evoexp.validation import Positive


class FloorPlatform(Chain):
    """An upright cylinder on prismatic joints along x and y, or along x, y and z."""

    component: ClassVar[str] = "floor_platform"

    body_radius: Positive  # of the cylinder [length unit of the scene]
    # of the cylinder, which stands on the floor z = 0; in three dimensions it is centred on
    # its place
    body_height: Positive
    dimensions: Literal[2, 3] = 2  # how many directions it moves along

    def append_to(self, model: Any, arm: int) -> ArmParts:
        """Add the joints, q = (x, y[, z]), and the body."""
        joints, parent = (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ), 0
        for axis, joint in zip("xyz"[: self.dimensions], joints, strict=False):
            parent = model.addJoint(parent, joint(), pin.SE3.Identity(), f"platform_{axis}")
        low = 0.0 if self.dimensions == 2 else -0.5 * self.body_height
        start, end = np.array([0.0, 0.0, low]), np.array([0.0, 0.0, low + self.body_height])
        shape = coal.Cylinder(self.body_radius, self.body_height)
        placement = pin.SE3(np.eye(3), 0.5 * (start + end))
        body = pin.GeometryObject("platform", parent, 0, placement, shape)
        return ArmParts([Link(0, parent, start, end, self.body_radius)], [body])
