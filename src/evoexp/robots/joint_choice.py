"""Which joints of a URDF move, in which arm, where the others stand, and what is left open."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from evoexp.errors import SettingError, demand, nearest
from evoexp.robots.meshes import unit_of
from evoexp.robots.urdf_model import BASE, LIMIT_SETTINGS, coordinate_names
from evoexp.robots.urdf_reading import PATH, Mimic, UrdfJoint

if TYPE_CHECKING:
    from evoexp.robots.urdf import Urdf


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
    """Check that a named joint moves of its own."""
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
