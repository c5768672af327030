"""Arms given by numbers: planar ones, joint by joint, by a table; and several as one robot."""

from typing import Annotated, Any, Literal

import coal
import numpy as np
import pinocchio as pin
from pydantic import Field

from evoexp.attachments import File
from evoexp.errors import SettingError, demand
from evoexp.numeric.elementary import DEGREE, length, matrix_product, rotation_matrix, sincos
from evoexp.records import FloatArray
from evoexp.robots.assembly import (
    AppendArm,
    ArmParts,
    Assembly,
    Chain,
    Link,
    Point3,
    Robot,
    Tool,
    along,
    placed,
)
from evoexp.validation import TARGET, Limits, NonNegative, Positive, Settings

Point2 = tuple[float, float]


class PlanarChain(Chain):
    """Revolute joints about z in the x–y plane; a joint angle is relative to the link before."""

    # lengths from joint to joint, the last to the tip [length unit of the scene]
    link_lengths: Annotated[tuple[Positive, ...], Field(min_length=1)]
    base_position: Point2  # the first joint (x, y)
    base_angle: float = 0.0  # direction of the first link at q = 0, from +x [deg]
    link_radius: NonNegative = 0.0  # half the thickness of every link; 0: a line
    tool_radius: NonNegative = 0.0  # of a ball around the tip; 0: none
    # least and greatest angle of every joint [rad], as the papers print them; None: any angle
    joint_limits: tuple[Limits, ...] | None = None

    def _check(self) -> None:
        limits = self.joint_limits
        if limits is not None and len(limits) != len(self.link_lengths):
            must = f"one pair per link ({len(self.link_lengths)})"
            raise SettingError("joint_limits", must, len(limits))

    def append_to(self, model: Any, arm: int) -> ArmParts:
        """Add one revolute joint per link; a tool is a link of no length on the last joint."""
        parent, links = 0, []
        placement = placed((*self.base_position, 0.0), (0.0, 0.0, self.base_angle))
        for k, link_length in enumerate(self.link_lengths):
            parent = model.addJoint(parent, pin.JointModelRZ(), placement, f"arm_{arm}_joint_{k}")
            if self.joint_limits is not None:
                model.lowerPositionLimit[parent - 1] = self.joint_limits[k][0]
                model.upperPositionLimit[parent - 1] = self.joint_limits[k][1]
            tip = np.array([link_length, 0.0, 0.0])
            links.append(Link(arm, parent, np.zeros(3), tip, self.link_radius))
            placement = pin.SE3(np.eye(3), tip)
        if self.tool_radius > 0.0:
            links.append(Link(arm, parent, tip, tip, self.tool_radius))
        return ArmParts(links)


class SerialJoint(Settings):
    """One joint."""

    # direction that it turns about or slides along, in the frame of the joint before; any
    # length but 0
    axis: Point3
    # from the joint before (from the base for the first one), at q = 0 [length unit of the
    # scene]
    offset: Point3
    kind: Literal["revolute", "prismatic"] = "revolute"  # whether it turns or slides

    def _check(self) -> None:
        demand(any(self.axis), "axis", "a direction, not (0, 0, 0)", list(self.axis))

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

    joints: Annotated[tuple[SerialJoint, ...], Field(min_length=1)]  # from the base to the tip
    tip: Point3  # from the last joint [length unit of the scene]
    base_position: Point3  # in the world
    base_angle: float = 0.0  # turn of the whole arm about the world's z [deg]
    link_radius: NonNegative = 0.0  # half the thickness of every link; 0: a line

    def append_to(self, model: Any, arm: int) -> ArmParts:
        """Add the joints; links of no length are left out."""
        turn = rotation_matrix((0.0, 0.0, self.base_angle))
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
    demand(reach != 0.0, f"{field}.end", "another point than start", list(body.end))
    kind = coal.Capsule if body.shape == "capsule" else coal.Cylinder
    return kind(body.radius, reach), along(start, end)


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

    # rows of the table, from the base to the last joint
    joints: Annotated[tuple[DhJoint, ...], Field(min_length=1)]
    bodies: Annotated[tuple[AnyBody, ...], Field(min_length=1)]  # what can collide
    base_position: Point3  # of the frame 0 in the world [length unit]
    base_rotation: Point3 = (0.0, 0.0, 0.0)  # its roll, pitch, yaw [deg]
    tool_position: Point3 = (0.0, 0.0, 0.0)  # of the tool's frame in the last one [length unit]
    # its roll, pitch, yaw [deg]; z is the main grasping direction, y stands across it
    tool_rotation: Point3 = (0.0, 0.0, 0.0)

    def _check(self) -> None:
        names = [body.name for body in self.bodies]
        for k, body in enumerate(self.bodies):
            if body.joint > len(self.joints):
                raise SettingError(f"bodies[{k}].joint", f"at most {len(self.joints)}", body.joint)
            if body.name in names[:k]:
                raise SettingError(f"bodies[{k}].name", "a name that no other body has", body.name)

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


class Arms(Robot):
    """Arms standing in one scene; q is their configurations one after the other."""

    arms: Annotated[tuple[Chain, ...], Field(min_length=1)]  # the arms, each with its own base
    # pairs of bodies that need no test, derived when the files of arms out of a URDF are
    # read; None: none are
    pairs: File | None = None

    @classmethod
    def wants_pairs(cls, settings: dict[str, Any]) -> bool:
        """Whether pairs are still to be derived: where an arm comes out of a URDF."""
        arms = settings.get("arms")
        if settings.get("pairs") is not None or not isinstance(arms, list):
            return False
        return any(isinstance(arm, dict) and arm.get(TARGET) == "urdf" for arm in arms)

    def build(self) -> Assembly:
        """Return the robot with its derived pairs."""
        for k, arm in enumerate(self.arms):
            must = "left out for one of several arms"
            demand(not getattr(arm, "spheres", None), f"robot.arms[{k}].spheres", must, "a file")
        return super().build()._replace(pairs=self.pairs.content if self.pairs else None)

    @classmethod
    def read_files(cls, settings: dict[str, Any], field: str) -> dict[str, Any]:
        """Return settings in which the files that are given count for all arms out of a URDF."""
        settings = dict(settings)
        files = {name: settings.pop(name, None) for name in ("path", "srdf", "packages")}
        shared = {name: path for name, path in files.items() if path is not None}
        if shared and isinstance(arms := settings.get("arms"), list):
            is_urdf = [arm.get(TARGET) == "urdf" for arm in arms]
            arms = [shared | arm if own else arm for arm, own in zip(arms, is_urdf, strict=True)]
            settings["arms"] = arms
        return settings

    def notes(self) -> list[str]:
        """Join the remarks of the arms."""
        return list(dict.fromkeys(note for chain in self.arms for note in chain.notes()))

    def chains(self) -> tuple[AppendArm, ...]:
        """Return the arms; a URDF may bring several."""
        return tuple(arm for chain in self.arms for arm in chain.chains())
