"""The frames of all joints, one after the other."""

import numpy as np

from evoexp.robots.kinematics import KinematicTable
from evoexp.robots.poses import IDENTITY, frame_poses


def forward_kinematics(table: KinematicTable, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (joints, 3, 3, configurations) and origins (joints, 3, configurations)."""
    poses, q = np.empty((len(table.parent), 12, q.shape[1])), np.ascontiguousarray(q)
    for joint, own in enumerate(poses):
        frame_poses(table.chain, joint, IDENTITY, q, own)
    return poses[:, :9].reshape(len(poses), 3, 3, -1), poses[:, 9:]
