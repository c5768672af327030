"""A URDF says nothing that is passed over: it is read as it stands, or refused by link or joint."""

from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from evoexp.errors import SettingError
from robots.robot_samples import urdf_of

BOX = '<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'
LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


def arm(
    body: str = BOX, limit: str = LIMIT, more: str = "", head: str = "", joint: str = ""
) -> str:
    """Write an arm of one joint, whose second link holds a body."""
    return (
        f'<robot name="r"{head}><link name="a">{BOX}</link><link name="b">{body}</link>'
        f'<joint name="j" type="revolute"><parent link="a"/><child link="b"/>{joint}'
        f'<axis xyz="0 0 1"/>{limit}</joint>{more}</robot>'
    )


def collision(shape: str, origin: str = "") -> str:
    return f"<collision>{origin}<geometry>{shape}</geometry></collision>"


def bodies(folder: Path, text: str) -> dict[str, Any]:
    return {item.name: item for item in urdf_of(folder, text).build().geometry.geometryObjects}


SHAPES = "one of box, sphere, cylinder, capsule, mesh in a <geometry>"
REFUSED = {
    "an unknown shape": (collision('<ellipsoid radii="1 1 2"/>') + BOX, SHAPES),
    "no shape": (collision("") + BOX, SHAPES),
    "two shapes": (collision('<sphere radius="1"/><box size="1 1 1"/>'), SHAPES),
    "a shape twice": (collision('<sphere radius="1"/><sphere radius="1"/>'), "one <sphere>"),
    "no geometry": (f"<collision/>{BOX}", "a <geometry> in a <collision>"),
    "two geometries": (BOX.replace("</coll", "<geometry/></coll"), "one of box"),
    "a position of two": (collision('<box size="1 1 1"/>', '<origin xyz="1 0"/>'), "three numbers"),
    "a position of none": (collision('<box size="1 1 1"/>', '<origin xyz=""/>'), "three numbers"),
    "two origins": (collision('<box size="1 1 1"/>', "<origin/><origin/>"), "one <origin>"),
    "an attribute misspelt": (collision('<box size="1 1 1"/>', '<origin xzy="1 0 0"/>'), "'xyz'?"),
    "an element misspelt": (collision('<box size="1 1 1"/>', "<orgin/>"), "did you mean 'origin'?"),
    "a collision misspelt": (BOX.replace("collision", "Collision"), "did you mean 'collision'?"),
    "a quaternion": (collision('<box size="1 1 1"/>', '<origin quat_xyzw="0 0 0 1"/>'), "rpy in"),
    "NaN": (collision('<box size="1 1 1"/>', '<origin xyz="nan 0 0"/>'), "finite numbers"),
    "infinity": (collision('<sphere radius="inf"/>'), "finite numbers"),
    "a large number": (collision('<sphere radius="1e9"/>'), "finite numbers, at most 1e+07"),
    "a decimal comma": (collision('<sphere radius="0,1"/>'), "finite numbers"),
    "an underscore": (collision('<sphere radius="1_0"/>'), "finite numbers"),
    "a negative radius": (collision('<sphere radius="-1"/>'), "numbers greater than 0"),
    "a flat box": (collision('<box size="1 1 0"/>'), "numbers greater than 0"),
    "no radius": (collision("<sphere/>"), "radius in a <sphere>"),
    "no name of a mesh": (collision("<mesh/>"), "filename in a <mesh>"),
    "a scale of one": (collision('<mesh filename="a.obj" scale="0.001"/>'), "three numbers"),
    "a scale of 0": (collision('<mesh filename="a.obj" scale="1 0 1"/>'), "numbers other than 0"),
    "a scale of NaN": (collision('<mesh filename="a.obj" scale="1 nan 1"/>'), "finite numbers"),
    "a body in a visual": (f"<visual>{BOX}</visual>", "each <collision> in a <link>"),
    "a body in a body": (BOX.replace("<geo", "<collision/><geo"), "each <collision> in a <link>"),
}


@pytest.mark.parametrize(("body", "must"), REFUSED.values(), ids=REFUSED.keys())
def test_a_body_that_cannot_be_is_refused_by_its_link(
    tmp_path: Path, body: str, must: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SettingError) as refusal:
        urdf_of(tmp_path, arm(body))
    text = str(refusal.value)
    assert must in text and "link 'b'" in text and str(tmp_path / "r.urdf") in text
    assert "\n" not in text and not capfd.readouterr().err


TAKEN = {
    "a default namespace": arm(head=' xmlns="http://drake.mit.edu"'),
    "an unbound prefix": arm(more='<gazebo><controller:x name="y"/></gazebo>'),
    "Gazebo": arm(more='<gazebo reference="b"><collision>b</collision></gazebo><transmission/>'),
    "a version": arm(head=' version="2.7" xmlns:xacro="http://www.ros.org/wiki/xacro"'),
    "a byte order mark": "\ufeff" + arm(),
    "spaces and line ends": collision('<box size=" 0.1\n 0.2\t0.3 "/>'),
    "exponents": collision('<box size="1e-1 +.2 3.E-1"/>'),
    "an empty origin": collision('<box size="0.1 0.2 0.3"/>', "<origin/>"),
    "an inertia without mass": f"<inertial><origin/></inertial>{BOX}",
    "an inertia of NaN": f'<inertial><mass value="nan"/><inertia ixx="nan"/></inertial>{BOX}',
    "a visual that cannot be": f'<visual><origin xyz="1"/><geometry/></visual>{BOX}',
    "an unknown material": f'<visual><material name="none"/></visual>{BOX}',
    "a box with a file": collision('<box size="0.1 0.2 0.3" filename="none.obj"/>'),
    "elements of others": f"<sensor/>{BOX.replace('<geo', '<drake:proximity_properties/><geo')}",
}


@pytest.mark.parametrize("body", TAKEN.values(), ids=TAKEN.keys())
def test_a_body_is_built_whatever_stands_beside_it(
    tmp_path: Path, body: str, capfd: pytest.CaptureFixture[str]
) -> None:
    found = bodies(tmp_path, body if "<robot" in body else arm(body))
    assert list(found) == ["a", "b"]
    assert np.array_equal(2.0 * found["b"].geometry.halfSide, [0.1, 0.2, 0.3])
    assert not capfd.readouterr().err


@pytest.mark.parametrize("name", ["capsule", "drake:capsule"])
def test_a_capsule_is_one_of_several_bodies(tmp_path: Path, name: str) -> None:
    shape = collision(f'<{name} radius="0.05" length="0.3"/>', '<origin xyz="0.5 0 0"/>')
    found = bodies(tmp_path, arm(shape + BOX))
    capsule = found["b_0"].geometry
    assert isinstance(capsule, coal.Capsule)
    assert (capsule.radius, 2.0 * capsule.halfLength) == (0.05, 0.3)
    assert found["b_0"].placement.translation == pytest.approx([0.5, 0.0, 0.0])
    assert np.array_equal(2.0 * found["b_1"].geometry.halfSide, [0.1, 0.2, 0.3])


LINK = '<link name="c"/>'


def join(name: str, parent: str, child: str, kind: str = "fixed") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}</joint>'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (arm(more='<link name="b"/>'), "links have different names, was \"two links 'b'\""),
        (arm(more=LINK + join("j", "b", "c")), "was \"two joints 'j'\""),
        (arm(more=LINK), "one tree of links, was '2 roots: a, c'"),
        (arm(more=join("k", "b", "a")), "links form a tree, was 'a loop: a → b → a'"),
        (arm(more=LINK + join("k", "c", "c")), "was 'a loop: c → c'"),
        (arm(more=LINK + join("k", "a", "c") + join("l", "b", "c")), "'c' on joints 'k' and 'l'"),
        (arm(more=join("k", "b", "bb")), "the links of joint 'k', was \"without 'bb'\"; did you"),
        (arm(more='<joint name="k" type="fixed"/>'), "have a <parent>, was \"joint 'k' without"),
        (arm(more="<link/>"), "name in a <link>"),
        (arm().replace('"b"', '""'), "name in a <link>"),
        (arm(f"{BOX}<collision_checking><capsule/></collision_checking>"), "name in a <capsule>"),
        (arm(limit='<limit lower="-1" upper="1" velocity="-2"/>'), "a number of at least 0 as vel"),
        (arm(more=collision("<sphere/>")), "each <collision> in a <link>, was 'one in a <robot>'"),
        (arm(body=LINK), "each <link> in a <robot>, was \"link 'b': one in a <link>"),
        (arm(joint='<origin xyz="0 1"/>'), "three numbers as xyz of <origin>, was \"joint 'j'"),
        (arm(joint='<mimic multiplier="2"/>'), "joint in a <mimic>"),
        (arm(more='<xacro:property name="l"/>'), "FILE > robot.urdf), was '<xacro:property>'"),
        (arm(collision('<sphere radius="${r}"/>')), "(xacro FILE > robot.urdf), was '<sphere rad"),
        (arm(collision('<mesh filename="$(find x)/a.obj"/>')), "(xacro FILE > robot.urdf)"),
        ("<!doctype html><html></html>", "was \"an HTML page in the file's place"),
        ("version https://git-lfs.github.com/spec/v1\n", "was \"a Git-LFS pointer in the file's"),
        ("", "was 'an empty file'"),
        (arm()[:60], "must be XML with the root <robot>, was 'unclosed token: line 1"),
        ("<sdf></sdf>", "must be XML with the root <robot>, was '<sdf>'"),
        (arm(limit='<limit lower="1" upper="-1"/>'), "was \"joint 'j': 1 to -1\""),
        (arm(limit='<limit upper="-1"/>'), "was \"joint 'j': 0 to -1 (an absent limit is 0)\""),
        (arm(limit='<limit lower="nan" upper="1"/>'), "finite numbers"),
        (arm(limit='<limit lower="-1 0" upper="1"/>'), "one number"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_file_is_told_with_its_name(
    tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(SettingError) as refusal:
        urdf_of(tmp_path, text)
    told = str(refusal.value)
    assert message in told and str(tmp_path / "r.urdf") in told and "\n" not in told


@pytest.mark.parametrize(
    ("root", "base"), [("base_ground", "planar"), ("base_x_link", "floating"), ("k_x_link", "free")]
)
def test_links_that_the_base_adds_have_other_names(tmp_path: Path, root: str, base: str) -> None:
    text = arm(more=LINK + join("k", "b", "c", "planar")).replace('"a"', f'"{root}"')
    assert urdf_of(tmp_path, text).build().model.nq == 1
    with pytest.raises(SettingError, match=f"that robot.base adds, was '{root}'"):
        urdf_of(tmp_path, text, base=base).build()


def test_groups_that_hold_each_other_twice_are_looked_up_once(tmp_path: Path) -> None:
    twice = '<group name="g{0}"><group name="g{1}"/><group name="g{1}"/></group>'
    groups = "".join(twice.format(k, k + 1) for k in range(60))
    srdf = tmp_path / "r.srdf"
    srdf.write_text(f'<robot>{groups}<group name="g60"><joint name="j"/></group></robot>')
    assert urdf_of(tmp_path, arm(), srdf=str(srdf), group="g0").build().model.nq == 1


@pytest.mark.parametrize("axis", ["1 -5.6e-17 0", "0 1e-13 1", "1e-11 1 0", "0 0 2", "0 -1 0"])
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_joints_are_aligned_where_pinocchio_aligns_them(
    tmp_path: Path, axis: str, kind: str
) -> None:
    text = arm().replace("revolute", kind).replace('"0 0 1"', f'"{axis}"')
    (_, own), (_, reference) = (
        model.joints
        for model in (urdf_of(tmp_path, text).build().model, pin.buildModelFromXML(text))
    )
    assert own.shortname() == reference.shortname()


def test_a_joint_without_room_names_the_setting_of_a_limit(tmp_path: Path) -> None:
    locked = urdf_of(tmp_path, arm(limit='<limit lower="0" upper="0" velocity="1"/>'))
    with pytest.raises(SettingError, match=r"joint 'j': 0 to 0.*robot\.turn_limit"):
        locked.build()
    turn = '<link name="c"/>' + join("k", "b", "c", "continuous")
    still = urdf_of(tmp_path, arm(limit='<limit upper="0"/>', more=turn), joints=["k"])
    assert still.build().model.nq == 1
    sliding = arm(limit="<limit upper='0'/>").replace("revolute", "prismatic")
    with pytest.raises(SettingError, match=r"robot\.slide_limit"):
        urdf_of(tmp_path, sliding).build()


@pytest.mark.parametrize("limit", ["", '<limit lower="-inf" upper="1e9" velocity="inf"/>'])
def test_limits_that_are_none_are_the_setting(tmp_path: Path, limit: str) -> None:
    model = urdf_of(tmp_path, arm(limit=limit), turn_limit=90.0).build().model
    assert np.degrees(model.lowerPositionLimit) == pytest.approx([-90.0])
    assert np.degrees(model.upperPositionLimit) == pytest.approx([90.0])
    assert np.isinf(model.velocityLimit).all()


@pytest.mark.parametrize("limit", ['lower="2" upper="inf"', 'lower="-1e9" upper="-2"'])
def test_a_joint_with_one_limit_has_room_to_the_other_side(tmp_path: Path, limit: str) -> None:
    one_sided = arm(limit=f"<limit {limit}/>")
    assert urdf_of(tmp_path, one_sided).build().model.nq == 1
    with pytest.raises(SettingError, match=r"room within robot\.turn_limit, was \"joint 'j': "):
        urdf_of(tmp_path, one_sided, turn_limit=90.0).build()


def test_bodies_have_different_names(tmp_path: Path) -> None:
    text = arm(more=join("k", "b", "b_0") + f'<link name="b_0">{BOX}</link>')
    assert list(bodies(tmp_path, text)) == ["a", "b", "b_0"]
    several = text.replace(f'"b">{BOX}', f'"b">{BOX}{BOX}')
    assert list(bodies(tmp_path, several)) == ["a_0", "b_0", "b_1", "b_0_0"]


@pytest.mark.parametrize("value", ["nan", "inf", "1e400", "1_0", "x"])
def test_states_of_an_srdf_are_finite_numbers(tmp_path: Path, value: str) -> None:
    srdf = tmp_path / "r.srdf"
    state = f'<group_state name="s" group="g"><joint name="j" value="{value}"/></group_state>'
    srdf.write_text(f"<robot>{state}</robot>")
    with pytest.raises(
        SettingError, match=f"finite numbers, at most 1e.07, was \"'{value}' of 'j'"
    ):
        urdf_of(tmp_path, arm(), srdf=str(srdf)).build()


def test_notes_name_links_without_a_body_and_limits_that_are_not_given(tmp_path: Path) -> None:
    tool = '<link name="tool"/>' + join("k", "b", "tool")
    note = "links that move and have no body: tool"
    assert urdf_of(tmp_path, arm(more=tool)).notes() == [note]
    assert urdf_of(tmp_path, arm(more='<link name="s"/>' + join("k", "a", "s"))).notes() == []
    (low,) = urdf_of(tmp_path, arm(limit='<limit upper="1"/>')).notes()
    assert low == "joint 'j': the URDF gives no lower limit, which counts as 0"
    (none,) = urdf_of(tmp_path, arm(limit="<limit effort='1'/>"), turn_limit=90.0).notes()
    assert "'j': the URDF gives no limits; robot.turn_limit holds, 90 deg" in none
    free = urdf_of(tmp_path, arm(body="", more=tool), base="planar").notes()
    assert free == ["links that move and have no body: b, tool"]
