"""An arm given by its Denavit–Hartenberg table, with bodies on its links (Corsépius 2001, 4.1)."""

from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
import pinocchio as pin
from pydantic import Field, model_validator

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE, sincos
from evoexp.records import FloatArray
from evoexp.robots.assembly import ArmParts, Chain, Link, Tool
from evoexp.robots.bodies import AnyBody, Point3, body_geometry, placed
from evoexp.validation import Limits, Settings


class DhJoint(Settings):
    """One row of a table in the distal (standard) form.

    Turn about z, shift along z, shift along x, turn about x.
    """

    # a, α, d, θ at q = 0 [length unit, deg, length unit, deg]
    dh: tuple[float, float, float, float]
    # least and greatest value of the joint [deg], of a sliding one [length unit]
    limits: Limits
    kind: Literal["revolute", "prismatic"] = "revolute"  # whether θ or d is what moves

    def behind(self) -> Any:
        """Return the `pin.SE3` from the joint's moved frame to the next joint's, at q = 0."""
        a, alpha, d, theta = self.dh
        s, c = sincos(DEGREE * theta)
        sa, ca = sincos(DEGREE * alpha)
        rotation: FloatArray = np.array([[c, -s * ca, s * sa], [s, c * ca, -c * sa], [0.0, sa, ca]])
        return pin.SE3(rotation, np.array([a * c, a * s, d]))


class DhChain(Chain):
    """Joints in a row, each about or along the z axis of the frame before: ⁰T₁ ¹T₂ … ⁿ⁻¹Tₙ.

    Body frames: a body of joint k is given in the frame k of the table, which moves with joint k (a
    body of joint 0 in the base's).
    """

    component: ClassVar[str] = "dh_chain"

    # rows of the table, from the base to the last joint
    joints: Annotated[tuple[DhJoint, ...], Field(min_length=1)]
    bodies: Annotated[tuple[AnyBody, ...], Field(min_length=1)]  # what can collide
    base_position: Point3  # of the frame 0 in the world [length unit]
    base_rotation: Point3 = (0.0, 0.0, 0.0)  # its roll, pitch, yaw [deg]
    tool_position: Point3 = (0.0, 0.0, 0.0)  # of the tool's frame in the last one [length unit]
    # its roll, pitch, yaw [deg]; z is the main grasping direction, y stands across it
    tool_rotation: Point3 = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _bodies_fit(self) -> Self:
        names = [body.name for body in self.bodies]
        for k, body in enumerate(self.bodies):
            if body.joint > len(self.joints):
                raise SettingError(f"bodies[{k}].joint", f"at most {len(self.joints)}", body.joint)
            if body.name in names[:k]:
                raise SettingError(f"bodies[{k}].name", "a name that no other body has", body.name)
        return self

    def append_to(self, model: Any, arm: int) -> ArmParts:
        """Add the joints; a link is the line from one joint to the next, the last to the tool."""
        base, first = placed(self.base_position, self.base_rotation), model.njoints
        before, parent, start, links = base, 0, np.array(self.base_position), []
        for k, joint in enumerate(self.joints):
            sliding = joint.kind == "prismatic"
            kind = pin.JointModelPZ() if sliding else pin.JointModelRZ()
            links.append(Link(arm, parent, start, np.array(before.translation), 0.0))
            parent = model.addJoint(parent, kind, before, f"arm_{arm}_joint_{k}")
            unit = 1.0 if sliding else DEGREE
            model.lowerPositionLimit[parent - 1] = unit * joint.limits[0]
            model.upperPositionLimit[parent - 1] = unit * joint.limits[1]
            before, start = joint.behind(), np.zeros(3)
        tip = before * placed(self.tool_position, self.tool_rotation)
        links.append(Link(arm, parent, start, np.array(tip.translation), 0.0))
        # a body of joint k is given in the frame behind it
        frames = [(0, base)] + [(first + k, joint.behind()) for k, joint in enumerate(self.joints)]
        bodies = []
        for k, body in enumerate(self.bodies):
            shape, placement = body_geometry(body, f"robot.bodies[{k}]")
            index, frame = frames[body.joint]
            bodies.append(pin.GeometryObject(body.name, index, 0, frame * placement, shape))
        return ArmParts(
            [link for link in links if not np.array_equal(link.start, link.end)],
            bodies,
            Tool(parent, np.array(tip.rotation), np.array(tip.translation)),
        )
