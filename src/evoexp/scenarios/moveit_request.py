"""A MoveIt motion plan request: the group, the start state, and the goal."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.scenarios.moveit_files import UNKNOWN_OF_REQUEST, Document, Pose
from evoexp.scenarios.moveit_scene import frame_pose, read_state

HALF_TURN = 180.0  # [deg] an orientation within which is any orientation


class LinkGoal(NamedTuple):
    """Where a link shall be.

    Attributes:
        link: Its name.
        pose: In the root frame; of a goal without orientation only the position counts.
        distance: Tolerance [m].
        angle: Tolerance [deg]; None: any orientation will do.
    """

    link: str
    pose: Pose
    distance: float
    angle: float | None


class Request(NamedTuple):
    """A motion plan request.

    Attributes:
        group: The planning group; empty: not given.
        start: Joint names → positions [rad, m].
        joint_goal: Joint names → positions [rad, m]; empty: the goal is a link's.
        link_goal: The link's goal; None: the goal is one of joints.
    """

    group: str
    start: dict[str, float]
    joint_goal: dict[str, float]
    link_goal: LinkGoal | None


def read_request(content: bytes, frames: dict[str, Pose]) -> Request:
    """Read a motion plan request.

    Args:
        content: Of the file.
        frames: Of the scene: frames that do not move → their poses.

    Raises:
        SettingError: If it is none, or holds what evoexp does not know.
    """
    request = Document(content, "scenario.request")
    request.refuse(UNKNOWN_OF_REQUEST)
    goals = request.items(request.root.get("goal_constraints"), "goal_constraints")
    if len(goals) != 1:
        raise SettingError(request.field, "a request with one goal (goal_constraints)", len(goals))
    goal = request.mapping(goals[0], "goal_constraints[0]")
    if request.items(goal.get("visibility_constraints"), "goal_constraints[0]"):
        must = "free of visibility constraints, which evoexp does not know"
        raise SettingError(request.field, must, "goal_constraints[0].visibility_constraints")
    joints: dict[str, float] = {}
    for each in request.items(goal.get("joint_constraints"), "joint_constraints"):
        given = request.mapping(each, "joint_constraints")
        name = str(given.get("joint_name", ""))
        if name in joints:
            raise SettingError(request.field, "one goal per joint", name)
        joints[name] = request.number(given.get("position"), f"the goal of '{name}'")
    places = request.items(goal.get("position_constraints"), "position_constraints")
    turns = request.items(goal.get("orientation_constraints"), "orientation_constraints")
    if joints and (places or turns):
        raise SettingError(request.field, "a goal of joints or of a link", "both")
    if not joints and len(places) != 1:
        must = "a goal of joints, or of one position"
        raise SettingError(request.field, must, f"{len(places)} positions")
    start = read_state(request, request.root.get("start_state"), "start_state")
    link = None if joints else _link_goal(request, places[0], turns, frames)
    return Request(str(request.root.get("group_name") or ""), start, joints, link)


def _link_goal(
    request: Document, place: Any, turns: list[Any], frames: dict[str, Pose]
) -> LinkGoal:
    """Read a position constraint, and an orientation constraint of the same link."""
    given = request.mapping(place, "position_constraints[0]")
    link = str(given.get("link_name", ""))
    region = request.mapping(given.get("constraint_region"), f"constraint_region of '{link}'")
    bodies = request.items(region.get("primitives"), f"constraint_region of '{link}'")
    poses = request.items(region.get("primitive_poses"), f"constraint_region of '{link}'")
    if len(bodies) != 1 or len(poses) != 1:
        must = f"one sphere or box around the goal of '{link}'"
        raise SettingError(request.field, must, len(bodies))
    body = request.mapping(bodies[0], f"constraint_region of '{link}'")
    sizes = request.numbers(body.get("dimensions"), f"constraint_region of '{link}'")
    kind = {1: "box", 2: "sphere"}.get(body.get("type", 0), str(body.get("type")).lower())
    if (kind, len(sizes)) not in (("box", 3), ("sphere", 1)) or not sizes.min() > 0.0:
        must = f"a sphere or box around the goal of '{link}'"
        raise SettingError(request.field, must, f"{kind} {[float(size) for size in sizes]}")
    # the greatest ball in the box: a goal that is met by it is met by the box
    distance = float(sizes.min()) * (0.5 if kind == "box" else 1.0)
    frame = frame_pose(request, given.get("header"), frames)
    pose = frame.times(request.pose(poses[0], f"the goal of '{link}'"))
    offset = request.pose({"position": given.get("target_point_offset")}, f"'{link}'").position
    angle = None
    if len(turns) > 1:
        raise SettingError(request.field, f"one orientation of '{link}'", len(turns))
    if turns:
        angle, pose = _orientation(request, turns[0], link, pose, frames)
    elif offset.any():
        must = f"a goal of '{link}' without target_point_offset, or with an orientation"
        raise SettingError(request.field, must, [float(x) for x in offset])
    return LinkGoal(link, pose._replace(position=pose.of_point(-offset)), distance, angle)


def _orientation(
    request: Document, turn: Any, link: str, pose: Pose, frames: dict[str, Pose]
) -> tuple[float | None, Pose]:
    """Return the tolerance [deg] of an orientation, and the pose with it."""
    given = request.mapping(turn, "orientation_constraints[0]")
    if str(given.get("link_name", "")) != link:
        must = f"an orientation of '{link}', whose position is the goal"
        raise SettingError(request.field, must, str(given.get("link_name")))
    frame = frame_pose(request, given.get("header"), frames)
    turned = frame.times(request.pose({"orientation": given.get("orientation")}, f"'{link}'"))
    names = [f"absolute_{axis}_axis_tolerance" for axis in "xyz"]
    least = min(request.number(given.get(name, 0.0), f"{name} of '{link}'") for name in names)
    if not least > 0.0:
        raise SettingError(request.field, f"tolerances above 0 of '{link}'", least)
    angle = float(least / DEGREE)
    pose = Pose(turned.rotation, pose.position)
    return (angle, pose) if angle < HALF_TURN else (None, pose)


def state_of(names: tuple[str, ...], *states: dict[str, float]) -> np.ndarray:
    """Return the positions of joints, (joints,), from the first state that names each.

    Raises:
        SettingError: If none names one.
    """
    found = []
    for name in names:
        known = [state[name] for state in states if name in state]
        if not known:
            given = ", ".join(dict.fromkeys(each for state in states for each in state))
            must = f"a start or goal for joint '{name}'"
            raise SettingError("scenario.request", must, f"joints {given or 'none'}")
        found.append(known[0])
    return np.array(found, dtype=np.float64)
