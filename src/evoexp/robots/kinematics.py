"""The kinematic table of a Pinocchio model, from which kernels compute frames of whole batches.

The table is derived from any `pin.Model` whose joints have one degree of freedom. Each joint's
frame is turned so that the joint moves about (or along) its own z axis: the rotation of a revolute
joint then mixes two columns only.
"""

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.errors import EvoexpError, SettingError
from evoexp.numeric.ordered_sums import length, matrix_product
from evoexp.records import BoolArray, FloatArray, IntArray

U = np.uint64

SPATIAL_ROWS = 12
"""Rows of a joint's frame in space: nine of its rotation, three of its origin."""

MAX_JOINTS = 100  # the memory of Pinocchio's data grows with their cube: 70 MB


class UnsupportedJoint(EvoexpError):
    """A joint that the kinematic table cannot represent."""


class KinematicChain(NamedTuple):
    """The part of a kinematic table that kernels read."""

    parent: IntArray  # (joints,) index into the table, −1 for the world
    index_q: IntArray  # (joints,) the joint's place in q
    # (joints,) true for a joint that slides along its z axis, false for one that turns about it
    prismatic: BoolArray
    turned: BoolArray  # (joints,) true where the placement's rotation is not the identity
    rotation: FloatArray  # (joints, 9) placement in the parent's frame, row by row
    translation: FloatArray  # (joints, 3) [length unit]
    # (joints, 2) the joint's value is the first times its coordinate plus the second: 1 and 0,
    # unless it follows another joint, whose coordinate it shares
    rule: FloatArray


class KinematicTable(NamedTuple):
    """Joints in the order of the model, without the universe; parents before their children."""

    chain: KinematicChain
    # (joints, 3, 3) from the table's frame of a joint to Pinocchio's: columns are the table's axes
    alignment: FloatArray
    # whether every joint turns about the world's z, so that everything moves in parallel planes;
    # not if a joint follows another
    planar: bool
    free: BoolArray  # (joints,) whether a joint has a coordinate of its own, and follows no other

    @property
    def num_coordinates(self) -> int:
        """Number of values of a configuration."""
        return int(self.free.sum())

    @property
    def slides(self) -> BoolArray:
        """(nq,) whether a coordinate is a length, that of a joint that slides."""
        slides = np.zeros(self.num_coordinates, dtype=np.bool_)
        slides[self.chain.index_q[self.free]] = self.chain.prismatic[self.free]
        return slides

    def local(self, joint: int, point: FloatArray) -> FloatArray:
        """Express a point (3,), given in Pinocchio's frame of a joint (1, …), in the table's."""
        return matrix_product(self.alignment[joint - 1].T, point)


def kinematic_table(model: Any) -> KinematicTable:
    """Derive the table from a Pinocchio model.

    Raises:
        UnsupportedJoint: If a joint has not exactly one coordinate, or turns and slides at once.
        SettingError: If there are more joints than `MAX_JOINTS`.
    """
    check_size(model)
    data = model.createData()
    neutral = pin.neutral(model)
    pin.computeJointJacobians(model, data, neutral)
    count = model.njoints - 1
    parent = np.array(list(model.parents)[1:], dtype=np.int64) - 1
    index_q = np.array(list(model.idx_qs)[1:], dtype=np.int64)
    joints = list(model.joints)[1:]
    free = np.array([joint.shortname() != "JointModelMimic" for joint in joints], dtype=np.bool_)
    rule = np.tile([1.0, 0.0], (count, 1))
    alignment, prismatic = np.empty((count, 3, 3)), np.zeros(count, dtype=np.bool_)
    rotation, translation = np.empty((count, 9)), np.empty((count, 3))
    for k in range(count):
        if free[k]:
            axis, prismatic[k] = _free_axis(model, data, k + 1)
        else:  # Pinocchio's motion subspace of such a joint is its own times the multiplier
            mimic = joints[k].extract()
            rule[k] = mimic.scaling, mimic.offset
            axis, prismatic[k] = own_axis(model, k + 1)
            axis = axis / rule[k, 0]
        alignment[k] = _frame_with_z(axis)
        before = alignment[parent[k]].T if parent[k] >= 0 else np.eye(3)
        placement = model.jointPlacements[k + 1]
        turn = matrix_product(matrix_product(before, placement.rotation), alignment[k])
        rotation[k], translation[k] = turn.ravel(), matrix_product(before, placement.translation)
    turned = (rotation != np.eye(3).ravel()).any(axis=1)
    # placements map z to z exactly
    rows, z = rotation.reshape(-1, 3, 3), np.array([0.0, 0.0, 1.0])
    is_flat = (rows[:, 2] == z).all() and (rows[:, :, 2] == z).all()
    planar = bool(free.all() and not prismatic.any() and is_flat)
    chain = KinematicChain(parent, index_q, prismatic, turned, rotation, translation, rule)
    return KinematicTable(chain, alignment, planar, free)


def check_size(model: Any) -> None:
    """Refuse a model of more joints than `MAX_JOINTS`."""
    if model.njoints - 1 > MAX_JOINTS:
        raise SettingError("robot", f"of at most {MAX_JOINTS} joints", model.njoints - 1)


def _free_axis(model: Any, data: Any, joint: int) -> tuple[FloatArray, bool]:
    """Return the axis (3,) of a joint in its own frame, and whether it slides."""
    name = model.names[joint]
    if model.nqs[joint] != 1 or model.nvs[joint] != 1:
        kind = model.joints[joint].shortname()
        raise UnsupportedJoint(
            f"robot: joint '{name}' ({kind}) must have one coordinate, has {model.nqs[joint]}"
        )
    jacobian = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL)
    # one joint alone comes as a vector
    jacobian = np.reshape(jacobian, (6, -1))[:, model.idx_vs[joint]]
    linear, angular = jacobian[:3], jacobian[3:]
    slides = length(angular) < 0.5
    if not slides and length(linear) > 1e-12:
        raise UnsupportedJoint(f"robot: joint '{name}' must turn or slide, does both at once")
    return (linear if slides else angular), slides


def own_axis(model: Any, joint: int) -> tuple[FloatArray, bool]:
    """Return the axis (3,) of a joint by its motion subspace, and whether it slides."""
    data = model.joints[joint].createData()
    model.joints[joint].calc(data, pin.neutral(model))
    motion = np.reshape(data.S, 6)
    return (motion[:3], True) if motion[:3].any() else (motion[3:], False)


def _frame_with_z(axis: FloatArray) -> FloatArray:
    """Return a rotation whose third column is the axis; the identity for +z itself."""
    unit = axis / length(axis)
    if unit[2] == 1.0:
        return np.eye(3)
    if unit[2] == -1.0:
        return np.diag([1.0, -1.0, -1.0])
    x = np.cross(np.eye(3)[np.argmin(np.abs(unit))], unit)
    x /= length(x)
    return np.column_stack([x, np.cross(unit, x), unit])
