"""A platform that moves over a floor without turning; or a body that moves through space."""

from typing import ClassVar, Literal

import coal
import numpy as np
import pinocchio as pin

from evoexp.robots.assembly import Assembly, Link, Robot
from evoexp.robots.kinematics import kinematic_table
from evoexp.validation import Positive


class FloorPlatform(Robot):
    """An upright cylinder on prismatic joints along x and y, or along x, y and z."""

    component: ClassVar[str] = "floor_platform"

    body_radius: Positive  # of the cylinder [length unit of the scene]
    # of the cylinder, which stands on the floor z = 0; in three dimensions it is centred on
    # its place
    body_height: Positive
    dimensions: Literal[2, 3] = 2  # how many directions it moves along

    def build(self) -> Assembly:
        """Return the model with q = (x, y[, z]) and its body."""
        model, geometry, parent = pin.Model(), pin.GeometryModel(), 0
        joints = (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ)[: self.dimensions]
        for axis, joint in zip("xyz", joints, strict=False):
            parent = model.addJoint(parent, joint(), pin.SE3.Identity(), f"platform_{axis}")
        low = 0.0 if self.dimensions == 2 else -0.5 * self.body_height
        start, end = np.array([0.0, 0.0, low]), np.array([0.0, 0.0, low + self.body_height])
        shape = coal.Cylinder(self.body_radius, self.body_height)
        placement = pin.SE3(np.eye(3), 0.5 * (start + end))
        geometry.addGeometryObject(pin.GeometryObject("platform", parent, 0, placement, shape))
        links = (Link(0, parent, start, end, self.body_radius),)
        return Assembly(
            model, geometry, links, np.array([[0, model.nq]]), kinematic_table(model), (0,)
        )
