"""A planar arm of revolute joints, given by its link lengths."""

from typing import Annotated, Any, ClassVar, Self

import numpy as np
import pinocchio as pin
from pydantic import Field, model_validator

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE, sincos
from evoexp.robots.assembly import ArmParts, Chain, Link
from evoexp.validation import Limits, NonNegative, Positive

Point2 = tuple[float, float]


class PlanarChain(Chain):
    """Revolute joints about z in the x–y plane; a joint angle is relative to the link before."""

    component: ClassVar[str] = "planar_chain"

    # lengths from joint to joint, the last to the tip [length unit of the scene]
    link_lengths: Annotated[tuple[Positive, ...], Field(min_length=1)]
    base_position: Point2  # the first joint (x, y)
    base_angle: float = 0.0  # direction of the first link at q = 0, from +x [deg]
    link_radius: NonNegative = 0.0  # half the thickness of every link; 0: a line
    tool_radius: NonNegative = 0.0  # of a ball around the tip; 0: none
    # least and greatest angle of every joint [rad], as the papers print them; None: any angle
    joint_limits: tuple[Limits, ...] | None = None

    @model_validator(mode="after")
    def _limits_fit(self) -> Self:
        limits = self.joint_limits
        if limits is not None and len(limits) != len(self.link_lengths):
            must = f"one pair per link ({len(self.link_lengths)})"
            raise SettingError("joint_limits", must, len(limits))
        return self

    def append_to(self, model: Any, arm: int) -> ArmParts:
        """Add one revolute joint per link; a tool is a link of no length on the last joint."""
        parent = 0
        s, c = sincos(DEGREE * self.base_angle)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        placement = pin.SE3(turn, np.array([*self.base_position, 0.0]))
        links = []
        for k, length in enumerate(self.link_lengths):
            parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"arm_{arm}_joint_{k}")
            if self.joint_limits is not None:
                model.lowerPositionLimit[parent - 1] = self.joint_limits[k][0]
                model.upperPositionLimit[parent - 1] = self.joint_limits[k][1]
            tip = np.array([length, 0.0, 0.0])
            links.append(Link(arm, parent, np.zeros(3), tip, self.link_radius))
            placement = pin.SE3(np.eye(3), tip)
        if self.tool_radius > 0.0:
            links.append(Link(arm, parent, tip, tip, self.tool_radius))
        return ArmParts(links)
