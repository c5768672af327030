"""Joints of a URDF that move, stand and follow: against Pinocchio's reading of the whole file."""

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from evoexp.collision.body_table import body_table
from evoexp.collision.motion_bounds import (
    approach_bounds,
    joint_frames,
    joint_twists,
    pair_reaches,
    reaches,
)
from evoexp.errors import EvoexpError
from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import DEGREE
from evoexp.records import FloatArray
from evoexp.robots.assembly import Assembly
from evoexp.robots.kinematics import KinematicChain
from evoexp.robots.poses import frame_pose, local_pose
from evoexp.robots.urdf import Urdf
from evoexp.testing import conditions
from robots.joint_frames import forward_kinematics

DATA = Path(__file__).parent / "data" / "two_arms"
URDF, SRDF = DATA / "two_arms.urdf", DATA / "two_arms.srdf"
FOLLOWING = {"left_coupler": ("left_elbow", -0.5, 0.2), "a_left_thumb": ("left_finger", 1.0, 0.0)}


def robot(path: Path = URDF, **settings: Any) -> Urdf:
    given = {"path": str(path), "srdf": str(SRDF), **settings}
    found = Urdf.read_files(given, "robot")
    for name in ("urdf", "srdf"):
        found[name] = {"sha256": found[name]["sha256"]}
    return Urdf.model_validate(found, strict=False)


def test_without_a_tool_frame_the_tool_is_the_farthest_fixed_link(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    body = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
    names = ("base", "arm", "flange", "tip")
    links = "".join(f'<link name="{name}">{body * (name == "arm")}</link>' for name in names)
    fixed = "".join(
        f'<joint name="{child}_joint" type="fixed"><parent link="{parent}"/>'
        f'<child link="{child}"/><origin xyz="0 0 {height}"/></joint>'
        for parent, child, height in (("arm", "flange", 0.3), ("flange", "tip", 0.2))
    )
    turning = (
        '<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    )
    path.write_text(f'<robot name="arm">{links}{turning}{fixed}</robot>')
    found = Urdf.read_files({"path": str(path)}, "robot")
    found["urdf"] = {"sha256": found["urdf"]["sha256"]}
    (tool,) = Urdf.model_validate(found, strict=False).build().tools
    assert tool.position == pytest.approx([0.0, 0.0, 0.5])


def whole_placements(path: Path, values: dict[str, float]) -> tuple[Any, Any, dict[str, Any]]:
    """Return model, data and placements of the bodies by the whole URDF, every joint by name."""
    text, no_limit = path.read_text(), '<limit effort="1" velocity="1"/></joint>'
    # Pinocchio reads neither leftovers of fixed joints nor joints without a limit
    text = text.replace('<limit lower="1" upper="-1"/><mimic joint="nothing"/>', "")
    for name in ("right_upper", "left_thumb"):
        head, tail = text.split(f'<child link="{name}"/>')
        text = head + f'<child link="{name}"/>' + tail.replace("</joint>", no_limit, 1)
    model = pin.buildModelFromXML(text)
    geometry = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    q = pin.neutral(model)
    for joint in range(1, model.njoints):
        value, place = values[model.names[joint]], model.idx_qs[joint]
        if model.nqs[joint] == 2:
            q[place : place + 2] = np.cos(value), np.sin(value)
        else:
            q[place] = value
    data, placed = model.createData(), geometry.createData()
    pin.updateGeometryPlacements(model, data, geometry, placed, q)
    pin.updateFramePlacements(model, data)
    names = [item.name.rpartition("_")[0] for item in geometry.geometryObjects]
    return model, data, dict(zip(names, placed.oMg, strict=True))


def agrees(assembly: Assembly, standing: dict[str, float], tool: str = "") -> None:
    """Compare bodies, joints of the table and the tool's frame at random configurations."""
    model = assembly.model
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    free = [joint for joint in range(1, model.njoints) if model.nqs[joint] == 1]
    for seed in range(20):
        q = low + (high - low) * np.random.default_rng(seed).random(model.nq)
        values = {model.names[joint]: float(q[model.idx_qs[joint]]) for joint in free}
        values = standing | values
        for name, (source, multiplier, offset) in FOLLOWING.items():
            values[name] = multiplier * values[source] + offset
        whole, data, expected = whole_placements(URDF, values)
        own, placed = model.createData(), assembly.geometry.createData()
        pin.updateGeometryPlacements(model, own, assembly.geometry, placed, q)
        names = [item.name for item in assembly.geometry.geometryObjects]
        assert sorted(names) == sorted(expected)
        for name, placement in zip(names, placed.oMg, strict=True):
            assert np.abs(placement.homogeneous - expected[name].homogeneous).max() < 1e-12
        rotations, origins = forward_kinematics(assembly.table, q[:, None])
        for joint in range(1, model.njoints):
            frame = data.oMi[whole.getJointId(model.names[joint])]
            turned = rotations[joint - 1, :, :, 0] @ assembly.table.alignment[joint - 1].T
            assert np.abs(turned - frame.rotation).max() < 1e-12
            assert np.abs(origins[joint - 1, :, 0] - frame.translation).max() < 1e-12
        if tool:
            end = assembly.tools[0]
            local = local_pose(assembly.table, end.joint, end.rotation, end.position)
            pose = frame_pose(assembly.table, end.joint - 1, local, q)
            frame = data.oMf[whole.getFrameId(tool)]
            assert np.abs(pose[9:] - frame.translation).max() < 1e-12
            assert np.abs(pose[:9] - frame.rotation.ravel()).max() < 1e-12


STANDING = {
    "trunk_lift": 0.05,
    "left_shoulder": 0.0,
    "left_elbow": 0.0,
    "left_finger": 0.01,
    "right_shoulder": 0.0,
    "right_elbow": 0.0,
}


def test_a_group_moves_and_the_other_joints_stand_at_the_limit_nearest_to_0() -> None:
    assembly = robot(group="right_arm").build()
    assert list(assembly.model.names) == ["universe", "right_shoulder", "right_elbow"]
    agrees(assembly, STANDING, "right_fore")


def test_joints_that_are_named_move_and_the_others_stand_where_they_are_told() -> None:
    fixed = {"left_elbow": 30.0, "trunk_lift": 0.2, "left_finger": 0.03, "left_shoulder": -100.0}
    found = robot(joints=["right_elbow", "right_shoulder"], fixed=fixed)
    turned = {"left_elbow": 30.0 * DEGREE, "left_shoulder": -100.0 * DEGREE}
    told = fixed | turned
    agrees(found.build(), STANDING | told)


@pytest.mark.parametrize("group", ["", "left", "left_arm", "left_gripper"])
def test_joints_that_follow_others_do_so_in_every_model(group: str) -> None:
    """The thumb stands before the finger that it follows in Pinocchio's order."""
    assembly = robot(group=group).build()
    table = assembly.table
    follow = {str(assembly.model.names[int(k) + 1]) for k in np.flatnonzero(~table.free)}
    left = {"left_coupler", "a_left_thumb"}
    expected = {"left_arm": {"left_coupler"}, "left_gripper": {"a_left_thumb"}}.get(group, left)
    assert follow == expected and table.num_coordinates == assembly.model.nq
    if group == "left_gripper":
        assert table.slides.tolist() == [True]
    agrees(assembly, STANDING)


def test_the_certifier_bounds_hold_for_joints_that_follow() -> None:
    """Frames, twists and greatest speeds against differences of Pinocchio's placements."""
    assembly = robot(group="left").build()
    model, chain, rng = assembly.model, assembly.table.chain, np.random.default_rng(3)
    bodies = body_table(assembly.table, list(assembly.geometry.geometryObjects))
    count, joints = len(bodies.joint), len(chain.parent)
    pairs = np.array([(a, b) for b in range(count) for a in range(b)], dtype=np.int64)
    for _ in range(10):
        coefficients = np.zeros((4, model.nq))
        coefficients[:2] = rng.uniform(-1.0, 1.0, (2, model.nq))
        strokes = np.abs(coefficients).sum(axis=0)
        reach = reaches(chain, bodies.joint, bodies.from_origin, bodies.from_axis, strokes)
        bounds, above = np.empty((2, len(pairs))), np.empty(joints)
        by_joint = pair_reaches(pairs, reach)
        approach(tuple(chain), coefficients, by_joint, bounds, above)
        frames, twists = np.empty((joints, 12)), np.empty((joints, 6))
        frames_and_twists(tuple(chain), coefficients, 0.5, frames, twists)
        before = placements(assembly, coefficients[0] + 0.5 * coefficients[1])
        after = placements(assembly, coefficients[0] + (0.5 + 1e-6) * coefficients[1])
        for k in range(joints):
            turned = frames[k, :9].reshape(3, 3) @ assembly.table.alignment[k].T
            assert np.abs(turned - before[0][k + 1].rotation).max() < 1e-12
            assert np.abs(frames[k, 9:] - before[0][k + 1].translation).max() < 1e-12
            speed = (after[0][k + 1].translation - before[0][k + 1].translation) * 1e6
            expected = twists[k, 3:] + np.cross(twists[k, :3], frames[k, 9:])
            assert speed == pytest.approx(expected, abs=1e-4)
        for pair, (a, b) in enumerate(pairs.tolist()):
            apart = [
                np.linalg.norm(p[1][a].translation - p[1][b].translation) for p in (before, after)
            ]
            assert abs(apart[1] - apart[0]) * 1e6 <= bounds[0, pair] + 1e-4


@kernel
def approach(
    fields: Any, coefficients: FloatArray, by_joint: FloatArray, out: FloatArray, above: FloatArray
) -> None:
    """Bound the approach of all pairs on the whole segment."""
    approach_bounds(KinematicChain(*fields), coefficients, 0.0, 1.0, by_joint, out, above)


@kernel
def frames_and_twists(
    fields: Any, coefficients: FloatArray, u: float, frames: FloatArray, twists: FloatArray
) -> None:
    """Write frames and twists of all joints."""
    chain, q = KinematicChain(*fields), np.empty(coefficients.shape[1])
    q[:] = coefficients[0] + u * (coefficients[1] + u * (coefficients[2] + u * coefficients[3]))
    joint_frames(chain, q, frames)
    joint_twists(chain, coefficients, u, frames, twists)


def placements(assembly: Assembly, q: FloatArray) -> tuple[Any, Any]:
    """Return Pinocchio's placements of joints and of bodies."""
    data, placed = assembly.model.createData(), assembly.geometry.createData()
    pin.updateGeometryPlacements(assembly.model, data, assembly.geometry, placed, q)
    return data.oMi, placed.oMg


def test_a_base_moves_by_one_coordinate_after_another() -> None:
    """At x, y, z, yaw, pitch, roll the bodies stand as those of a base that is placed there."""
    still = robot(
        group="right_arm",
        base_position=[0.3, -0.2, 0.1],
        base_rotation=[10.0, 20.0, 30.0],
    ).build()
    moving = robot(group="right_arm", base="floating").build()
    assert [str(name) for name in moving.model.names][1:4] == ["base_x", "base_y", "base_z"]
    arm = np.array([0.4, -0.7])
    pose = np.array([0.3, -0.2, 0.1, *(DEGREE * np.array([30.0, 20.0, 10.0]))])
    for one, two in zip(
        placements(still, arm)[1], placements(moving, np.concatenate([pose, arm]))[1], strict=True
    ):
        assert np.abs(one.homogeneous - two.homogeneous).max() < 1e-12
    assert robot(group="right_arm", base="planar").build().model.nq == 5


@pytest.mark.parametrize(("base", "nq"), [("fixed", 1), ("free", 4)])
def test_planar_joints_of_a_file_stand_or_move(base: str, nq: int, tmp_path: Path) -> None:
    text = (
        '<robot name="x"><link name="a"/><joint name="floor" type="planar"><parent link="a"/>'
        '<child link="b"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/></joint><link name="b"/>'
        '<joint name="turn" type="continuous"><parent link="b"/><child link="c"/>'
        '<axis xyz="0 0 1"/>'
        '</joint><link name="c"><collision><geometry><sphere radius="1"/></geometry></collision>'
        "</link></robot>"
    )
    path = tmp_path / "x.urdf"
    path.write_text(text)
    assembly = robot(path, base=base).build()
    assert assembly.model.nq == nq
    placed = placements(assembly, np.full(nq, 0.5))[1][0]
    if base == "fixed":
        assert placed.translation == pytest.approx([0.0, 0.0, 1.0])
    else:  # it stays in the plane across y, and turns about y, then z
        assert placed.translation[1] == 0.0
        assert np.hypot(placed.translation[0], placed.translation[2] - 1.0) == pytest.approx(
            0.5**0.5
        )
        about = pin.utils.rotate("y", 0.5) @ pin.utils.rotate("z", 0.5)
        assert placed.rotation == pytest.approx(about)


def scenario_of(*overrides: str) -> Any:
    words = ("robot=urdf", f"robot.path={URDF}", f"robot.srdf={SRDF}", *overrides)
    (condition,) = conditions(*words).values()
    return condition.scenario


POSTURES = (
    *("scenario=urdf_reach", "planner=posture_es", "ga=corsepius"),
    *("objective=corsepius_reach", "collision=corsepius_spheres", "robot.group=left_arm"),
)
STRINGS = (
    *("scenario=urdf_two_arms", "planner=rana_puma", "ga=rana_puma", "objective=rana_puma"),
    *("collision=urdf_two_arms", "robot.groups=[left_arm,right_arm]"),
)


def test_states_are_start_and_goal_by_their_names() -> None:
    task = scenario_of(*POSTURES, "scenario.q_start=bent")
    assert task.q_start == pytest.approx([0.5 / DEGREE, -1.0 / DEGREE])
    motion = scenario_of(*STRINGS, "scenario.q_start=bent", "scenario.q_goal=[bent,[1.0,2.0]]")
    assert motion.q_start[1] == pytest.approx([0.25 / DEGREE, 1.0 / DEGREE])
    assert motion.q_goal[0] == motion.q_start[0] and motion.q_goal[1] == (1.0, 2.0)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (
            (*POSTURES, "scenario.q_start=bend"),
            "scenario.q_start: must be a state that the robot's",
        ),
        ((*POSTURES, "scenario.q_start=bend"), "was 'bend'; did you mean 'bent'?"),
        (
            (*POSTURES[:-1], "robot.group=left", "scenario.q_start=bent"),
            "scenario.q_start: must be a state that tells left_finger, was 'bent'",
        ),
        (
            (*STRINGS, "scenario.q_goal=[bent]"),
            "must be one state or list per arm of the robot (2)",
        ),
    ],
)
def test_states_that_are_not_there(overrides: tuple[str, ...], message: str) -> None:
    with pytest.raises(EvoexpError) as found:
        scenario_of(*overrides)
    assert message in str(found.value)


def test_fields_at_their_defaults_are_no_part_of_the_identity() -> None:
    plain = robot().canonical()
    assert set(plain) == {"_target_", "revision", "urdf", "srdf"}
    assert robot(fixed={"b": 1.0, "a": 2}).canonical()["fixed"] == [["a", 2.0], ["b", 1.0]]


def test_limits_that_are_missing_are_given_by_settings() -> None:
    model = (
        robot(joints=["left_shoulder", "right_shoulder"], continuous_turns=2.5, turn_limit=90.0)
        .build()
        .model
    )
    assert model.upperPositionLimit / DEGREE == pytest.approx([900.0, 90.0])
    assert np.array_equal(model.lowerPositionLimit, -model.upperPositionLimit)


def test_two_groups_are_two_arms_and_share_the_trunk() -> None:
    assembly = robot(groups=["right_arm", "torso"], tool_frames=["right_fore", "chest"])
    with pytest.raises(EvoexpError, match="in which none hangs on a later one"):
        assembly.build()
    assembly = robot(groups=["torso", "right_arm"], tool_frames=["chest", "right_fore"]).build()
    assert assembly.arm_slices.tolist() == [[0, 1], [1, 3]]
    assert list(assembly.model.names)[1:] == ["trunk_lift", "right_shoulder", "right_elbow"]
    names = [item.name for item in assembly.geometry.geometryObjects]
    assert len(names) == len(set(names)) == 9 and "trunk" in names
    assert frozenset(("chest", "right_upper")) in assembly.disabled
    agrees(assembly, STANDING)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"group": "right_arms"}, "robot.group: must be a group of the SRDF (left_arm, left_gripp"),
        ({"group": "hollow"}, "robot.group: must be a group with a joint that moves, was 'hollow'"),
        ({"group": "loop"}, "robot.group: must be a group that does not contain itself, was 'loop"),
        ({"groups": ["left_arm", "left"]}, "robot.groups: must be groups that have no joint in co"),
        ({"groups": ["left_arm", "lift"]}, "robot.groups[1]: must be a group of the SRDF"),
        ({"joints": ["right_elbo"]}, "was 'right_elbo'; did you mean 'right_elbow'?"),
        ({"joints": ["left_mount"]}, "robot.joints: must be names of joints that move, was"),
        ({"joints": ["left_coupler"]}, "move of their own, was \"'left_coupler', which follows 'l"),
        (
            {"joints": ["left_elbow"], "fixed": {"left_elbow": 1.0}},
            "robot.fixed.left_elbow: must be left out: this joint moves, was 1.0",
        ),
        ({"fixed": {"left_elbo": 1.0}, "group": "torso"}, "did you mean 'left_elbow'?"),
        (
            {"fixed": {"trunk_lift": 0.4}, "group": "left_arm"},
            "robot.fixed.trunk_lift: must be within the joint's limits [0.05, 0.3], was 0.4",
        ),
        (
            {"fixed": {"left_coupler": 0.4}, "group": "torso"},
            "robot.fixed.left_coupler: must be left out: this joint follows 'left_elbow'",
        ),
        ({"group": "left_arm", "joints": ["left_elbow"]}, "robot.joints: must be left out beside"),
        ({"tool_frame": "trunk", "group": "left_arm"}, "robot.tool_frame: must be a frame that m"),
        ({"groups": ["left_arm"], "tool_frames": ["a", "b"]}, "robot.tool_frames: must be a frame"),
    ],
)
def test_refusals(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(EvoexpError) as found:
        robot(**settings).build()
    assert message in str(found.value)
    assert "\n" not in str(found.value)


def test_by_the_command_line() -> None:
    words = (
        *("scenario=urdf_reach", "planner=posture_es", "ga=corsepius", "robot=urdf"),
        *("objective=corsepius_reach", "collision=corsepius_spheres", f"robot.path={URDF}"),
        *(f"robot.srdf={SRDF}", "robot.group=left_arm", "robot.fixed={left_finger: 0.02}"),
    )
    (condition,) = conditions(*words).values()
    assert condition.robot.canonical()["fixed"] == [["left_finger", 0.02]]


CHAIN = (
    '<robot name="x"><link name="l0"/>{joints}<link name="l4"><collision><geometry>'
    '<sphere radius="0.1"/></geometry></collision></link></robot>'
)
# each follows the one before: multiplier, offset [rad]
RULES = {"j2": ("j1", 2.0, 0.3), "j3": ("j2", -0.5, 0.7), "j4": ("j3", 1.5, -0.2)}


def chain(path: Path, *, follow: bool) -> Urdf:
    """Write an arm whose joints follow one another, or are all free."""
    joints = ""
    for k in range(1, 5):
        source, multiplier, offset = RULES.get(f"j{k}", ("", 0.0, 0.0))
        rule = f'<mimic joint="{source}" multiplier="{multiplier}" offset="{offset}"/>'
        joints += (
            f'<joint name="j{k}" type="revolute"><parent link="l{k - 1}"/><child link="l{k}"/>'
            f'<origin xyz="0.3 0 0.1"/><axis xyz="0 {k % 2} {1 - k % 2}"/>'
            f'<limit lower="-3" upper="3"/>{rule if follow and source else ""}</joint>'
        )
        joints += f'<link name="l{k}"/>' if k < 4 else ""
    path.write_text(CHAIN.format(joints=joints))
    return Urdf.model_validate(Urdf.read_files({"path": str(path)}, "robot"), strict=False)


@pytest.mark.parametrize("standing", [False, True], ids=["moving", "standing"])
def test_offsets_go_through_chains_of_followers(tmp_path: Path, standing: bool) -> None:
    """Against the same arm with four free joints, whose values follow the rules one by one."""
    followers = chain(tmp_path / "follow.urdf", follow=True)
    free = chain(tmp_path / "free.urdf", follow=False).build()
    for lead in (-0.6, 0.0, 0.45):
        values = {"j1": lead}
        for name, (source, multiplier, offset) in RULES.items():
            values[name] = multiplier * values[source] + offset
        expected = placements(free, np.array([values[f"j{k}"] for k in range(1, 5)]))[1][0]
        if standing:  # a joint before the chain moves, the chain stands
            text = (tmp_path / "follow.urdf").read_text()
            turn = (
                '<link name="ground"/><joint name="j0" type="continuous"><parent link="ground"/>'
                '<child link="l0"/></joint></robot>'
            )
            (tmp_path / "still.urdf").write_text(text.replace("</robot>", turn))
            fixed = {"j1": lead / DEGREE}
            settings = {"path": str(tmp_path / "still.urdf"), "joints": ["j0"], "fixed": fixed}
            followers = Urdf.model_validate(Urdf.read_files(settings, "robot"), strict=False)
        assembly, q = followers.build(), np.array([0.0 if standing else lead])
        placed = placements(assembly, q)[1][0]
        assert np.abs(placed.homogeneous - expected.homogeneous).max() < 1e-12
        if not standing:
            origins = forward_kinematics(assembly.table, q[:, None])[1]
            whole = placements(free, np.array([values[f"j{k}"] for k in range(1, 5)]))[0]
            for joint in range(1, 5):
                assert np.abs(origins[joint - 1, :, 0] - whole[joint].translation).max() < 1e-12
