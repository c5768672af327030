"""Poses as 12 numbers: nine of the rotation, row by row, then the position.

Every sum is taken in a fixed order, so a pose has the same bits on every machine.
"""

from typing import Any

import numpy as np

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.vectors import LANES, load, store
from evoexp.records import FloatArray
from evoexp.robots.forward_kinematics import (
    SPATIAL_FRAME,
    VECTOR,
    eight_of,
    spatial_frames,
)
from evoexp.robots.kinematics import SPATIAL_ROWS, KinematicChain, KinematicTable, U

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def pose_of(rotation: Any, position: Any) -> FloatArray:
    """Return the pose (12,) of a rotation (3, 3) and a position (3,)."""
    return np.concatenate(
        [np.asarray(rotation, dtype=np.float64).ravel(), np.asarray(position, dtype=np.float64)]
    )


def local_pose(table: KinematicTable, joint: int, rotation: Any, position: Any) -> FloatArray:
    """Express a pose, given in Pinocchio's frame of a joint (1, …), in the table's frame of it."""
    turn = pose_of(table.alignment[joint - 1].T, np.zeros(3))
    return np.asarray(compose(turn, pose_of(rotation, position)))


@kernel
def compose(one: FloatArray, two: FloatArray) -> FloatArray:
    """Return the pose `two`, given in the frame `one`, in the frame that `one` is given in."""
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
        joint: Index into the table of the joint that moves the frame.
        local: (12,) pose of the frame in the table's frame of the joint.
        q: (nq, configurations) [rad], lengths for prismatic joints.
        out: (12, configurations), written.
    """
    count, target = q.shape[1], out.reshape(-1)
    flat, padded = q.reshape(-1), np.zeros(q.shape[0] * LANES)
    frames, found = np.empty(U(len(chain.parent)) * SPATIAL_FRAME), np.empty(SPATIAL_FRAME)
    chain, local, flat, target, padded, frames, found = borrowed(
        (chain, local, flat, target, padded, frames, found)
    )
    own = U(joint) * SPATIAL_FRAME
    for first in range(0, count, LANES):
        spatial_frames(chain, eight_of(flat, first, count, padded), 1.0, frames)
        for e in range(3):
            row, at = U(3 * e) * VECTOR, U(9 + e) * VECTOR
            x, y = load(frames, own + row), load(frames, own + row + VECTOR)
            z = load(frames, own + row + U(2) * VECTOR)
            # row e of the rotation
            for k in range(3):
                turned_axis = x * local[k] + y * local[3 + k] + z * local[6 + k]
                store(found, row + U(k) * VECTOR, turned_axis)
            # coordinate e of the position
            moved = x * local[9] + y * local[10] + z * local[11]
            store(found, at, load(frames, own + at) + moved)
        for number in range(SPATIAL_ROWS):
            for lane in range(min(LANES, count - first)):
                target[number * count + first + lane] = found[number * LANES + lane]


def frame_pose(table: KinematicTable, joint: int, local: FloatArray, q: FloatArray) -> FloatArray:
    """Return the pose (12,) of one frame in the world at one configuration.

    Args:
        joint: Index into the table of the joint that moves the frame; −1: it stands still.
        local: (12,) pose in the table's frame of the joint.
        q: (nq,) [rad], lengths for prismatic joints.
    """
    if joint < 0:
        return local
    out = np.empty((12, 1))
    frame_poses(table.chain, joint, local, np.ascontiguousarray(q[:, None]), out)
    return out[:, 0].copy()
