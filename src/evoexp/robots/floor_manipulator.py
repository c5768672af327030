"""A platform that moves over a floor, with an arm of three links on it (Chen & Zalzala 1995)."""

from typing import Any, ClassVar

import numpy as np
import pinocchio as pin

from evoexp.robots.assembly import ArmParts, Chain, Link, link_capsule
from evoexp.robots.floor_platform import FloorPlatform
from evoexp.robots.mobile_arm import MobileArm
from evoexp.validation import NonNegative, Positive

NUM_JOINTS = 5


class FloorManipulator(Chain):
    """Prismatic joints along x and y, then three revolute ones in the upright plane through x.

    The configuration is q = (x, y, θ1, θ2, θ3).

    Positive angles lift a link that points to +x. The platform is an upright cylinder; the arm's
    first joint stands in the middle of its top.
    """

    component: ClassVar[str] = "floor_manipulator"

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
