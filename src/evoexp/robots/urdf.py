"""A robot out of a user's URDF: its joints, limits and collision bodies, primitives and meshes.

The files are read once, at the door: a configuration holds the hashes of their contents, which
travel with it (`evoexp.attachments`). Where they lay and what they were called is no part of any
identity.
"""

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

import numpy as np
import pinocchio as pin
from pydantic import BeforeValidator

from evoexp.attachments import SHA256, File, keep, located
from evoexp.errors import SettingError, nearest
from evoexp.mesh_files import MESHES, mesh_content, package_folders
from evoexp.records import FloatArray
from evoexp.robots.assembly import Arm, ArmStates, Assembly, Chain, LinkFrames
from evoexp.robots.bodies import Point3, placed
from evoexp.robots.given_spheres import spheres_of_bodies, with_spheres
from evoexp.robots.joint_choice import JointRoles, joint_roles, standing_values
from evoexp.robots.mesh_checks import whole_mesh
from evoexp.robots.mesh_pieces import (
    Decomposition,
    in_pieces,
    mesh_key,
    mesh_pieces,
    read_pieces,
)
from evoexp.robots.poses import pose_of
from evoexp.robots.robot_data import robot_file
from evoexp.robots.srdf import Srdf
from evoexp.robots.urdf_arms import UrdfArm, UrdfTree, body_names
from evoexp.robots.urdf_bodies import built_bodies
from evoexp.robots.urdf_notes import check_room, urdf_notes
from evoexp.robots.urdf_reading import UrdfFile, read_urdf, urdf_file
from evoexp.robots.urdf_rewriting import JointRules, plain_urdf
from evoexp.robots.urdf_text import file_content, parsed_xml
from evoexp.validation import Positive, Settings

MESH = "collision/geometry/mesh"  # of a link
SPHERES = "robot.spheres"


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
        return str(self._file.root.get("name", ""))

    def build(self) -> Assembly:
        """Return the robot with its derived pairs, given spheres and the frames of its links."""
        pairs = self.pairs.content if self.pairs else None
        found = super().build()._replace(pairs=pairs, frames=self._link_frames())
        return found if self.spheres is None else found._replace(spheres=self._given_spheres())

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
        srdf = robot_file(settings.pop("srdf", None), f"{field}.srdf")
        packages = package_folders(settings.pop("packages", None), f"{field}.packages")
        content = file_content(path, f"{field}.path")
        file = Path(located(str(path)))
        with _named(file):
            root = urdf_file(content, f"{field}.path").root
        found: dict[str, bytes] = {}
        for link in root.iterfind("link"):
            for name in (mesh.get("filename") for mesh in link.iterfind(MESH)):
                if name not in found:
                    with _named(f"link '{link.get('name')}' of {file}"):
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

    def chains(self) -> tuple[Arm, ...]:
        """Return the arms: one, or one per group."""
        roles, model = self._roles(), self._model()
        check_room(self._file, roles, "robot.path")
        values, tips = standing_values(self.fixed, self._file.joints, roles), self._tips(roles.tips)
        bodies, base = self._geometry(model), self._base(model)
        tree = UrdfTree(model, bodies, base, roles, values, tips, self._srdf)
        return tuple(UrdfArm(tree, k) for k in range(len(roles.arms)))

    def states(self) -> tuple[ArmStates, ...]:
        """Return the named states of each arm."""
        return tuple(own for chain in self.chains() for own in chain.states())

    def notes(self) -> list[str]:
        """Remark on what the URDF leaves open: bodies, limits, units."""
        meshes = {mesh.name: mesh.file.content for mesh in self.meshes}
        return list(urdf_notes(self._file, self._roles(), self._rules, meshes))

    @property
    def _file(self) -> UrdfFile:
        return urdf_file(self.urdf.content)

    @property
    def _srdf(self) -> Srdf | None:
        return None if self.srdf is None else Srdf(self.srdf.content, self._file.joints)

    @property
    def _rules(self) -> JointRules:
        return JointRules(self.continuous_turns, self.turn_limit, self.slide_limit, self.base)

    def _roles(self) -> JointRoles:
        groups, joints = self.groups or ((self.group,) if self.group else ()), self._file.joints
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

    def _link_frames(self) -> LinkFrames:
        model = self._model()
        base = self._base(model)
        links = [frame for frame in model.frames if frame.type == pin.FrameType.BODY]
        poses = [(str(link.name), base * link.placement) for link in links if not link.parentJoint]
        standing = tuple(
            (name, tuple(pose_of(pose.rotation, pose.translation).tolist())) for name, pose in poses
        )
        moving = frozenset(str(link.name) for link in links if link.parentJoint)
        ground = "" if self._srdf is None else self._srdf.ground()
        return LinkFrames(str(links[0].name), standing, moving, ground)

    def _model(self) -> Any:
        try:
            return pin.buildModelFromXML(plain_urdf(self._file.root, self._rules))
        except (ValueError, RuntimeError) as error:
            reason = str(error).strip().splitlines()[0]
            raise SettingError("robot.path", "a URDF that Pinocchio reads", reason) from None

    def _geometry(self, model: Any) -> Any:
        with tempfile.TemporaryDirectory() as directory:
            places = {}
            for k, mesh in enumerate(self.meshes):
                ending = Path(mesh.name).suffix.lower()
                if ending not in MESHES:
                    must = f"a name that ends in {', '.join(MESHES)}"
                    raise SettingError(f"robot.meshes[{k}].name", must, mesh.name)
                places[mesh.name] = Path(directory) / f"mesh_{k}{ending}"
                places[mesh.name].write_bytes(mesh.file.content)
            bodies = built_bodies(model, self._file.root, self._rules, places, "robot.path")
        return bodies if self.decomposition is None else self._in_pieces(bodies, places)

    def _given_spheres(self) -> dict[str, FloatArray]:
        """Return the given spheres of each body by its name: middles in its frame, and radii."""
        assert self.spheres is not None
        model = self._model()
        root = with_spheres(self._file.root, read_urdf(self.spheres.content, SPHERES), SPHERES)
        spheres = built_bodies(model, root, self._rules, {}, SPHERES)
        bodies = list(self._geometry(model).geometryObjects)
        found = spheres_of_bodies(bodies, list(spheres.geometryObjects))
        return dict(zip(body_names(bodies), found, strict=True))

    def _in_pieces(self, geometry: Any, places: dict[str, Path]) -> Any:
        """Return collision bodies with the pieces of meshes in their place.

        Args:
            geometry: The bodies, a `pin.GeometryModel`.
            places: Name of each mesh → the path from which it was read.
        """
        files = {str(places[mesh.name]): mesh.pieces for mesh in self.meshes}
        shapes = {}
        for item in geometry.geometryObjects:
            if item.meshPath not in files:
                continue
            pieces, scale = files[item.meshPath], np.array(item.meshScale).ravel()
            if pieces is None:
                raise SettingError("robot.meshes", "given with their pieces", None)
            shapes[mesh_key(item)] = read_pieces(pieces.content, scale, "robot.meshes")
        return in_pieces(geometry, shapes)

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
