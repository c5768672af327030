"""Forward kinematics of batches beside Pinocchio, called once per configuration.

And beside numpy.
"""

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from evoexp.configuration import compose
from evoexp.robots.kinematics import kinematic_table
from evoexp.robots.poses import IDENTITY, frame_poses

SIZE = 2000


def two_planar_arms() -> Any:
    return compose.expand(["experiment=rana_planar"])[0].conditions[0].condition.robot.build().model


MODELS = {
    "two planar arms (4 joints)": two_planar_arms,
    "6R manipulator": pin.buildSampleModelManipulator,
}


def pinocchio_frames(model: Any, data: Any, q: Any) -> None:
    """Compute the frames of all joints; reading them into arrays is not counted."""
    for one in q:
        pin.forwardKinematics(model, data, one)


def numpy_frames(table: Any, q: Any) -> tuple[Any, Any]:
    """Return rotations and origins of the table's frames for q (nq, configurations).

    All configurations at once.
    """
    rotations, origins = [], []
    for k, before in enumerate(table.parent):
        s, c, zero = np.sin(q[table.index_q[k]]), np.cos(q[table.index_q[k]]), np.zeros(q.shape[1])
        turn = np.array([[c, -s, zero], [s, c, zero], [zero, zero, zero + 1.0]]).transpose(2, 0, 1)
        own = table.rotation[k].reshape(3, 3) @ turn
        rotations.append(rotations[before] @ own if before >= 0 else own)
        shift = table.translation[k]
        origins.append(
            origins[before] + rotations[before] @ shift
            if before >= 0
            else np.tile(shift, (q.shape[1], 1))
        )
    return rotations, origins


@pytest.mark.parametrize("name", MODELS)
def bench_forward_kinematics(beside: Any, name: str) -> None:
    model = MODELS[name]()
    data, table = model.createData(), kinematic_table(model)
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (model.nq, SIZE))
    some = np.ascontiguousarray(q[:, :200].T)
    poses, last = np.empty((12, SIZE)), len(table.parent) - 1
    frame_poses(table.chain, last, IDENTITY, q, poses)
    pin.forwardKinematics(model, data, some[7])
    assert np.abs(poses[9:, 7] - data.oMi[model.njoints - 1].translation).max() < 1e-12
    expected = numpy_frames(table, q)
    assert np.abs(poses[:9].reshape(3, 3, -1) - expected[0][-1].transpose(1, 2, 0)).max() < 1e-12
    assert np.abs(poses[9:] - expected[1][-1].T).max() < 1e-12
    beside(
        f"forward kinematics, {name}, {SIZE} configurations",
        lambda: frame_poses(table.chain, last, IDENTITY, q, poses),
        {
            "numpy": (lambda: numpy_frames(table, q), SIZE, 1),
            "Pinocchio": (lambda: pinocchio_frames(model, data, some), len(some), 1),
        },
        unit="configuration",
        amount=SIZE,
        repeat=10,
    )
