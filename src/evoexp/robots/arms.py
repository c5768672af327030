"""Robots given by numbers: arms, platforms, arms on platforms; and several arms as one robot."""

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
    link_capsule,
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


ARM_JOINTS = 3  # of an arm on a platform (Chen & Zalzala 1995)


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
        for k, link_length in enumerate(self.link_lengths):
            joint = pin.JointModelRevoluteUnaligned(np.array([0.0, -1.0, 0.0]))
            parent = model.addJoint(parent, joint, pin.SE3(np.eye(3), place), f"arm_joint_{k}")
            place = np.array([link_length, 0.0, 0.0])
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
