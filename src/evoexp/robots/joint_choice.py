"""Which joints of a URDF move, in which arm, and where the others stand."""

from typing import NamedTuple

from evoexp.errors import SettingError, nearest
from evoexp.robots.srdf import Srdf
from evoexp.robots.urdf_model import BASE, coordinate_names
from evoexp.robots.urdf_reading import Mimic, UrdfJoint


class JointRoles(NamedTuple):
    """The roles of the joints of a URDF."""

    arms: tuple[frozenset[str], ...]  # names of the coordinates that move of their own, of each arm
    # of joints that follow others, by their names; the source is one that moves of its own, or that
    # stands
    rules: dict[str, Mimic]
    tips: tuple[str, ...]  # the link at the end of each arm, empty where nothing names one


def joint_roles(
    joints: dict[str, UrdfJoint],
    srdf: Srdf | None,
    names: tuple[str, ...],
    groups: tuple[str, ...],
    base: str,
    *,
    several: bool,
) -> JointRoles:
    """Choose the joints that move: those named, those of groups, or all.

    Args:
        joints: Of the URDF.
        srdf: Its groups; None: there are none.
        names: Joints that are named.
        groups: Groups that are named, an arm each.
        base: Whether planar and floating joints move, and whether the root does: see `JointRules`.
        several: Whether `robot.groups` named them, for errors.

    Raises:
        SettingError: If a joint or group is not there, cannot move of its own, or belongs to two
            arms.
    """
    rules = {name: _to_the_end(joint, joints) for name, joint in joints.items() if joint.mimic}
    free = {
        name: coordinate_names(name, joint.kind)
        for name, joint in joints.items()
        if joint.mimic is None
        and joint.kind != "fixed"
        and (base != "fixed" or joint.kind not in ("planar", "floating"))
    }
    if names:
        given = "robot.group" if not several else "robot.groups"
        if groups:
            raise SettingError("robot.joints", f"left out beside {given}", list(names))
        arms = [{part for name in names for part in free[_free(name, joints, free)]}]
    elif groups:
        if srdf is None:
            raise SettingError("robot.srdf", "given: it tells the joints of a group", None)
        arms = []
        for k, group in enumerate(groups):
            field = f"robot.groups[{k}]" if several else "robot.group"
            members = srdf.group_joints(group, field)
            own = {part for name in members & free.keys() for part in free[name]}
            if not own:
                raise SettingError(field, "a group with a joint that moves", group)
            arms.append(own)
    else:
        arms = [{part for parts in free.values() for part in parts}]
    if base in ("planar", "floating"):
        arms[0] |= set(coordinate_names(BASE, base))
    if not all(arms):
        raise SettingError("robot.path", "a URDF with a joint that moves", None)
    for k, arm in enumerate(arms):
        for other in arms[:k]:
            if shared := sorted(arm & other):
                must = "groups that have no joint in common"
                raise SettingError("robot.groups", must, ", ".join(shared))
    tips = tuple(srdf.tip(group) for group in groups) if srdf is not None and groups else ("",)
    return JointRoles(tuple(frozenset(arm) for arm in arms), rules, tips)


def standing_values(
    fixed: tuple[tuple[str, float], ...], joints: dict[str, UrdfJoint], roles: JointRoles
) -> dict[str, float]:
    """Check the values that are given to joints that stand still.

    Raises:
        SettingError: If a joint is not there, moves, follows another or has no coordinate.
    """
    moving = frozenset[str]().union(*roles.arms)
    for name, value in fixed:
        if name not in joints:
            names = sorted(set(joints) - moving)
            must = "the names of joints that stand still"
            raise SettingError("robot.fixed", must, name, nearest(name, names))
        if name in moving:
            raise SettingError(f"robot.fixed.{name}", "left out: this joint moves", value)
        if (rule := roles.rules.get(name)) is not None:
            must = f"left out: this joint follows '{rule.source}'"
            raise SettingError(f"robot.fixed.{name}", must, value)
        if joints[name].kind in ("fixed", "planar", "floating"):
            must = f"left out: a {joints[name].kind} joint has no value"
            raise SettingError(f"robot.fixed.{name}", must, value)
    return dict(fixed)


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


def _to_the_end(joint: UrdfJoint, joints: dict[str, UrdfJoint]) -> Mimic:
    """Join the rules of joints that follow followers, to one of the joint that leads them all."""
    assert joint.mimic is not None
    rule = joint.mimic
    while (before := joints[rule.source].mimic) is not None:
        rule = Mimic(
            before.source,
            rule.multiplier * before.multiplier,
            rule.multiplier * before.offset + rule.offset,
        )
    return rule
