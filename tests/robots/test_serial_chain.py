"""Serial chains against Pinocchio and plain geometry."""

import numpy as np
import pinocchio as pin
import pytest

from evoexp.errors import SettingError
from evoexp.robots.arms import Arms
from evoexp.robots.planar_chain import PlanarChain
from evoexp.robots.serial_chain import SerialChain, SerialJoint
from robots.joint_frames import forward_kinematics

Z, Y = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)


def test_a_serial_chain_in_the_plane_is_a_planar_chain() -> None:
    planar = PlanarChain(link_lengths=(4.0, 3.0), base_position=(1.0, 2.0), base_angle=30.0).build()
    joints = (
        SerialJoint(axis=(0.0, 0.0, 2.0), offset=(0.0, 0.0, 0.0)),
        SerialJoint(axis=Z, offset=(4.0, 0.0, 0.0)),
    )
    serial = SerialChain(
        joints=joints, tip=(3.0, 0.0, 0.0), base_position=(1.0, 2.0, 0.0), base_angle=30.0
    ).build()
    assert serial.table.planar
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (2, 9))
    for one, two in zip(
        forward_kinematics(planar.table, q), forward_kinematics(serial.table, q), strict=True
    ):
        assert one == pytest.approx(two, abs=1e-14)
    for one, two in zip(planar.links, serial.links, strict=True):
        assert (one.joint, one.start.tolist(), one.end.tolist()) == (
            two.joint,
            two.start.tolist(),
            two.end.tolist(),
        )


def test_links_run_from_joint_to_joint_and_the_column_stands_still() -> None:
    joints = (
        SerialJoint(axis=Z, offset=(0.0, 0.0, 0.5)),
        SerialJoint(axis=Y, offset=(0.0, 0.0, 0.0)),
        SerialJoint(axis=(1.0, 0.0, 0.0), offset=(0.7, 0.0, 0.1), kind="prismatic"),
    )
    arm = SerialChain(
        joints=joints, tip=(0.2, 0.0, 0.0), base_position=(3.0, 0.0, 0.0), base_angle=90.0
    )
    assembly = Arms(arms=(arm, arm)).build()
    assert assembly.arm_slices.tolist() == [[0, 3], [3, 6]]
    assert [(link.arm, link.joint) for link in assembly.links] == [
        (0, 0),
        (0, 2),
        (0, 3),
        (1, 0),
        (1, 5),
        (1, 6),
    ]
    column = assembly.links[0]
    assert column.start.tolist() == [3.0, 0.0, 0.0]
    assert column.end.tolist() == [3.0, 0.0, 0.5]
    data = assembly.model.createData()
    q = np.array(
        [0.0, 0.0, 0.25, 0.0, np.pi / 2, 0.0]
    )  # the first arm slides out, the second one points down
    pin.forwardKinematics(assembly.model, data, q)
    tips = [data.oMi[link.joint].act(link.end) for link in (assembly.links[2], assembly.links[5])]
    assert tips[0] == pytest.approx(
        [3.0, 0.7 + 0.25 + 0.2, 0.6], abs=1e-12
    )  # +x of the arm is the world's +y
    assert tips[1] == pytest.approx([3.0, 0.1, 0.5 - 0.9], abs=1e-12)


def test_an_axis_needs_a_direction() -> None:
    with pytest.raises(SettingError, match=r"axis: must be a direction, not \(0, 0, 0\)"):
        SerialJoint(axis=(0.0, 0.0, 0.0), offset=(0.0, 0.0, 0.0))
