"""Chains, arms and kinematics of robots, against Pinocchio, textbooks and plain geometry."""

from typing import Any

import coal
import numpy as np
import pinocchio as pin
import pytest

from composed import composed
from evoexp.collision.bodies.touching_spheres import TouchingSpheres
from evoexp.errors import EvoexpError, SettingError
from evoexp.numeric.compilation import kernel
from evoexp.numeric.vectors import LANES
from evoexp.records import FloatArray
from evoexp.robots import planar_ends
from evoexp.robots.arms import Arms, DhChain, DhJoint, PlanarChain, SerialChain, SerialJoint
from evoexp.robots.kinematics import MAX_JOINTS, kinematic_table
from evoexp.robots.planar_ends import PlanarArm, block_ends, bring_tip_to, planar_arm
from robots.robot_samples import forward_kinematics, placements, random_tree, tool_pose

Z, Y, X = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)


def planar(*lengths: float, **settings: Any) -> PlanarChain:
    return PlanarChain(**({"link_lengths": lengths, "base_position": (0.0, 0.0)} | settings))


ARM = planar(3.0, 2.0, 1.0, base_position=(0.5, -1.0), base_angle=30.0)
NUM_POSITIONS = 40


def test_bodies_and_tool_of_a_planar_chain_by_hand() -> None:
    settings = {"link_radius": 0.1, "tool_radius": 0.3, "base_position": (1.0, 2.0)}
    assembly = planar(2.0, 1.0, base_angle=90.0, **settings).build()
    *links, ball = (item.geometry for item in assembly.geometry.geometryObjects)
    assert all(isinstance(shape, coal.Capsule) for shape in links) and isinstance(ball, coal.Sphere)
    sizes = [(2.0 * shape.halfLength, shape.radius) for shape in links]
    assert sizes == [(2.0, 0.1), (1.0, 0.1)] and ball.radius == 0.3
    assert [link.is_tool for link in assembly.links] == [False, False, True]
    joints, bodies = placements(assembly, np.array([0.3, 0.4]))
    first, second = (np.array([-np.sin(angle), np.cos(angle), 0.0]) for angle in (0.3, 0.7))
    points = np.cumsum([(1.0, 2.0, 0.0), 2.0 * first, second], axis=0)
    for k in (0, 1):
        half = np.array([0.0, 0.0, links[k].halfLength])
        assert bodies[k].act(-half) == pytest.approx(points[k], abs=1e-12)
        assert bodies[k].act(half) == pytest.approx(points[k + 1], abs=1e-12)
        link = assembly.links[k]
        assert joints[link.joint].act(link.start) == pytest.approx(points[k], abs=1e-12)
        assert joints[link.joint].act(link.end) == pytest.approx(points[k + 1], abs=1e-12)
    assert bodies[2].translation == pytest.approx(points[2], abs=1e-12)
    with pytest.raises(SettingError, match="robot: must be without tools"):
        TouchingSpheres(spheres_per_link=5, sphere_radius=0.1, collision_substeps=1).bind(
            assembly, ()
        )


def test_joint_limits_reach_the_model() -> None:
    limits = ((-1.0, 1.0), (0.0, 2.0), (-0.5, 0.25))
    model = ARM.model_copy(update={"joint_limits": limits}).build().model
    assert model.lowerPositionLimit.tolist() == [-1.0, 0.0, -0.5]
    assert model.upperPositionLimit.tolist() == [1.0, 2.0, 0.25]


def test_links_run_from_joint_to_joint_and_the_column_stands_still() -> None:
    joints = (
        SerialJoint(axis=Z, offset=(0.0, 0.0, 0.5)),
        SerialJoint(axis=Y, offset=(0.0, 0.0, 0.0)),
        SerialJoint(axis=X, offset=(0.7, 0.0, 0.1), kind="prismatic"),
    )
    base = {"base_position": (3.0, 0.0, 0.0), "base_angle": 90.0}
    arm = SerialChain(joints=joints, tip=(0.2, 0.0, 0.0), **base)
    assembly = Arms(arms=(arm, arm)).build()
    assert assembly.arm_slices.tolist() == [[0, 3], [3, 6]]
    links = assembly.links
    owners = [(link.arm, link.joint) for link in links]
    assert owners == [(0, 0), (0, 2), (0, 3), (1, 0), (1, 5), (1, 6)]
    assert [links[0].start.tolist(), links[0].end.tolist()] == [[3.0, 0.0, 0.0], [3.0, 0.0, 0.5]]
    # the first arm slides out, the second one points down; +x of the arm is the world's +y
    frames, _ = placements(assembly, np.array([0.0, 0.0, 0.25, 0.0, np.pi / 2, 0.0]))
    tips = [frames[link.joint].act(link.end) for link in (links[2], links[5])]
    assert tips[0] == pytest.approx([3.0, 0.7 + 0.25 + 0.2, 0.6], abs=1e-12)
    assert tips[1] == pytest.approx([3.0, 0.1, 0.5 - 0.9], abs=1e-12)


@kernel
def ends_at(
    starts: FloatArray, ends: FloatArray, arm: PlanarArm, at: int, num: int, out: FloatArray
) -> None:
    block_ends(starts, ends, arm, at, num, out[0], out[1])


def link_ends(paths: FloatArray, position: int, num: int = NUM_POSITIONS) -> FloatArray:
    """Return x and y of base and link ends of a block of paths, (2, 4, LANES)."""
    out = np.empty((2, 4 * LANES))
    ends_at(*paths.reshape(2, -1), planar_arm(ARM.build()), position, num, out)
    return out.reshape(2, 4, LANES)


def test_link_ends_along_paths_agree_with_pinocchio() -> None:
    starts, ends = paths = np.random.default_rng(0).uniform(-3.0, 3.0, (2, 3, LANES))
    for position in (0, 1, 13, NUM_POSITIONS):
        found = link_ends(paths, position)
        q = starts + position / NUM_POSITIONS * (ends - starts)
        for lane in range(LANES):
            frames, _ = placements(ARM.build(), q[:, lane])
            tip = frames[3].act(np.array([1.0, 0.0, 0.0]))
            expected = np.array([*(frames[j].translation for j in (1, 2, 3)), tip])[:, :2]
            np.testing.assert_allclose(found[..., lane].T, expected, atol=1e-13)
    last = link_ends(paths, NUM_POSITIONS)
    assert np.array_equal(last, link_ends(paths[[1, 1]], 0, 1)), "to the last bit"


def plain_steps(q: FloatArray, target: FloatArray, limits: FloatArray, arm: PlanarArm) -> bool:
    """Step by Jᵀ (J Jᵀ + λ)⁻¹ e, the Jacobian by turning the way from each joint to the tip."""
    reach = arm.lengths.sum()
    for _ in range(planar_ends.MOST_STEPS):
        links = arm.lengths * np.exp(1j * (arm.base_angle + np.cumsum(q)))
        to_tip = np.cumsum(links[::-1])[::-1]  # from each joint
        error = complex(*target) - complex(arm.base_x, arm.base_y) - links.sum()
        if abs(error) <= planar_ends.CLOSE * reach:
            return True
        jacobian = np.array([(1j * to_tip).real, (1j * to_tip).imag])  # (2, N)
        square = jacobian @ jacobian.T + planar_ends.DAMPING * reach**2 * np.eye(2)
        q += jacobian.T @ np.linalg.solve(square, [error.real, error.imag])
        q[:] = np.clip(q, *limits.T)
    return False


def test_a_tip_is_brought_to_a_place_by_damped_least_squares() -> None:
    rng, reached = np.random.default_rng(0), 0
    arm = PlanarArm(np.array([0.5, 0.4, 0.3]), 0.1, -0.2, 0.3)
    limits = np.array([[-2.5, 2.5]] * 3)
    for _ in range(40):
        q, target = rng.uniform(-2.5, 2.5, 3), rng.uniform(-0.7, 0.7, 2)
        plain = q.copy()
        is_there = bring_tip_to(q, target, limits, arm)
        assert is_there is plain_steps(plain, target, limits, arm)
        if is_there:
            reached += 1
            np.testing.assert_allclose(q, plain, atol=1e-6)
    assert reached > 20


SPHERE = {"name": "ball", "joint": 1, "shape": "sphere", "center": (0.0, 0.0, 0.0), "radius": 0.1}


def chain(*joints: DhJoint, **settings: Any) -> DhChain:
    joints = joints or (DhJoint(dh=(1.0, 0.0, 0.0, 0.0), limits=(-90.0, 90.0)),)
    plain = {"joints": joints, "bodies": (SPHERE,), "base_position": (0.0, 0.0, 0.0)}
    return DhChain(**(plain | settings))


@pytest.mark.parametrize("experiment", ["corsepius_ball", "corsepius_shelf", "corsepius_gate_wide"])
def test_the_tool_is_where_the_table_puts_it(experiment: str) -> None:
    robot = composed(f"experiment={experiment}").robot
    assembly, rng = robot.build(), np.random.default_rng(0)
    base, tool = np.eye(4), np.eye(4)
    base[:3, 3], tool[:3, 3] = robot.base_position, robot.tool_position
    for _ in range(50):
        q = rng.uniform(assembly.model.lowerPositionLimit, assembly.model.upperPositionLimit)
        expected = base
        for joint, value in zip(robot.joints, q, strict=True):
            a, alpha, d, theta = joint.dh
            s, c = np.sin(np.deg2rad(theta) + value), np.cos(np.deg2rad(theta) + value)
            sa, ca = np.sin(np.deg2rad(alpha)), np.cos(np.deg2rad(alpha))
            x, y = [c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s]
            expected = expected @ np.array([x, y, [0, sa, ca, d], [0, 0, 0, 1.0]])
        expected, pose = expected @ tool, tool_pose(assembly, q)
        assert np.abs(pose[:9].reshape(3, 3) - expected[:3, :3]).max() < 1e-12
        assert np.abs(pose[9:] - expected[:3, 3]).max() < 1e-12


def test_base_and_tool_are_chosen_freely() -> None:
    base = {"base_position": (0.0, 0.0, 1.0), "base_rotation": (0.0, 90.0, 0.0)}
    tool = {"tool_position": (0.0, 0.0, 0.5), "tool_rotation": (90.0, 0.0, 0.0)}
    pose = tool_pose(chain(**base, **tool).build(), np.zeros(1))
    # x of the base points down, its z along the world's x
    assert pose[9:] == pytest.approx([0.5, 0.0, 0.0], abs=1e-12)
    assert pose[[2, 5, 8]] == pytest.approx([0.0, -1.0, 0.0], abs=1e-12)


def test_sliding_joints_slide_along_z() -> None:
    slide = DhJoint(dh=(0.0, 90.0, 0.2, 0.0), limits=(0.0, 0.5), kind="prismatic")
    turn = DhJoint(dh=(1.0, 0.0, 0.0, 0.0), limits=(-90.0, 90.0))
    assembly = chain(slide, turn).build()
    assert assembly.model.upperPositionLimit[0] == 0.5
    _, origins = forward_kinematics(assembly.table, np.array([[0.3], [0.0]]))
    assert origins[1, :, 0] == pytest.approx([0.0, 0.0, 0.5])


@pytest.mark.parametrize("seed", range(6))
def test_random_trees_agree_with_pinocchio_one_by_one_and_in_batches(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_tree(rng, 14)
    table, data = kinematic_table(model), model.createData()
    q = rng.uniform(-4.0, 4.0, size=(model.nq, 133))
    rotations, origins = forward_kinematics(table, q)
    point = np.array([0.3, -0.2, 0.5])
    for sample in range(q.shape[1]):
        pin.forwardKinematics(model, data, q[:, sample])
        for joint in range(1, model.njoints):
            turn, origin = rotations[joint - 1, ..., sample], origins[joint - 1, :, sample]
            frame = data.oMi[joint]
            assert np.abs(turn @ table.alignment[joint - 1].T - frame.rotation).max() < 1e-12
            assert np.abs(origin - frame.translation).max() < 1e-12
            world = turn @ table.local(joint, point) + origin
            assert np.abs(world - frame.act(point)).max() < 1e-12
    for sample in (0, 1, 7, 8, 132):
        alone = forward_kinematics(table, q[:, [sample]])
        assert np.array_equal(alone[0], rotations[..., [sample]])
        assert np.array_equal(alone[1], origins[..., [sample]])


@pytest.mark.parametrize(
    ("joints", "message"),
    [
        ([pin.JointModelFreeFlyer()], "joint 'joint_0' .* must have one coordinate"),
        ([pin.JointModelSpherical()], "joint 'joint_0' .* must have one coordinate"),
        ([pin.JointModelRUBZ()], "joint 'joint_0' .* must have one coordinate"),
        ([pin.JointModelHZ(0.3)], "joint 'joint_0' must turn or slide"),
        ([pin.JointModelRZ()] * (MAX_JOINTS + 1), "robot: must be of at most 100 joints, was 101"),
    ],
)
def test_joints_that_no_table_holds_are_refused(joints: list[Any], message: str) -> None:
    model, last = pin.Model(), 0
    for k, joint in enumerate(joints):
        last = model.addJoint(last, joint, pin.SE3.Identity(), f"joint_{k}")
    with pytest.raises(EvoexpError, match=message):
        kinematic_table(model)
