"""A task that MoveIt wrote: a planning scene, and a motion plan request in it, as YAML.

The files are read at the door and travel with the condition as contents. `planners.moveit_tasks`
says the same task in the words of the planners: from a configuration to another one, or to a pose
of the tool.
"""

import functools
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from evoexp.attachments import SHA256, File, file_content, keep, located
from evoexp.errors import SettingError, nearest
from evoexp.mesh_files import mesh_content, package_folders
from evoexp.records import FloatArray
from evoexp.scenarios.moveit_files import MessagePart
from evoexp.scenarios.moveit_frames import Frames, has_other_frames
from evoexp.scenarios.moveit_meshes import Mesh, resources
from evoexp.scenarios.moveit_messages import MAX_SCENE, REQUEST, SCENE
from evoexp.scenarios.moveit_request import (
    LinkGoal,
    Request,
    read_link_goal,
    read_request,
    state_of,
)
from evoexp.scenarios.moveit_scene import (
    AllowedPairs,
    World,
    check_robot_place,
    read_allowed,
    read_state,
    read_world,
)
from evoexp.scenarios.moveit_yaml import read_document
from evoexp.validation import Component, NonNegative, Positive, Settings

if TYPE_CHECKING:
    from evoexp.robots.assembly import LinkFrames

FILES = {"scene": SCENE, "request": REQUEST}  # settings → messages
LoadMesh = Callable[[bytes, str, str], Mesh]
"""Reads a mesh out of a file's content, the ending of its name, and a field for errors."""

_paths: dict[str, str] = {}  # SHA-256 of a file → its path as it was given, for messages


class SceneMesh(Settings):
    """A mesh that a scene names by its file."""

    name: str  # as the scene names it
    file: File  # its content


class MoveitTask(Component):
    """A planning scene and a request; in a configuration both are paths of YAML files.

    `packages` tells the folders of packages of meshes, by their names.
    """

    component: ClassVar[str] = "moveit"
    length_unit: ClassVar[str] = "m"

    scene: File  # A `moveit_msgs/PlanningScene`
    request: File  # A `moveit_msgs/MotionPlanRequest`
    security_margin: NonNegative  # clearance between bodies that the task requires [m]
    # of the tool at a goal of joints, for planners that end at poses [m]
    position_tolerance: Positive
    angle_tolerance: Positive  # the same of its orientation [deg]
    meshes: tuple[SceneMesh, ...] = ()  # that the scene names by their files
    # the id of a fixed transform that names its frame; `header` where a scene has other
    # frames than one. Runs before November 2026 took the child's, and are refused
    frame_names: Literal["child", "header"] = "child"

    @classmethod
    def read_files(cls, settings: dict[str, Any], field: str) -> dict[str, Any]:
        """Return settings with the contents of files in the place of their paths.

        Raises:
            SettingError: If a file cannot be read, or is not what it should be.
        """
        settings = dict(settings)
        packages = package_folders(settings.pop("packages", None), f"{field}.packages")
        for name, message in FILES.items():
            path = settings.get(name)
            if not isinstance(path, str | None):
                continue
            if path in (None, "???"):
                must = f"given: the path of MoveIt's planning {name} (YAML)"
                raise SettingError(f"{field}.{name}", must, None)
            content = file_content(path, f"{field}.{name}", MAX_SCENE)
            settings[name] = {SHA256: keep(content)}
            _paths[settings[name][SHA256]] = path
            document = _document(content, f"{field}.{name}: {path}", message)
            if message == SCENE and has_other_frames(document):
                settings["frame_names"] = "header"
            if message == SCENE and (names := resources(document)):
                place, own = Path(located(path)), f"{field}.{name}"
                contents = [mesh_content(mesh, place, packages, own) for mesh in names]
                settings["meshes"] = [
                    {"name": mesh, "file": {SHA256: keep(content)}}
                    for mesh, content in zip(names, contents, strict=True)
                ]
        return settings

    @property
    def allowed(self) -> AllowedPairs:
        """The scene's allowed-collision matrix."""
        return _allowed(self._message("scene"))

    @property
    def plan_request(self) -> Request:
        """The request, but for the places in it."""
        return _request(self._message("request"))

    @property
    def state(self) -> dict[str, float]:
        """Joint names → positions at the start [rad, m]; the request's come before the scene's."""
        return read_state(self._message("scene")["robot_state"]) | self.plan_request.start

    def world(self, links: "LinkFrames | None", load: LoadMesh) -> World:
        """Return the scene's objects.

        Args:
            links: Of the robot; None: they have no names.
            load: Reads meshes that the scene names.

        Raises:
            SettingError: If the scene holds what evoexp does not know, or the robot stands
                elsewhere than its root.
        """
        scene = self._message("scene")
        if self.frame_names == "child" and has_other_frames(scene):
            must = "header, as MoveIt names frames: give the scene again and run it again"
            raise SettingError("scenario.frame_names", must, self.frame_names)
        world = _world(scene, links, self.meshes, load)
        check_robot_place(self._message("request")["start_state"], world.frames)
        return world

    def notes(self, robot: Any) -> tuple[str, ...]:
        """Name the parts of the messages that are left out and may matter.

        Args:
            robot: The robot of the condition.
        """
        name = getattr(robot, "robot_name", "")
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
        return _document(file.content, field, FILES[name])

    def start_configuration(self, joints: tuple[str, ...]) -> FloatArray:
        """Return the start of joints, (nq,) [rad, m].

        Raises:
            SettingError: If the files are silent about one.
        """
        return state_of(joints, self.state)

    def goal_configuration(self, joints: tuple[str, ...]) -> FloatArray | None:
        """Return the goal of the joints that move, (nq,) [rad, m]; None: it is a pose.

        Raises:
            SettingError: If it names a joint that does not move, or is silent about one that does
                and has no start.
        """
        goal = self.plan_request.joint_goal
        for name in goal:
            if name not in joints:
                must = f"a goal for joints that move ({', '.join(joints)})"
                raise SettingError("scenario.request", must, name, nearest(name, joints))
        return state_of(joints, goal, self.state) if goal else None

    def link_goal(self, frames: Frames) -> LinkGoal:
        """Return the goal, a pose of a link.

        Args:
            frames: Of the world.

        Raises:
            SettingError: If it holds what evoexp does not know.
        """
        return read_link_goal(self._message("request"), frames)


_document = functools.lru_cache(maxsize=64)(read_document)
_allowed = functools.lru_cache(maxsize=64)(read_allowed)
_request = functools.lru_cache(maxsize=64)(read_request)


@functools.lru_cache(maxsize=64)
def _world(
    scene: MessagePart, links: "LinkFrames | None", meshes: tuple[SceneMesh, ...], load: LoadMesh
) -> World:
    loaded = {}
    for mesh in meshes:
        field = f"{scene.field}: the mesh '{mesh.name}'"
        loaded[mesh.name] = load(mesh.file.content, Path(mesh.name).suffix, field)
    return read_world(scene, links, loaded)
