"""Poses as 12 numbers: nine of the rotation, row by row, then the position.

Every sum is taken in a fixed order, so a pose has the same bits on every machine.
"""

from typing import Any

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray
from evoexp.robots.kinematics import (
    BLOCK,
    SPATIAL_ROWS,
    KinematicChain,
    KinematicTable,
    U,
    block_frames,
    load_block,
)

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def pose_of(rotation: Any, position: Any) -> FloatArray:
    """Return the pose (12,) of a rotation (3, 3) and a position (3,)."""
    return np.concatenate(
        [np.asarray(rotation, dtype=np.float64).ravel(), np.asarray(position, dtype=np.float64)]
    )


def local_pose(table: KinematicTable, joint: int, rotation: Any, position: Any) -> FloatArray:
    """Express a pose, given in Pinocchio's frame of a joint, in the table's frame of it, (12,).

    Args:
        table: The robot's kinematic table.
        joint: Pinocchio's index of the joint, at least 1.
        rotation: (3, 3).
        position: (3,) [length unit].
    """
    return np.asarray(
        compose(pose_of(table.alignment[joint - 1].T, np.zeros(3)), pose_of(rotation, position))
    )


@kernel
def compose(one: FloatArray, two: FloatArray) -> FloatArray:
    """Return the pose `two`, given in the frame `one`, in the frame that `one` is given in.

    Args:
        one: (12,).
        two: (12,).
    """
    out = np.empty(12)
    for e in range(3):
        a, b, c = one[3 * e], one[3 * e + 1], one[3 * e + 2]
        for k in range(3):
            out[3 * e + k] = a * two[k] + b * two[3 + k] + c * two[6 + k]
        out[9 + e] = one[9 + e] + (a * two[9] + b * two[10] + c * two[11])
    return out


@kernel
def invert(pose: FloatArray) -> FloatArray:
    """Return the inverse of a pose (12,)."""
    out = np.empty(12)
    for e in range(3):
        for k in range(3):
            out[3 * e + k] = pose[3 * k + e]
        out[9 + e] = -(pose[e] * pose[9] + pose[3 + e] * pose[10] + pose[6 + e] * pose[11])
    return out


@kernel
def frame_poses(
    chain: KinematicChain, joint: int, local: FloatArray, q: FloatArray, out: FloatArray
) -> None:
    """Write the pose of one frame in the world for a batch of configurations.

    Args:
        chain: The robot's joints.
        joint: Index into the table of the joint that moves the frame.
        local: (12,) pose of the frame in the table's frame of the joint.
        q: (nq, configurations) [rad], lengths for prismatic joints.
        out: (12, configurations), written.
    """
    num_joints = len(chain.parent)
    block_q = np.zeros(q.shape[0] * BLOCK)
    frames, scratch = np.empty(num_joints * SPATIAL_ROWS * BLOCK), np.empty(SPATIAL_ROWS * BLOCK)
    own = U(joint) * U(SPATIAL_ROWS * BLOCK)
    for first in range(0, q.shape[1], BLOCK):
        count = min(BLOCK, q.shape[1] - first)
        load_block(q, first, count, 1.0, block_q)
        block_frames(chain, block_q, frames, scratch)
        for e in range(3):
            x, y = own + U(3 * e * BLOCK), own + U((3 * e + 1) * BLOCK)
            z, o = own + U((3 * e + 2) * BLOCK), own + U((9 + e) * BLOCK)
            # row e of the rotation
            for k in range(3):
                for n in range(count):
                    i = U(n)
                    turned_axis = (
                        frames[x + i] * local[k]
                        + frames[y + i] * local[3 + k]
                        + frames[z + i] * local[6 + k]
                    )
                    out[3 * e + k, first + n] = turned_axis
            # coordinate e of the position
            for n in range(count):
                i = U(n)
                moved = (
                    frames[x + i] * local[9] + frames[y + i] * local[10] + frames[z + i] * local[11]
                )
                out[9 + e, first + n] = frames[o + i] + moved


def frame_pose(table: KinematicTable, joint: int, local: FloatArray, q: FloatArray) -> FloatArray:
    """Return the pose (12,) of one frame in the world at one configuration.

    Args:
        table: The robot's kinematic table.
        joint: Index into the table of the joint that moves the frame; −1: it stands still.
        local: (12,) pose in the table's frame of the joint.
        q: (nq,) [rad], lengths for prismatic joints.
    """
    if joint < 0:
        return local
    out = np.empty((12, 1))
    frame_poses(table.chain, joint, local, np.ascontiguousarray(q[:, None]), out)
    return out[:, 0].copy()
