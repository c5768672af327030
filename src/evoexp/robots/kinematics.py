"""The kinematic table of a Pinocchio model, and forward kinematics of whole batches from it.

The table is derived from any `pin.Model` whose joints have one degree of freedom. Each joint's frame is turned so that
the joint moves about (or along) its own z axis: the rotation of a revolute joint then mixes two columns only. Kernels
keep the configurations innermost, in blocks of `BLOCK` lanes, and use evoexp's own sine and cosine: the result does not
depend on the CPU's vector width.
"""

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.errors import EvoexpError
from evoexp.numerics import kernel, sincos
from evoexp.records import FloatArray

BLOCK = 64
"""Configurations that a kernel carries through all its steps at once; its scratch stays in the first-level cache."""


class UnsupportedJoint(EvoexpError):
    """A joint that the kinematic table cannot represent."""


class KinematicTable(NamedTuple):
    """Joints in the order of the model, without the universe; parents come before their children.

    Attributes:
        parent: (joints,) index into the table, −1 for the world.
        index_q: (joints,) the joint's place in q.
        prismatic: (joints,) true for a joint that slides along its z axis, false for one that turns about it.
        turned: (joints,) true where the placement's rotation is not the identity.
        rotation: (joints, 9) placement in the parent's frame, row by row.
        translation: (joints, 3).
        alignment: (joints, 3, 3) from the table's frame of a joint to Pinocchio's: columns are the table's axes.
        planar: Whether every joint turns about the world's z, so that everything moves in parallel planes.
    """

    parent: np.ndarray
    index_q: np.ndarray
    prismatic: np.ndarray
    turned: np.ndarray
    rotation: FloatArray
    translation: FloatArray
    alignment: FloatArray
    planar: bool

    def local(self, joint: int, point: FloatArray) -> FloatArray:
        """Return a point given in the frame of Pinocchio's joint `joint` (≥ 1) in the table's frame of it."""
        return np.asarray(self.alignment[joint - 1].T @ point)


def kinematic_table(model: Any) -> KinematicTable:
    """Derive the table from a Pinocchio model.

    Raises:
        UnsupportedJoint: If a joint has not exactly one coordinate, or turns and slides at once.
    """
    data = model.createData()
    neutral = pin.neutral(model)
    pin.computeJointJacobians(model, data, neutral)
    num_joints = model.njoints - 1
    alignment = np.empty((num_joints, 3, 3))
    prismatic = np.zeros(num_joints, dtype=np.bool_)
    rotation, translation = np.empty((num_joints, 9)), np.empty((num_joints, 3))
    parent = np.array([model.parents[j] - 1 for j in range(1, model.njoints)], dtype=np.int64)
    for k in range(num_joints):
        axis, prismatic[k] = _axis(model, data, neutral, k + 1)
        alignment[k] = _frame_with_z(axis)
        before = alignment[parent[k]] if parent[k] >= 0 else np.eye(3)
        placement = model.jointPlacements[k + 1]
        rotation[k] = (before.T @ placement.rotation @ alignment[k]).ravel()
        translation[k] = before.T @ placement.translation
    turned = np.array([not np.array_equal(matrix, np.eye(3).ravel()) for matrix in rotation], dtype=np.bool_)
    index_q = np.array([model.idx_qs[j] for j in range(1, model.njoints)], dtype=np.int64)
    planar = not prismatic.any() and all(_keeps_plane(matrix) for matrix in rotation)
    return KinematicTable(parent, index_q, prismatic, turned, rotation, translation, alignment, planar)


def forward_kinematics(table: KinematicTable, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the frames of all joints for a batch of configurations.

    Args:
        table: The kinematic table.
        q: (nq, configurations) [rad], lengths for prismatic joints.

    Returns:
        Rotations (joints, 3, 3, configurations) and origins (joints, 3, configurations) in the world. The rotations are
        those of the table's frames; times `alignment` transposed they are Pinocchio's.

    Raises:
        ValueError: If q has not as many rows as the model has coordinates.
    """
    num_joints = len(table.parent)
    q = np.ascontiguousarray(q, dtype=np.float64)
    if q.ndim != 2 or q.shape[0] != num_joints:
        raise ValueError(f"q must have shape ({num_joints}, configurations), was {q.shape}")
    rotations = np.empty((num_joints, 9, q.shape[1]))
    origins = np.empty((num_joints, 3, q.shape[1]))
    _forward_kinematics(*table[:6], q, rotations, origins)
    return rotations.reshape(num_joints, 3, 3, -1), origins


@kernel
def _forward_kinematics(  # type: ignore[no-untyped-def]
    parent, index_q, prismatic, turned, rotation, translation, q, rotations, origins
):
    num_joints, total = len(parent), q.shape[1]
    block_q = np.zeros((q.shape[0], BLOCK))
    frames = np.empty((num_joints, 9, BLOCK))
    points = np.empty((num_joints, 3, BLOCK))
    scratch = np.empty((11, BLOCK))
    for first in range(0, total, BLOCK):
        count = min(BLOCK, total - first)
        block_q[:, :count] = q[:, first : first + count]
        block_frames(parent, index_q, prismatic, turned, rotation, translation, block_q, frames, points, scratch)
        rotations[:, :, first : first + count] = frames[:, :, :count]
        origins[:, :, first : first + count] = points[:, :, :count]


@kernel
def block_frames(  # type: ignore[no-untyped-def]
    parent, index_q, prismatic, turned, rotation, translation, q, frames, points, scratch
):
    """Frames of all joints for one block of configurations.

    Args:
        parent: Of the table, as the next five.
        index_q: See `KinematicTable`.
        prismatic: See `KinematicTable`.
        turned: See `KinematicTable`.
        rotation: See `KinematicTable`.
        translation: See `KinematicTable`.
        q: (nq, BLOCK).
        frames: (joints, 9, BLOCK), written: rotations row by row.
        points: (joints, 3, BLOCK), written: origins.
        scratch: (11, BLOCK).
    """
    for k in range(len(parent)):
        before = parent[k]
        offset, matrix = translation[k], rotation[k]
        if before < 0:
            for row in range(3):
                for lane in range(BLOCK):
                    points[k, row, lane] = offset[row]
                for column in range(3):
                    for lane in range(BLOCK):
                        scratch[3 * row + column, lane] = matrix[3 * row + column]
        else:
            for row in range(3):
                x, y, z = frames[before, 3 * row], frames[before, 3 * row + 1], frames[before, 3 * row + 2]
                for lane in range(BLOCK):
                    points[k, row, lane] = points[before, row, lane] + (
                        x[lane] * offset[0] + y[lane] * offset[1] + z[lane] * offset[2]
                    )
                for column in range(3):
                    if turned[k]:
                        for lane in range(BLOCK):
                            scratch[3 * row + column, lane] = (
                                x[lane] * matrix[column] + y[lane] * matrix[3 + column] + z[lane] * matrix[6 + column]
                            )
                    else:
                        for lane in range(BLOCK):
                            scratch[3 * row + column, lane] = frames[before, 3 * row + column, lane]
        _move(prismatic[k], q[index_q[k]], scratch, frames[k], points[k], scratch[9], scratch[10])


@kernel
def block_planar_frames(parent, index_q, turned, rotation, translation, q, points, sine, cosine):  # type: ignore[no-untyped-def]
    """The same for planar tables: every frame is a turn about z, kept as its sine and cosine.

    Args:
        parent: Of the table, as the next four.
        index_q: See `KinematicTable`.
        turned: See `KinematicTable`.
        rotation: See `KinematicTable`.
        translation: See `KinematicTable`.
        q: (nq, BLOCK).
        points: (joints, 3, BLOCK), written: origins.
        sine: (joints, BLOCK), written: of the angle from the world's x axis.
        cosine: (joints, BLOCK), written.
    """
    for k in range(len(parent)):
        before = parent[k]
        dx, dy, dz = translation[k]
        c0, s0 = rotation[k, 0], rotation[k, 3]
        own_q = q[index_q[k]]
        for lane in range(BLOCK):
            s, c = sincos(own_q[lane])
            sine[k, lane] = s
            cosine[k, lane] = c
        if turned[k]:
            for lane in range(BLOCK):
                s, c = sine[k, lane], cosine[k, lane]
                sine[k, lane] = s0 * c + c0 * s
                cosine[k, lane] = c0 * c - s0 * s
        if before < 0:
            points[k, 0], points[k, 1], points[k, 2] = dx, dy, dz
        else:
            for lane in range(BLOCK):
                sb, cb = sine[before, lane], cosine[before, lane]
                s, c = sine[k, lane], cosine[k, lane]
                sine[k, lane] = sb * c + cb * s
                cosine[k, lane] = cb * c - sb * s
                points[k, 0, lane] = points[before, 0, lane] + (cb * dx - sb * dy)
                points[k, 1, lane] = points[before, 1, lane] + (sb * dx + cb * dy)
                points[k, 2, lane] = points[before, 2, lane] + dz


@kernel
def _move(prismatic, q, placed, frame, point, sine, cosine):  # type: ignore[no-untyped-def]
    """Turn a placed frame about its z axis by q, or slide its origin along it."""
    if not prismatic:
        for lane in range(BLOCK):
            sine[lane], cosine[lane] = sincos(q[lane])
    for row in range(3):
        x, y, z = placed[3 * row], placed[3 * row + 1], placed[3 * row + 2]
        for lane in range(BLOCK):
            frame[3 * row + 2, lane] = z[lane]
        if prismatic:
            for lane in range(BLOCK):
                point[row, lane] += z[lane] * q[lane]
                frame[3 * row, lane] = x[lane]
                frame[3 * row + 1, lane] = y[lane]
        else:
            for lane in range(BLOCK):
                frame[3 * row, lane] = x[lane] * cosine[lane] + y[lane] * sine[lane]
                frame[3 * row + 1, lane] = y[lane] * cosine[lane] - x[lane] * sine[lane]


def _axis(model: Any, data: Any, neutral: FloatArray, joint: int) -> tuple[FloatArray, bool]:
    """Return a joint's axis in its own frame, and whether it slides."""
    name = model.names[joint]
    if model.nqs[joint] != 1 or model.nvs[joint] != 1:
        kind = model.joints[joint].shortname()
        raise UnsupportedJoint(f"robot: joint '{name}' ({kind}) must have one coordinate, has {model.nqs[joint]}")
    jacobian = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL)[:, model.idx_vs[joint]]
    linear, angular = jacobian[:3], jacobian[3:]
    slides = bool(np.linalg.norm(angular) < 0.5)
    if not slides and np.linalg.norm(linear) > 1e-12:
        raise UnsupportedJoint(f"robot: joint '{name}' must turn or slide, does both at once")
    return (linear if slides else angular), slides


def _frame_with_z(axis: FloatArray) -> FloatArray:
    """Return a rotation whose third column is the axis; the identity for +z itself."""
    unit = axis / np.linalg.norm(axis)
    if unit[2] == 1.0:
        return np.eye(3)
    if unit[2] == -1.0:
        return np.diag([1.0, -1.0, -1.0])
    helper = np.eye(3)[np.argmin(np.abs(unit))]
    x = np.cross(helper, unit)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(unit, x), unit])


def _keeps_plane(matrix: FloatArray) -> bool:
    """Whether a placement's rotation maps z to z exactly."""
    rows = matrix.reshape(3, 3)
    return bool(rows[2, 2] == 1.0 and not rows[:2, 2].any() and not rows[2, :2].any())
