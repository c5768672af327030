"""The Pinocchio model and the coal bodies of a URDF, and which of its joints move, in which arm.

Joints and frames stand in the order in which Pinocchio's own reader puts them: depth first, the
joints on a link by their names.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin

from evoexp.errors import SettingError, demand, demand_known, nearest
from evoexp.numeric.elementary import DEGREE, length
from evoexp.records import FloatArray
from evoexp.robots.meshes import mesh_shape, read_pieces, unit_of
from evoexp.robots.urdf_reading import (
    LARGEST,
    PATH,
    Mimic,
    UrdfBody,
    UrdfJoint,
    read_urdf,
    repeated,
)

if TYPE_CHECKING:
    from evoexp.robots.urdf import Urdf

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
# the coordinates of planar and floating joints, and their axes in the joint's frame
PLANAR = {"x": X, "y": Y, "yaw": Z}
FLOATING = {"x": X, "y": Y, "z": Z, "yaw": Z, "pitch": Y, "roll": X}
COORDINATES = {"planar": PLANAR, "floating": FLOATING}
ALIGNED = 1e-12  # [-] axes as near as that to x, y or z are these
UNLIMITED = 1e6  # [rad, m] limits as large as this are none
# setting of the limits of joints without them, by kind; its unit [rad, m], and the unit's name
LIMIT_SETTINGS = {
    "continuous": ("continuous_turns", 360.0 * DEGREE, "turns"),
    "revolute": ("turn_limit", DEGREE, "deg"),
    "prismatic": ("slide_limit", 1.0, "m"),
}
BASE = "base"  # what the coordinates of a base that moves are called: base_x, base_y, …
# Pinocchio's joints of one coordinate by kind: along or about x, y, z, and any other axis
JOINT_MODELS = {
    "revolute": (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ),
    "prismatic": (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ),
}
UNALIGNED = {
    "revolute": pin.JointModelRevoluteUnaligned,
    "prismatic": pin.JointModelPrismaticUnaligned,
}


def coordinate_names(name: str, kind: str) -> tuple[str, ...]:
    """Name the coordinates of a joint: its own name, or several of a planar or floating one."""
    return tuple(f"{name}_{part}" for part in COORDINATES[kind]) if kind in COORDINATES else (name,)


def urdf_model(robot: "Urdf") -> Any:
    """Build the `pin.Model` of all joints of a URDF, one coordinate each, or none."""
    file = robot.file
    joints, root = list(file.joints.values()), file.root
    if robot.base in COORDINATES:
        root = f"{BASE}_ground"
        joints.append(UrdfJoint(BASE, robot.base, root, file.root, axis=Z))
    joints = [part for joint in joints for part in _parts(joint, robot)]
    links = [root, *(joint.child for joint in joints)]
    for what, names in {"joint": [joint.name for joint in joints], "link": links}.items():
        if double := repeated(names):
            must = f"a URDF whose {what}s have other names than those that robot.base adds"
            raise SettingError(PATH, must, double[0])
    on_link: dict[str, list[UrdfJoint]] = {}
    for joint in sorted(joints, key=lambda joint: joint.name, reverse=True):
        on_link.setdefault(joint.parent, []).append(joint)
    model = pin.Model()
    at_rest = pin.SE3.Identity()
    model.addFrame(pin.Frame(root, 0, 0, at_rest, pin.FrameType.BODY))
    waiting = [(joint, 1) for joint in on_link.get(root, ())]
    while waiting:
        joint, before = waiting.pop()
        carrier = model.frames[before]
        index, kind = carrier.parentJoint, pin.FrameType.FIXED_JOINT
        place = carrier.placement * joint.placement
        if joint.kind != "fixed":
            index = model.addJoint(index, _joint_model(joint), place, joint.name)
            model.lowerPositionLimit[-1], model.upperPositionLimit[-1] = joint.limits
            model.velocityLimit[-1] = joint.speed
            place, kind = at_rest, pin.FrameType.JOINT
        own = model.addFrame(pin.Frame(joint.name, index, before, place, kind))
        link = model.addFrame(pin.Frame(joint.child, index, own, place, pin.FrameType.BODY))
        waiting += [(above, link) for above in on_link.get(joint.child, ())]
    return model


def _parts(joint: UrdfJoint, robot: "Urdf") -> list[UrdfJoint]:
    """Return a joint with its limits, or joints of one coordinate each in its place."""
    if joint.kind == "fixed" or (joint.kind in COORDINATES and robot.base == "fixed"):
        return [joint._replace(kind="fixed")]
    if joint.kind not in COORDINATES:
        return [_limited(joint, robot)]
    axes = _across(joint.axis) if joint.kind == "planar" else FLOATING
    parts: list[UrdfJoint] = []
    parent, place = joint.parent, joint.placement
    for part, axis in axes.items():
        link = joint.child if part == list(axes)[-1] else f"{joint.name}_{part}_link"
        kind = "prismatic" if part in ("x", "y", "z") else "revolute"
        added = UrdfJoint(f"{joint.name}_{part}", kind, parent, link, place, axis)
        parts.append(_limited(added, robot))
        parent, place = link, pin.SE3.Identity()
    return parts


def _limited(joint: UrdfJoint, robot: "Urdf") -> UrdfJoint:
    """Give a joint limits to either side, if it has none or is continuous."""
    setting, unit, _ = LIMIT_SETTINGS[joint.kind]
    most = unit * float(getattr(robot, setting))
    low, high = (0.0 if limit is None else limit for limit in joint.limits)
    if joint.kind == "continuous" or joint.limits == (None, None):
        low, high = -most, most
    elif max(abs(low), abs(high)) >= UNLIMITED:
        if low >= most or high <= -most:
            must = f"a URDF whose joints have room within robot.{setting}"
            raise SettingError(PATH, must, f"joint '{joint.name}': {low:g} to {high:g}")
        low, high = max(low, -most), min(high, most)
    kind = "prismatic" if joint.kind == "prismatic" else "revolute"
    return joint._replace(kind=kind, limits=(low, high))


def _across(normal: tuple[float, ...]) -> dict[str, tuple[float, ...]]:
    """Choose the axes of a planar joint's coordinates: two across its normal, and the normal."""
    z = np.array(normal) / length(np.array(normal))
    x, y = np.eye(3)[0], np.eye(3)[1]
    if z[2] != 1.0:
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= length(x)
        y = np.cross(z, x)
    return dict(zip(PLANAR, (tuple(axis.tolist()) for axis in (x, y, z)), strict=True))


def _joint_model(joint: UrdfJoint) -> Any:
    axis = np.array(joint.axis)
    for unit, aligned in zip(np.eye(3), JOINT_MODELS[joint.kind], strict=True):
        # Pinocchio's isApprox: exporters write 1 -5.6e-17 0
        if length(axis - unit) <= ALIGNED * min(length(axis), 1.0):
            return aligned()
    return UNALIGNED[joint.kind](axis / length(axis))


def placed_bodies(
    robot: "Urdf", model: Any, links: dict[str, tuple[UrdfBody, ...]], field: str
) -> Iterator[Any]:
    """Yield the bodies of links as `pin.GeometryObject`s of their names, in the model's order."""
    frames = ((k, f) for k, f in enumerate(model.frames) if f.type == pin.FrameType.BODY)
    for k, frame in frames:
        for body in links.get(frame.name, ()):
            for shape in _shapes(robot, body):
                shape.computeLocalAABB()
                reach = np.abs(body.placement.translation).max() + shape.aabb_radius
                if not 0.0 <= reach <= LARGEST:
                    must = f"a URDF whose bodies end within {LARGEST:g} m (link '{frame.name}')"
                    raise SettingError(field, must, f"{body.mesh or body.kind} to {reach:.3g}")
                place = frame.placement * body.placement
                yield pin.GeometryObject(frame.name, frame.parentJoint, k, place, shape)


def _shapes(robot: "Urdf", body: UrdfBody) -> list[Any]:
    """Return the coal shapes of a body, several where a mesh is cut into pieces."""
    if body.mesh is None:
        shapes = {"box": coal.Box, "sphere": coal.Sphere, "cylinder": coal.Cylinder}
        return [shapes.get(body.kind, coal.Capsule)(*body.sizes)]
    names = [mesh.name for mesh in robot.meshes]
    must = "the meshes that the URDF names"
    demand(body.mesh in names, "robot.meshes", must, f"without '{body.mesh}'")
    k, is_hull = names.index(body.mesh), body.kind == "convex"
    content, pieces = robot.meshes[k].file.content, robot.meshes[k].pieces
    if robot.decomposition is None:
        return [mesh_shape(content, names[k], body.sizes, f"robot.meshes[{k}]", hull=is_hull)]
    if pieces is None:
        raise SettingError("robot.meshes", "given with their pieces", None)
    return read_pieces(pieces.content, np.array(body.sizes), "robot.meshes")


def given_spheres(robot: "Urdf", model: Any, bodies: list[Any]) -> list[FloatArray]:
    """Read the spheres that a file gives each body: middles in its own frame and radii, (n, 4).

    A sphere belongs to the body of its link whose middle is nearest to its own.
    """
    assert robot.spheres is not None
    field, links = "robot.spheres", robot.file.links
    given = read_urdf(robot.spheres.content, field).links
    for link, shapes in given.items():
        if shapes:
            demand_known(link, links, field, "a URDF whose spheres belong to links of the robot")
        is_sphere = all(shape.kind == "sphere" for shape in shapes)
        demand(is_sphere, field, "a URDF of spheres", f"another body of '{link}'")
    demand(any(given.values()), field, "a URDF of spheres", "one without")
    rows: list[list[list[float]]] = [[] for _ in bodies]
    for sphere in placed_bodies(robot, model, given, field):
        point = sphere.placement.translation
        own = [k for k, body in enumerate(bodies) if body.name == sphere.name]
        middles = [bodies[k].placement.act(bodies[k].geometry.aabb_center) for k in own]
        if own:
            k = own[int(np.argmin([np.sum((middle - point) ** 2) for middle in middles]))]
            rows[k].append([*bodies[k].placement.actInv(point), float(sphere.geometry.radius)])
    return [np.array(each).reshape(-1, 4) for each in rows]


class JointRoles(NamedTuple):
    """The roles of the joints of a URDF."""

    arms: tuple[frozenset[str], ...]  # names of the coordinates that move of their own, of each arm
    # of joints that follow others, by their names; the source is one that moves of its own, or that
    # stands
    rules: dict[str, Mimic]
    # the frame of each arm's tool, empty where nothing names one, and the field that chose it
    tips: tuple[tuple[str, str], ...]

    @property
    def moving(self) -> frozenset[str]:
        """Names of the coordinates that move of their own."""
        return frozenset[str]().union(*self.arms)


def joint_roles(robot: "Urdf") -> JointRoles:
    """Choose the joints that move: those named, those of groups, or all."""
    joints, srdf, base = robot.file.joints, robot.semantics, robot.base
    free = {
        name: coordinate_names(name, joint.kind)
        for name, joint in joints.items()
        if joint.mimic is None
        and joint.kind != "fixed"
        and (base != "fixed" or joint.kind not in ("planar", "floating"))
    }
    groups = {f"robot.groups[{k}]": group for k, group in enumerate(robot.groups)}
    if robot.group and not groups:
        groups = {"robot.group": robot.group}
    if robot.joints:
        must = f"left out beside {'robot.groups' if robot.groups else 'robot.group'}"
        demand(not groups, "robot.joints", must, list(robot.joints))
        arms = [{part for name in robot.joints for part in free[_free(name, joints, free)]}]
    elif groups:
        if srdf is None:
            raise SettingError("robot.srdf", "given: it tells the joints of a group", None)
        arms = []
        for field, group in groups.items():
            members = srdf.group_joints(group, field) & free.keys()
            demand(members, field, "a group with a joint that moves", group)
            arms.append({part for name in members for part in free[name]})
    else:
        arms = [{part for parts in free.values() for part in parts}]
    if base in ("planar", "floating"):
        arms[0] |= set(coordinate_names(BASE, base))
    demand(all(arms), PATH, "a URDF with a joint that moves", None)
    for k, arm in enumerate(arms):
        for other in arms[:k]:
            must = "groups that have no joint in common"
            demand(not arm & other, "robot.groups", must, ", ".join(sorted(arm & other)))
    tips = [srdf.tip(group) for group in groups.values()] if srdf is not None and groups else [""]
    rules = {
        name: _whole_rule(joint.mimic, joints) for name, joint in joints.items() if joint.mimic
    }
    return JointRoles(tuple(map(frozenset, arms)), rules, _tool_frames(robot, tips))


def _tool_frames(robot: "Urdf", tips: list[str]) -> tuple[tuple[str, str], ...]:
    """Return the frame of each arm's tool, the tip of its group if none is named, and the field."""
    if robot.tool_frame and robot.groups:
        raise SettingError("robot.tool_frame", "left out beside robot.groups", robot.tool_frame)
    if robot.tool_frame:
        return ((robot.tool_frame, "robot.tool_frame"),)
    if not robot.tool_frames:
        return tuple((name, "robot.srdf") for name in tips)
    if len(robot.tool_frames) != len(robot.groups):
        must = f"a frame per group ({len(robot.groups)})"
        raise SettingError("robot.tool_frames", must, list(robot.tool_frames))
    return tuple((name, f"robot.tool_frames[{k}]") for k, name in enumerate(robot.tool_frames))


def _free(name: str, joints: dict[str, UrdfJoint], free: dict[str, tuple[str, ...]]) -> str:
    if name in free:
        return name
    joint, must = joints.get(name), "names of joints that move"
    if joint is None:
        raise SettingError("robot.joints", must, name, nearest(name, list(free)))
    if joint.mimic is not None:
        must = f"{must} of their own"
        raise SettingError("robot.joints", must, f"'{name}', which follows '{joint.mimic.source}'")
    raise SettingError("robot.joints", must, f"'{name}', which is {joint.kind}")


def _whole_rule(rule: Mimic, joints: dict[str, UrdfJoint]) -> Mimic:
    """Join the rules of joints that follow followers, to one of the joint that leads them all."""
    while (before := joints[rule.source].mimic) is not None:
        offset = rule.multiplier * before.offset + rule.offset
        rule = Mimic(before.source, rule.multiplier * before.multiplier, offset)
    return rule


def standing_values(robot: "Urdf", roles: JointRoles) -> dict[str, float]:
    """Return the values [deg, m] that are given to joints that stand still."""
    for joint, setting, _ in _limited_joints(robot, roles):
        if joint.limits != (None, None) and not any(joint.limits):
            must = "a URDF whose moving joints have room between their limits"
            hint = f"; without limits robot.{setting} holds, and robot.joints leaves it standing"
            raise SettingError(PATH, must, f"joint '{joint.name}': 0 to 0", hint)
    joints = robot.file.joints
    for name, value in robot.fixed:
        if name not in joints:
            names = sorted(set(joints) - roles.moving)
            must = "the names of joints that stand still"
            raise SettingError("robot.fixed", must, name, nearest(name, names))
        must = ""
        if name in roles.moving:
            must = "left out: this joint moves"
        elif name in roles.rules:
            must = f"left out: this joint follows '{roles.rules[name].source}'"
        elif joints[name].kind in ("fixed", "planar", "floating"):
            must = f"left out: a {joints[name].kind} joint has no value"
        demand(not must, f"robot.fixed.{name}", must, value)
    return dict(robot.fixed)


def urdf_notes(robot: "Urdf") -> Iterator[str]:
    """Yield a remark on each of the things that a URDF leaves open: bodies, limits, units."""
    file, roles = robot.file, joint_roles(robot)
    above, bare = {joint.child: joint for joint in file.joints.values()}, []
    for link in (link for link, bodies in file.links.items() if not bodies):
        carried, name = robot.base in ("planar", "floating"), link
        while not carried and (joint := above.get(name)) is not None:
            source = roles.rules[joint.name].source if joint.name in roles.rules else joint.name
            names = {source, *coordinate_names(source, joint.kind)}
            carried, name = not roles.moving.isdisjoint(names), joint.parent
        bare += [link] if carried else []
    if bare:
        yield f"links that move and have no body: {', '.join(bare)}"
    for joint, setting, unit in _limited_joints(robot, roles):
        sides = zip(("lower", "upper"), joint.limits, strict=True)
        absent = [side for side, limit in sides if limit is None]
        if len(absent) == 2:
            most = f"robot.{setting} holds, {getattr(robot, setting):g} {unit} to either side"
            yield f"joint '{joint.name}': the URDF gives no limits; {most}"
        elif absent:
            yield f"joint '{joint.name}': the URDF gives no {absent[0]} limit, which counts as 0"
    for mesh in robot.meshes:
        if (metres := unit_of(mesh.file.content, mesh.name)) != 1.0:
            yield (
                f"mesh '{mesh.name}': its unit is {metres:g} m, its numbers are taken in metres, "
                f'as by Pinocchio; scale="{metres:g} {metres:g} {metres:g}" turns them'
            )


def _limited_joints(robot: "Urdf", roles: JointRoles) -> Iterator[tuple[UrdfJoint, str, str]]:
    """Yield the joints between limits that move of their own, with the setting without them."""
    for joint in robot.file.joints.values():
        if joint.kind in ("revolute", "prismatic") and joint.name in roles.moving:
            setting, _, unit = LIMIT_SETTINGS[joint.kind]
            yield joint, setting, unit
