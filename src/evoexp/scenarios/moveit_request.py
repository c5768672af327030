"""A MoveIt motion plan request: the group, the start state, and the goal."""

from typing import NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE
from evoexp.scenarios.moveit_files import MessagePart, Pose, primitive_kind
from evoexp.scenarios.moveit_frames import Frames
from evoexp.scenarios.moveit_scene import read_state

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


def read_request(request: MessagePart) -> Request:
    """Read a motion plan request.

    Raises:
        SettingError: If it holds what evoexp does not know.
    """
    goal, joints = _goal(request), dict[str, float]()
    for constraint in goal["joint_constraints"]:
        name = constraint["joint_name"].text
        if name in joints:
            raise request.refusal("one goal per joint", name)
        joints[name] = constraint["position"].called(f"the goal of '{name}'").number()
    places, turns = list(goal["position_constraints"]), list(goal["orientation_constraints"])
    if joints and (places or turns):
        raise request.refusal("a goal of joints or of a link", "both")
    if not joints and len(places) != 1:
        raise request.refusal("a goal of joints, or of one position", f"{len(places)} positions")
    link = places[0]["link_name"].text if places else ""
    if places and not link:
        raise request.refusal("a goal of a link (link_name)", link)
    start = read_state(request["start_state"])
    return Request(request["group_name"].text, start, joints, link)


def _goal(request: MessagePart) -> MessagePart:
    """Return the only goal."""
    goals = list(request["goal_constraints"])
    if len(goals) != 1:
        raise request.refusal("a request with one goal (goal_constraints)", len(goals))
    return goals[0]


def read_link_goal(request: MessagePart, frames: Frames) -> LinkGoal:
    """Read the goal of a link: a position constraint, and perhaps an orientation constraint.

    Args:
        request: Whose goal is a link's.
        frames: In which places are given.

    Raises:
        SettingError: If it holds what evoexp does not know.
    """
    goal = _goal(request)
    (place,), turns = goal["position_constraints"], list(goal["orientation_constraints"])
    link, region = place["link_name"].text, place["constraint_region"]
    bodies, poses = list(region["primitives"]), list(region["primitive_poses"])
    if len(bodies) != 1 or len(poses) != 1:
        raise request.refusal(f"one sphere or box around the goal of '{link}'", len(bodies))
    sizes, kind = bodies[0]["dimensions"].numbers(), primitive_kind(bodies[0]["type"].value)
    if (kind, len(sizes)) not in (("box", 3), ("sphere", 1)) or not sizes.min() > 0.0:
        must = f"a sphere or box around the goal of '{link}'"
        raise request.refusal(must, f"{kind} {sizes.tolist()}")
    # the greatest ball in the box: a goal that is met by it is met by the box
    distance = float(sizes.min()) * (0.5 if kind == "box" else 1.0)
    frame = frames.of_header(place.called(f"the goal of '{link}'"))
    pose, angle = frame.times(poses[0].pose), None
    shift = place["target_point_offset"]
    offset = shift.point if shift else np.zeros(3)
    if len(turns) > 1:
        raise request.refusal(f"one orientation of '{link}'", len(turns))
    if turns:
        angle, pose = _orientation(turns[0], link, pose, frames)
    elif offset.any():
        must = f"a goal of '{link}' without target_point_offset, or with an orientation"
        raise request.refusal(must, offset.tolist())
    return LinkGoal(link, pose._replace(position=pose.of_point(-offset)), distance, angle)


def _orientation(
    turn: MessagePart, link: str, pose: Pose, frames: Frames
) -> tuple[float | None, Pose]:
    """Return the tolerance [deg] of an orientation, and the pose with it."""
    if turn["link_name"].text != link:
        must = f"an orientation of '{link}', whose position is the goal"
        raise turn.refusal(must, turn["link_name"].text)
    turned = frames.of_header(turn.called(f"the orientation of '{link}'")).times(turn.pose)
    least = min(turn[f"absolute_{axis}_axis_tolerance"].number(0.0) for axis in "xyz")
    if not least > 0.0:
        raise turn.refusal(f"tolerances above 0 of '{link}'", least)
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
