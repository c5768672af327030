"""An arm of three links on a platform that moves along a line.

Chen & Zalzala 1995, section 4.2, Fig. 3.
"""

from typing import Any, ClassVar, Self

import numpy as np
import pinocchio as pin
from pydantic import model_validator

from evoexp.errors import demand
from evoexp.records import FloatArray
from evoexp.robots.assembly import ArmParts, Chain, Link, link_capsule
from evoexp.validation import Limits, NonNegative, Positive

NUM_JOINTS = 3  # of the arm


class MobileArm(Chain):
    """One prismatic joint along x, on it three revolute joints about z; q = (X_p, θ1, θ2, θ3).

    The first revolute joint stands in the middle of the platform, on the line that the platform
    moves along (y = 0). Every joint angle is relative to the link before.
    """

    component: ClassVar[str] = "mobile_arm"

    link_lengths: tuple[Positive, Positive, Positive]  # l1, l2, l3 [length unit of the scene]
    # length and height of the platform, a rectangle with round ends [length unit]
    platform_size: tuple[Positive, Positive]
    link_radius: NonNegative = 0.0  # half the thickness of every link; 0: a line
    # least and greatest θ1, θ2, θ3 within ±180° [deg]; None: any angle (Eq. 7)
    joint_limits: tuple[Limits, Limits, Limits] | None = None
    # least and greatest τ1, τ2, τ3; None: any torque (Eq. 9)
    torque_limits: tuple[Limits, Limits, Limits] | None = None

    @model_validator(mode="after")
    def _is_longer_than_high(self) -> Self:
        length, height = self.platform_size
        must = "[length, height] with length > height"
        demand(length > height, "platform_size", must, [length, height])
        return self

    @property
    def limits(self) -> FloatArray:
        """(6, 2) least and greatest joint angles [deg], then torques."""
        anything = ((-np.inf, np.inf),) * NUM_JOINTS
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
        names = ["platform", *[""] * NUM_JOINTS]
        bodies = [link_capsule(link, name) for link, name in zip(links, names, strict=True)]
        return ArmParts(links, bodies)
