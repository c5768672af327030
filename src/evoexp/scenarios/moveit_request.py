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
        request.require(name not in joints, "one goal per joint", name)
        joints[name] = constraint["position"].called(f"the goal of '{name}'").number()
    places, turns = list(goal["position_constraints"]), list(goal["orientation_constraints"])
    request.require(not joints or not (places or turns), "a goal of joints or of a link", "both")
    must = "a goal of joints, or of one position"
    request.require(joints or len(places) == 1, must, f"{len(places)} positions")
    link = places[0]["link_name"].text if places else ""
    request.require(link or not places, "a goal of a link (link_name)", link)
    start = read_state(request["start_state"])
    return Request(request["group_name"].text, start, joints, link)


def _goal(request: MessagePart) -> MessagePart:
    """Return the only goal."""
    goals = list(request["goal_constraints"])
    must = "a request with one goal (goal_constraints)"
    request.require(len(goals) == 1, must, len(goals))
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
    must = f"one sphere or box around the goal of '{link}'"
    request.require(len(bodies) == len(poses) == 1, must, len(bodies))
    sizes, kind = bodies[0]["dimensions"].numbers(), primitive_kind(bodies[0]["type"].value)
    is_known = (kind, len(sizes)) in (("box", 3), ("sphere", 1)) and sizes.min() > 0.0
    must = f"a sphere or box around the goal of '{link}'"
    request.require(is_known, must, f"{kind} {sizes.tolist()}")
    # the greatest ball in the box: a goal that is met by it is met by the box
    distance = float(sizes.min()) * (0.5 if kind == "box" else 1.0)
    frame = frames.of_header(place.called(f"the goal of '{link}'"))
    pose, angle = frame.times(poses[0].pose), None
    shift = place["target_point_offset"]
    offset = shift.point if shift else np.zeros(3)
    request.require(len(turns) <= 1, f"one orientation of '{link}'", len(turns))
    must = f"a goal of '{link}' without target_point_offset, or with an orientation"
    request.require(turns or not offset.any(), must, offset.tolist())
    if turns:
        angle, pose = _orientation(turns[0], link, pose, frames)
    return LinkGoal(link, pose._replace(position=pose.of_point(-offset)), distance, angle)


def _orientation(
    turn: MessagePart, link: str, pose: Pose, frames: Frames
) -> tuple[float | None, Pose]:
    """Return the tolerance [deg] of an orientation, and the pose with it."""
    must, name = f"an orientation of '{link}', whose position is the goal", turn["link_name"].text
    turn.require(name == link, must, name)
    turned = frames.of_header(turn.called(f"the orientation of '{link}'")).times(turn.pose)
    least = min(turn[f"absolute_{axis}_axis_tolerance"].number(0.0) for axis in "xyz")
    turn.require(least > 0.0, f"tolerances above 0 of '{link}'", least)
    angle = float(least / DEGREE)
    pose = Pose(turned.rotation, pose.position)
    return (angle, pose) if angle < HALF_TURN else (None, pose)


def state_of(names: tuple[str, ...], *states: dict[str, float]) -> np.ndarray:
    """Return the positions of joints, (joints,), from the first state that names each.

    Raises:
        SettingError: If none names one.
    """
    positions = {name: q for state in reversed(states) for name, q in state.items()}
    for name in names:
        if name not in positions:
            known = ", ".join(dict.fromkeys(joint for state in states for joint in state))
            must = f"a start or goal for joint '{name}'"
            raise SettingError("scenario.request", must, f"joints {known or 'none'}")
    return np.array([positions[name] for name in names], dtype=np.float64)
