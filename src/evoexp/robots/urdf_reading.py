"""A URDF reduced to its links, collision bodies and joints, all of them checked.

urdfdom leaves out what it does not understand, says so on stderr only, and with one body all others
of the link. It is given nothing of the kind: elements that are not used are dropped, numbers are
written anew, and whatever it would pass over is refused here, by link or joint.
"""

import functools
import re
import xml.etree.ElementTree as ET
from difflib import get_close_matches
from typing import Any, NamedTuple

import numpy as np

from evoexp.errors import SettingError, nearest
from evoexp.robots.urdf_text import JointText, check_rules, parsed_xml, read_joints

MOST_LINKS = 300  # and collision bodies: pairs of them are judged
LARGEST = 1e7  # [m, rad] as of the numbers of other robots
SHORTEST = 1e-6  # [-] of an axis
KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
SHAPES = ("box", "sphere", "cylinder", "capsule", "mesh")
DRAKE_CAPSULE = "drake:capsule"  # means the same
ALIKE = 0.8  # [-] names of elements as similar as that are slips
XACRO = "a URDF that xacro has expanded (xacro FILE > robot.urdf)"

# elements and the elements in them that are read; all others are dropped; `collision_checking` is
# Pinocchio's: it names cylinders that are capsules, and meshes that are replaced by their hulls
PARTS = {
    "robot": ("link", "joint"),
    "link": ("collision", "collision_checking"),
    "collision": ("origin", "geometry"),
    "geometry": SHAPES,
    "joint": ("origin", "parent", "child", "axis", "limit", "mimic"),
}
SINGLE = ("collision", "geometry", "joint")  # hold one element of each name
PLACES = {"collision": "link", "link": "robot"}  # where they stand in a URDF, and nowhere else
# attributes that are read: how many numbers they hold, 0: a name
ATTRIBUTES = {
    "robot": {"name": 0},
    "link": {"name": 0},
    "collision": {"name": 0},
    "joint": {"name": 0, "type": 0},
    "parent": {"link": 0},
    "child": {"link": 0},
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": {"lower": 1, "upper": 1, "velocity": 1},
    "mimic": {"joint": 0, "multiplier": 1, "offset": 1},
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "mesh": {"filename": 0, "scale": 3},
}
OPTIONAL = {"origin", "limit", "collision"}  # whose attributes may all be left out
DEFAULTS = {("robot", "name"), ("mimic", "multiplier"), ("mimic", "offset"), ("mesh", "scale")}
POSITIVE = {"size", "radius", "length"}
UNBOUNDED = {"lower", "upper", "velocity"}  # may be infinite
WORDS = {1: "one number", 3: "three numbers"}
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
INFINITE = re.compile(r"[+-]?inf(inity)?", re.IGNORECASE)


class UrdfFile(NamedTuple):
    """A URDF of one tree of links, read and checked once; shared, so not to be changed."""

    root: Any  # of the elements and attributes that are used, see `read_urdf`
    joints: dict[str, JointText]  # by their names, in the file's order


@functools.lru_cache(maxsize=32)
def urdf_file(content: bytes, field: str = "robot.path") -> UrdfFile:
    """Read a URDF whose links form one tree.

    Args:
        field: That names it, for errors.

    Raises:
        SettingError: If it cannot be, by link or joint.
    """
    root = read_urdf(content, field)
    joints = read_joints(root)
    check_tree([link.get("name") for link in root.iterfind("link")], joints, field)
    check_rules(joints, field)
    return UrdfFile(root, joints)


def read_urdf(content: bytes, field: str) -> Any:
    """Read the links, collision bodies and joints of a URDF.

    Args:
        field: That names it, for errors.

    Returns:
        The root of a tree of the elements and attributes that are used; numbers are written as
        Python writes them, in the place of Drake's capsules stand others.

    Raises:
        SettingError: For an element, a number or a name that cannot be, by link or joint.
    """
    source = parsed_xml(content, field, "robot")
    for element in source.iter():
        if element.tag.startswith("xacro:"):
            raise SettingError(field, XACRO, f"<{element.tag}>")
    root = _Reader(field).reduced(source, "")
    for what, path in {"links": "link", "collision bodies": "link/collision"}.items():
        if (count := len(root.findall(path))) > MOST_LINKS:
            raise SettingError(field, f"a URDF of at most {MOST_LINKS} {what}", count)
    for kind in ("link", "joint"):
        names = [element.get("name") for element in root.iterfind(kind)]
        if double := [name for name in names if names.count(name) > 1]:
            must = f"a URDF whose {kind}s have different names"
            raise SettingError(field, must, f"two {kind}s '{double[0]}'")
    for joint in root.iterfind("joint"):
        _check_joint(joint, field)
    return root


def check_tree(links: list[str], joints: dict[str, JointText], field: str) -> None:
    """Check that joints join the links of a URDF to one tree.

    Args:
        links: Their names.
        joints: By their names.
        field: That names the URDF, for errors.

    Raises:
        SettingError: If a link is not there, hangs on two joints or in a loop, or if there are
            several roots.
    """
    above: dict[str, JointText] = {}  # link → the joint that carries it
    for joint in joints.values():
        for link in (joint.parent, joint.child):
            if link not in links:
                must = f"a URDF that has the links of joint '{joint.name}'"
                raise SettingError(field, must, f"without '{link}'", nearest(link, links))
        if joint.child in above:
            must = "a URDF whose links hang on one joint each"
            was = f"link '{joint.child}' on joints '{above[joint.child].name}' and '{joint.name}'"
            raise SettingError(field, must, was)
        above[joint.child] = joint
    roots = [link for link in links if link not in above]
    for link in links:
        passed = [link]
        while passed[-1] in above:
            passed.append(above[passed[-1]].parent)
            if passed[-1] == link:
                must = "a URDF whose links form a tree"
                raise SettingError(field, must, f"a loop: {' → '.join(passed[::-1])}")
            if len(passed) > len(links):
                break  # it leads into a loop of others, which is told at one of these
    if len(roots) != 1:
        must = "a URDF of one tree of links"
        was = f"{len(roots)} roots: {', '.join(roots)}" if roots else "no link"
        raise SettingError(field, must, was)


class _Reader:
    def __init__(self, field: str) -> None:
        self._field = field

    def reduced(self, element: Any, where: str) -> Any:
        """Return an element with the elements and attributes that are used.

        Args:
            where: Names the link or joint that it belongs to.
        """
        tag = "capsule" if element.tag == DRAKE_CAPSULE else element.tag
        if tag in ("link", "joint"):
            where = f"{tag} '{element.get('name', '')}'"
        if tag == "collision_checking":
            return element
        found = ET.Element(tag, self._attributes(element, tag, where))
        known: tuple[str, ...] = PARTS.get(tag, ())
        if tag == "joint" and element.get("type") == "fixed":
            known = known[:3]
        for child in element:
            if child.tag in known or (tag == "geometry" and child.tag == DRAKE_CAPSULE):
                found.append(self.reduced(child, where))
            else:
                self._check_dropped(child, tag, where)
        if tag in SINGLE:
            names = [child.tag for child in found]
            if double := [name for name in names if names.count(name) > 1]:
                self._refuse(f"one <{double[0]}> in a <{tag}>", where, "several")
        if tag == "geometry" and len(found) != 1:
            shapes = f"one of {', '.join(SHAPES)} in a <geometry>"
            self._refuse(shapes, where, " and ".join(child.tag for child in found) or "none")
        if tag == "collision" and found.find("geometry") is None:
            self._refuse("a <geometry> in a <collision>", where, "none")
        return found

    def _check_dropped(self, child: Any, tag: str, where: str) -> None:
        """Refuse an element that is not used, if somebody meant another one, or put it wrongly."""
        if tag == "geometry":
            self._refuse(f"one of {', '.join(SHAPES)} in a <geometry>", where, f"<{child.tag}>")
        known = PARTS.get(tag, ())
        meant = get_close_matches(child.tag.lower(), known, 1, ALIKE)
        if meant and child.tag not in known:
            hint = f"; did you mean '{meant[0]}'?"
            self._refuse(f"elements of a URDF in a <{tag}>", where, f"<{child.tag}>", hint)
        inside = [child] if tag == "robot" else child.iter()
        for element in inside:
            if (place := PLACES.get(element.tag)) is not None:
                self._refuse(f"each <{element.tag}> in a <{place}>", where, f"one in a <{tag}>")

    def _attributes(self, element: Any, tag: str, where: str) -> dict[str, str]:
        """Return the attributes that are used, numbers written anew."""
        kinds, found = ATTRIBUTES.get(tag, {}), {}
        for name, text in element.items():
            if "${" in text or "$(" in text:
                raise SettingError(self._field, XACRO, f'<{tag} {name}="{text[:40]}"/>')
            if name in kinds:
                found[name] = text if kinds[name] == 0 else self._numbers(tag, name, text, where)
        missing = [name for name in kinds if name not in found]
        for name in element.keys() - found.keys():
            if (tag, name) == ("origin", "quat_xyzw"):
                self._refuse("rpy in an <origin>", where, name)
            if meant := get_close_matches(name.lower(), missing, 1, 0.6):
                hint = f"; did you mean '{meant[0]}'?"
                self._refuse(f"attributes of a URDF in a <{tag}>", where, name, hint)
        for name in missing:
            if tag not in OPTIONAL and (tag, name) not in DEFAULTS:
                self._refuse(f"{name} in a <{tag}>", where, "none")
        return found

    def _numbers(self, tag: str, name: str, text: str, where: str) -> str:
        """Check the numbers of an attribute and write them anew."""
        words, count, here = text.split(), ATTRIBUTES[tag][name], f"as {name} of <{tag}>"
        if len(words) != count:
            self._refuse(f"{WORDS[count]} {here}", where, text[:60])
        values = []
        for word in words:
            if name in UNBOUNDED and INFINITE.fullmatch(word):
                values.append(float(word))
                continue
            value = float(word) if NUMBER.fullmatch(word) else np.nan
            if not abs(value) <= LARGEST and not (name in UNBOUNDED and abs(value) > LARGEST):
                self._refuse(f"finite numbers, at most {LARGEST:g}, {here}", where, text[:60])
            values.append(value)
        if name in POSITIVE and min(values) <= 0.0:
            self._refuse(f"numbers greater than 0 {here}", where, text[:60])
        if name == "scale" and 0.0 in values:
            self._refuse(f"numbers other than 0 {here}", where, text[:60])
        return " ".join(map(repr, values))

    def _refuse(self, must: str, where: str, was: str, hint: str = "") -> None:
        must = f"a URDF with {must}"
        raise SettingError(self._field, must, f"{where}: {was}" if where else was, hint)


def _check_joint(joint: Any, field: str) -> None:
    """Check a joint's kind, ends, axis and limits."""
    kind, name = joint.get("type"), joint.get("name")
    if kind not in KINDS:
        must = f"a URDF whose joints are {', '.join(KINDS[:-1])} or {KINDS[-1]}"
        raise SettingError(field, must, f"joint '{name}' of type {kind}")
    for end in ("parent", "child"):
        if joint.find(end) is None:
            must = f"a URDF whose joints have a <{end}>"
            raise SettingError(field, must, f"joint '{name}' without")
    axis, limit = joint.find("axis"), joint.find("limit")
    if axis is not None and kind not in ("fixed", "floating"):
        direction = [float(word) for word in str(axis.get("xyz", "1 0 0")).split()]
        if not sum(map(abs, direction)) > SHORTEST:
            must = "a URDF whose axes point somewhere"
            raise SettingError(field, must, f"joint '{name}': {axis.get('xyz')}")
    if limit is not None and kind in ("revolute", "prismatic"):
        lower, upper = (float(limit.get(side, "0")) for side in ("lower", "upper"))
        if lower > upper:
            must = "a URDF whose lower limits do not exceed the upper ones"
            is_whole = {"lower", "upper"} <= set(limit.keys())
            absent = "" if is_whole else " (an absent limit is 0)"
            raise SettingError(field, must, f"joint '{name}': {lower:g} to {upper:g}{absent}")
