"""Platforms that move, with and without an arm of three links (Chen & Zalzala 1995)."""

from typing import Any, Literal

import coal
import numpy as np
import pinocchio as pin

from evoexp.errors import demand
from evoexp.records import FloatArray
from evoexp.robots.assembly import ArmParts, Chain, Link, link_capsule
from evoexp.validation import Limits, NonNegative, Positive

ARM_JOINTS = 3


class FloorPlatform(Chain):
    """An upright cylinder on prismatic joints along x and y, or along x, y and z."""

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


class MobileArm(Chain):
    """One prismatic joint along x, on it three revolute joints about z; q = (X_p, θ1, θ2, θ3).

    The first revolute joint stands in the middle of the platform, on the line that the platform
    moves along (y = 0). Every joint angle is relative to the link before.
    """

    link_lengths: tuple[Positive, Positive, Positive]  # l1, l2, l3 [length unit of the scene]
    # length and height of the platform, a rectangle with round ends [length unit]
    platform_size: tuple[Positive, Positive]
    link_radius: NonNegative = 0.0  # half the thickness of every link; 0: a line
    # least and greatest θ1, θ2, θ3 within ±180° [deg]; None: any angle (Eq. 7)
    joint_limits: tuple[Limits, Limits, Limits] | None = None
    # least and greatest τ1, τ2, τ3; None: any torque (Eq. 9)
    torque_limits: tuple[Limits, Limits, Limits] | None = None

    def _check(self) -> None:
        length, height = self.platform_size
        must = "[length, height] with length > height"
        demand(length > height, "platform_size", must, [length, height])

    @property
    def limits(self) -> FloatArray:
        """(6, 2) least and greatest joint angles [deg], then torques."""
        anything = ((-np.inf, np.inf),) * ARM_JOINTS
        return np.array([*(self.joint_limits or anything), *(self.torque_limits or anything)])

    def append_to(self, model: Any, arm: int) -> ArmParts:
        """Add the platform's joint and the arm's; the platform is the first link."""
        platform = model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), f"arm_{arm}_platform")
        length, height = self.platform_size
        end = np.array([0.5 * (length - height), 0.0, 0.0])
        links = [Link(arm, platform, -end, end, 0.5 * height)]
        parent, placement = platform, pin.SE3.Identity()
        for k, link_length in enumerate(self.link_lengths):
            parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"arm_{arm}_joint_{k}")
            tip = np.array([link_length, 0.0, 0.0])
            links.append(Link(arm, parent, np.zeros(3), tip, self.link_radius))
            placement = pin.SE3(np.eye(3), tip)
        names = ["platform", *[""] * ARM_JOINTS]
        bodies = [link_capsule(link, name) for link, name in zip(links, names, strict=True)]
        return ArmParts(links, bodies)


class FloorManipulator(Chain):
    """Prismatic joints along x and y, then three revolute ones in the upright plane through x.

    The configuration is q = (x, y, θ1, θ2, θ3).

    Positive angles lift a link that points to +x. The platform is an upright cylinder; the arm's
    first joint stands in the middle of its top.
    """

    body_radius: Positive  # of the platform [length unit of the scene]
    body_height: Positive  # of the platform
    link_lengths: tuple[Positive, Positive, Positive]  # l1, l2, l3
    link_radius: NonNegative = 0.0  # half the thickness of every link; 0: a line

    def append_to(self, model: Any, arm: int) -> ArmParts:
        """Add the platform, whose link is the first, and the joints of the arm on it."""
        platform = self.platform().append_to(model, arm)
        (body,), bodies = platform.links, platform.bodies or []
        links, parent, place = [body], body.joint, body.end
        for k, length in enumerate(self.link_lengths):
            joint = pin.JointModelRevoluteUnaligned(np.array([0.0, -1.0, 0.0]))
            parent = model.addJoint(parent, joint, pin.SE3(np.eye(3), place), f"arm_joint_{k}")
            place = np.array([length, 0.0, 0.0])
            links.append(Link(0, parent, np.zeros(3), place, self.link_radius))
            bodies.append(link_capsule(links[-1], f"link_{k + 1}"))
        return ArmParts(links, bodies)

    def platform(self) -> FloorPlatform:
        """Return the platform alone."""
        return FloorPlatform(body_radius=self.body_radius, body_height=self.body_height)

    def arm(self) -> MobileArm:
        """Return the arm on a platform that moves along a line."""
        size = (2.0 * self.body_radius, min(self.body_height, self.body_radius))
        return MobileArm(
            link_lengths=self.link_lengths, platform_size=size, link_radius=self.link_radius
        )
