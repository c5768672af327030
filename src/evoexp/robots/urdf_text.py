"""XML of a URDF or an SRDF: read within bounds, checked, without elements that are not used."""

import xml.etree.ElementTree as ET
from typing import Any

from evoexp.errors import SettingError
from evoexp.input_files import read_bounded

MOST_NESTED, MOST_ELEMENTS = 50, 100_000  # of XML
MOST_LINKS = 300  # and collision bodies: pairs of them are judged
LARGEST = 1e7  # [m, rad] as of the numbers of other robots
SHORTEST = 1e-6  # [-] of an axis
# attributes of places, bodies and limits
NUMERIC = {"xyz", "rpy", "size", "scale", "radius", "length", "lower", "upper"}
MOVING = ("revolute", "prismatic")
MESH = "link/collision/geometry/mesh"


def file_content(path: Any, field: str) -> bytes:
    """Read a file.

    Raises:
        SettingError: If no path is given, or the file cannot be read.
    """
    if path in (None, "???"):
        raise SettingError(field, "given: the path of a URDF", None)
    try:
        return read_bounded(str(path))
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise SettingError(field, f"a file that can be read ({reason})", str(path)) from None


def parsed_xml(content: bytes, field: str, tag: str) -> Any:
    """Read XML; return its root element.

    Args:
        content: The text.
        field: That names it in errors.
        tag: The root's.

    Raises:
        SettingError: If it is no such XML, or one that declares entities or is deep or large.
    """
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


def check_urdf(root: Any, field: str) -> None:
    """Check numbers, axes, kinds of joints and how many links there are.

    Raises:
        SettingError: For what evoexp's kinematics or Pinocchio's reader cannot take.
    """
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


def plain_urdf(content: bytes, places: dict[str, str]) -> str:
    """Return a URDF without visual elements, with the present paths of its meshes."""
    root = parsed_xml(content, "robot.urdf", "robot")
    check_urdf(root, "robot.urdf")
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
