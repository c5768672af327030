"""A robot out of a user's URDF: its joints, limits and collision bodies, primitives and meshes.

The files are read once, at the door: a configuration holds the hashes of their contents, which
travel with it (`evoexp.attachments`). Where they lay and what they were called is no part of any
identity.
"""

import contextlib
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator

from evoexp import attachments
from evoexp.errors import SettingError, demand, demand_known, nearest
from evoexp.robots.assembly import AppendArm, Assembly, Chain, Point3, assembled
from evoexp.robots.meshes import Decomposition, mesh_pieces, whole_mesh
from evoexp.robots.urdf_arms import UrdfTree
from evoexp.robots.urdf_model import given_spheres, urdf_notes
from evoexp.robots.urdf_reading import (
    LARGEST,
    NUMBER,
    UrdfFile,
    UrdfJoint,
    parsed_xml,
    read_urdf,
    urdf_file,
)
from evoexp.validation import Positive, Settings

ROBOT_DATA = "example-robot-data"  # names of its files begin with this and a colon
MOST_GROUPS = 300  # of an SRDF, nested in one another


class Mesh(Settings):
    """A mesh of a collision body."""

    name: str  # as the URDF names it
    file: attachments.File  # its content
    # the convex pieces in its place, see `mesh_pieces`; None: it stays as it is
    pieces: attachments.File | None = None


def _pairs(value: Any) -> Any:
    return tuple(sorted(value.items())) if isinstance(value, dict) else value


@contextlib.contextmanager
def _named(file: Any) -> Iterator[None]:
    """Add the name of a file to the refusals of what is in it."""
    try:
        yield
    except SettingError as error:
        hint = f"{error.hint}; in {file}"
        raise SettingError(error.field, error.must, error.was, hint) from None


def robot_file(path: Any, field: str) -> Any:
    """Find a file of the package, if a path begins with `example-robot-data:`."""
    if not isinstance(path, str) or not path.startswith(f"{ROBOT_DATA}:"):
        return path
    try:
        package = distribution(ROBOT_DATA)
    except PackageNotFoundError:
        must = f"a file that is there; install {ROBOT_DATA}: pip install 'evoexp[robots]'"
        raise SettingError(field, must, path) from None
    folder = Path(str(package.locate_file(f"cmeel.prefix/share/{ROBOT_DATA}/robots")))
    found = folder / path.removeprefix(f"{ROBOT_DATA}:")
    if ".." not in found.parts and found.is_file():
        return str(found)
    ending = found.suffix.lower()
    names = [str(each.relative_to(folder)) for each in sorted(folder.rglob(f"*{ending}"))]
    hint = nearest(path.removeprefix(f"{ROBOT_DATA}:"), names) if ending else ""
    raise SettingError(field, f"a file of {ROBOT_DATA}", path, hint)


class Srdf:
    """Groups, states and disabled pairs of the robot of a URDF."""

    def __init__(self, content: bytes, joints: dict[str, UrdfJoint]) -> None:
        """Read the text, of the robot that has some joints, by their names."""
        self._root = root = parsed_xml(content, "robot.srdf")
        self._joints = joints
        self._above = {joint.child: joint for joint in joints.values()}
        self._groups = {str(group.get("name")): group for group in root.iterfind("group")}
        # joints of the groups that were looked up: one may be in many others
        self._joints_of: dict[str, set[str]] = {}
        # pairs of links that are never judged
        disabled = root.iterfind("disable_collisions")
        self.disabled = [(str(pair.get("link1")), str(pair.get("link2"))) for pair in disabled]
        # the frame to which a virtual joint ties the root, empty where none does: MoveIt's planning
        # frame is that of a virtual joint that is not fixed (`buildRecursive` in moveit_core's
        # `robot_model.cpp`)
        self._virtual = [joint.get("name") for joint in root.iterfind("virtual_joint")]
        free = (j for j in root.iterfind("virtual_joint") if j.get("type") != "fixed")
        self.ground = next((str(joint.get("parent_frame")) for joint in free), "")

    def tip(self, group: str) -> str:
        """Name the link at the end of a group's only chain, or where a hand is mounted, if any."""
        if group not in self._groups:
            return ""
        chains = self._groups[group].findall("chain")
        if len(chains) == 1:
            return str(chains[0].get("tip_link"))
        hands = [
            str(hand.get("parent_link"))
            for hand in self._root.iterfind("end_effector")
            if hand.get("parent_group") == group
        ]
        return hands[0] if len(hands) == 1 else ""

    def states(self) -> dict[str, dict[str, float]]:
        """Return values of joints [rad, m] by the names of states; of several groups, one state."""
        states: dict[str, dict[str, float]] = {}
        for state in self._root.iterfind("group_state"):
            values = states.setdefault(str(state.get("name")), {})
            for joint in state.iterfind("joint"):
                name, words = str(joint.get("name")), str(joint.get("value")).split()
                if len(words) != 1:
                    continue  # of a joint of several coordinates
                if not NUMBER.fullmatch(words[0]) or abs(float(words[0])) > LARGEST:
                    must = f"an SRDF whose states are finite numbers, at most {LARGEST:g}"
                    raise SettingError("robot.srdf", must, f"'{words[0]}' of '{name}'")
                values[name] = float(words[0])
        return states

    def group_joints(self, group: str, field: str, above: tuple[str, ...] = ()) -> set[str]:
        """Find the joints of a group that lies in those above: of its chains, links and groups."""
        must = f"a group of the SRDF ({', '.join(self._groups) or 'it has none'})"
        demand_known(group, self._groups, field, must)
        is_outside = group not in above and len(above) <= MOST_GROUPS
        demand(is_outside, field, "a group that does not contain itself", group)
        if group in self._joints_of:
            return self._joints_of[group]
        joints: set[str] = set()
        for part in self._groups[group]:
            match part.tag:
                case "chain":
                    joints |= self._chain(str(part.get("base_link")), str(part.get("tip_link")))
                case "joint" if (name := str(part.get("name"))) in self._joints:
                    joints.add(name)
                case "joint" if name not in self._virtual:  # those tie the robot to the world
                    must = f"an SRDF whose group '{group}' names joints of the URDF"
                    raise SettingError("robot.srdf", must, name, nearest(name, list(self._joints)))
                case "link" if (above_it := self._above.get(str(part.get("name")))) is not None:
                    joints.add(above_it.name)
                case "group":
                    joints |= self.group_joints(str(part.get("name")), field, (*above, group))
        self._joints_of[group] = joints
        return joints

    def _chain(self, base: str, tip: str) -> set[str]:
        joints, link = set[str](), tip
        while link != base:
            joint = self._above.get(link)
            if joint is None or joint.name in joints:
                must = "an SRDF whose chains lead from a tip down to a base"
                raise SettingError("robot.srdf", must, f"'{tip}' does not hang on '{base}'")
            joints.add(joint.name)
            link = joint.parent
        return joints


class Urdf(Chain):
    """An arm out of a URDF; in a configuration `path` (and `srdf`) name the files that are read.

    `packages` tells the folders of packages of meshes, by their names.
    """

    urdf: attachments.File  # the URDF
    meshes: tuple[Mesh, ...] = ()  # of its collision bodies
    # names pairs of links that are never judged; None: none are named
    srdf: attachments.File | None = None
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
    fixed: Annotated[tuple[tuple[str, float], ...], BeforeValidator(_pairs)] = ()
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
    spheres: attachments.File | None = None
    # pairs of bodies that need no test, derived when the files are read; None: none are
    pairs: attachments.File | None = None

    @property
    def file(self) -> UrdfFile:
        """The URDF."""
        return urdf_file(self.urdf.content)

    @property
    def semantics(self) -> Srdf | None:
        """The SRDF; None: there is none."""
        return None if self.srdf is None else Srdf(self.srdf.content, self.file.joints)

    @classmethod
    def wants_pairs(cls, settings: dict[str, Any]) -> bool:
        """Whether plain settings are still to be given derived pairs of bodies, as data."""
        return settings.get("pairs") is None and "urdf" in settings

    def build(self) -> Assembly:
        """Return the robot with its derived pairs, given spheres and the frames of its links."""
        tree = UrdfTree(self)
        spheres = None
        if self.spheres:
            rows = given_spheres(self, tree.model, tree.bodies)
            spheres = dict(zip(tree.names, rows, strict=True))
        return assembled(tree.arms())._replace(
            pairs=self.pairs.content if self.pairs else None,
            spheres=spheres,
            frames=tree.link_frames(),
        )

    def chains(self) -> tuple[AppendArm, ...]:
        """Return the arms: one, or one per group."""
        return UrdfTree(self).arms()

    def notes(self) -> list[str]:
        """Remark on what the URDF leaves open: bodies, limits, units."""
        return list(urdf_notes(self))

    @classmethod
    def read_files(cls, settings: dict[str, Any], field: str) -> dict[str, Any]:
        """Return settings with the contents of files in the place of their paths."""
        settings = dict(settings)
        if "path" not in settings:
            return settings
        path = robot_file(settings.pop("path"), f"{field}.path")
        demand(path not in (None, "???"), f"{field}.path", "given: the path of a URDF", None)
        srdf = robot_file(settings.pop("srdf", None), f"{field}.srdf")
        packages = attachments.package_folders(settings.pop("packages", None), f"{field}.packages")
        content = attachments.file_content(path, f"{field}.path")
        file = Path(attachments.located(str(path)))
        with _named(file):
            links = urdf_file(content, f"{field}.path").links
        meshes: dict[str, dict[str, Any]] = {}
        how: Any = settings.get("decomposition")
        bodies = ((link, body.mesh) for link, own in links.items() for body in own)
        for link, name in bodies:
            if name is None or name in meshes:
                continue
            with _named(f"link '{link}' of {file}"):
                data = attachments.mesh_content(name, file, packages, f"{field}.path")
                data = whole_mesh(data, name, f"{field}.path")
            meshes[name] = {"name": name, "file": {attachments.SHA256: attachments.keep(data)}}
            if how in get_args(Decomposition):
                cut = mesh_pieces(data, Path(name).suffix, how, f"{field}.decomposition")
                meshes[name]["pieces"] = {attachments.SHA256: attachments.keep(cut)}
        settings["urdf"] = {attachments.SHA256: attachments.keep(content)}
        if meshes:
            settings["meshes"] = list(meshes.values())
        for name, path, check in (
            ("spheres", settings.pop("spheres", None), read_urdf),
            ("srdf", srdf, parsed_xml),
        ):
            if path is not None:
                content = attachments.file_content(path, f"{field}.{name}")
                with _named(path):
                    check(content, f"{field}.{name}")
                settings[name] = {attachments.SHA256: attachments.keep(content)}
        return settings
