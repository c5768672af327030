"""Link ends of planar arms, and the limits of their joints, against Pinocchio."""

import numpy as np
import pinocchio as pin
import pytest

from evoexp.errors import SettingError
from evoexp.numeric.compilation import kernel
from evoexp.numeric.vectors import LANES
from evoexp.robots.planar_chain import PlanarChain
from evoexp.robots.planar_ends import (
    PlanarArm,
    block_ends,
    load_lanes,
    planar_arm,
)

ARM = PlanarChain(link_lengths=(3.0, 2.0, 1.0), base_position=(0.5, -1.0), base_angle=30.0)
NUM_POSITIONS = 40


@kernel
def ends_at(
    starts: np.ndarray,
    ends: np.ndarray,
    arm: PlanarArm,
    position: int,
    num_positions: int,
    x: np.ndarray,
    y: np.ndarray,
) -> None:
    block_ends(starts, ends, arm, position, num_positions, x, y)


@pytest.fixture
def paths() -> np.ndarray:
    """Starts and ends of a block of paths, (2, joints, LANES) [rad]."""
    return np.random.default_rng(0).uniform(-3.0, 3.0, (2, 3, LANES))


def pinocchio_ends(q: np.ndarray) -> np.ndarray:
    """Return base and link ends (4, 2) of one posture."""
    model = ARM.build().model
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    tip = data.oMi[3].act(np.array([1.0, 0.0, 0.0]))
    return np.vstack([*(data.oMi[j].translation[:2] for j in (1, 2, 3)), tip[:2]])


def test_link_ends_agree_with_pinocchio(paths: np.ndarray) -> None:
    starts, ends = (np.ascontiguousarray(q).ravel() for q in paths)
    arm = planar_arm(ARM.build())
    x, y = np.empty((2, 4 * LANES))
    for position in (0, 1, 13, NUM_POSITIONS):
        ends_at(starts, ends, arm, position, NUM_POSITIONS, x, y)
        for lane in range(LANES):
            q = paths[0, :, lane] + position / NUM_POSITIONS * (
                paths[1, :, lane] - paths[0, :, lane]
            )
            found = np.column_stack([x.reshape(4, LANES)[:, lane], y.reshape(4, LANES)[:, lane]])
            np.testing.assert_allclose(found, pinocchio_ends(q), atol=1e-13)


def test_the_last_position_is_the_end_to_the_last_bit(paths: np.ndarray) -> None:
    starts, ends = (np.ascontiguousarray(q).ravel() for q in paths)
    arm = planar_arm(ARM.build())
    x, y, u, v = np.empty((4, 4 * LANES))
    ends_at(starts, ends, arm, NUM_POSITIONS, NUM_POSITIONS, x, y)
    ends_at(ends, ends, arm, 0, 1, u, v)
    assert np.array_equal(x, u)
    assert np.array_equal(y, v)


def test_a_block_is_filled_with_its_last_individual() -> None:
    q = np.random.default_rng(1).random((2, 50))
    lanes, block = np.arange(50 + LANES), np.empty(2 * LANES)
    lanes[:3] = 7, 40, 9
    load_lanes(q, lanes, 0, 3, block)
    assert np.array_equal(block.reshape(2, LANES)[:, :3], q[:, [7, 40, 9]])
    assert np.array_equal(block.reshape(2, LANES)[:, 3:], np.repeat(q[:, [9]], LANES - 3, axis=1))


def test_joint_limits_reach_the_model() -> None:
    limits = ((-1.0, 1.0), (0.0, 2.0), (-0.5, 0.25))
    model = ARM.model_copy(update={"joint_limits": limits}).build().model
    assert model.lowerPositionLimit.tolist() == [-1.0, 0.0, -0.5]
    assert model.upperPositionLimit.tolist() == [1.0, 2.0, 0.25]


def test_limits_that_cannot_be_are_refused() -> None:
    with pytest.raises(SettingError, match=r"joint_limits: must be one pair per link \(3\), was 1"):
        PlanarChain(
            link_lengths=(1.0, 1.0, 1.0), base_position=(0.0, 0.0), joint_limits=((0.0, 1.0),)
        )
    with pytest.raises(SettingError, match=r"joint_limits\[0\]: must be \[least, greatest\]"):
        PlanarChain(link_lengths=(1.0,), base_position=(0.0, 0.0), joint_limits=((1.0, 1.0),))
