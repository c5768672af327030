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

    parent: IntArray  # the first seven are those of `KinematicChain`
    index_q: IntArray
    prismatic: BoolArray
    turned: BoolArray
    rotation: FloatArray
    translation: FloatArray
    rule: FloatArray
    # (joints, 3, 3) from the table's frame of a joint to Pinocchio's: columns are the table's axes
    alignment: FloatArray
    # whether every joint turns about the world's z, so that everything moves in parallel planes;
    # not if a joint follows another
    planar: bool
    free: BoolArray  # (joints,) whether a joint has a coordinate of its own, and follows no other
    num_coordinates: int  # number of values of a configuration

    @property
    def chain(self) -> KinematicChain:
        """The seven arrays that kernels read."""
        return KinematicChain(*self[:7])

    @property
    def slides(self) -> BoolArray:
        """(nq,) whether a coordinate is a length, that of a joint that slides."""
        found = np.zeros(self.num_coordinates, dtype=np.bool_)
        found[self.index_q[self.free]] = self.prismatic[self.free]
        return found

    def local(self, joint: int, point: FloatArray) -> FloatArray:
        """Express a point, given in Pinocchio's frame of a joint, in the table's frame of it.

        Args:
            joint: Pinocchio's index of the joint, at least 1.
            point: (3,) [length unit].
        """
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
        rotation[k] = matrix_product(
            matrix_product(before.T, placement.rotation), alignment[k]
        ).ravel()
        translation[k] = matrix_product(before.T, placement.translation)
    joints = range(1, model.njoints)
    rule = np.array([_rule(model, joint) for joint in joints]).reshape(-1, 2)
    free = np.array([not _follows(model, joint) for joint in joints], dtype=np.bool_)
    turned = np.array(
        [not np.array_equal(matrix, np.eye(3).ravel()) for matrix in rotation], dtype=np.bool_
    )
    index_q = np.array([model.idx_qs[j] for j in range(1, model.njoints)], dtype=np.int64)
    planar = (
        bool(free.all())
        and not prismatic.any()
        and all(_keeps_plane(matrix) for matrix in rotation)
    )
    return KinematicTable(
        parent,
        index_q,
        prismatic,
        turned,
        rotation,
        translation,
        rule,
        alignment,
        planar,
        free,
        int(free.sum()),
    )


def _follows(model: Any, joint: int) -> bool:
    """Whether a joint follows another, and has no coordinate of its own."""
    return bool(model.joints[joint].shortname() == "JointModelMimic")


def _rule(model: Any, joint: int) -> tuple[float, float]:
    """Return multiplier and offset of a joint's value, of its coordinate or that of its source."""
    if not _follows(model, joint):
        return 1.0, 0.0
    mimic = model.joints[joint].extract()
    return float(mimic.scaling), float(mimic.offset)


def check_size(model: Any) -> None:
    """Refuse a model of more joints than `MAX_JOINTS`.

    Raises:
        SettingError: If there are more.
    """
    if model.njoints - 1 > MAX_JOINTS:
        raise SettingError("robot", f"of at most {MAX_JOINTS} joints", model.njoints - 1)


def _axis(model: Any, data: Any, neutral: FloatArray, joint: int) -> tuple[FloatArray, bool]:
    """Return a joint's axis in its own frame, and whether it slides.

    Raises:
        UnsupportedJoint: If it has not exactly one coordinate, or turns and slides at once.
    """
    name = model.names[joint]
    if _follows(model, joint):
        # Pinocchio's motion subspace of such a joint is its own times the multiplier
        axis, slides = own_axis(model, joint)
        return axis / _rule(model, joint)[0], slides
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
    """Return the axis (3,) of a joint of one coordinate by its motion subspace; whether it slides.

    Args:
        model: The joint's.
        joint: Its index.
    """
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


def _keeps_plane(matrix: FloatArray) -> bool:
    """Whether a placement's rotation maps z to z exactly."""
    rows = matrix.reshape(3, 3)
    return bool(rows[2, 2] == 1.0 and not rows[:2, 2].any() and not rows[2, :2].any())
