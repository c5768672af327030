import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp.errors import SettingError
from evoexp.robots.dh_chain import DhChain, DhJoint
from evoexp.robots.poses import compose as behind
from evoexp.robots.poses import frame_pose, invert, local_pose, pose_of
from robots.joint_frames import forward_kinematics

SPHERE = {"name": "ball", "joint": 1, "shape": "sphere", "center": (0.0, 0.0, 0.0), "radius": 0.1}


def robot(experiment: str) -> DhChain:
    found = composed(f"experiment={experiment}").robot
    assert isinstance(found, DhChain)
    return found


def denavit_hartenberg(row: tuple[float, float, float, float], q: float) -> np.ndarray:
    """The matrix as textbooks print it."""
    a, alpha, d, theta = row[0], np.deg2rad(row[1]), row[2], np.deg2rad(row[3]) + q
    s, c, sa, ca = np.sin(theta), np.cos(theta), np.sin(alpha), np.cos(alpha)
    return np.array(
        [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1.0]]
    )


@pytest.mark.parametrize("experiment", ["corsepius_ball", "corsepius_shelf", "corsepius_gate_wide"])
def test_the_tool_is_where_the_table_puts_it(experiment: str) -> None:
    chain = robot(experiment)
    assembly = chain.build()
    rng = np.random.default_rng(0)
    tool = assembly.tools[0]
    local = local_pose(assembly.table, tool.joint, tool.rotation, tool.position)
    for _ in range(50):
        q = rng.uniform(assembly.model.lowerPositionLimit, assembly.model.upperPositionLimit)
        expected = np.eye(4)
        expected[:3, 3] = chain.base_position
        for joint, value in zip(chain.joints, q, strict=True):
            expected = expected @ denavit_hartenberg(joint.dh, value)
        offset = np.eye(4)
        offset[:3, 3] = chain.tool_position
        expected = expected @ offset
        pose = frame_pose(assembly.table, tool.joint - 1, local, q)
        assert np.abs(pose[:9].reshape(3, 3) - expected[:3, :3]).max() < 1e-12
        assert np.abs(pose[9:] - expected[:3, 3]).max() < 1e-12


def test_the_manus_has_its_proportions() -> None:
    assembly = robot("corsepius_ball").build()
    tool = assembly.tools[0]
    local = local_pose(assembly.table, tool.joint, tool.rotation, tool.position)
    stretched = frame_pose(
        assembly.table, tool.joint - 1, local, np.deg2rad([0.0, 0.0, 90.0, 0.0, 0.0, 0.0])
    )
    assert stretched[9:] == pytest.approx([0.40 + 0.32 + 0.16, 0.105, 0.60])
    assert stretched[[2, 5, 8]] == pytest.approx(
        [1.0, 0.0, 0.0], abs=1e-12
    )  # z: the grasping direction


def test_bodies_move_with_their_joints() -> None:
    assembly = robot("corsepius_ball").build()
    names = [item.name for item in assembly.geometry.geometryObjects]
    assert names == [
        "column",
        "shoulder",
        "upper_arm",
        "forearm",
        "wrist",
        "hand",
        "finger_left",
        "finger_right",
    ]
    data, placements = assembly.model.createData(), assembly.geometry.createData()
    pin.updateGeometryPlacements(assembly.model, data, assembly.geometry, placements, np.zeros(6))
    upper_arm = placements.oMg[2].translation
    assert upper_arm == pytest.approx([0.20, 0.105, 0.60])


def test_base_and_tool_are_chosen_freely() -> None:
    joint = DhJoint(dh=(1.0, 0.0, 0.0, 0.0), limits=(-90.0, 90.0))
    chain = DhChain(
        joints=(joint,),
        bodies=(SPHERE,),
        base_position=(0.0, 0.0, 1.0),
        base_rotation=(0.0, 90.0, 0.0),
        tool_position=(0.0, 0.0, 0.5),
        tool_rotation=(90.0, 0.0, 0.0),
    )
    assembly = chain.build()
    tool = assembly.tools[0]
    local = local_pose(assembly.table, tool.joint, tool.rotation, tool.position)
    pose = frame_pose(assembly.table, 0, local, np.zeros(1))
    assert pose[9:] == pytest.approx(
        [0.5, 0.0, 0.0], abs=1e-12
    )  # x of the base points down, its z along the world's x
    assert pose[[2, 5, 8]] == pytest.approx([0.0, -1.0, 0.0], abs=1e-12)


def test_sliding_joints_slide_along_z() -> None:
    joints = (
        DhJoint(dh=(0.0, 90.0, 0.2, 0.0), limits=(0.0, 0.5), kind="prismatic"),
        DhJoint(dh=(1.0, 0.0, 0.0, 0.0), limits=(-90.0, 90.0)),
    )
    assembly = DhChain(joints=joints, bodies=(SPHERE,), base_position=(0.0, 0.0, 0.0)).build()
    assert assembly.model.upperPositionLimit[0] == 0.5
    _, origins = forward_kinematics(assembly.table, np.array([[0.3], [0.0]]))
    assert origins[1, :, 0] == pytest.approx([0.0, 0.0, 0.5])


def test_poses_compose_and_invert() -> None:
    for _ in range(20):
        one, two = pin.SE3.Random(), pin.SE3.Random()
        both = one * two
        a, b = pose_of(one.rotation, one.translation), pose_of(two.rotation, two.translation)
        assert behind(a, b) == pytest.approx(pose_of(both.rotation, both.translation))
        assert behind(invert(a), a) == pytest.approx(pose_of(np.eye(3), np.zeros(3)), abs=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"bodies": (SPHERE, SPHERE)},
            r"bodies\[1\].name: must be a name that no other body has, was 'ball'",
        ),
        ({"bodies": ({**SPHERE, "joint": 2},)}, r"bodies\[0\].joint: must be at most 1, was 2"),
    ],
)
def test_bodies_that_do_not_fit(change: dict[str, object], message: str) -> None:
    joint = DhJoint(dh=(1.0, 0.0, 0.0, 0.0), limits=(-90.0, 90.0))
    settings = {"joints": (joint,), "bodies": (SPHERE,), "base_position": (0.0, 0.0, 0.0)} | change
    with pytest.raises(SettingError, match=message):
        DhChain(**settings)  # type: ignore[arg-type]


def test_limits_in_the_wrong_order_are_refused() -> None:
    joint = DhJoint(dh=(1.0, 0.0, 0.0, 0.0), limits=(90.0, -90.0))
    with pytest.raises(
        SettingError, match=r"joints\[0\].limits: must be \[least, greatest\] with least < greatest"
    ):
        DhChain(joints=(joint,), bodies=(SPHERE,), base_position=(0.0, 0.0, 0.0))  # type: ignore[arg-type]


def test_a_rod_without_length_is_refused() -> None:
    joint = DhJoint(dh=(1.0, 0.0, 0.0, 0.0), limits=(-90.0, 90.0))
    rod = {
        "name": "rod",
        "joint": 1,
        "shape": "capsule",
        "start": (0.0,) * 3,
        "end": (0.0,) * 3,
        "radius": 0.1,
    }
    chain = DhChain(joints=(joint,), bodies=(rod,), base_position=(0.0, 0.0, 0.0))
    with pytest.raises(
        SettingError, match=r"robot.bodies\[0\].end: must be another point than start"
    ):
        chain.build()
