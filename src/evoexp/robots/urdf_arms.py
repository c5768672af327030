"""The arms of one URDF: parts of one tree, whose other joints stand still or follow."""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from evoexp.errors import SettingError, demand, demand_known
from evoexp.numeric.elementary import DEGREE, matrix_product, sincos
from evoexp.robots.assembly import AppendArm, ArmParts, ArmStates, Link, LinkFrames, Tool, placed
from evoexp.robots.kinematics import own_axis, pose_of
from evoexp.robots.urdf_model import joint_roles, placed_bodies, standing_values, urdf_model
from evoexp.robots.urdf_reading import PATH

if TYPE_CHECKING:
    from evoexp.robots.urdf import Urdf


class UrdfTree:
    """A URDF as a model of all its joints, and which of them move, in which arm."""

    def __init__(self, robot: "Urdf") -> None:
        """Build the model and the bodies, and find out which joints move."""
        roles = joint_roles(robot)
        values, self.tips = standing_values(robot, roles), roles.tips
        self.model = urdf_model(robot)
        self.bodies = list(placed_bodies(robot, self.model, robot.file.links, PATH))
        # bodies are named by their links, numbered where a link has several; all are numbered if
        # one of these were the name of another link
        self._links = links = [str(body.name) for body in self.bodies]
        numbered = [f"{link}_{links[:k].count(link)}" for k, link in enumerate(links)]
        pairs = zip(links, numbered, strict=True)
        self.names = [link if links.count(link) == 1 else name for link, name in pairs]
        if len(set(self.names)) < len(links):
            self.names = numbered
        self.base = placed(robot.base_position, robot.base_rotation)
        if robot.base_frame:
            frame = self._frame(robot.base_frame, "robot.base_frame")
            must = "a frame that does not move"
            demand(frame.parentJoint == 0, "robot.base_frame", must, robot.base_frame)
            self.base = self.base * frame.placement.inverse()
        self._srdf = robot.semantics
        index = {str(name): k for k, name in enumerate(self.model.names)}
        # joints that follow: index of the source, multiplier, offset
        self._rules = {
            # a source that is fixed stands at 0, as the universe does
            index[name]: (index.get(rule.source, 0), rule.multiplier, rule.offset)
            for name, rule in roles.rules.items()
            if name in index
        }
        # joints of each arm, in the order in which they are added
        self.order = self._ordered([{index[name] for name in arm} for arm in roles.arms])
        moving = [joint for arm in self.order for joint in arm]
        self._place_in = {joint: k for k, joint in enumerate(moving)}
        self._values = self._standing({index[name]: value for name, value in values.items()})
        self._disabled = frozenset(self._unjudged())

    def _frame(self, name: str, field: str) -> Any:
        names = [frame.name for frame in self.model.frames]
        demand_known(name, names, field, f"a frame of the URDF ({', '.join(names)})")
        return self.model.frames[names.index(name)]

    def _ordered(self, arms: list[set[int]]) -> list[list[int]]:
        """Order the joints of each arm: behind what carries them, and behind what they follow."""
        rules = self._rules.items()
        arms = [
            arm | {j for j, (source, rate, _) in rules if source in arm and rate} for arm in arms
        ]
        needs = {}
        for joint in (everything := set[int]().union(*arms)):
            above = {
                *self.model.supports[self.model.parents[joint]],
                *self._rules.get(joint, ())[:1],
            }
            needs[joint] = above & everything
        added: list[int] = []
        orders = []
        for k, arm in enumerate(arms):
            left, begin = sorted(arm), len(added)
            while left:
                ready = [joint for joint in left if needs[joint].issubset(added)]
                if not ready:
                    name = self.model.names[left[0]]
                    must = "groups in an order in which none hangs on a later one"
                    raise SettingError("robot.groups", must, f"'{name}' in number {k + 1}")
                # one at a time: an arm without followers keeps Pinocchio's order
                added.append(ready[0])
                left.remove(ready[0])
            orders.append(added[begin:])
        return orders

    def _standing(self, given: dict[int, float]) -> dict[int, float]:
        """Return the values of the joints that stand [rad, m]."""
        model, values = self.model, {0: 0.0}
        for joint in range(1, model.njoints):
            if joint in self._place_in or joint in self._rules:
                continue
            low, high = (
                float(limits[model.idx_qs[joint]])
                for limits in (model.lowerPositionLimit, model.upperPositionLimit)
            )
            values[joint] = min(max(0.0, low), high)
            if joint in given:
                unit = self._unit(joint)
                values[joint] = given[joint] * unit
                slack = 1e-9 * max(1.0, abs(values[joint]))
                if not low - slack <= values[joint] <= high + slack:
                    must = f"within the joint's limits [{low / unit:g}, {high / unit:g}]"
                    raise SettingError(f"robot.fixed.{model.names[joint]}", must, given[joint])
        for joint, (source, multiplier, offset) in self._rules.items():
            if joint not in self._place_in:
                values[joint] = (multiplier * values[source] if multiplier else 0.0) + offset
        return values

    def _unit(self, joint: int) -> float:
        """Return the unit of a joint's values in settings: a degree, or 1 for lengths."""
        return 1.0 if own_axis(self.model, joint)[1] else DEGREE

    def _carriers(self, first: int) -> list[tuple[int, Any]]:
        """Return the robot's joint that carries each joint's frame, and its `pin.SE3` there.

        The root's come first; `first` is the index of the robot's first joint out of this URDF.
        """
        carriers = [(0, self.base)]
        for joint in range(1, self.model.njoints):
            if joint in self._place_in:
                carriers.append((first + self._place_in[joint], pin.SE3.Identity()))
                continue
            carrier, frame = carriers[self.model.parents[joint]]
            motion = _motion(self.model, joint, self._values[joint])
            carriers.append((carrier, frame * self.model.jointPlacements[joint] * motion))
        return carriers

    def _arm_of(self, joint: int) -> int:
        """Return the arm that moves a joint of the URDF, the first one of what stands still."""
        above = reversed(self.model.supports[joint])
        return next((k for j in above for k, arm in enumerate(self.order) if j in arm), 0)

    def _unjudged(self) -> set[frozenset[str]]:
        """Return the pairs of bodies that the SRDF disables, or of arms that meet at a joint."""
        names: dict[str, list[str]] = {}
        for name, link in zip(self.names, self._links, strict=True):
            names.setdefault(link, []).append(name)
        disabled = self._srdf.disabled if self._srdf else []
        pairs = {
            frozenset((a, b))
            for one, two in disabled
            for a in names.get(one, ())
            for b in names.get(two, ())
        }
        carriers = self._carriers(1)
        above = {0: -1}  # joint of the robot → the one that carries it
        for joint, place in self._place_in.items():
            above[1 + place] = carriers[self.model.parents[joint]][0]
        bodies = [
            (name, self._arm_of(body.parentJoint), carriers[body.parentJoint][0])
            for name, body in zip(self.names, self.bodies, strict=True)
        ]
        for k, (name, arm, joint) in enumerate(bodies if len(self.order) > 1 else ()):
            for other, other_arm, by in bodies[k + 1 :]:
                if arm != other_arm and (joint == by or above[joint] == by or above[by] == joint):
                    pairs.add(frozenset((name, other)))
        return pairs

    def link_frames(self) -> LinkFrames:
        """Return the frames of the links: of those that stand still with their poses."""
        links = [frame for frame in self.model.frames if frame.type == pin.FrameType.BODY]
        poses = [(str(f.name), self.base * f.placement) for f in links if not f.parentJoint]
        standing = tuple(
            (name, tuple(pose_of(pose.rotation, pose.translation).tolist())) for name, pose in poses
        )
        moving = frozenset(str(link.name) for link in links if link.parentJoint)
        ground = self._srdf.ground if self._srdf else ""
        return LinkFrames(str(links[0].name), standing, moving, ground)

    def arms(self) -> tuple[AppendArm, ...]:
        """Return the arms, the first with all that stands still."""
        return tuple(partial(self._append_arm, index) for index in range(len(self.order)))

    def _append_arm(self, index: int, model: Any, arm: int) -> ArmParts:
        """Add the joints of an arm to a model.

        A link is the line from a joint to one behind it, the last to the tool.
        """
        own = self.model
        demand(self.bodies, PATH, "a URDF with collision bodies", None)
        # the place of the tree's first joint in the robot
        first = model.njoints - sum(len(joints) for joints in self.order[:index])
        carriers, links = self._carriers(first), []
        for joint in self.order[index]:
            carrier, frame = carriers[own.parents[joint]]
            place = frame * own.jointPlacements[joint]
            name = f"arm_{arm}_{own.names[joint]}"
            added = model.addJoint(carrier, own.joints[joint], place, name)
            q, into = own.idx_qs[joint], model.idx_qs[added]
            model.lowerPositionLimit[into] = own.lowerPositionLimit[q]
            model.upperPositionLimit[into] = own.upperPositionLimit[q]
            model.velocityLimit[model.idx_vs[added]] = own.velocityLimit[own.idx_vs[joint]]
            start = np.zeros(3) if carrier else np.array(self.base.translation)
            links.append(Link(arm, carrier, start, np.array(place.translation), 0.0))
        tool = self._tool(index, carriers)
        links.append(Link(arm, tool.joint, np.zeros(3), tool.position, 0.0))
        bodies = [
            pin.GeometryObject(name, carrier, 0, frame * body.placement, body.geometry)
            for name, body in zip(self.names, self.bodies, strict=True)
            for carrier, frame in [carriers[body.parentJoint]]
            if self._arm_of(body.parentJoint) == index
        ]
        followers = tuple(
            (carriers[source][0], carriers[joint][0], multiplier, offset)
            for joint in self.order[index]
            if joint in self._rules
            for source, multiplier, offset in [self._rules[joint]]
        )
        links = [link for link in links if not np.array_equal(link.start, link.end)]
        free = [joint for joint in self.order[index] if joint not in self._rules]
        states = ArmStates(
            tuple(str(own.names[joint]) for joint in free),
            tuple(map(self._unit, free)),
            self._srdf.states() if self._srdf else {},
        )
        return ArmParts(links, bodies, tool, self._disabled, followers, states, has_names=True)

    def _tool(self, arm: int, carriers: list[tuple[int, Any]]) -> Tool:
        name, field = self.tips[arm]
        if name:
            frame = self._frame(name, field)
        else:
            joints = set(self.order[arm])
            frames = [
                frame
                for frame in self.model.frames
                if frame.type in (pin.FrameType.BODY, pin.FrameType.FIXED_JOINT)
                and not joints.isdisjoint(self.model.supports[frame.parentJoint])
            ]
            frame = max(frames, key=self._depth)
        carrier, place = carriers[frame.parentJoint]
        demand(carrier, field, "a frame that moves", name)
        place = place * frame.placement
        return Tool(carrier, np.array(place.rotation), np.array(place.translation))

    def _depth(self, frame: Any) -> tuple[int, int]:
        """Return how many moving joints carry a frame, and how many frames."""
        count = sum(joint in self._place_in for joint in self.model.supports[frame.parentJoint])
        steps, index = 0, frame.parentFrame
        while index > 0:
            index, steps = self.model.frames[index].parentFrame, steps + 1
        return count, steps


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
