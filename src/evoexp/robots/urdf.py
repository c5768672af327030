"""A robot out of a user's URDF: its joints, limits and collision bodies, primitives and meshes.

The files are read once, at the door: a configuration holds the hashes of their contents, which
travel with it (`evoexp.attachments`). Where they lay and what they were called is no part of any
identity.
"""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

import numpy as np
from pydantic import BeforeValidator

from evoexp.attachments import SHA256, File, file_content, keep, located
from evoexp.errors import SettingError, nearest
from evoexp.mesh_files import mesh_content, package_folders
from evoexp.records import FloatArray
from evoexp.robots.assembly import Arm, ArmStates, Assembly, Chain, Robot, assembled
from evoexp.robots.bodies import Point3, placed
from evoexp.robots.joint_choice import JointRoles, joint_roles, standing_values
from evoexp.robots.mesh_checks import mesh_shape, whole_mesh
from evoexp.robots.mesh_pieces import Decomposition, mesh_pieces, read_pieces
from evoexp.robots.robot_data import robot_file
from evoexp.robots.srdf import Srdf
from evoexp.robots.urdf_arms import UrdfArm, UrdfTree
from evoexp.robots.urdf_model import (
    JointRules,
    placed_bodies,
    primitive_shape,
    spheres_of_bodies,
    urdf_model,
)
from evoexp.robots.urdf_notes import check_room, urdf_notes
from evoexp.robots.urdf_reading import UrdfBody, UrdfFile, read_urdf, urdf_file
from evoexp.robots.xml_files import parsed_xml
from evoexp.validation import Positive, Settings

PATH, SPHERES = "robot.path", "robot.spheres"  # settings, as errors name them


class Mesh(Settings):
    """A mesh of a collision body."""

    name: str  # as the URDF names it
    file: File  # its content
    # the convex pieces in its place, see `mesh_pieces`; None: it stays as it is
    pieces: File | None = None


@contextlib.contextmanager
def _named(file: Any) -> Iterator[None]:
    """Add the name of a file to the refusals of what is in it."""
    try:
        yield
    except SettingError as error:
        hint = f"{error.hint}; in {file}"
        raise SettingError(error.field, error.must, error.was, hint) from None


def _pairs(value: Any) -> Any:
    """Turn a mapping of names to values into pairs in the order of the names."""
    return tuple(sorted(value.items())) if isinstance(value, dict) else value


StandingValues = Annotated[tuple[tuple[str, float], ...], BeforeValidator(_pairs)]


class Urdf(Chain):
    """An arm out of a URDF; in a configuration `path` (and `srdf`) name the files that are read.

    `packages` tells the folders of packages of meshes, by their names.
    """

    component: ClassVar[str] = "urdf"

    urdf: File  # the URDF
    meshes: tuple[Mesh, ...] = ()  # of its collision bodies
    srdf: File | None = None  # names pairs of links that are never judged; None: none are named
    # the link, fixed to the ground, whose frame stands at the base; empty: the root
    base_frame: str = ""
    base_position: Point3 = (0.0, 0.0, 0.0)  # where the base stands in the world [m]
    base_rotation: Point3 = (0.0, 0.0, 0.0)  # its roll, pitch, yaw [deg]
    # the link or joint whose frame is the tool's; empty: the tip of the group, or the link
    # farthest down the tree
    tool_frame: str = ""
    joints: tuple[str, ...] = ()  # names of those that move; empty: those of the group, or all
    group: str = ""  # the SRDF's group whose joints move; empty: none
    # the SRDF's groups that are an arm each, the first with all that stands still
    groups: tuple[str, ...] = ()
    # the tool's frame of each of these arms; empty: the tips of the groups
    tool_frames: tuple[str, ...] = ()
    # values of joints that stand still [deg, m]; of others 0, or the limit nearest to it
    fixed: StandingValues = ()
    continuous_turns: Positive = 1.0  # how far a continuous joint turns to either side [turns]
    # how far a turning joint does whose limits the URDF does not give [deg]
    turn_limit: Positive = 180.0
    slide_limit: Positive = 1.0  # how far a sliding joint moves to either side, then [m]
    # whether planar and floating joints stand still (fixed) or move (free); or the whole
    # robot moves, as by a planar or floating joint below its root
    base: Literal["fixed", "free", "planar", "floating"] = "fixed"
    # whether meshes are replaced by convex pieces that contain them: by CoACD, or by the
    # convex hull of each; None: they stay as they are
    decomposition: Decomposition | None = None
    # A URDF of spheres, link by link, that cover the bodies in a search; they need not
    # contain them. None: covers are found
    spheres: File | None = None
    # pairs of bodies that need no test, derived when the files are read; None: none are
    pairs: File | None = None

    @classmethod
    def wants_pairs(cls, settings: dict[str, Any]) -> bool:
        """Whether pairs are still to be derived."""
        return settings.get("pairs") is None and "urdf" in settings

    @property
    def robot_name(self) -> str:
        """The robot's name in the URDF."""
        return self.file.name

    def build(self) -> Assembly:
        """Return the robot with its derived pairs, given spheres and the frames of its links."""
        tree = self._tree()
        return assembled(_arms(tree))._replace(
            pairs=self.pairs.content if self.pairs else None,
            spheres=self._given_spheres(tree) if self.spheres else None,
            frames=tree.link_frames(),
        )

    def chains(self) -> tuple[Arm, ...]:
        """Return the arms: one, or one per group."""
        return _arms(self._tree())

    def states(self) -> tuple[ArmStates, ...]:
        """Return the named states of each arm."""
        return Robot.states(self)

    def notes(self) -> list[str]:
        """Remark on what the URDF leaves open: bodies, limits, units."""
        meshes = {mesh.name: mesh.file.content for mesh in self.meshes}
        return list(urdf_notes(self.file, self.roles, self._rules, meshes))

    @classmethod
    def read_files(cls, settings: dict[str, Any], field: str) -> dict[str, Any]:
        """Return settings with the contents of files in the place of their paths.

        Raises:
            SettingError: If a file is missing or is no URDF, or a joint is of another kind than
                evoexp's kinematics.
        """
        settings = dict(settings)
        if "path" not in settings:
            return settings
        path = robot_file(settings.pop("path"), f"{field}.path")
        if path in (None, "???"):
            raise SettingError(f"{field}.path", "given: the path of a URDF", None)
        srdf = robot_file(settings.pop("srdf", None), f"{field}.srdf")
        packages = package_folders(settings.pop("packages", None), f"{field}.packages")
        content = file_content(path, f"{field}.path")
        file = Path(located(str(path)))
        with _named(file):
            links = urdf_file(content, f"{field}.path").links
        found: dict[str, bytes] = {}
        for link, bodies in links.items():
            for name in (body.mesh for body in bodies):
                if name is not None and name not in found:
                    with _named(f"link '{link}' of {file}"):
                        data = mesh_content(name, file, packages, f"{field}.path")
                        found[name] = whole_mesh(data, name, f"{field}.path")
        settings["urdf"] = {SHA256: keep(content)}
        if found:
            how: Any = settings.get("decomposition")
            settings["meshes"] = [
                {"name": name, "file": {SHA256: keep(data)}} for name, data in found.items()
            ]
            for mesh, (name, data) in zip(settings["meshes"], found.items(), strict=True):
                if how in get_args(Decomposition):
                    cut = mesh_pieces(data, Path(name).suffix, how, f"{field}.decomposition")
                    mesh["pieces"] = {SHA256: keep(cut)}
        others = {"spheres": settings.pop("spheres", None), "srdf": srdf}
        for name, path in others.items():
            if path is None:
                continue
            content = file_content(path, f"{field}.{name}")
            with _named(path):
                if name == "spheres":
                    read_urdf(content, f"{field}.spheres")
                else:
                    parsed_xml(content, f"{field}.srdf", "robot")
            settings[name] = {SHA256: keep(content)}
        return settings

    @property
    def file(self) -> UrdfFile:
        """The URDF."""
        return urdf_file(self.urdf.content)

    @property
    def _srdf(self) -> Srdf | None:
        return None if self.srdf is None else Srdf(self.srdf.content, self.file.joints)

    @property
    def _rules(self) -> JointRules:
        return JointRules(self.continuous_turns, self.turn_limit, self.slide_limit, self.base)

    @property
    def roles(self) -> JointRoles:
        """The roles of its joints.

        Raises:
            SettingError: If a joint or group is not there, or cannot be chosen.
        """
        groups, joints = self.groups or ((self.group,) if self.group else ()), self.file.joints
        several = bool(self.groups)
        return joint_roles(joints, self._srdf, self.joints, groups, self.base, several=several)

    def _tips(self, found: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
        """Return the frame of each arm's tool, empty if none is named, and the field that chose it.

        Raises:
            SettingError: If there are not as many frames as arms.
        """
        if self.tool_frame and self.groups:
            raise SettingError("robot.tool_frame", "left out beside robot.groups", self.tool_frame)
        if self.tool_frame:
            return ((self.tool_frame, "robot.tool_frame"),)
        if not self.tool_frames:
            return tuple((name, "robot.srdf") for name in found)
        if len(self.tool_frames) != len(self.groups):
            must = f"a frame per group ({len(self.groups)})"
            raise SettingError("robot.tool_frames", must, list(self.tool_frames))
        return tuple((name, f"robot.tool_frames[{k}]") for k, name in enumerate(self.tool_frames))

    def _tree(self) -> UrdfTree:
        """Return the model, the bodies and the roles of the joints."""
        roles = self.roles
        check_room(self.file, roles, PATH)
        values, tips = standing_values(self.fixed, self.file.joints, roles), self._tips(roles.tips)
        model, meshes = urdf_model(self.file, self._rules), enumerate(self.meshes)
        files = {mesh.name: (mesh, f"robot.meshes[{k}]") for k, mesh in meshes}

        def shapes(body: UrdfBody) -> list[Any]:
            if body.mesh is None:
                return [primitive_shape(body)]
            if body.mesh not in files:
                must = "those that the URDF names"
                raise SettingError("robot.meshes", must, f"without '{body.mesh}'")
            mesh, field = files[body.mesh]
            if self.decomposition is None:
                is_hull = body.kind == "convex"
                return [mesh_shape(mesh.file.content, mesh.name, body.sizes, field, hull=is_hull)]
            if mesh.pieces is None:
                raise SettingError("robot.meshes", "given with their pieces", None)
            return read_pieces(mesh.pieces.content, np.array(body.sizes), "robot.meshes")

        bodies = list(placed_bodies(model, self.file.links, shapes, PATH))
        return UrdfTree(model, bodies, self._base(model), roles, values, tips, self._srdf)

    def _given_spheres(self, tree: UrdfTree) -> dict[str, FloatArray]:
        """Return the given spheres of each body by its name: middles in its frame, and radii.

        Raises:
            SettingError: If the file has no spheres, other bodies, or links that the robot has not.
        """
        assert self.spheres is not None
        given = read_urdf(self.spheres.content, SPHERES).links
        for link, bodies in given.items():
            if bodies and link not in self.file.links:
                must = "a URDF whose spheres belong to links of the robot"
                raise SettingError(SPHERES, must, link, nearest(link, list(self.file.links)))
            if any(body.kind != "sphere" for body in bodies):
                raise SettingError(SPHERES, "a URDF of spheres", f"another body of '{link}'")
        if not any(given.values()):
            raise SettingError(SPHERES, "a URDF of spheres", "one without")
        spheres = placed_bodies(tree.model, given, lambda body: [primitive_shape(body)], SPHERES)
        return dict(zip(tree.names, spheres_of_bodies(tree.bodies, list(spheres)), strict=True))

    def _base(self, model: Any) -> Any:
        """Return the `pin.SE3` of the root in the world."""
        base = placed(self.base_position, self.base_rotation)
        if not self.base_frame:
            return base
        names = [frame.name for frame in model.frames]
        if self.base_frame not in names:
            must = f"a frame of the URDF ({', '.join(names)})"
            hint = nearest(self.base_frame, names)
            raise SettingError("robot.base_frame", must, self.base_frame, hint)
        frame = model.frames[names.index(self.base_frame)]
        if frame.parentJoint != 0:
            raise SettingError("robot.base_frame", "a frame that does not move", self.base_frame)
        return base * frame.placement.inverse()


def _arms(tree: UrdfTree) -> tuple[Arm, ...]:
    return tuple(UrdfArm(tree, k) for k in range(len(tree.order)))
