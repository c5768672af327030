"""A URDF rewritten for Pinocchio: every joint that moves has one coordinate between limits."""

import copy
import xml.etree.ElementTree as ET
from typing import Any, NamedTuple

import numpy as np

from evoexp.errors import SettingError
from evoexp.numeric.elementary import DEGREE

PLANAR = (("x", "prismatic", "1 0 0"), ("y", "prismatic", "0 1 0"), ("yaw", "revolute", "0 0 1"))
FLOATING = (
    *PLANAR[:2],
    ("z", "prismatic", "0 0 1"),
    PLANAR[2],
    ("pitch", "revolute", "0 1 0"),
    ("roll", "revolute", "1 0 0"),
)
UNLIMITED = 1e6  # [rad, m] limits as large as this are none
BASE = "base"  # what the coordinates of a base that moves are called: base_x, base_y, …


class JointRules(NamedTuple):
    """How joints are taken that have no limits, or several coordinates."""

    continuous_turns: float  # turns of a continuous joint to either side
    turn_limit: float  # limit to either side of a turning joint that has none [deg]
    slide_limit: float  # the same of a sliding joint [m]
    # whether planar and floating joints stand still (fixed) or move (free), or the root moves
    # besides (planar, floating)
    base: str


def plain_urdf(root: Any, rules: JointRules, places: dict[str, str] | None = None) -> str:
    """Rewrite a URDF for Pinocchio, with the present paths of its meshes.

    Cylinders stand in the place of capsules, which urdfdom leaves out.

    Args:
        root: That `read_urdf` returned.
        rules: For joints without limits, or of several coordinates.
        places: Where each mesh lies; None: collision bodies are left out.
    """
    root = copy.deepcopy(root)
    for link in root.iterfind("link"):
        for collision in link.findall("collision"):
            (shape,) = collision.find("geometry")
            if places is None:
                link.remove(collision)
            elif shape.tag == "capsule":
                shape.tag = "cylinder"
            elif shape.tag == "mesh":
                if (name := shape.get("filename")) not in places:
                    must = "those that the URDF names"
                    raise SettingError("robot.meshes", must, f"without '{name}'")
                shape.set("filename", places[name])
    for joint in root.findall("joint"):
        _rewrite_joint(root, joint, rules)
    if rules.base in ("planar", "floating"):
        _free_base(root, FLOATING if rules.base == "floating" else PLANAR, rules)
    return ET.tostring(root, encoding="unicode")


def coordinate_names(name: str, kind: str) -> tuple[str, ...]:
    """Name the coordinates of a joint: its own name, or several of a planar or floating one."""
    if kind not in ("planar", "floating"):
        return (name,)
    return tuple(f"{name}_{part}" for part, *_ in (PLANAR if kind == "planar" else FLOATING))


def _rewrite_joint(root: Any, joint: Any, rules: JointRules) -> None:
    kind = joint.get("type")
    for part in joint.findall("mimic"):
        joint.remove(part)
    if kind in ("planar", "floating"):
        if rules.base != "fixed":
            _part_joint(root, joint, FLOATING if kind == "floating" else PLANAR, rules)
            return
        kind = "fixed"
        joint.set("type", kind)
    if kind == "fixed":
        for part in [part for part in joint if part.tag not in ("origin", "parent", "child")]:
            joint.remove(part)
        return
    if kind == "continuous":
        joint.set("type", "revolute")
        turn = 360.0 * DEGREE * rules.continuous_turns
        _limit(joint, turn, always=True)
    elif kind == "revolute":
        _limit(joint, rules.turn_limit * DEGREE)
    else:
        _limit(joint, rules.slide_limit)


def _limit(joint: Any, most: float, *, always: bool = False) -> None:
    """Give a joint limits to either side, if it has none or `always`."""
    limit = joint.find("limit")
    if limit is None:
        limit = ET.SubElement(joint, "limit")
    given = [float(limit.get(side, "0")) for side in ("lower", "upper")]
    named = limit.get("lower") is not None or limit.get("upper") is not None
    if always or not named:
        given = [-most, most]
    elif max(map(abs, given)) >= UNLIMITED:
        given = [max(given[0], -most), min(given[1], most)]
    for side, value in zip(("lower", "upper"), given, strict=True):
        limit.set(side, repr(value))
    # numbers without which Pinocchio does not read limits; a speed of 0 is none
    limit.set("effort", "0")
    if not np.isfinite(float(limit.get("velocity", "inf"))):
        limit.set("velocity", "0")


def _part_joint(root: Any, joint: Any, parts: Any, rules: JointRules) -> None:
    """Put joints of one coordinate each in the place of a planar or floating one."""
    name, origin, axis = str(joint.get("name")), joint.find("origin"), joint.find("axis")
    parent, child = (
        "" if end is None else str(end.get("link"))
        for end in (joint.find("parent"), joint.find("child"))
    )
    normal = "1 0 0" if axis is None else str(axis.get("xyz"))
    if joint.get("type") == "planar":
        axes = _across(normal)
        parts = [(part, kind, axes[part]) for part, kind, _ in parts]
    root.remove(joint)
    added = _append_parts(root, name, parent, child, parts, rules)
    if origin is not None:
        added[0].append(origin)


def _across(normal: str) -> dict[str, str]:
    """Choose the directions of a planar joint's coordinates in the plane across a normal."""
    z = np.array([float(word) for word in normal.split()])
    z /= np.sqrt(np.sum(z * z))
    x, y = np.eye(3)[0], np.eye(3)[1]
    if z[2] != 1.0:
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.sqrt(np.sum(x * x))
        y = np.cross(z, x)
    words = [" ".join(map(repr, direction.tolist())) for direction in (x, y, z)]
    return dict(zip(("x", "y", "yaw"), words, strict=True))


def _free_base(root: Any, parts: Any, rules: JointRules) -> None:
    """Put joints below the root link: the whole robot moves."""
    children = {str(child.get("link")) for child in root.iterfind("joint/child")}
    roots = [str(link.get("name")) for link in root.iterfind("link")]
    below = [name for name in roots if name not in children]
    ground = f"{BASE}_ground"
    ET.SubElement(root, "link", {"name": ground})
    _append_parts(root, BASE, ground, below[0], parts, rules)


def _append_parts(
    root: Any, name: str, parent: str, child: str, parts: Any, rules: JointRules
) -> list[Any]:
    """Append joints of one coordinate each, one behind the other, with links between them."""
    joints = []
    for k, (part, kind, axis) in enumerate(parts):
        joint = ET.SubElement(root, "joint", {"name": f"{name}_{part}", "type": kind})
        link = child if k == len(parts) - 1 else f"{name}_{part}_link"
        if link != child:
            ET.SubElement(root, "link", {"name": link})
        ET.SubElement(joint, "parent", {"link": parent})
        ET.SubElement(joint, "child", {"link": link})
        ET.SubElement(joint, "axis", {"xyz": axis})
        _rewrite_joint(root, joint, rules)
        joints.append(joint)
        parent = link
    return joints
