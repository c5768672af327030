"""Joints of a URDF that move, stand and follow: against the slow reader of the whole file."""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from evoexp.errors import EvoexpError
from evoexp.numeric.elementary import DEGREE
from evoexp.robots.assembly import Assembly
from evoexp.robots.urdf import Urdf
from robots.robot_samples import (
    REACH,
    TWO,
    forward_kinematics,
    placements,
    task,
    tool_pose,
    urdf,
    urdf_of,
)
from robots.test_urdf_bodies import SlowRobot

DATA = Path(__file__).parent / "data" / "two_arms"
URDF, SRDF = DATA / "two_arms.urdf", DATA / "two_arms.srdf"
STANDING = {"trunk_lift": 0.05, "left_finger": 0.01} | dict.fromkeys(
    ("left_shoulder", "left_elbow", "right_shoulder", "right_elbow"), 0.0
)
BODY = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'


def robot(**settings: Any) -> Urdf:
    return urdf(URDF, srdf=str(SRDF), **settings)


def joint(name: str, kind: str, parent: str, child: str, more: str = "") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{more}</joint>'


def test_without_a_tool_frame_the_tool_is_the_farthest_fixed_link(tmp_path: Path) -> None:
    names = ("base", "arm", "flange", "tip")
    text = "".join(f'<link name="{name}">{BODY * (name == "arm")}</link>' for name in names)
    for parent, child, z in (("arm", "flange", 0.3), ("flange", "tip", 0.2)):
        text += joint(child, "fixed", parent, child, f'<origin xyz="0 0 {z}"/>')
    text += joint("turn", "revolute", "base", "arm", '<limit lower="-1" upper="1"/>')
    (tool,) = urdf_of(tmp_path, f'<robot name="arm">{text}</robot>').build().tools
    assert tool.position == pytest.approx([0.0, 0.0, 0.5])


def agrees(assembly: Assembly, standing: dict[str, float], tool: str = "") -> None:
    """Compare bodies, joints of the table and the tool's frame at random configurations."""
    model, whole = assembly.model, SlowRobot(URDF)
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    names = [item.name for item in assembly.geometry.geometryObjects]
    assert sorted(names) == sorted(whole.bodies())
    for seed in range(20):
        q = low + (high - low) * np.random.default_rng(seed).random(model.nq)
        free = [k for k in range(1, model.njoints) if model.nqs[k] == 1]
        values = standing | {model.names[k]: float(q[model.idx_qs[k]]) for k in free}
        for name, place in zip(names, placements(assembly, q)[1], strict=True):
            ((_, local),) = whole.bodies()[name]
            expected = whole.link_pose(name, values) @ local
            assert np.abs(place.homogeneous - expected).max() < 1e-12
        rotations, origins = forward_kinematics(assembly.table, q[:, None])
        for k in range(1, model.njoints):
            child = whole.end(whole.joints[str(model.names[k])], "child")
            expected = whole.link_pose(child, values)
            turned = rotations[k - 1, :, :, 0] @ assembly.table.alignment[k - 1].T
            assert np.abs(turned - expected[:3, :3]).max() < 1e-12
            assert np.abs(origins[k - 1, :, 0] - expected[:3, 3]).max() < 1e-12
        if tool:
            pose, expected = tool_pose(assembly, q), whole.link_pose(tool, values)
            assert np.abs(pose[9:] - expected[:3, 3]).max() < 1e-12
            assert np.abs(pose[:9] - expected[:3, :3].ravel()).max() < 1e-12


def test_a_group_moves_and_the_other_joints_stand_at_the_limit_nearest_to_0() -> None:
    assembly = robot(group="right_arm").build()
    assert list(assembly.model.names) == ["universe", "right_shoulder", "right_elbow"]
    agrees(assembly, STANDING, "right_fore")


def test_joints_that_are_named_move_and_the_others_stand_where_they_are_told() -> None:
    angles = {"left_elbow": 30.0, "left_shoulder": -100.0}
    slides = {"trunk_lift": 0.2, "left_finger": 0.03}
    moving = robot(joints=["right_elbow", "right_shoulder"], fixed=angles | slides)
    radians = {name: angle * DEGREE for name, angle in angles.items()}
    agrees(moving.build(), STANDING | radians | slides)


@pytest.mark.parametrize(
    ("group", "followers"),
    [
        *((group, {"left_coupler", "a_left_thumb"}) for group in ("", "left")),
        *(("left_arm", {"left_coupler"}), ("left_gripper", {"a_left_thumb"})),
    ],
)
def test_joints_that_follow_others_do_so_in_every_model(group: str, followers: set[str]) -> None:
    """The thumb stands before the finger that it follows in Pinocchio's order."""
    assembly = robot(group=group).build()
    table = assembly.table
    assert {str(assembly.model.names[int(k) + 1]) for k in np.flatnonzero(~table.free)} == followers
    assert table.num_coordinates == assembly.model.nq
    assert group != "left_gripper" or table.slides.tolist() == [True]
    agrees(assembly, STANDING)


def test_a_base_moves_by_one_coordinate_after_another() -> None:
    """At x, y, z, yaw, pitch, roll the bodies stand as those of a base that is placed there."""
    place, angles, arm = [0.3, -0.2, 0.1], [10.0, 20.0, 30.0], [0.4, -0.7]
    still = robot(group="right_arm", base_position=place, base_rotation=angles).build()
    moving = robot(group="right_arm", base="floating").build()
    assert list(moving.model.names)[1:4] == ["base_x", "base_y", "base_z"]
    q = np.array([*place, *(DEGREE * np.array(angles[::-1])), *arm])
    bodies = (placements(still, np.array(arm))[1], placements(moving, q)[1])
    for one, two in zip(*bodies, strict=True):
        assert np.abs(one.homogeneous - two.homogeneous).max() < 1e-12
    assert robot(group="right_arm", base="planar").build().model.nq == 5


@pytest.mark.parametrize(("base", "nq"), [("fixed", 1), ("free", 4)])
def test_planar_joints_of_a_file_stand_or_move(base: str, nq: int, tmp_path: Path) -> None:
    links = f'<link name="a"/><link name="b"/><link name="c">{BODY}</link>'
    floor = joint("floor", "planar", "a", "b", '<origin xyz="0 0 1"/><axis xyz="0 1 0"/>')
    turn = joint("turn", "continuous", "b", "c", '<axis xyz="0 0 1"/>')
    text = f'<robot name="x">{links}{floor}{turn}</robot>'
    assembly = urdf_of(tmp_path, text, base=base).build()
    assert assembly.model.nq == nq
    place = placements(assembly, np.full(nq, 0.5))[1][0]
    x, y, z = place.translation
    if base == "fixed":
        assert [x, y, z] == pytest.approx([0.0, 0.0, 1.0])
    else:  # it stays in the plane across y, and turns about y, then z
        assert y == 0.0 and np.hypot(x, z - 1.0) == pytest.approx(0.5**0.5)
        about = pin.utils.rotate("y", 0.5) @ pin.utils.rotate("z", 0.5)
        assert place.rotation == pytest.approx(about)


POSTURES = (*REACH, "robot.group=left_arm")
STRINGS = ("robot=urdf", *TWO[1:], "robot.groups=[left_arm,right_arm]")


def scenario_of(base: tuple[str, ...], *overrides: str) -> Any:
    return task(f"robot.srdf={SRDF}", *overrides, base=base, path=URDF).scenario


def test_states_are_start_and_goal_by_their_names() -> None:
    posture = scenario_of(POSTURES, "scenario.q_start=bent")
    assert posture.q_start == pytest.approx([0.5 / DEGREE, -1.0 / DEGREE])
    motion = scenario_of(STRINGS, "scenario.q_start=bent", "scenario.q_goal=[bent,[1.0,2.0]]")
    assert motion.q_start[1] == pytest.approx([0.25 / DEGREE, 1.0 / DEGREE])
    assert motion.q_goal == (motion.q_start[0], (1.0, 2.0))


def test_fields_at_their_defaults_are_no_part_of_the_identity() -> None:
    assert set(robot().canonical()) == {"_target_", "revision", "urdf", "srdf"}
    assert robot(fixed={"b": 1.0, "a": 2}).canonical()["fixed"] == [["a", 2.0], ["b", 1.0]]
    words = ("robot.group=left_arm", "robot.fixed={left_finger: 0.02}")
    by_words = task(f"robot.srdf={SRDF}", *words, path=URDF)
    assert by_words.robot.canonical()["fixed"] == [["left_finger", 0.02]]


def test_limits_that_are_missing_are_given_by_settings() -> None:
    joints = ["left_shoulder", "right_shoulder"]
    model = robot(joints=joints, continuous_turns=2.5, turn_limit=90.0).build().model
    assert model.upperPositionLimit / DEGREE == pytest.approx([900.0, 90.0])
    assert np.array_equal(model.lowerPositionLimit, -model.upperPositionLimit)


def test_two_groups_are_two_arms_and_share_the_trunk() -> None:
    with pytest.raises(EvoexpError, match="in which none hangs on a later one"):
        robot(groups=["right_arm", "torso"], tool_frames=["right_fore", "chest"]).build()
    assembly = robot(groups=["torso", "right_arm"], tool_frames=["chest", "right_fore"]).build()
    assert assembly.arm_slices.tolist() == [[0, 1], [1, 3]]
    assert list(assembly.model.names)[1:] == ["trunk_lift", "right_shoulder", "right_elbow"]
    names = {item.name for item in assembly.geometry.geometryObjects}
    assert len(names) == assembly.geometry.ngeoms == 9 and "trunk" in names
    assert frozenset(("chest", "right_upper")) in assembly.disabled
    agrees(assembly, STANDING)


# each follows the one before: multiplier, offset [rad]
RULES = ((2.0, 0.3), (-0.5, 0.7), (1.5, -0.2))


def chain_of_followers(ground: bool) -> str:
    """Write an arm whose joints follow one another, on a joint that turns, or not."""
    text = f'<robot name="x"><link name="l4">{BODY}</link>'
    for k in range(4):
        more = f'<origin xyz="0.3 0 0.1"/><axis xyz="0 {(k + 1) % 2} {k % 2}"/>'
        more += '<limit lower="-3" upper="3"/>'
        if k:
            multiplier, offset = RULES[k - 1]
            more += f'<mimic joint="j{k}" multiplier="{multiplier}" offset="{offset}"/>'
        text += f'<link name="l{k}"/>' + joint(f"j{k + 1}", "revolute", f"l{k}", f"l{k + 1}", more)
    if ground:
        text += '<link name="ground"/>' + joint("j0", "continuous", "ground", "l0")
    return text + "</robot>"


@pytest.mark.parametrize("standing", [False, True], ids=["moving", "standing"])
@pytest.mark.parametrize("lead", [-0.6, 0.0, 0.45])
def test_offsets_go_through_chains_of_followers(
    tmp_path: Path, lead: float, standing: bool
) -> None:
    """The first joint moves; or it stands, as the whole chain does, and a joint before it moves."""
    settings = {"joints": ["j0"], "fixed": {"j1": lead / DEGREE}} if standing else {}
    assembly = urdf_of(tmp_path, chain_of_followers(standing), **settings).build()
    whole, q = SlowRobot(tmp_path / "r.urdf"), np.array([0.0 if standing else lead])
    (place,) = placements(assembly, q)[1]
    assert np.abs(place.homogeneous - whole.link_pose("l4", {"j1": lead})).max() < 1e-12
    if not standing:
        origins = forward_kinematics(assembly.table, q[:, None])[1][..., 0]
        for k, origin in enumerate(origins, 1):
            expected = whole.link_pose(f"l{k}", {"j1": lead})[:3, 3]
            assert np.abs(origin - expected).max() < 1e-12
