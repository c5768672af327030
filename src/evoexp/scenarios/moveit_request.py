"""A MoveIt motion plan request: the group, the start state, and the goal."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.scenarios.moveit_files import Document, Pose, primitive_kind
from evoexp.scenarios.moveit_frames import Frames
from evoexp.scenarios.moveit_scene import check_robot_place, read_state

HALF_TURN = 180.0  # [deg] an orientation within which is any orientation


class LinkGoal(NamedTuple):
    """Where a link shall be."""

    link: str  # its name
    pose: Pose  # in the root frame; of a goal without orientation only the position counts
    distance: float  # tolerance [m]
    angle: float | None  # tolerance [deg]; None: any orientation will do


class Request(NamedTuple):
    """A motion plan request."""

    group: str  # the planning group; empty: not given
    start: dict[str, float]  # joint names → positions [rad, m]
    joint_goal: dict[str, float]  # joint names → positions [rad, m]; empty: the goal is a link's
    link: str  # the link whose pose is the goal; empty: the goal is one of joints


def read_request(request: Document) -> Request:
    """Read a motion plan request.

    Raises:
        SettingError: If it holds what evoexp does not know.
    """
    joints: dict[str, float] = {}
    goal = _goal(request)
    for item in request.items(goal.get("joint_constraints"), "joint_constraints"):
        given = request.mapping(item, "joint_constraints")
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
    link = ""
    if places:
        place = request.mapping(places[0], "position_constraints[0]")
        link = str(place.get("link_name") or "")
        if not link:
            raise SettingError(request.field, "a goal of a link (link_name)", link)
    start = read_state(request, request.root.get("start_state"), "start_state")
    return Request(str(request.root.get("group_name") or ""), start, joints, link)


def _goal(request: Document) -> dict[str, Any]:
    """Return the only goal."""
    goals = request.items(request.root.get("goal_constraints"), "goal_constraints")
    if len(goals) != 1:
        raise SettingError(request.field, "a request with one goal (goal_constraints)", len(goals))
    return request.mapping(goals[0], "goal_constraints[0]")


def read_link_goal(request: Document, frames: Frames) -> LinkGoal:
    """Read the goal of a link: a position constraint, and perhaps an orientation constraint.

    Args:
        request: Whose goal is a link's.
        frames: In which places are given.

    Raises:
        SettingError: If it holds what evoexp does not know.
    """
    goal = _goal(request)
    turns = request.items(goal.get("orientation_constraints"), "orientation_constraints")
    given = request.mapping(goal["position_constraints"][0], "position_constraints[0]")
    link = str(given.get("link_name", ""))
    region = request.mapping(given.get("constraint_region"), f"constraint_region of '{link}'")
    bodies = request.items(region.get("primitives"), f"constraint_region of '{link}'")
    poses = request.items(region.get("primitive_poses"), f"constraint_region of '{link}'")
    if len(bodies) != 1 or len(poses) != 1:
        must = f"one sphere or box around the goal of '{link}'"
        raise SettingError(request.field, must, len(bodies))
    body = request.mapping(bodies[0], f"constraint_region of '{link}'")
    sizes = request.numbers(body.get("dimensions"), f"constraint_region of '{link}'")
    kind = primitive_kind(body.get("type"))
    if (kind, len(sizes)) not in (("box", 3), ("sphere", 1)) or not sizes.min() > 0.0:
        must = f"a sphere or box around the goal of '{link}'"
        raise SettingError(request.field, must, f"{kind} {[float(size) for size in sizes]}")
    # the greatest ball in the box: a goal that is met by it is met by the box
    distance = float(sizes.min()) * (0.5 if kind == "box" else 1.0)
    frame = frames.of_header(request, given.get("header"), f"the goal of '{link}'")
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
    request: Document, turn: Any, link: str, pose: Pose, frames: Frames
) -> tuple[float | None, Pose]:
    """Return the tolerance [deg] of an orientation, and the pose with it."""
    given = request.mapping(turn, "orientation_constraints[0]")
    if str(given.get("link_name", "")) != link:
        must = f"an orientation of '{link}', whose position is the goal"
        raise SettingError(request.field, must, str(given.get("link_name")))
    frame = frames.of_header(request, given.get("header"), f"the orientation of '{link}'")
    turned = frame.times(request.pose({"orientation": given.get("orientation")}, f"'{link}'"))
    names = [f"absolute_{axis}_axis_tolerance" for axis in "xyz"]
    least = min(request.number(given.get(name, 0.0), f"{name} of '{link}'") for name in names)
    if not least > 0.0:
        raise SettingError(request.field, f"tolerances above 0 of '{link}'", least)
    angle = float(least / DEGREE)
    pose = Pose(turned.rotation, pose.position)
    return (angle, pose) if angle < HALF_TURN else (None, pose)


def check_start(request: Document, frames: Frames) -> None:
    """Refuse a start at which the robot stands elsewhere than its root.

    Raises:
        SettingError: If it does.
    """
    check_robot_place(request, request.root.get("start_state"), "start_state", frames)


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
