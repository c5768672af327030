"""Remarks on the bounds of joints, bodies of links and units of meshes that a URDF leaves open."""

from collections.abc import Iterator, Mapping
from typing import Any

from evoexp.errors import SettingError
from evoexp.robots.joint_choice import JointRoles
from evoexp.robots.mesh_checks import unit_of
from evoexp.robots.urdf_rewriting import JointRules, coordinate_names

LIMIT_SETTINGS = {"revolute": ("turn_limit", "deg"), "prismatic": ("slide_limit", "m")}


def check_room(root: Any, roles: JointRoles, field: str) -> None:
    """Check that joints that move of their own have room between their limits.

    Args:
        root: Of the URDF, that `read_urdf` returned.
        roles: Which joints move.
        field: That names the URDF, for errors.

    Raises:
        SettingError: If both limits of one are 0, as exporters write them where none are known.
    """
    moving = frozenset[str]().union(*roles.arms)
    for joint in root.iterfind("joint"):
        limit, setting = joint.find("limit"), LIMIT_SETTINGS.get(joint.get("type"), ("",))[0]
        if limit is None or not setting or joint.get("name") not in moving:
            continue
        given = [side for side in ("lower", "upper") if limit.get(side) is not None]
        if given and all(float(limit.get(side)) == 0.0 for side in given):
            must = "a URDF whose moving joints have room between their limits"
            hint = f"; without limits robot.{setting} holds, and robot.joints leaves it standing"
            raise SettingError(field, must, f"joint '{joint.get('name')}': 0 to 0", hint)


def urdf_notes(
    root: Any, roles: JointRoles, rules: JointRules, meshes: Mapping[str, bytes]
) -> Iterator[str]:
    """Yield a remark on each of the things that a URDF leaves open.

    Args:
        root: Of the URDF, that `read_urdf` returned.
        roles: Which joints move.
        rules: How joints are taken that have no limits.
        meshes: Contents of meshes by their names.
    """
    if bare := [
        link for link in _moving_links(root, roles, rules) if link.find("collision") is None
    ]:
        yield f"links that move and have no body: {', '.join(link.get('name') for link in bare)}"
    moving = frozenset[str]().union(*roles.arms)
    for joint in root.iterfind("joint"):
        kind, limit = joint.get("type"), joint.find("limit")
        if kind not in LIMIT_SETTINGS or joint.get("name") not in moving:
            continue
        absent = [side for side in ("lower", "upper") if limit is None or limit.get(side) is None]
        if len(absent) == 2:
            setting, unit = LIMIT_SETTINGS[kind]
            most = f"robot.{setting} holds, {getattr(rules, setting):g} {unit} to either side"
            yield f"joint '{joint.get('name')}': the URDF gives no limits; {most}"
        elif absent:
            side = absent[0]
            yield f"joint '{joint.get('name')}': the URDF gives no {side} limit, which counts as 0"
    for name, content in meshes.items():
        if (metres := unit_of(content, name)) != 1.0:
            yield (
                f"mesh '{name}': its unit is {metres:g} m, its numbers are taken in metres, "
                f'as by Pinocchio; scale="{metres:g} {metres:g} {metres:g}" turns them'
            )


def _moving_links(root: Any, roles: JointRoles, rules: JointRules) -> Iterator[Any]:
    """Yield the links that a joint carries which moves of its own or follows one that does."""
    free = frozenset[str]().union(*roles.arms)
    above = {joint.find("child").get("link"): joint for joint in root.iterfind("joint")}
    for link in root.iterfind("link"):
        carried, name = rules.base in ("planar", "floating"), link.get("name")
        while not carried and (joint := above.get(name)) is not None:
            joint_name = joint.get("name")
            source = roles.rules[joint_name].source if joint_name in roles.rules else joint_name
            carried = not free.isdisjoint({source, *coordinate_names(source, joint.get("type"))})
            name = joint.find("parent").get("link")
        if carried:
            yield link
