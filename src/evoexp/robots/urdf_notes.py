"""Remarks on the bounds of joints, bodies of links and units of meshes that a URDF leaves open."""

from collections.abc import Iterator, Mapping

from evoexp.errors import SettingError
from evoexp.robots.joint_choice import JointRoles
from evoexp.robots.mesh_checks import unit_of
from evoexp.robots.urdf_model import JointRules, coordinate_names
from evoexp.robots.urdf_reading import UrdfFile, UrdfJoint

LIMIT_SETTINGS = {"revolute": ("turn_limit", "deg"), "prismatic": ("slide_limit", "m")}


def check_room(file: UrdfFile, roles: JointRoles, field: str) -> None:
    """Check that joints that move of their own have room between their limits.

    Args:
        file: The URDF.
        roles: Which joints move.
        field: That names the URDF, for errors.

    Raises:
        SettingError: If both limits of one are 0, as exporters write them where none are known.
    """
    for joint, setting, _ in _limited(file, roles):
        given = [limit for limit in joint.limits if limit is not None]
        if given and not any(given):
            must = "a URDF whose moving joints have room between their limits"
            hint = f"; without limits robot.{setting} holds, and robot.joints leaves it standing"
            raise SettingError(field, must, f"joint '{joint.name}': 0 to 0", hint)


def urdf_notes(
    file: UrdfFile, roles: JointRoles, rules: JointRules, meshes: Mapping[str, bytes]
) -> Iterator[str]:
    """Yield a remark on each of the things that a URDF leaves open.

    Args:
        file: The URDF.
        roles: Which joints move.
        rules: How joints are taken that have no limits.
        meshes: Contents of meshes by their names.
    """
    moving = _moving_links(file, roles, rules)
    if bare := [link for link in moving if not file.links[link]]:
        yield f"links that move and have no body: {', '.join(bare)}"
    for joint, setting, unit in _limited(file, roles):
        sides = zip(("lower", "upper"), joint.limits, strict=True)
        absent = [side for side, limit in sides if limit is None]
        if len(absent) == 2:
            most = f"robot.{setting} holds, {getattr(rules, setting):g} {unit} to either side"
            yield f"joint '{joint.name}': the URDF gives no limits; {most}"
        elif absent:
            yield f"joint '{joint.name}': the URDF gives no {absent[0]} limit, which counts as 0"
    for name, content in meshes.items():
        if (metres := unit_of(content, name)) != 1.0:
            yield (
                f"mesh '{name}': its unit is {metres:g} m, its numbers are taken in metres, "
                f'as by Pinocchio; scale="{metres:g} {metres:g} {metres:g}" turns them'
            )


def _limited(file: UrdfFile, roles: JointRoles) -> Iterator[tuple[UrdfJoint, str, str]]:
    """Yield the joints between limits that move of their own, with the setting without them."""
    moving = frozenset[str]().union(*roles.arms)
    for joint in file.joints.values():
        if joint.kind in LIMIT_SETTINGS and joint.name in moving:
            yield joint, *LIMIT_SETTINGS[joint.kind]


def _moving_links(file: UrdfFile, roles: JointRoles, rules: JointRules) -> Iterator[str]:
    """Yield the links that a joint carries which moves of its own or follows one that does."""
    free = frozenset[str]().union(*roles.arms)
    above = {joint.child: joint for joint in file.joints.values()}
    for link in file.links:
        carried, name = rules.base in ("planar", "floating"), link
        while not carried and (joint := above.get(name)) is not None:
            source = roles.rules[joint.name].source if joint.name in roles.rules else joint.name
            carried = not free.isdisjoint({source, *coordinate_names(source, joint.kind)})
            name = joint.parent
        if carried:
            yield link
