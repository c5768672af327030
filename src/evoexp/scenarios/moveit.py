"""A task that MoveIt wrote: a planning scene, and a motion plan request in it, as YAML.

The files are read at the door and travel with the condition as contents. `planners.arm_tasks`
says the same task in the words of the planners: from a configuration to another one, or to a pose
of the tool.
"""

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

import numpy as np

from evoexp import attachments
from evoexp.attachments import SHA256, File, file_content, keep, located, mesh_content
from evoexp.errors import SettingError, demand, demand_known
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from evoexp.scenarios import moveit_files, moveit_scene
from evoexp.scenarios.moveit_files import SCENE, MessagePart, Pose, primitive_kind, read_document
from evoexp.scenarios.moveit_scene import Frames, SceneMesh
from evoexp.validation import Component, NonNegative, Positive

if TYPE_CHECKING:
    from evoexp.robots.assembly import LinkFrames

HALF_TURN = 180.0  # [deg] an orientation within which is any orientation
FILES = {"scene": SCENE, "request": moveit_files.REQUEST}  # settings → messages

_paths: dict[str, str] = {}  # SHA-256 of a file → its path as it was given, for messages


class LinkGoal(NamedTuple):
    """Where a link shall be."""

    pose: Pose  # in the root frame; of a goal without orientation only the position counts
    distance: float  # tolerance [m]
    angle: float | None  # tolerance [deg]; None: any orientation will do


class Request(NamedTuple):
    """A motion plan request."""

    group: str  # the planning group; empty: not given
    start: dict[str, float]  # joint names → positions [rad, m]
    joint_goal: dict[str, float]  # joint names → positions [rad, m]; empty: the goal is a link's
    link: str  # the link whose pose is the goal; empty: the goal is one of joints


class MoveitTask(Component):
    """A planning scene and a request; in a configuration both are paths of YAML files.

    `packages` tells the folders of packages of meshes, by their names.
    """

    component: ClassVar[str] = "moveit"
    length_unit: ClassVar[str] = "m"

    scene: File  # A `moveit_msgs/PlanningScene`
    request: File  # A `moveit_msgs/MotionPlanRequest`
    security_margin: NonNegative  # clearance between bodies that the task requires [m]
    # of the tool's position at a goal of joints, for planners that end at poses [m]
    position_tolerance: Positive
    angle_tolerance: Positive  # of its orientation [deg]
    meshes: tuple[SceneMesh, ...] = ()  # that the scene names by their files
    # the id of a fixed transform that names its frame; `header` where a scene has other
    # frames than one. Runs before November 2026 took the child's, and are refused
    frame_names: Literal["child", "header"] = "child"

    @classmethod
    def read_files(cls, settings: dict[str, Any], field: str) -> dict[str, Any]:
        """Return settings with the contents of files in the place of their paths."""
        settings = dict(settings)
        packages = attachments.package_folders(settings.pop("packages", None), f"{field}.packages")
        for name, message in FILES.items():
            path = settings.get(name)
            if not isinstance(path, str | None):
                continue
            if path in (None, "???"):
                must = f"given: the path of MoveIt's planning {name} (YAML)"
                raise SettingError(f"{field}.{name}", must, None)
            content = file_content(path, f"{field}.{name}", moveit_files.MAX_SCENE)
            settings[name] = {SHA256: keep(content)}
            _paths[settings[name][SHA256]] = path
            document = read_document(content, f"{field}.{name}: {path}", message)
            if message == SCENE and moveit_scene.has_other_frames(document):
                settings["frame_names"] = "header"
            # files of meshes, as robowflex names them
            things = document["world"]["collision_objects"] if message == SCENE else ()
            meshes = [mesh["resource"].text for thing in things for mesh in thing["meshes"]]
            files = []
            for mesh in filter(None, dict.fromkeys(meshes)):
                content = mesh_content(mesh, Path(located(path)), packages, f"{field}.{name}")
                files.append({"name": mesh, "file": {SHA256: keep(content)}})
            if files:
                settings["meshes"] = files
        return settings

    @property
    def allowed(self) -> moveit_scene.AllowedPairs:
        """The scene's allowed-collision matrix."""
        return moveit_scene.read_allowed(self._message("scene"))

    @property
    def plan_request(self) -> Request:
        """The request, but for the places in it."""
        return read_request(self._message("request"))

    @property
    def state(self) -> dict[str, float]:
        """Joint names → positions at the start [rad, m]; the request's come before the scene's."""
        scene = moveit_scene.read_state(self._message("scene")["robot_state"])
        return scene | self.plan_request.start

    def world(self, links: "LinkFrames | None", load: moveit_scene.LoadMesh) -> moveit_scene.World:
        """Return the scene's objects, among a robot's links if these have names."""
        scene = self._message("scene")
        if self.frame_names == "child" and moveit_scene.has_other_frames(scene):
            must = "header, as MoveIt names frames: give the scene again and run it again"
            raise SettingError("scenario.frame_names", must, self.frame_names)
        world = moveit_scene.read_world(scene, links, self.meshes, load)
        moveit_scene.check_robot_place(self._message("request")["start_state"], world.frames)
        return world

    def notes(self, robot: Any) -> tuple[str, ...]:
        """Name the parts of the messages that are left out and may matter to a robot."""
        name = robot.file.name if hasattr(robot, "file") else ""
        scene, request = (self._message(name).value for name in FILES)
        notes = []
        if scene.get("is_diff"):
            notes.append("the scene is a change of another (is_diff): it is taken as it is")
        if name and (model := scene.get("robot_model_name") or name) != name:
            notes.append(f"the scene is of the robot '{model}', the robot is '{name}'")
        scaled = ("max_velocity_scaling_factor", "max_acceleration_scaling_factor")
        left = [name for name in scaled if request.get(name) not in (None, 0, 1)]
        left += ["max_cartesian_speed"] if request.get("max_cartesian_speed") else []
        if left:
            notes.append(f"left out of the request: {', '.join(left)} (export has its own limits)")
        return tuple(notes)

    def _message(self, name: str) -> MessagePart:
        file: File = getattr(self, name)
        path = _paths.get(file.sha256)
        field = f"scenario.{name}" if path is None else f"scenario.{name}: {path}"
        return read_document(file.content, field, FILES[name])

    def start_configuration(self, joints: tuple[str, ...]) -> FloatArray:
        """Return the start of joints, (nq,) [rad, m]."""
        return _positions(joints, self.state)

    def goal_configuration(self, joints: tuple[str, ...]) -> FloatArray | None:
        """Return the goal of the joints that move, (nq,) [rad, m]; None: it is a pose."""
        goal = self.plan_request.joint_goal
        for name in goal:
            must = f"a goal for joints that move ({', '.join(joints)})"
            demand_known(name, joints, "scenario.request", must)
        return _positions(joints, goal, self.state) if goal else None

    def link_goal(self, frames: Frames) -> LinkGoal:
        """Return the goal, a pose of a link, given in frames of the world."""
        return read_link_goal(self._message("request"), frames)


def _positions(names: tuple[str, ...], *states: dict[str, float]) -> FloatArray:
    """Return the positions of joints, (joints,), from the first state that names each."""
    positions = {name: q for state in reversed(states) for name, q in state.items()}
    known = ", ".join(dict.fromkeys(joint for state in states for joint in state)) or "none"
    for name in names:
        must = f"a start or goal for joint '{name}'"
        demand(name in positions, "scenario.request", must, f"joints {known}")
    return np.array([positions[name] for name in names], dtype=np.float64)


@functools.lru_cache(maxsize=64)
def read_request(request: MessagePart) -> Request:
    """Read a motion plan request."""
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
    start = moveit_scene.read_state(request["start_state"])
    return Request(request["group_name"].text, start, joints, link)


def _goal(request: MessagePart) -> MessagePart:
    goals = list(request["goal_constraints"])
    must = "a request with one goal (goal_constraints)"
    request.require(len(goals) == 1, must, len(goals))
    return goals[0]


def read_link_goal(request: MessagePart, frames: Frames) -> LinkGoal:
    """Read the goal of a link: a position constraint, and perhaps an orientation constraint."""
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
    for turn in turns:
        must = f"an orientation of '{link}', whose position is the goal"
        turn.require(turn["link_name"].text == link, must, turn["link_name"].text)
        turned = frames.of_header(turn.called(f"the orientation of '{link}'")).times(turn.pose)
        least = min(turn[f"absolute_{axis}_axis_tolerance"].number(0.0) for axis in "xyz")
        turn.require(least > 0.0, f"tolerances above 0 of '{link}'", least)
        pose = Pose(turned.rotation, pose.position)
        angle = least / DEGREE if least / DEGREE < HALF_TURN else None
    return LinkGoal(pose._replace(position=pose.of_point(-offset)), distance, angle)
