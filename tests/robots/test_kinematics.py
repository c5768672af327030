"""The kinematic table and batched forward kinematics, against Pinocchio."""

import numpy as np
import pinocchio as pin
import pytest

from evoexp.errors import SettingError
from evoexp.robots.kinematics import MAX_JOINTS, UnsupportedJoint, kinematic_table
from robots.joint_frames import forward_kinematics


def random_tree(seed: int, num_joints: int = 14) -> pin.Model:
    """A tree of revolute and prismatic joints with random axes and placements."""
    rng = np.random.default_rng(seed)
    model = pin.Model()
    for k in range(num_joints):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        joints = [
            pin.JointModelRX(),
            pin.JointModelRY(),
            pin.JointModelRZ(),
            pin.JointModelPX(),
            pin.JointModelPZ(),
            pin.JointModelRevoluteUnaligned(*axis),
            pin.JointModelPrismaticUnaligned(*axis),
        ]
        joint = joints[rng.integers(len(joints))]
        placement = (
            pin.SE3.Random() if rng.random() < 0.7 else pin.SE3(np.eye(3), rng.normal(size=3))
        )
        model.addJoint(int(rng.integers(0, k + 1)), joint, placement, f"joint_{k}")
    return model


@pytest.mark.parametrize("seed", range(6))
def test_random_trees_agree_with_pinocchio(seed: int) -> None:
    pin.seed(seed)
    model = random_tree(seed)
    table = kinematic_table(model)
    q = np.random.default_rng(seed).uniform(-4.0, 4.0, size=(model.nq, 133))
    rotations, origins = forward_kinematics(table, q)
    data = model.createData()
    for sample in range(q.shape[1]):
        pin.forwardKinematics(model, data, q[:, sample])
        for joint in range(1, model.njoints):
            rotation = rotations[joint - 1, :, :, sample] @ table.alignment[joint - 1].T
            assert np.abs(rotation - data.oMi[joint].rotation).max() < 1e-12
            assert np.abs(origins[joint - 1, :, sample] - data.oMi[joint].translation).max() < 1e-12


def test_points_of_links_agree_with_pinocchio() -> None:
    pin.seed(3)
    model = random_tree(3)
    table = kinematic_table(model)
    q = np.linspace(-1.0, 1.0, model.nq)
    rotations, origins = forward_kinematics(table, q[:, None])
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    point = np.array([0.3, -0.2, 0.5])
    for joint in range(1, model.njoints):
        world = rotations[joint - 1, :, :, 0] @ table.local(joint, point) + origins[joint - 1, :, 0]
        assert np.abs(world - data.oMi[joint].act(point)).max() < 1e-12


def test_blocks_do_not_matter() -> None:
    model = random_tree(1)
    table = kinematic_table(model)
    q = np.random.default_rng(0).uniform(-3.0, 3.0, size=(model.nq, 192))
    together = forward_kinematics(table, q)
    for sample in (0, 1, 7, 8, 135):
        alone = forward_kinematics(table, q[:, sample : sample + 1])
        assert np.array_equal(alone[0][..., 0], together[0][..., sample])
        assert np.array_equal(alone[1][..., 0], together[1][..., sample])


@pytest.mark.parametrize(
    "joint", [pin.JointModelFreeFlyer(), pin.JointModelSpherical(), pin.JointModelRUBZ()]
)
def test_joints_with_several_coordinates_are_refused(joint: object) -> None:
    model = pin.Model()
    model.addJoint(0, joint, pin.SE3.Identity(), "wrist")
    with pytest.raises(UnsupportedJoint, match=r"joint 'wrist' .* must have one coordinate"):
        kinematic_table(model)


def test_a_joint_that_turns_and_slides_is_refused() -> None:
    model = pin.Model()
    model.addJoint(0, pin.JointModelHZ(0.3), pin.SE3.Identity(), "screw")
    with pytest.raises(UnsupportedJoint, match="joint 'screw' must turn or slide"):
        kinematic_table(model)


def test_a_robot_of_more_joints_than_memory_bears_is_refused() -> None:
    model, last = pin.Model(), 0
    for k in range(MAX_JOINTS + 1):
        last = model.addJoint(last, pin.JointModelRZ(), pin.SE3.Identity(), f"joint{k}")
    with pytest.raises(SettingError, match="robot: must be of at most 100 joints, was 101"):
        kinematic_table(model)
