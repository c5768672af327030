"""A robot out of a user's URDF: its joints, limits and collision bodies, primitives and meshes.

The files are read once, at the door: a configuration holds the hashes of their contents, which
travel with it (`evoexp.attachments`). Where they lay and what they were called is no part of any
identity.
"""

import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pinocchio as pin

from evoexp.attachments import SHA256, File, keep
from evoexp.errors import SettingError, nearest
from evoexp.input_files import read_bounded
from evoexp.robots.assembly import Chain, Link, Tool
from evoexp.robots.bodies import Point3, placed
from evoexp.validation import Settings

MOST_NESTED, MOST_ELEMENTS = 50, 100_000  # of XML
MOST_LINKS = 300  # and collision bodies: pairs of them are judged
MESHES = (".stl", ".obj", ".dae", ".ply")  # endings: a URDF makes nobody's other files travel
LARGEST = 1e7  # [m, rad] as of the numbers of other robots
SHORTEST = 1e-6  # [-] of an axis
# attributes of places, bodies and limits
NUMERIC = {"xyz", "rpy", "size", "scale", "radius", "length", "lower", "upper"}
MOVING = ("revolute", "prismatic")
MESH = "link/collision/geometry/mesh"


class Mesh(Settings):
    """A mesh of a collision body.

    Attributes:
        name: As the URDF names it.
        file: Its content.
    """

    name: str
    file: File


class Urdf(Chain):
    """An arm out of a URDF; in a configuration `path` (and `srdf`) name the files that are read.

    Attributes:
        urdf: The URDF.
        meshes: Of its collision bodies.
        srdf: Names pairs of links that are never judged; None: none are named.
        base_frame: The link, fixed to the ground, whose frame stands at the base; empty: the root.
        base_position: Where the base stands in the world [m].
        base_rotation: Its roll, pitch, yaw [deg].
        tool_frame: The link or joint whose frame is the tool's; empty: the link farthest down the
            tree.
    """

    component: ClassVar[str] = "urdf"

    urdf: File
    meshes: tuple[Mesh, ...] = ()
    srdf: File | None = None
    base_frame: str = ""
    base_position: Point3 = (0.0, 0.0, 0.0)
    base_rotation: Point3 = (0.0, 0.0, 0.0)
    tool_frame: str = ""

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
        path, srdf = settings.pop("path"), settings.pop("srdf", None)
        content = _content(path, f"{field}.path")
        root = _parsed(content, f"{field}.path", "robot")
        _check_joints(root, f"{field}.path")
        settings["urdf"] = {SHA256: keep(content)}
        names = dict.fromkeys(str(mesh.get("filename")) for mesh in root.iterfind(MESH))
        if names:
            found = {name: _mesh(name, Path(path), f"{field}.path") for name in names}
            settings["meshes"] = [
                {"name": name, "file": {SHA256: keep(data)}} for name, data in found.items()
            ]
        if srdf is not None:
            content = _content(srdf, f"{field}.srdf")
            _parsed(content, f"{field}.srdf", "robot")
            settings["srdf"] = {SHA256: keep(content)}
        return settings

    def append_to(self, model: Any, arm: int) -> list[Link]:
        """Add the joints; a link is the line from a joint to one behind it.

        The last to the tool.
        """
        own, first = self._model(), model.njoints
        base = self._base(own)
        for joint in range(1, own.njoints):
            parent, placement = own.parents[joint], own.jointPlacements[joint]
            before = (0, base * placement) if parent == 0 else (first + parent - 1, placement)
            added = model.addJoint(
                before[0], own.joints[joint], before[1], f"arm_{arm}_{own.names[joint]}"
            )
            index = own.idx_qs[joint]
            model.lowerPositionLimit[model.idx_qs[added]] = own.lowerPositionLimit[index]
            model.upperPositionLimit[model.idx_qs[added]] = own.upperPositionLimit[index]
        links = []
        for joint in range(1, own.njoints):
            parent, end = own.parents[joint], own.jointPlacements[joint].translation
            if parent == 0:
                links.append(
                    Link(
                        arm,
                        0,
                        np.array(base.translation),
                        np.array((base * own.jointPlacements[joint]).translation),
                        0.0,
                    )
                )
            else:
                links.append(Link(arm, first + parent - 1, np.zeros(3), np.array(end), 0.0))
        tool = self.tool(model, first, links)
        links.append(Link(arm, tool.joint, np.zeros(3), tool.position, 0.0))
        return [link for link in links if not np.array_equal(link.start, link.end)]

    def append_bodies(self, model: Any, arm: int, first_joint: int, links: list[Link]) -> list[Any]:
        """Return the collision bodies."""
        own = self._model()
        base = self._base(own)
        items = list(self._geometry(own).geometryObjects)
        stems = [item.name.rpartition("_")[0] for item in items]
        bodies = []
        for item, stem in zip(items, stems, strict=True):
            name = stem if stems.count(stem) == 1 else item.name
            joint = item.parentJoint
            where = (
                (first_joint + joint - 1, item.placement) if joint else (0, base * item.placement)
            )
            bodies.append(pin.GeometryObject(name, where[0], 0, where[1], item.geometry))
        if not bodies:
            raise SettingError("robot.path", "a URDF with collision bodies", None)
        return bodies

    def tool(self, model: Any, first_joint: int, links: list[Link]) -> Tool:
        """Return the tool's frame."""
        own = self._model()
        frames = [
            frame
            for frame in own.frames
            if frame.type in (pin.FrameType.BODY, pin.FrameType.FIXED_JOINT)
        ]
        name = self.tool_frame or max(frames, key=lambda frame: _depth(own, frame)).name
        frame = _frame(own, name, "tool_frame")
        if frame.parentJoint == 0:
            raise SettingError("robot.tool_frame", "a frame that moves", name)
        placement = frame.placement
        joint = first_joint + frame.parentJoint - 1
        return Tool(joint, np.array(placement.rotation), np.array(placement.translation))

    def disabled_pairs(self) -> set[frozenset[str]]:
        """Return pairs of bodies that the SRDF switches off."""
        if self.srdf is None:
            return set()
        root = _parsed(self.srdf.content, "robot.srdf", "robot")
        names = [item.name for item in self._geometry(self._model()).geometryObjects]
        stems = [name.rpartition("_")[0] for name in names]
        of_link: dict[str, set[str]] = {}
        for name, stem in zip(names, stems, strict=True):
            of_link.setdefault(stem, set()).add(stem if stems.count(stem) == 1 else name)
        pairs = [
            (str(pair.get("link1")), str(pair.get("link2")))
            for pair in root.iterfind("disable_collisions")
        ]
        return {
            frozenset((a, b))
            for one, two in pairs
            for a in of_link.get(one, ())
            for b in of_link.get(two, ())
        }

    def _model(self) -> Any:
        try:
            return pin.buildModelFromXML(_plain(self.urdf.content, {}))
        except (ValueError, RuntimeError) as error:
            raise SettingError(
                "robot.path", "a URDF that Pinocchio reads", str(error).strip().splitlines()[0]
            ) from None

    def _geometry(self, model: Any) -> Any:
        with tempfile.TemporaryDirectory() as directory:
            places = {}
            for k, mesh in enumerate(self.meshes):
                ending = Path(mesh.name).suffix.lower()
                if ending not in MESHES:
                    must = f"a name that ends in {', '.join(MESHES)}"
                    raise SettingError(f"robot.meshes[{k}].name", must, mesh.name)
                place = Path(directory) / f"mesh_{k}{ending}"
                place.write_bytes(mesh.file.content)
                places[mesh.name] = str(place)
            try:
                text = _plain(self.urdf.content, places)
                found = pin.buildGeomFromUrdfString(
                    model, text, pin.GeometryType.COLLISION, None, directory
                )
            except (ValueError, RuntimeError) as error:
                raise SettingError(
                    "robot.path",
                    "a URDF whose collision bodies can be read",
                    str(error).strip().splitlines()[0].replace(directory, ""),
                ) from None

        for item in found.geometryObjects:
            item.geometry.computeLocalAABB()
            far = np.abs(item.placement.translation).max() + item.geometry.aabb_radius
            if not 0.0 <= far <= LARGEST:
                must = f"a URDF whose bodies lie within {LARGEST:g} m"
                raise SettingError("robot.path", must, f"'{item.name}' that reaches to {far:.3g}")
        return found

    def _base(self, model: Any) -> Any:
        """Return the `pin.SE3` of the root in the world."""
        base = placed(self.base_position, self.base_rotation)
        if not self.base_frame:
            return base
        frame = _frame(model, self.base_frame, "base_frame")
        if frame.parentJoint != 0:
            raise SettingError("robot.base_frame", "a frame that does not move", self.base_frame)
        return base * frame.placement.inverse()


def _content(path: Any, field: str) -> bytes:
    if path in (None, "???"):
        raise SettingError(field, "given: the path of a URDF", None)
    try:
        return read_bounded(str(path))
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SettingError(field, f"a file that can be read ({reason})", str(path)) from None


def _parsed(content: bytes, field: str, tag: str) -> Any:
    try:
        root = ET.fromstring(content, ET.XMLParser(target=_PlainTree(field)))
    except (ET.ParseError, ValueError, LookupError) as error:
        raise SettingError(field, f"XML with the root <{tag}>", str(error)) from None
    if root.tag != tag:
        raise SettingError(field, f"XML with the root <{tag}>", f"<{root.tag}>")
    return root


class _PlainTree(ET.TreeBuilder):
    """Builds a tree that is neither deep nor large, of a text that declares no entities."""

    def __init__(self, field: str) -> None:
        super().__init__()
        self._field, self._depth, self._count = field, 0, 0

    def doctype(self, name: str, public: str | None, system: str | None) -> None:
        """Refuse document types: their entities unfold to any size, or name other files."""
        raise SettingError(self._field, "XML without a document type", f"<!DOCTYPE {name}>")

    def start(self, tag: str, attributes: Any) -> Any:
        """Open an element."""
        self._depth, self._count = self._depth + 1, self._count + 1
        if self._depth > MOST_NESTED or self._count > MOST_ELEMENTS:
            must = f"XML of at most {MOST_ELEMENTS:,} elements, nested {MOST_NESTED} deep"
            raise SettingError(self._field, must, f"more, at <{tag[:40]}>")
        return super().start(tag, attributes)

    def end(self, tag: str) -> Any:
        """Close an element."""
        self._depth -= 1
        return super().end(tag)


def _check_joints(root: Any, field: str) -> None:
    counts = {"links": "link", "collision bodies": "link/collision"}
    for what, path in counts.items():
        if (count := len(root.findall(path))) > MOST_LINKS:
            raise SettingError(field, f"a URDF of at most {MOST_LINKS} {what}", count)
    for element in root.iter():
        for name in NUMERIC.intersection(element.keys()):
            if not all(map(_is_number, str(element.get(name)).split())):
                must = f"a URDF whose numbers are finite, at most {LARGEST:g}"
                was = f'<{element.tag} {name}="{str(element.get(name))[:40]}"/>'
                raise SettingError(field, must, was)
    for axis in root.iterfind("joint/axis"):
        if not sum(abs(float(word)) for word in str(axis.get("xyz", "1")).split()) > SHORTEST:
            raise SettingError(field, "a URDF whose axes point somewhere", axis.get("xyz"))
    for joint in root.iterfind("joint"):
        kind = joint.get("type")
        if kind not in (*MOVING, "fixed") or joint.find("mimic") is not None:
            what = "mimic" if joint.find("mimic") is not None else kind
            hint = (
                "; a continuous joint can be given limits, as a revolute one"
                if kind == "continuous"
                else ""
            )
            raise SettingError(
                field,
                f"a URDF whose joints are {', '.join(MOVING)} or fixed{hint}",
                f"joint '{joint.get('name')}' of type {what}",
            )


def _is_number(word: str) -> bool:
    """Whether a word is a number that joints and bodies can have."""
    try:
        return abs(float(word)) <= LARGEST
    except ValueError:
        return False


def _mesh(name: str, urdf: Path, field: str) -> bytes:
    """Return the content of a mesh: beside the URDF, or in a package in a directory above it."""
    if name.startswith("package://"):
        rest = name.removeprefix("package://")
        if rest.startswith("/") or ".." in Path(rest).parts:
            raise SettingError(field, "a URDF whose meshes lie in their packages", name)
        tried = [parent / rest for parent in urdf.resolve().parents]
        tried += [parent / rest.partition("/")[2] for parent in urdf.resolve().parents]
    else:
        tried = [urdf.parent / name.removeprefix("file://")]
    for place in tried:
        if "\0" not in name and place.is_file():
            if place.resolve().suffix.lower() not in MESHES:
                must = f"a URDF whose meshes are files that end in {', '.join(MESHES)}"
                raise SettingError(field, must, name)
            return _content(place, field)
    raise SettingError(field, "a URDF whose meshes are there", f"a missing mesh '{name}'")


def _plain(content: bytes, places: dict[str, str]) -> str:
    """Return a URDF without visual elements, with the present paths of its meshes."""
    root = _parsed(content, "robot.urdf", "robot")
    _check_joints(root, "robot.urdf")
    for link in root.iterfind("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
        if not places:
            for collision in link.findall("collision"):
                if collision.find("geometry/mesh") is not None:
                    link.remove(collision)
    for mesh in root.iterfind(MESH):
        if (name := str(mesh.get("filename"))) not in places:
            raise SettingError("robot.meshes", "those that the URDF names", f"without '{name}'")
        mesh.set("filename", places[name])
    return ET.tostring(root, encoding="unicode")


def _frame(model: Any, name: str, field: str) -> Any:
    names = [frame.name for frame in model.frames]
    if name not in names:
        raise SettingError(
            f"robot.{field}",
            f"a frame of the URDF ({', '.join(names)})",
            name,
            nearest(name, names),
        )
    return model.frames[names.index(name)]


def _depth(model: Any, frame: Any) -> tuple[int, int]:
    """Return how many joints carry a frame, and how many frames."""
    joint, count = frame.parentJoint, 0
    while joint > 0:
        joint, count = model.parents[joint], count + 1
    steps, index = 0, frame.parentFrame
    while index > 0:
        index, steps = model.frames[index].parentFrame, steps + 1
    return count, steps
