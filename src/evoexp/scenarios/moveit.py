"""A task that MoveIt wrote: a planning scene, and a motion plan request in it, as YAML.

The files are read at the door and travel with the condition as contents. `arm_motion` and
`posture_task` say the same task in the words of the planners: from a configuration to another one,
or to a pose of the tool.
"""

import functools
import re
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from evoexp.attachments import SHA256, File, keep, located
from evoexp.errors import SettingError, nearest
from evoexp.input_files import read_bounded
from evoexp.numeric.elementary import DEGREE
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.scenarios.arm_motion import ArmMotion
from evoexp.scenarios.moveit_files import MAX_SCENE, Pose
from evoexp.scenarios.moveit_request import LinkGoal, Request, read_request, state_of
from evoexp.scenarios.moveit_scene import World, read_world
from evoexp.validation import Component, NonNegative, Positive

if TYPE_CHECKING:
    from evoexp.scenarios.posture_task import PostureTask

FILES = ("scene", "request")
UP = (0.0, 0.0, 1.0)  # as MoveIt's planning frames have it


class Joints(NamedTuple):
    """The joints of a robot that move.

    Attributes:
        names: In the order of q.
        slides: (nq,) whether each slides.
        slices: (arms, 2) of q.
    """

    names: tuple[str, ...]
    slides: BoolArray
    slices: IntArray

    def typed(self, q: FloatArray) -> FloatArray:
        """Return q (nq,) [rad, m] as scenarios give it [deg, m]."""
        return np.where(self.slides, q, q / DEGREE)


class MoveitTask(Component):
    """A planning scene and a request; in a configuration both are paths of YAML files.

    Attributes:
        scene: A `moveit_msgs/PlanningScene`.
        request: A `moveit_msgs/MotionPlanRequest`.
        security_margin: Clearance between bodies that the task requires [m].
        position_tolerance: Of the tool at a goal of joints, for planners that end at poses [m].
        angle_tolerance: The same of its orientation [deg].
    """

    component: ClassVar[str] = "moveit"
    length_unit: ClassVar[str] = "m"

    scene: File
    request: File
    security_margin: NonNegative
    position_tolerance: Positive
    angle_tolerance: Positive

    @classmethod
    def read_files(cls, settings: dict[str, Any], field: str) -> dict[str, Any]:
        """Return settings with the contents of files in the place of their paths.

        Raises:
            SettingError: If a file cannot be read, or is not what it should be.
        """
        settings = dict(settings)
        for name in FILES:
            path = settings.get(name)
            if isinstance(path, str | None):
                if path in (None, "???"):
                    must = f"given: the path of MoveIt's planning {name} (YAML)"
                    raise SettingError(f"{field}.{name}", must, None)
                settings[name] = {SHA256: keep(_content(path, f"{field}.{name}"))}
        return settings

    @property
    def world(self) -> World:
        """The scene, read."""
        return _world(self.scene.content)

    @property
    def plan_request(self) -> Request:
        """The request, read."""
        return _request(self.request.content, self.scene.content)

    @property
    def state(self) -> dict[str, float]:
        """Joint names → positions at the start [rad, m]; the request's come before the scene's."""
        return self.world.state | self.plan_request.start

    def disabled(
        self, bodies: tuple[str, ...], given: frozenset[frozenset[str]]
    ) -> frozenset[frozenset[str]]:
        """Return the pairs of a robot's bodies that are never judged.

        Args:
            bodies: Their names: the links', numbered where a link has several.
            given: Pairs that the robot itself names; the scene's matrix has the last word.
        """
        allowed = self.world.allowed
        links = [_link(name, allowed.names) for name in bodies]
        found = set(given)
        for a, one in enumerate(bodies):
            for b, two in enumerate(bodies[:a]):
                known = allowed.may_touch(links[a], links[b])
                pair = frozenset((one, two))
                if known is not None and links[a] != links[b]:
                    (found.add if known else found.discard)(pair)
        return frozenset(found)

    def touching(self, bodies: tuple[str, ...]) -> tuple[tuple[int, int], ...]:
        """Return the pairs (body, obstacle) that may touch."""
        world = self.world
        links = [_link(name, world.allowed.names) for name in bodies]
        return tuple(
            (k, n)
            for k, link in enumerate(links)
            for n, name in enumerate(world.objects)
            if world.allowed.may_touch(link, name)
        )

    def arm_motion(self, joints: Joints) -> ArmMotion:
        """Return the task as a motion from a configuration to another.

        Raises:
            SettingError: If the goal is a pose, or is silent about a joint.
        """
        q_goal = self.goal_configuration(joints)
        if q_goal is None:
            must = "a goal of joints for this planner (posture_es plans to poses)"
            link = self.plan_request.link_goal
            raise SettingError("scenario.request", must, f"a pose of '{link and link.link}'")
        ends = [joints.typed(q) for q in (state_of(joints.names, self.state), q_goal)]
        start, end = (
            tuple(tuple(float(value) for value in q[a:b]) for a, b in joints.slices) for q in ends
        )
        return ArmMotion(
            q_start=start,
            q_goal=end,
            security_margin=self.security_margin,
            length_unit=self.length_unit,
            obstacles=self.world.obstacles,
        )

    def goal_configuration(self, joints: Joints) -> FloatArray | None:
        """Return the goal (nq,) [rad, m]; None: it is a pose.

        Raises:
            SettingError: If it names a joint that does not move, or is silent about one that does
                and has no start.
        """
        goal = self.plan_request.joint_goal
        for name in goal:
            if name not in joints.names:
                must = f"a goal for joints that move ({', '.join(joints.names)})"
                hint = nearest(name, joints.names)
                raise SettingError("scenario.request", must, name, hint)
        return state_of(joints.names, goal, self.state) if goal else None

    def posture_task(self, joints: Joints, tool_at_goal: Pose | None) -> "PostureTask":
        """Return the task as one of reaching a pose.

        Args:
            joints: Of the robot.
            tool_at_goal: The tool's pose in the goal's configuration; None: the goal is a pose.
        """
        from evoexp.scenarios.posture_task import Phase, PointGoal, PoseGoal, PostureTask

        if tool_at_goal is not None:
            link = LinkGoal("", tool_at_goal, self.position_tolerance, self.angle_tolerance)
        else:
            given = self.plan_request.link_goal
            assert given is not None
            link = given
        start = joints.typed(state_of(joints.names, self.state))
        x, y, z = (float(value) for value in link.pose.position)
        goal: PoseGoal | PointGoal = PointGoal(kind="point", point=(x, y, z))
        if link.angle is not None:
            goal = PoseGoal(kind="pose", point=(x, y, z), rotation=link.pose.angles)
        # a goal that is a point only is rated without the term of the orientation
        terms = () if link.angle is not None else ("goal_distance", "limit_margin", "collision")
        return PostureTask(
            q_start=tuple(float(value) for value in start),
            phases=(Phase(name="goal", goal=goal, terms=terms),),
            subgoals=(),
            position_tolerance=link.distance,
            angle_tolerance=self.angle_tolerance if link.angle is None else link.angle,
            up=UP,
            security_margin=self.security_margin,
            length_unit=self.length_unit,
            check_reach=True,
            obstacles=self.world.obstacles,
        )


@functools.lru_cache(maxsize=64)
def _world(content: bytes) -> World:
    return read_world(content)


@functools.lru_cache(maxsize=64)
def _request(content: bytes, scene: bytes) -> Request:
    return read_request(content, _world(scene).frames)


def _content(path: str, field: str) -> bytes:
    try:
        return read_bounded(located(path), MAX_SCENE)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SettingError(field, f"a file that can be read ({reason})", path) from None


def _link(body: str, named: set[str]) -> str:
    """Return the link of a body: its name, without a number that tells bodies of a link apart."""
    return body if body in named else re.sub(r"_\d+$", "", body)
