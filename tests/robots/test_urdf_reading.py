"""A URDF says nothing that is passed over: it is read as it stands, or refused by link or joint."""

from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest
import yaml

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


SAMPLES = yaml.safe_load(Path(__file__).with_name("urdf_samples.yaml").read_text(encoding="utf-8"))


def written(parts: dict[str, str]) -> str:
    """Write an arm of some parts, or the whole text that is one of them."""
    filled = {name: part.replace("BOX", BOX) for name, part in parts.items() if name != "said"}
    return filled["text"] if "text" in filled else arm(**filled)


def collision(shape: str, origin: str = "") -> str:
    return f"<collision>{origin}<geometry>{shape}</geometry></collision>"


def bodies(folder: Path, text: str) -> dict[str, Any]:
    return {item.name: item for item in urdf_of(folder, text).build().geometry.geometryObjects}


@pytest.mark.parametrize(("body", "must"), SAMPLES["bodies"].values(), ids=SAMPLES["bodies"])
def test_a_body_that_cannot_be_is_refused_by_its_link(
    tmp_path: Path, body: str, must: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SettingError) as refusal:
        urdf_of(tmp_path, written({"body": body}))
    text = str(refusal.value)
    assert must in text and "link 'b'" in text and str(tmp_path / "r.urdf") in text
    assert "\n" not in text and not capfd.readouterr().err


@pytest.mark.parametrize("parts", SAMPLES["taken"].values(), ids=SAMPLES["taken"])
def test_a_body_is_built_whatever_stands_beside_it(
    tmp_path: Path, parts: dict[str, str], capfd: pytest.CaptureFixture[str]
) -> None:
    found = bodies(tmp_path, written(parts))
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


@pytest.mark.parametrize("parts", SAMPLES["files"], ids=lambda parts: parts["said"])
def test_what_is_wrong_with_a_file_is_told_with_its_name(
    tmp_path: Path, parts: dict[str, str]
) -> None:
    with pytest.raises(SettingError) as refusal:
        urdf_of(tmp_path, written(parts))
    told = str(refusal.value)
    assert parts["said"] in told and str(tmp_path / "r.urdf") in told and "\n" not in told


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
