"""The arms of one URDF: parts of one tree, whose other joints stand still or follow."""

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.errors import SettingError, nearest
from evoexp.numeric.elementary import DEGREE, sincos
from evoexp.numeric.ordered_sums import matrix_product
from evoexp.robots.assembly import Arm, ArmParts, ArmStates, Follower, Link, LinkFrames, Tool
from evoexp.robots.joint_choice import JointRoles
from evoexp.robots.kinematics import own_axis
from evoexp.robots.poses import pose_of
from evoexp.robots.srdf import Srdf
from evoexp.robots.urdf_model import PlacedBody


class Carrier(NamedTuple):
    """The joint of the robot that carries the frame of a joint of the URDF."""

    joint: int  # index of the robot's joint, 0: the world
    placement: Any  # pin.SE3 or None

    def place(self, local: Any) -> Any:
        """Return the `pin.SE3` of a place in the frame, seen from the robot's joint."""
        return local if self.placement is None else self.placement * local


class UrdfTree:
    """A URDF as a model of all its joints, and which of them move, in which arm."""

    def __init__(
        self,
        model: Any,
        bodies: list[PlacedBody],
        base: Any,
        roles: JointRoles,
        values: dict[str, float],
        tips: tuple[tuple[str, str], ...],
        srdf: Srdf | None,
    ) -> None:
        """Find out which joints move.

        Args:
            model: Of all joints, one coordinate each, see `urdf_model`.
            bodies: Its collision bodies.
            base: `pin.SE3` of the root in the world.
            roles: Which joints move, which follow.
            values: Of joints that stand [deg, m].
            tips: Frame of each arm's tool, empty where none is chosen, and the field that chose it.
            srdf: Its states and pairs that are never judged; None: there are none.
        """
        self.model, self.bodies, self.base, self.tips = model, bodies, base, tips
        self.states = [] if srdf is None else srdf.states()
        self._ground = "" if srdf is None else srdf.ground()
        self.names = _body_names(bodies)
        of_link: dict[str, set[str]] = {}
        for name, body in zip(self.names, bodies, strict=True):
            of_link.setdefault(body.link, set()).add(name)
        self.disabled = {
            frozenset((a, b))
            for one, two in ([] if srdf is None else srdf.disabled_links())
            for a in of_link.get(one, ())
            for b in of_link.get(two, ())
        }
        index = {str(name): k for k, name in enumerate(model.names)}
        # joints that follow: index of the source, multiplier, offset
        self.rules = {
            # a source that is fixed stands at 0, as the universe does
            index[name]: (index.get(rule.source, 0), rule.multiplier, rule.offset)
            for name, rule in roles.rules.items()
            if name in index
        }
        self._arms = [{index[name] for name in arm} for arm in roles.arms]
        self.order = self._ordered()  # joints of each arm, in the order in which they are added
        moving = [joint for arm in self.order for joint in arm]
        self._values = self._standing(moving, {index[n]: v for n, v in values.items()})
        self._place_in = {joint: k for k, joint in enumerate(moving)}
        if len(self.order) > 1:
            self.disabled |= self._neighbours_between_arms()

    def carriers(self, first: int) -> list[Carrier]:
        """Return the carriers of all joints' frames, the root's first.

        Args:
            first: Index of the first joint of the robot that comes from this URDF.
        """
        found = [Carrier(0, self.base)]
        for joint in range(1, self.model.njoints):
            if joint in self._place_in:
                found.append(Carrier(first + self._place_in[joint], None))
                continue
            before = found[self.model.parents[joint]]
            place = before.place(self.model.jointPlacements[joint])
            found.append(
                Carrier(before.joint, place * _motion(self.model, joint, self._values[joint]))
            )
        return found

    def link_frames(self) -> LinkFrames:
        """Return the frames of the links: of those that stand still with their poses."""
        links = [frame for frame in self.model.frames if frame.type == pin.FrameType.BODY]
        poses = [(str(f.name), self.base * f.placement) for f in links if not f.parentJoint]
        standing = tuple(
            (name, tuple(pose_of(pose.rotation, pose.translation).tolist())) for name, pose in poses
        )
        moving = frozenset(str(link.name) for link in links if link.parentJoint)
        return LinkFrames(str(links[0].name), standing, moving, self._ground)

    def frame(self, name: str, field: str) -> Any:
        """Find a `pin.Frame` by its name.

        Raises:
            SettingError: If there is none; the names of all are listed.
        """
        names = [frame.name for frame in self.model.frames]
        if name not in names:
            must = f"a frame of the URDF ({', '.join(names)})"
            raise SettingError(field, must, name, nearest(name, names))
        return self.model.frames[names.index(name)]

    def last_frame(self, arm: int) -> Any:
        """Return the frame that most joints of an arm carry, the farthest down the tree."""
        own = self.order[arm]
        frames = [
            frame
            for frame in self.model.frames
            if frame.type in (pin.FrameType.BODY, pin.FrameType.FIXED_JOINT)
            and any(joint in own for joint in self._path(frame.parentJoint))
        ]
        return max(frames, key=lambda frame: self._depth(frame))

    def _path(self, joint: int) -> list[int]:
        """Return a joint and those that carry it."""
        found = []
        while joint > 0:
            found.append(joint)
            joint = self.model.parents[joint]
        return found

    def _depth(self, frame: Any) -> tuple[int, int]:
        """Return how many moving joints carry a frame, and how many frames."""
        count = sum(joint in self._place_in for joint in self._path(frame.parentJoint))
        steps, index = 0, frame.parentFrame
        while index > 0:
            index, steps = self.model.frames[index].parentFrame, steps + 1
        return count, steps

    def arm_of(self, joint: int) -> int:
        """Return the arm that moves a joint of the URDF, the first one of what stands still."""
        while joint > 0:
            for k, arm in enumerate(self.order):
                if joint in arm:
                    return k
            joint = self.model.parents[joint]
        return 0

    def _neighbours_between_arms(self) -> set[frozenset[str]]:
        """Return pairs of bodies of different arms that meet at a joint, or that one carries."""
        carriers, found = self.carriers(1), set()
        above = {0: -1}
        for joint, place in self._place_in.items():
            above[1 + place] = carriers[self.model.parents[joint]].joint
        bodies = [
            (name, self.arm_of(body.joint), carriers[body.joint].joint)
            for name, body in zip(self.names, self.bodies, strict=True)
        ]
        for k, (name, arm, joint) in enumerate(bodies):
            for other, other_arm, by in bodies[k + 1 :]:
                if arm != other_arm and (joint == by or above[joint] == by or above[by] == joint):
                    found.add(frozenset((name, other)))
        return found

    def _ordered(self) -> tuple[tuple[int, ...], ...]:
        """Return the joints of each arm: behind what carries them, and behind what they follow.

        Raises:
            SettingError: If an arm hangs on joints of a later one.
        """
        arms = []
        whole = [
            own
            | {joint for joint, (source, rate, _) in self.rules.items() if source in own and rate}
            for own in self._arms
        ]
        everything = set[int]().union(*whole)
        added: set[int] = set()
        for k, own in enumerate(whole):
            order: list[int] = []
            left = sorted(own)
            while left:
                ready = [joint for joint in left if self._needs(joint) & everything <= added]
                if not ready:
                    name = self.model.names[left[0]]
                    must = "groups in an order in which none hangs on a later one"
                    raise SettingError("robot.groups", must, f"'{name}' in number {k + 1}")
                # one at a time: an arm without followers keeps Pinocchio's order
                order.append(ready[0])
                added.add(ready[0])
                left.remove(ready[0])
            arms.append(tuple(order))
        return tuple(arms)

    def _needs(self, joint: int) -> set[int]:
        """Return the joints that must be there before a joint is added."""
        source = {self.rules[joint][0]} if joint in self.rules else set()
        return set(self._path(self.model.parents[joint])) | source

    def _standing(self, moving: list[int], given: dict[int, float]) -> dict[int, float]:
        """Return the values of the joints that stand [rad, m]."""
        model, found = self.model, {0: 0.0}
        for joint in range(1, model.njoints):
            low, high = (
                float(limits[model.idx_qs[joint]])
                for limits in (model.lowerPositionLimit, model.upperPositionLimit)
            )
            unit = 1.0 if own_axis(model, joint)[1] else DEGREE
            if joint in moving or joint in self.rules:
                continue
            if joint in given:
                value = given[joint] * unit
                slack = 1e-9 * max(1.0, abs(value))
                if not low - slack <= value <= high + slack:
                    must = f"within the joint's limits [{low / unit:g}, {high / unit:g}]"
                    raise SettingError(f"robot.fixed.{model.names[joint]}", must, given[joint])
                found[joint] = value
            else:
                found[joint] = min(max(0.0, low), high)
        for joint, (source, multiplier, offset) in self.rules.items():
            if joint not in moving:
                found[joint] = (multiplier * found[source] if multiplier else 0.0) + offset
        return found


def _body_names(bodies: list[PlacedBody]) -> list[str]:
    """Return the names of bodies: those of their links, with a number where a link has several.

    All are numbered if one of these were the name of another link.
    """
    links = [body.link for body in bodies]
    numbered = [f"{link}_{links[:k].count(link)}" for k, link in enumerate(links)]
    names = [
        link if links.count(link) == 1 else name for link, name in zip(links, numbered, strict=True)
    ]
    return names if len(set(names)) == len(names) else numbered


class UrdfArm(Arm):
    """One arm of a URDF; bodies that stand still belong to the first arm."""

    def __init__(self, tree: UrdfTree, index: int) -> None:
        """Take the arm of a number out of a tree."""
        self._tree, self._index = tree, index
        self._own = tree.order[index]
        self._before = sum(len(arm) for arm in tree.order[:index])

    def own_names(self) -> tuple[set[str], set[str]]:
        """Return the names of the joints and of the bodies, as the URDF has them."""
        joints = {str(self._tree.model.names[joint]) for joint in self._own}
        return joints, {name for name, _ in self._bodies()}

    def append_to(self, model: Any, arm: int) -> ArmParts:
        """Add the joints; a link is the line from a joint to one behind it, the last to the tool.

        Raises:
            SettingError: If the URDF has no bodies, or the tool's frame stands still.
        """
        tree, own = self._tree, self._tree.model
        if not tree.bodies:
            raise SettingError("robot.path", "a URDF with collision bodies", None)
        first = model.njoints - self._before  # the place of the tree's first joint in the robot
        carriers, links = tree.carriers(first), []
        for joint in self._own:
            before = carriers[own.parents[joint]]
            place = before.place(own.jointPlacements[joint])
            name = f"arm_{arm}_{own.names[joint]}"
            added = model.addJoint(before.joint, own.joints[joint], place, name)
            index = own.idx_qs[joint]
            model.lowerPositionLimit[model.idx_qs[added]] = own.lowerPositionLimit[index]
            model.upperPositionLimit[model.idx_qs[added]] = own.upperPositionLimit[index]
            model.velocityLimit[model.idx_vs[added]] = own.velocityLimit[own.idx_vs[joint]]
            start = np.zeros(3) if before.joint else np.array(tree.base.translation)
            links.append(Link(arm, before.joint, start, np.array(place.translation), 0.0))
        tool = self._tool(carriers)
        links.append(Link(arm, tool.joint, np.zeros(3), tool.position, 0.0))
        bodies = []
        for name, body in self._bodies():
            carrier = carriers[body.joint]
            place = carrier.place(body.placement)
            bodies.append(pin.GeometryObject(name, carrier.joint, 0, place, body.shape))
        followers = tuple(
            Follower(carriers[joint].joint, carriers[source].joint, multiplier, offset)
            for joint in self._own
            if joint in tree.rules
            for source, multiplier, offset in [tree.rules[joint]]
        )
        links = [link for link in links if not np.array_equal(link.start, link.end)]
        return ArmParts(links, bodies, tool, frozenset(tree.disabled), followers)

    def states(self) -> tuple[ArmStates, ...]:
        """Return the named states of the joints that move."""
        tree, own = self._tree, [joint for joint in self._own if joint not in self._tree.rules]
        found: dict[str, dict[str, float]] = {}
        for state in tree.states:  # of several groups: one state of all their joints
            found[state.name] = found.get(state.name, {}) | state.values
        units = tuple(1.0 if own_axis(tree.model, joint)[1] else DEGREE for joint in own)
        joints = tuple(str(tree.model.names[joint]) for joint in own)
        return (ArmStates(joints, units, found),)

    def _tool(self, carriers: list[Carrier]) -> Tool:
        """Return the tool's frame."""
        name, field = self._tree.tips[self._index]
        frame = self._tree.frame(name, field) if name else self._tree.last_frame(self._index)
        carrier = carriers[frame.parentJoint]
        if carrier.joint == 0:
            raise SettingError(field, "a frame that moves", name)
        place = carrier.place(frame.placement)
        return Tool(carrier.joint, np.array(place.rotation), np.array(place.translation))

    def _bodies(self) -> list[tuple[str, PlacedBody]]:
        """Return the bodies that this arm's joints carry, the first arm's with those that stand."""
        bodies = zip(self._tree.names, self._tree.bodies, strict=True)
        return [(n, body) for n, body in bodies if self._tree.arm_of(body.joint) == self._index]


def _motion(model: Any, joint: int, value: float) -> Any:
    """Return the `pin.SE3` by which a joint moves what it carries, by its coordinate [rad, m]."""
    axis, slides = own_axis(model, joint)
    if slides:
        return pin.SE3(np.eye(3), axis * value)
    s, c = sincos(value)
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    square = matrix_product(cross, cross)
    return pin.SE3(np.eye(3) + s * cross + (1.0 - c) * square, np.zeros(3))
