"""The product of a robot description: one Pinocchio model, with the arms as slices of q."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin

from evoexp.errors import SettingError, nearest
from evoexp.numeric.ordered_sums import length
from evoexp.records import FloatArray
from evoexp.robots.bodies import along
from evoexp.robots.kinematics import KinematicTable, check_size, kinematic_table
from evoexp.validation import Component


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


class Assembly(NamedTuple):
    """A robot, built. Shared and read-only: whoever needs `pin.Data` makes its own."""

    model: Any  # pin.Model
    geometry: Any  # pin.GeometryModel
    links: tuple[Link, ...]  # links as segments
    arm_slices: np.ndarray  # (arms, 2) first and one-past-last index of each arm in q
    table: KinematicTable  # the kinematic table of the model
    body_arms: tuple[int, ...]  # which arm each body belongs to
    tools: tuple[Tool, ...] = ()  # the tool's frame of each arm
    # pairs of bodies' names that are never judged (an SRDF's)
    disabled: frozenset[frozenset[str]] = frozenset()
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


class Follower(NamedTuple):
    """A joint that follows another: its coordinate is multiplier · q of the source + offset."""

    joint: int  # index of the Pinocchio joint
    source: int
    multiplier: float
    offset: float  # [rad], a length for a prismatic joint


class ArmStates(NamedTuple):
    """The named states of an arm."""

    joints: tuple[str, ...]  # names of the joints that move, in the order of q
    units: tuple[float, ...]  # of each: degrees, or 1 for lengths [rad, m]
    # values of joints by their names [rad, m], by the states' names
    states: dict[str, dict[str, float]]

    def values_of(self, name: str, field: str) -> list[float]:
        """Return the configuration of a state [deg, m].

        Args:
            field: That names it, for errors.

        Raises:
            SettingError: If there is none, or it leaves out a joint.
        """
        if name not in self.states:
            names = sorted(self.states)
            must = f"a state that the robot's SRDF names ({', '.join(names) or 'none'}), or numbers"
            raise SettingError(field, must, name, nearest(name, names))
        state = self.states[name]
        if missing := [joint for joint in self.joints if joint not in state]:
            raise SettingError(field, f"a state that tells {', '.join(missing)}", name)
        return [state[joint] / unit for joint, unit in zip(self.joints, self.units, strict=True)]


class Arm:
    """Base of a part of a robot: joints, bodies, a tool and what a file tells of them."""

    def append_to(self, model: Any, arm: int) -> list[Link]:
        """Add the arm's joints to a model; return its links."""
        raise NotImplementedError

    def append_bodies(self, model: Any, arm: int, first_joint: int, links: list[Link]) -> list[Any]:
        """Return the bodies as `pin.GeometryObject`: the links, unless an arm has others.

        Args:
            model: With the arm's joints.
            arm: Its number.
            first_joint: Its first joint.
        """
        return [link_capsule(link, "") for link in links]

    def tool(self, model: Any, first_joint: int, links: list[Link]) -> Tool:
        """Return the tool's frame: at the end of the last link, turned as its joint.

        An arm with another tool overrides this.
        """
        return Tool(links[-1].joint, np.eye(3), links[-1].end)

    def disabled_pairs(self) -> set[frozenset[str]]:
        """Return pairs of bodies' names that are never judged."""
        return set()

    def own_names(self) -> tuple[set[str], set[str]]:
        """Return the names of joints and of bodies that a file gives, which are kept; or none."""
        return set(), set()

    def followers(self, first_joint: int) -> list[Follower]:
        """Return the joints that follow others.

        Args:
            first_joint: Index of the arm's first joint.
        """
        return []

    def states(self) -> tuple[ArmStates, ...]:
        """Return the named states: none, unless a file names some."""
        return (ArmStates((), (), {}),)


class Robot(Component):
    """Base of every robot description: names its arms, which are built together."""

    def chains(self) -> tuple[Arm, ...]:
        """Return the arms, in the order of their slices of q."""
        raise NotImplementedError

    @classmethod
    def wants_pairs(cls, settings: dict[str, Any]) -> bool:
        """Whether plain settings are to be given derived pairs of bodies, as data."""
        return False

    def states(self) -> tuple[ArmStates, ...]:
        """Return the named states of each arm."""
        return tuple(own for chain in self.chains() for own in chain.states())

    def notes(self) -> list[str]:
        """Remark on what the description leaves open."""
        return []

    def build(self) -> Assembly:
        """Append all arms to one model.

        Returns:
            The model with q = (arm 0, arm 1, …), its exact geometry and its kinematic table.
        """
        model, geometry = pin.Model(), pin.GeometryModel()
        chains = self.chains()
        prefixed = _needs_prefix(chains)
        links: list[Link] = []
        ranges, arms, tools, disabled, followers = [], [], [], set(), []
        for k, chain in enumerate(chains):
            joint, prefix = model.njoints, f"arm_{k + 1}_" if prefixed[k] else ""
            own = chain.append_to(model, k)
            check_size(model)  # before bodies are added, which takes ever longer
            if any(chain.own_names()):
                for added in range(joint, model.njoints):
                    name = str(model.names[added]).removeprefix(f"arm_{k}_")
                    model.names[added] = prefix + name
            bodies = chain.append_bodies(model, k, joint, own)
            for body in bodies:
                body.name = prefix + body.name if body.name else f"link_{geometry.ngeoms}"
                geometry.addGeometryObject(body)
            links += own
            arms += [k] * len(bodies)
            tools.append(chain.tool(model, joint, own))
            pairs = chain.disabled_pairs()
            disabled |= {frozenset(prefix + name for name in pair) for pair in pairs}
            followers += chain.followers(joint)
            ranges.append((joint, model.njoints))
        for follower in followers:
            source, joint, *rule = follower.source, follower.joint, *follower[2:]
            model = pin.transformJointIntoMimic(model, source, joint, *rule)
        return Assembly(
            model,
            geometry,
            tuple(links),
            _slices(model, ranges),
            kinematic_table(model),
            tuple(arms),
            tuple(tools),
            frozenset(disabled),
        )


def _needs_prefix(arms: tuple[Arm, ...]) -> list[bool]:
    """Return which arms' names get the arm's number before them: where names would be the same."""
    names = [arm.own_names() for arm in arms]
    several = [
        sum(len(each[kind]) for each in names) > len(set[str]().union(*(n[kind] for n in names)))
        for kind in range(2)
    ]
    return [len(arms) > 1 and (any(several) or not any(own)) for own in names]


def _slices(model: Any, ranges: list[tuple[int, int]]) -> np.ndarray:
    """Return (arms, 2) first and one-past-last place in q of the joints of each arm."""
    slices, first = [], 0
    for start, stop in ranges:
        after = first + sum(int(model.nqs[joint]) for joint in range(start, stop))
        slices.append((first, after))
        first = after
    return np.array(slices, dtype=np.int64)


class Chain(Arm, Robot):
    """Base of a single arm, which can stand as a robot of its own."""

    def chains(self) -> tuple[Arm, ...]:
        """Return the arm itself."""
        return (self,)


def link_capsule(link: Link, name: str) -> Any:
    """Return a link as a `pin.GeometryObject`: a coal capsule along it, or a sphere for a tool."""
    if link.is_tool:
        return pin.GeometryObject(
            name, link.joint, 0, pin.SE3(np.eye(3), link.start), coal.Sphere(link.radius)
        )
    shape = coal.Capsule(link.radius, length(link.end - link.start))
    return pin.GeometryObject(name, link.joint, 0, along(link.start, link.end), shape)
