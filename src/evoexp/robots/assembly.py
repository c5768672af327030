"""The product of a robot description: one Pinocchio model, with the arms as slices of q."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin

from evoexp.errors import demand, demand_known
from evoexp.numeric.elementary import length, rotation_matrix
from evoexp.records import FloatArray
from evoexp.robots.kinematics import KinematicTable, check_size, kinematic_table
from evoexp.validation import Component

Point3 = tuple[float, float, float]


class Link(NamedTuple):
    """A line segment, thickened by a radius, that moves with one joint; a tool has no length."""

    arm: int
    joint: int  # index of the Pinocchio joint that moves it; 0: it stands still
    start: FloatArray  # (3,) in the frame of the joint [length unit of the scene]
    end: FloatArray  # (3,)
    radius: float  # 0 for a line

    @property
    def is_tool(self) -> bool:
        """Whether it is a ball."""
        return bool(np.array_equal(self.start, self.end))


class Tool(NamedTuple):
    """The frame of an arm's tool: z is the main grasping direction, y stands across it."""

    joint: int  # index of the Pinocchio joint that moves it
    rotation: FloatArray  # (3, 3) in the frame of the joint
    position: FloatArray  # (3,)


class LinkFrames(NamedTuple):
    """The frames of a URDF's links, for tasks that give places in them."""

    root: str  # the link that all others hang on
    # name of each link that is fixed to the ground, and its pose (12,) in the world
    standing: tuple[tuple[str, tuple[float, ...]], ...]
    moving: frozenset[str]  # names of the links that hang on a joint
    ground: str = ""  # the frame to which the SRDF's virtual joint ties the root; empty: none


class ArmStates(NamedTuple):
    """The named states of an arm."""

    joints: tuple[str, ...]  # names of the joints that move, in the order of q
    units: tuple[float, ...]  # of each: degrees, or 1 for lengths [rad, m]
    # values of joints by their names [rad, m], by the states' names
    states: dict[str, dict[str, float]]

    def values_of(self, name: str, field: str) -> list[float]:
        """Return the configuration of a state [deg, m]."""
        names = sorted(self.states)
        must = f"a state that the robot's SRDF names ({', '.join(names) or 'none'}), or numbers"
        demand_known(name, names, field, must)
        state = self.states[name]
        missing = [joint for joint in self.joints if joint not in state]
        demand(not missing, field, f"a state that tells {', '.join(missing)}", name)
        return [state[joint] / unit for joint, unit in zip(self.joints, self.units, strict=True)]


class Assembly(NamedTuple):
    """A robot, built. Shared and read-only: whoever needs `pin.Data` makes its own."""

    model: Any  # pin.Model
    geometry: Any  # pin.GeometryModel
    links: tuple[Link, ...]  # links as segments
    arm_slices: np.ndarray  # (arms, 2) first and one-past-last index of each arm in q
    table: KinematicTable  # the kinematic table of the model
    body_arms: tuple[int, ...]  # which arm each body belongs to
    tools: tuple[Tool, ...]  # the tool's frame of each arm
    # pairs of bodies' names that are never judged (an SRDF's)
    disabled: frozenset[frozenset[str]]
    states: tuple[ArmStates, ...]  # the named states of each arm
    # data of `collision.derived_pairs`, attached to the condition; None: there is none
    pairs: bytes | None = None
    # spheres that are given as the covers of bodies, by name: (spheres, 4) middles in the body's
    # frame and radii; None: none are
    spheres: Mapping[str, FloatArray] | None = None
    frames: LinkFrames | None = None  # of the links; None: they have no names

    @property
    def num_arms(self) -> int:
        """Number of arms."""
        return len(self.arm_slices)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """(nq) names of the joints that move, in the order of q."""
        own = np.flatnonzero(self.table.free)
        own = own[np.argsort(self.table.chain.index_q[own])]
        return tuple(str(self.model.names[k + 1]) for k in own.tolist())


class ArmParts(NamedTuple):
    """The links, bodies and rules that an arm adds to a robot."""

    links: list[Link]
    bodies: list[Any] | None = None  # each a pin.GeometryObject; None: the links, as capsules
    tool: Tool | None = None  # its frame; None: at the end of the last link, turned as its joint
    disabled: frozenset[frozenset[str]] = frozenset()  # pairs of bodies that are never judged
    # the joints that follow others: indices of the source's Pinocchio joint and of the own, then
    # multiplier and offset: q = multiplier · q of the source + offset [rad, m]
    followers: tuple[tuple[int, int, float, float], ...] = ()
    states: ArmStates = ArmStates((), (), {})  # those that a file names
    has_names: bool = False  # whether a file names joints and bodies, which keep these names


AppendArm = Callable[[Any, int], ArmParts]
"""Adds the joints of the arm of a number to a `pin.Model`; returns what comes with them."""


class Robot(Component, is_base=True):
    """Base of every robot description: names its arms, which are built together."""

    def chains(self) -> tuple[AppendArm, ...]:
        """Return the arms, in the order of their slices of q."""
        raise NotImplementedError

    def notes(self) -> list[str]:
        """Remark on what the description leaves open."""
        return []

    def build(self) -> Assembly:
        """Return all arms in one Pinocchio model with coal bodies, q = (arm 0, arm 1, …)."""
        return assembled(self.chains())


class Chain(Robot, is_base=True):
    """Base of a single arm, which can stand as a robot of its own."""

    def append_to(self, model: Any, arm: int) -> ArmParts:
        """Add the joints of the arm of a number to a `pin.Model`; return what comes with them."""
        raise NotImplementedError

    def chains(self) -> tuple[AppendArm, ...]:
        """Return the arm itself."""
        return (self.append_to,)


def assembled(arms: tuple[AppendArm, ...]) -> Assembly:
    """Append arms to one model, with q = (arm 0, arm 1, …)."""
    model, geometry = pin.Model(), pin.GeometryModel()
    parts: list[ArmParts] = []
    slices, bodies, names = [], [], list[str]()
    for k, append in enumerate(arms):
        first = model.njoints
        parts.append(append(model, k))
        check_size(model)  # before bodies are added, which takes ever longer
        slices.append((first, model.njoints))
        own, links = parts[k].bodies, parts[k].links
        bodies.append([link_capsule(link, "") for link in links] if own is None else own)
        if parts[k].has_names:
            joints = [model.names[joint] for joint in range(*slices[k])]
            names += [f"joint {str(name).removeprefix(f'arm_{k}_')}" for name in joints]
            names += [f"body {body.name}" for body in bodies[k]]
    # of several arms, all have a prefix where names would be the same, else those without names
    is_double = len(set(names)) < len(names)
    tools, disabled, body_arms = [], set[frozenset[str]](), []
    for k, part in enumerate(parts):
        is_prefixed = len(arms) > 1 and (is_double or not part.has_names)
        prefix = f"arm_{k + 1}_" if is_prefixed else ""
        for joint in range(*slices[k]) if part.has_names else ():
            model.names[joint] = prefix + str(model.names[joint]).removeprefix(f"arm_{k}_")
        for body in bodies[k]:
            body.name = prefix + body.name if body.name else f"link_{geometry.ngeoms}"
            geometry.addGeometryObject(body)
            body_arms.append(k)
        tools.append(part.tool or Tool(part.links[-1].joint, np.eye(3), part.links[-1].end))
        disabled |= {frozenset(prefix + name for name in pair) for pair in part.disabled}
    for follower in (follower for part in parts for follower in part.followers):
        model = pin.transformJointIntoMimic(model, *follower)
    # joints that follow have no coordinates
    ends = np.cumsum([0] + [sum(model.nqs[first:last]) for first, last in slices])
    return Assembly(
        model,
        geometry,
        tuple(link for part in parts for link in part.links),
        np.stack([ends[:-1], ends[1:]], axis=1).astype(np.int64),
        kinematic_table(model),
        tuple(body_arms),
        tuple(tools),
        frozenset(disabled),
        tuple(part.states for part in parts),
    )


def link_capsule(link: Link, name: str) -> Any:
    """Return a link as a `pin.GeometryObject`: a coal capsule along it, or a sphere for a tool."""
    if link.is_tool:
        return pin.GeometryObject(
            name, link.joint, 0, pin.SE3(np.eye(3), link.start), coal.Sphere(link.radius)
        )
    shape = coal.Capsule(link.radius, length(link.end - link.start))
    return pin.GeometryObject(name, link.joint, 0, along(link.start, link.end), shape)


def along(start: FloatArray, end: FloatArray) -> Any:
    """Return the `pin.SE3` of a capsule or cylinder (coal draws them along z) on a segment."""
    direction = end - start
    reach = length(direction)
    rotation = np.eye(3)
    if reach > 0.0:
        upright = np.array([0.0, 0.0, 1.0])
        rotation = pin.Quaternion.FromTwoVectors(upright, direction / reach).toRotationMatrix()
    return pin.SE3(rotation, 0.5 * (start + end))


def placed(position: Point3, angles: Point3) -> Any:
    """Return the `pin.SE3` of a position and roll, pitch, yaw [deg] about fixed axes."""
    return pin.SE3(rotation_matrix(angles), np.array(position))
