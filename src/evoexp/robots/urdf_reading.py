"""A URDF read once: its links, collision bodies and joints, all of them checked.

urdfdom leaves out what it does not understand, says so on stderr only, and with one body all others
of the link. Here nothing is passed over: what cannot be is refused, by link or joint.
"""

import functools
import math
import re
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple
from xml.parsers import expat

import numpy as np
import pinocchio as pin
import yaml

from evoexp.errors import SettingError, demand, nearest
from evoexp.input_files import stand_in

PATH = "robot.path"  # the setting that names the URDF, for errors
MOST_NESTED, MOST_ELEMENTS = 50, 100_000  # of XML
MOST_LINKS = 300  # and collision bodies: pairs of them are judged
LARGEST = 1e7  # [m, rad] as of the numbers of other robots
SHORTEST = 1e-6  # [-] of an axis
KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
DRAKE_CAPSULE = "drake:capsule"  # means the same
ALIKE = 0.8  # [-] names of elements as similar as that are slips
XACRO = "a URDF that xacro has expanded (xacro FILE > robot.urdf)"

ELEMENTS = yaml.load(
    Path(__file__).with_name("urdf_elements.yaml").read_text(encoding="utf-8"), yaml.CSafeLoader
)
PARTS, ATTRIBUTES = ELEMENTS["parts"], ELEMENTS["attributes"]
SHAPES, UNBOUNDED = PARTS["geometry"], ELEMENTS["unbounded"]
WORDS = {1: "one number", 3: "three numbers"}
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
INFINITE = re.compile(r"[+-]?inf(inity)?", re.IGNORECASE)


class Mimic(NamedTuple):
    """The rule of a joint that follows another: q = multiplier · q of the source + offset."""

    source: str
    multiplier: float
    offset: float


class UrdfJoint(NamedTuple):
    """A joint as the URDF gives it."""

    name: str
    kind: str  # one of `KINDS`
    parent: str  # the link that carries it
    child: str  # the link that it carries
    placement: Any = pin.SE3.Identity()  # of its frame in that of the parent
    axis: tuple[float, ...] = (1.0, 0.0, 0.0)  # of any length but 0
    # its least and greatest coordinate [rad, m]; None: the file gives none
    limits: tuple[float | None, float | None] = (None, None)
    speed: float = math.inf  # its greatest [rad/s, m/s]; inf: the file gives none
    mimic: Mimic | None = None  # the rule by which it follows another joint; None: it does not


class UrdfBody(NamedTuple):
    """A collision body as the URDF gives it."""

    kind: str  # one of `SHAPES`, or convex: the hull of a mesh
    sizes: tuple[float, ...]  # edges | radius | radius, length | scale of a mesh
    placement: Any  # pin.SE3 in the frame of its link
    mesh: str | None = None  # the name of its file, as the URDF has it; None: it is no mesh


class UrdfFile(NamedTuple):
    """A URDF, shared by all who read it."""

    name: str  # of the robot
    links: dict[str, tuple[UrdfBody, ...]]  # the bodies of each link, in the file's order
    joints: dict[str, UrdfJoint]  # by their names, in the file's order

    @property
    def root(self) -> str:
        """The link that no joint carries."""
        return next(iter(self.links.keys() - {joint.child for joint in self.joints.values()}))


@functools.lru_cache(maxsize=32)
def parsed_xml(content: bytes, field: str) -> Any:
    """Read XML as TinyXML does, without namespaces; return its root element, shared by all."""
    must, builder, open_tags, count = "XML with the root <robot>", ET.TreeBuilder(), [], 0

    def start(name: str, attributes: Any) -> None:
        nonlocal count
        name = "capsule" if name == DRAKE_CAPSULE else name
        open_tags.append(name)
        count += 1
        if len(open_tags) > MOST_NESTED or count > MOST_ELEMENTS:
            most = f"XML of at most {MOST_ELEMENTS:,} elements, nested {MOST_NESTED} deep"
            raise SettingError(field, most, f"more, at <{name[:40]}>")
        builder.start(name, attributes)

    def doctype(name: str, *_: Any) -> None:  # entities unfold to any size, or name other files
        raise SettingError(field, "XML without a document type", f"<!DOCTYPE {name}>")

    if reason := stand_in(content):
        raise SettingError(field, must, reason)
    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.StartDoctypeDeclHandler = start, doctype
    parser.EndElementHandler = lambda name: builder.end(open_tags.pop())
    try:
        parser.Parse(content, True)
        root = builder.close()
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise SettingError(field, must, str(error)) from None
    demand(root.tag == "robot", field, must, f"<{root.tag}>")
    return root


@functools.lru_cache(maxsize=32)
def urdf_file(content: bytes, field: str = PATH) -> UrdfFile:
    """Read a URDF whose links form one tree."""
    file = read_urdf(content, field)
    _check_tree(list(file.links), file.joints, field)
    _check_rules(file.joints, field)
    return file


def read_urdf(content: bytes, field: str) -> UrdfFile:
    """Read the links, collision bodies and joints of a URDF."""
    root = parsed_xml(content, field)
    for element in root.iter():
        demand(not element.tag.startswith("xacro:"), field, XACRO, f"<{element.tag}>")
    _Check(field).element(root, "")
    for what, path in {"links": "link", "collision bodies": "link/collision"}.items():
        if (count := len(root.findall(path))) > MOST_LINKS:
            raise SettingError(field, f"a URDF of at most {MOST_LINKS} {what}", count)
    for kind in ("link", "joint"):
        if double := repeated(element.get("name") for element in root.iterfind(kind)):
            must = f"a URDF whose {kind}s have different names"
            raise SettingError(field, must, f"two {kind}s '{double[0]}'")
    links = {
        str(link.get("name")): tuple(_body(link, body) for body in link.iterfind("collision"))
        for link in root.iterfind("link")
    }
    joints = (_joint(joint, field) for joint in root.iterfind("joint"))
    return UrdfFile(str(root.get("name", "")), links, {joint.name: joint for joint in joints})


def repeated(names: Iterable[str]) -> list[str]:
    """List the names that are given more than once, the first first."""
    return [name for name, count in Counter(names).items() if count > 1]


def _numbers(element: Any, name: str, default: str) -> tuple[float, ...]:
    """Return the numbers of an attribute; the default where element or attribute are absent."""
    text = default if element is None else element.get(name, default)
    return tuple(map(float, text.split()))


def _placement(element: Any) -> Any:
    """Return the `pin.SE3` of an element's origin, with the bits that urdfdom and Pinocchio give.

    The rotation Rz(yaw) Ry(pitch) Rx(roll) goes through a quaternion.
    """
    origin = element.find("origin")
    half = [0.5 * angle for angle in _numbers(origin, "rpy", "0 0 0")]
    (sr, sp, sy), (cr, cp, cy) = map(math.sin, half), map(math.cos, half)
    x, y = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy
    z, w = cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy
    size = math.sqrt(x * x + y * y + z * z + w * w)
    turn = pin.Quaternion(w / size, x / size, y / size, z / size).toRotationMatrix()
    return pin.SE3(turn, np.array(_numbers(origin, "xyz", "0 0 0")))


def _body(link: Any, collision: Any) -> UrdfBody:
    shape = next(part for part in collision.find("geometry") if part.tag in SHAPES)
    kind = str(shape.tag)
    for other, plain in (("capsule", "cylinder"), ("convex", "mesh")):
        names = [item.get("name") for item in link.iterfind(f"collision_checking/{other}")]
        if kind == plain and collision.get("name") in names:
            kind = other
    attributes = {"box": ("size",), "sphere": ("radius",), "mesh": ("scale",)}
    sizes = [_numbers(shape, n, "1 1 1") for n in attributes.get(shape.tag, ("radius", "length"))]
    mesh = shape.get("filename") if shape.tag == "mesh" else None
    return UrdfBody(kind, sum(sizes, ()), _placement(collision), mesh)


def _joint(joint: Any, field: str) -> UrdfJoint:
    kind, name = joint.get("type"), joint.get("name")
    must = f"a URDF whose joints are {', '.join(KINDS[:-1])} or {KINDS[-1]}"
    demand(kind in KINDS, field, must, f"joint '{name}' of type {kind}")
    ends = [joint.find(end) for end in ("parent", "child")]
    for end, element in zip(("parent", "child"), ends, strict=True):
        must = f"a URDF whose joints have a <{end}>"
        demand(element is not None, field, must, f"joint '{name}' without")
    parent, child = (element.get("link") for element in ends)
    if kind == "fixed":
        return UrdfJoint(name, kind, parent, child, _placement(joint))
    axis, limit, rule = (joint.find(part) for part in ("axis", "limit", "mimic"))
    direction = _numbers(axis, "xyz", "1 0 0")
    if kind != "floating" and not sum(map(abs, direction)) > SHORTEST:
        must = "a URDF whose axes are not zero"
        raise SettingError(field, must, f"joint '{name}': {axis.get('xyz')}")
    texts = [None if limit is None else limit.get(side) for side in ("lower", "upper")]
    low, high = (None if text is None else float(text) for text in texts)
    if kind in ("revolute", "prismatic") and (low or 0.0) > (high or 0.0):
        must = "a URDF whose lower limits do not exceed the upper ones"
        absent = " (an absent limit is 0)" if None in (low, high) else ""
        raise SettingError(
            field, must, f"joint '{name}': {low or 0.0:g} to {high or 0.0:g}{absent}"
        )
    ((speed,), mimic) = _numbers(limit, "velocity", "inf"), None
    if rule is not None:
        (multiplier,), (offset,) = _numbers(rule, "multiplier", "1"), _numbers(rule, "offset", "0")
        mimic = Mimic(str(rule.get("joint")), multiplier, offset)
    return UrdfJoint(
        name, kind, parent, child, _placement(joint), direction, (low, high),
        speed if speed > 0.0 else math.inf, mimic,
    )  # fmt: skip


def _check_tree(links: list[str], joints: dict[str, UrdfJoint], field: str) -> None:
    """Check that joints join the links to one tree: each link on one joint, but for one root."""
    above: dict[str, UrdfJoint] = {}  # link → the joint that carries it
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
    must = "a URDF of one tree of links"
    was = f"{len(roots)} roots: {', '.join(roots)}" if roots else "no link"
    demand(len(roots) == 1, field, must, was)


def _check_rules(joints: dict[str, UrdfJoint], field: str) -> None:
    for joint in joints.values():
        passed = [joint.name]
        while joint.mimic is not None:
            if joint.mimic.source not in joints:
                must = "a URDF whose joints follow joints that exist"
                raise SettingError(field, must, f"'{joint.name}' follows '{joint.mimic.source}'")
            joint = joints[joint.mimic.source]
            must = "a URDF whose joints follow other joints"
            demand(joint.name not in passed, field, must, " → ".join([*passed, joint.name]))
            passed.append(joint.name)


class _Check:
    def __init__(self, field: str) -> None:
        self._field = field

    def element(self, element: Any, where: str) -> None:
        """Check an element, and those in it, of the link or joint that is named by `where`."""
        tag = element.tag
        if tag in ("link", "joint"):
            where = f"{tag} '{element.get('name', '')}'"
        if tag == "collision_checking":
            if unnamed := [child.tag for child in element if not child.get("name")]:
                self._refuse(f"name in a <{unnamed[0]}> in a <{tag}>", where, "none")
            return
        self._attributes(element, tag, where)
        known = PARTS.get(tag, [])
        if tag == "joint" and element.get("type") == "fixed":
            known = known[:3]
        names = []
        for child in element:
            if child.tag in known:
                self.element(child, where)
                names.append(child.tag)
            else:
                self._check_left_out(child, tag, where)
        if tag in ELEMENTS["single"] and (double := repeated(names)):
            self._refuse(f"one <{double[0]}> in a <{tag}>", where, "several")
        if tag == "geometry" and len(names) != 1:
            shapes = f"one of {', '.join(SHAPES)} in a <geometry>"
            self._refuse(shapes, where, " and ".join(names) or "none")
        if tag == "collision" and "geometry" not in names:
            self._refuse("a <geometry> in a <collision>", where, "none")

    def _check_left_out(self, child: Any, tag: str, where: str) -> None:
        """Refuse an element that is not used, if somebody meant another one, or put it wrongly."""
        if tag == "geometry":
            self._refuse(f"one of {', '.join(SHAPES)} in a <geometry>", where, f"<{child.tag}>")
        known = PARTS.get(tag, [])
        meant = get_close_matches(child.tag.lower(), known, 1, ALIKE)
        if meant and child.tag not in {*known, *ELEMENTS["others"]}:
            hint = f"; did you mean '{meant[0]}'?"
            self._refuse(f"elements of a URDF in a <{tag}>", where, f"<{child.tag}>", hint)
        inside = [child] if tag == "robot" else child.iter()
        for element in inside:
            if (place := ELEMENTS["places"].get(element.tag)) is not None:
                self._refuse(f"each <{element.tag}> in a <{place}>", where, f"one in a <{tag}>")

    def _attributes(self, element: Any, tag: str, where: str) -> None:
        """Check the attributes that are read, and whether others are slips for them."""
        kinds = ATTRIBUTES.get(tag, {})
        for name, text in element.items():
            if "${" in text or "$(" in text:
                raise SettingError(self._field, XACRO, f'<{tag} {name}="{text[:40]}"/>')
            if kinds.get(name):
                self._check_numbers(tag, name, text, where)
        missing = [name for name in kinds if not element.get(name)]
        for name in set(element.keys()) - kinds.keys():
            if (tag, name) == ("origin", "quat_xyzw"):
                self._refuse("rpy in an <origin>", where, name)
            if meant := get_close_matches(name.lower(), missing, 1, 0.6):
                hint = f"; did you mean '{meant[0]}'?"
                self._refuse(f"attributes of a URDF in a <{tag}>", where, name, hint)
        for name in missing:
            if name not in ELEMENTS["optional"].get(tag, []):
                self._refuse(f"{name} in a <{tag}>", where, "none")

    def _check_numbers(self, tag: str, name: str, text: str, where: str) -> None:
        words, count, here = text.split(), ATTRIBUTES[tag][name], f"as {name} of <{tag}>"
        if len(words) != count:
            self._refuse(f"{WORDS[count]} {here}", where, text[:60])
        values = []
        for word in words:
            is_infinite = name in UNBOUNDED and INFINITE.fullmatch(word)
            values.append(float(word) if is_infinite or NUMBER.fullmatch(word) else math.nan)
            if not abs(values[-1]) <= (math.inf if name in UNBOUNDED else LARGEST):
                self._refuse(f"finite numbers, at most {LARGEST:g}, {here}", where, text[:60])
        if name in ELEMENTS["positive"] and min(values) <= 0.0:
            self._refuse(f"numbers greater than 0 {here}", where, text[:60])
        if name == "velocity" and values[0] < 0.0:
            self._refuse(f"a number of at least 0 {here}", where, text[:60])
        if name == "scale" and 0.0 in values:
            self._refuse(f"numbers other than 0 {here}", where, text[:60])

    def _refuse(self, must: str, where: str, was: str, hint: str = "") -> None:
        must = f"a URDF with {must}"
        raise SettingError(self._field, must, f"{where}: {was}" if where else was, hint)
