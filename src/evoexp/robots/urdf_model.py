"""The Pinocchio model and the coal bodies of a URDF, with its joints as settings take them.

Joints and frames stand in the order in which Pinocchio's own reader puts them: depth first, the
joints on a link by their names.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import coal
import numpy as np
import pinocchio as pin

from evoexp.errors import SettingError, demand, demand_known
from evoexp.numeric.elementary import DEGREE
from evoexp.numeric.ordered_sums import length
from evoexp.records import FloatArray
from evoexp.robots.meshes import mesh_shape, read_pieces
from evoexp.robots.urdf_reading import LARGEST, PATH, UrdfBody, UrdfJoint, read_urdf, repeated

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
    must = "those that the URDF names"
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
