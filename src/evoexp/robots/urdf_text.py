"""XML of a URDF or an SRDF: read within bounds, checked, without elements that are not used."""

import xml.etree.ElementTree as ET
from typing import Any, NamedTuple

import numpy as np

from evoexp.attachments import located
from evoexp.errors import SettingError
from evoexp.input_files import read_bounded

MOST_NESTED, MOST_ELEMENTS = 50, 100_000  # of XML
MOST_LINKS = 300  # and collision bodies: pairs of them are judged
LARGEST = 1e7  # [m, rad] as of the numbers of other robots
SHORTEST = 1e-6  # [-] of an axis
# attributes of places, bodies, limits and joints that follow others
NUMERIC = {"xyz", "rpy", "size", "scale", "radius", "length", "multiplier", "offset"}
LIMITS = {"lower", "upper"}  # those that are larger than a robot's are none
KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
MESH = "link/collision/geometry/mesh"


class Mimic(NamedTuple):
    """The rule of a joint that follows another: q = multiplier · q of the source + offset."""

    source: str
    multiplier: float
    offset: float


class JointText(NamedTuple):
    """A joint as the URDF names it.

    Attributes:
        name: Its name.
        kind: Its type.
        parent: The link that carries it.
        child: The link that it carries.
        mimic: The rule by which it follows another joint; None: it moves of its own.
    """

    name: str
    kind: str
    parent: str
    child: str
    mimic: Mimic | None


def file_content(path: Any, field: str) -> bytes:
    """Read a file.

    Raises:
        SettingError: If no path is given, or the file cannot be read.
    """
    if path in (None, "???"):
        raise SettingError(field, "given: the path of a URDF", None)
    try:
        return read_bounded(located(str(path)))
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
        for name in LIMITS.intersection(element.keys()):
            if not _is_number(str(element.get(name)), np.inf):
                was = f'<{element.tag} {name}="{str(element.get(name))[:40]}"/>'
                raise SettingError(field, "a URDF whose limits are numbers", was)
    for joint in root.iterfind("joint"):
        kind, name = joint.get("type"), joint.get("name")
        if kind not in KINDS:
            must = f"a URDF whose joints are {', '.join(KINDS[:-1])} or {KINDS[-1]}"
            raise SettingError(field, must, f"joint '{name}' of type {kind}")
        axis = joint.find("axis")
        if axis is None or kind in ("fixed", "floating"):
            continue
        if not sum(abs(float(word)) for word in str(axis.get("xyz", "1")).split()) > SHORTEST:
            raise SettingError(field, "a URDF whose axes point somewhere", axis.get("xyz"))


def read_joints(root: Any, field: str) -> dict[str, JointText]:
    """Read the joints of a checked URDF.

    Returns:
        Them by their names, in the file's order.

    Raises:
        SettingError: If a joint follows one that is not there, or itself.
    """
    found = {}
    for joint in root.iterfind("joint"):
        name, kind = str(joint.get("name")), str(joint.get("type"))
        rule, mimic = joint.find("mimic"), None
        if rule is not None and kind != "fixed":
            numbers = (rule.get("multiplier", "1"), rule.get("offset", "0"))
            if not all(len(number.split()) == 1 for number in numbers):
                must = "a URDF whose multipliers and offsets are numbers"
                raise SettingError(field, must, f"joint '{name}'")
            mimic = Mimic(str(rule.get("joint")), *map(float, numbers))
        ends = (joint.find("parent"), joint.find("child"))
        parent, child = ("" if end is None else str(end.get("link")) for end in ends)
        found[name] = JointText(name, kind, parent, child, mimic)
    for joint in found.values():
        _check_rule(joint, found, field)
    return found


def _check_rule(joint: JointText, joints: dict[str, JointText], field: str) -> None:
    """Follow the rules from one joint to another, to one that moves of its own or stands."""
    passed = [joint.name]
    while joint.mimic is not None:
        if joint.mimic.source not in joints:
            must = "a URDF whose joints follow joints that are there"
            raise SettingError(field, must, f"'{joint.name}' follows '{joint.mimic.source}'")
        joint = joints[joint.mimic.source]
        if joint.name in passed:
            must = "a URDF whose joints do not follow themselves"
            raise SettingError(field, must, " → ".join([*passed, joint.name]))
        passed.append(joint.name)


def _is_number(word: str, largest: float = LARGEST) -> bool:
    """Whether a word is a number that joints and bodies can have."""
    try:
        return abs(float(word)) <= largest
    except ValueError:
        return False
