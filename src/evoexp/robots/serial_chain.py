"""An arm in space, given joint by joint: its place behind the joint before, and its axis."""

from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
import pinocchio as pin
from pydantic import Field, model_validator

from evoexp.errors import demand
from evoexp.numeric.elementary import DEGREE, sincos
from evoexp.numeric.ordered_sums import matrix_product
from evoexp.robots.assembly import ArmParts, Chain, Link
from evoexp.robots.bodies import Point3
from evoexp.validation import NonNegative, Settings


class SerialJoint(Settings):
    """One joint."""

    # direction that it turns about or slides along, in the frame of the joint before; any
    # length but 0
    axis: Point3
    # from the joint before (from the base for the first one), at q = 0 [length unit of the
    # scene]
    offset: Point3
    kind: Literal["revolute", "prismatic"] = "revolute"  # whether it turns or slides

    @model_validator(mode="after")
    def _points_somewhere(self) -> Self:
        demand(any(self.axis), "axis", "a direction, not (0, 0, 0)", list(self.axis))
        return self

    def model(self) -> Any:
        """Return Pinocchio's joint model."""
        slides, axis = self.kind == "prismatic", np.array(self.axis)
        kind = pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned
        return kind(axis / np.sqrt(np.sum(axis * axis)))


class SerialChain(Chain):
    """Joints one behind the other; at q = 0 all frames are parallel to the base's.

    A link is the straight segment from one joint to the next, the last one to the tip; joints that
    stand in the same place have none between them. The segment from the base to the first joint is
    a link that does not move.
    """

    component: ClassVar[str] = "serial_chain"

    joints: Annotated[tuple[SerialJoint, ...], Field(min_length=1)]  # from the base to the tip
    tip: Point3  # from the last joint [length unit of the scene]
    base_position: Point3  # in the world
    base_angle: float = 0.0  # turn of the whole arm about the world's z [deg]
    link_radius: NonNegative = 0.0  # half the thickness of every link; 0: a line

    def append_to(self, model: Any, arm: int) -> ArmParts:
        """Add the joints; links of no length are left out."""
        s, c = sincos(DEGREE * self.base_angle)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        base, parent, links = np.array(self.base_position), 0, []
        for k, joint in enumerate(self.joints):
            offset = np.array(joint.offset)
            placement, start, end = pin.SE3(np.eye(3), offset), np.zeros(3), offset
            if k == 0:
                start, end = base, base + matrix_product(turn, offset)
                placement = pin.SE3(turn, end)
            links.append(Link(arm, parent, start, end, self.link_radius))
            parent = model.addJoint(parent, joint.model(), placement, f"arm_{arm}_joint_{k}")
        links.append(Link(arm, parent, np.zeros(3), np.array(self.tip), self.link_radius))
        return ArmParts([link for link in links if not np.array_equal(link.start, link.end)])
