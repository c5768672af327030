"""The kinematic table of a Pinocchio model, and forward kinematics of whole batches from it.

The table is derived from any `pin.Model` whose joints have one degree of freedom. Each joint's
frame is turned so that the joint moves about (or along) its own z axis: the rotation of a revolute
joint then mixes two columns only. Kernels keep the configurations innermost, in blocks of `BLOCK`
lanes, and use evoexp's own sine and cosine: the result does not depend on the CPU's vector width.

What makes the loops over lanes vector code: a block's frames are one flat array, whose rows are
constant distances apart (otherwise the checks that nothing overlaps become too many, and LLVM stays
scalar); indices are unsigned (no wrap-around); and no views are made inside (each counts
references).
"""

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.errors import EvoexpError
from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import sincos
from evoexp.numeric.ordered_sums import length, matrix_product
from evoexp.records import BoolArray, FloatArray, IntArray

BLOCK = 64
"""Configurations that a kernel carries through all its steps at once.

The scratch of so many stays in the first-level cache.
"""

U = np.uint64

SPATIAL_ROWS = 12
"""Rows of a joint's frame in space: nine of its rotation, three of its origin."""

PLANAR_ROWS = 4
"""Rows of a joint's frame in the plane: sine, cosine, x, y."""


class UnsupportedJoint(EvoexpError):
    """A joint that the kinematic table cannot represent."""


class KinematicChain(NamedTuple):
    """The part of a kinematic table that kernels read.

    Attributes:
        parent: (joints,) index into the table, −1 for the world.
        index_q: (joints,) the joint's place in q.
        prismatic: (joints,) true for a joint that slides along its z axis, false for one that turns
            about it.
        turned: (joints,) true where the placement's rotation is not the identity.
        rotation: (joints, 9) placement in the parent's frame, row by row.
        translation: (joints, 3) [length unit].
    """

    parent: IntArray
    index_q: IntArray
    prismatic: BoolArray
    turned: BoolArray
    rotation: FloatArray
    translation: FloatArray


class KinematicTable(NamedTuple):
    """Joints in the order of the model, without the universe; parents come before their children.

    Attributes:
        parent: See `KinematicChain`, as for the next five.
        index_q: See there.
        prismatic: See there.
        turned: See there.
        rotation: See there.
        translation: See there.
        alignment: (joints, 3, 3) from the table's frame of a joint to Pinocchio's: columns are the
            table's axes.
        planar: Whether every joint turns about the world's z, so that everything moves in parallel
            planes.
    """

    parent: IntArray
    index_q: IntArray
    prismatic: BoolArray
    turned: BoolArray
    rotation: FloatArray
    translation: FloatArray
    alignment: FloatArray
    planar: bool

    @property
    def chain(self) -> KinematicChain:
        """The six arrays that kernels read."""
        return KinematicChain(*self[:6])

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
        rotation[k] = matrix_product(
            matrix_product(before.T, placement.rotation), alignment[k]
        ).ravel()
        translation[k] = matrix_product(before.T, placement.translation)
    turned = np.array(
        [not np.array_equal(matrix, np.eye(3).ravel()) for matrix in rotation], dtype=np.bool_
    )
    index_q = np.array([model.idx_qs[j] for j in range(1, model.njoints)], dtype=np.int64)
    planar = not prismatic.any() and all(_keeps_plane(matrix) for matrix in rotation)
    return KinematicTable(
        parent, index_q, prismatic, turned, rotation, translation, alignment, planar
    )


def forward_kinematics(table: KinematicTable, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the frames of all joints for a batch of configurations.

    Args:
        table: The kinematic table.
        q: (nq, configurations) [rad], lengths for prismatic joints.

    Returns:
        Rotations (joints, 3, 3, configurations) and origins (joints, 3, configurations) in the
        world. The rotations are those of the table's frames; times `alignment` transposed they are
        Pinocchio's.

    Raises:
        ValueError: If q has not as many rows as the model has coordinates.
    """
    num_joints = len(table.parent)
    q = np.ascontiguousarray(q, dtype=np.float64)
    if q.ndim != 2 or q.shape[0] != num_joints:
        raise ValueError(f"q must have shape ({num_joints}, configurations), was {q.shape}")
    rotations = np.empty((num_joints, 9, q.shape[1]))
    origins = np.empty((num_joints, 3, q.shape[1]))
    _forward_kinematics(tuple(table.chain), q, rotations, origins)
    return rotations.reshape(num_joints, 3, 3, -1), origins


@kernel
def _forward_kinematics(
    fields: tuple[Any, ...], q: FloatArray, rotations: FloatArray, origins: FloatArray
) -> None:
    """Run the kernel of `forward_kinematics`; fields of a `KinematicChain` as a plain tuple."""
    chain = KinematicChain(*fields)
    num_joints, total = len(chain.parent), q.shape[1]
    block_q = np.zeros(q.shape[0] * BLOCK)
    frames, scratch = np.empty(num_joints * SPATIAL_ROWS * BLOCK), np.empty(SPATIAL_ROWS * BLOCK)
    by_row = frames.reshape((num_joints, SPATIAL_ROWS, BLOCK))
    for first in range(0, total, BLOCK):
        count = min(BLOCK, total - first)
        load_block(q, first, count, 1.0, block_q)
        block_frames(chain, block_q, frames, scratch)
        rotations[:, :, first : first + count] = by_row[:, :9, :count]
        origins[:, :, first : first + count] = by_row[:, 9:, :count]


@kernel
def load_block(q: FloatArray, first: int, count: int, unit: float, out: FloatArray) -> None:
    """Copy some configurations to a block.

    Args:
        q: (nq, configurations).
        first: The configuration to begin with.
        count: How many are copied, at most `BLOCK`.
        unit: Factor of every coordinate.
        out: (nq · BLOCK,), written.
    """
    for k in range(q.shape[0]):
        row = U(k) * U(BLOCK)
        for n in range(count):
            out[row + U(n)] = q[U(k), U(first + n)] * unit


@kernel
def block_frames(
    chain: KinematicChain, q: FloatArray, frames: FloatArray, scratch: FloatArray
) -> None:
    """Compute the frames of all joints for one block of configurations.

    Args:
        chain: The joints.
        q: (nq · BLOCK,) [rad], lengths for prismatic joints.
        frames: (joints · SPATIAL_ROWS · BLOCK,), written: the rotation row by row, then the origin.
        scratch: (SPATIAL_ROWS · BLOCK,): the placed frame before the joint moves.
    """
    for k in range(len(chain.parent)):
        own, row = U(k) * U(SPATIAL_ROWS * BLOCK), U(chain.index_q[k]) * U(BLOCK)
        # the frame where the joint stands at 0
        _place(
            chain.parent[k], chain.turned[k], chain.rotation[k], chain.translation[k], frames,
            scratch,
        )  # fmt: skip
        if chain.prismatic[k]:  # the same rotation, the origin moved along z
            for n in range(9 * BLOCK):
                frames[own + U(n)] = scratch[U(n)]
            for e in range(3):
                o, z = U((9 + e) * BLOCK), U((3 * e + 2) * BLOCK)
                for n in range(BLOCK):
                    lane = U(n)
                    frames[own + o + lane] = scratch[o + lane] + scratch[z + lane] * q[row + lane]
        else:  # x and y turned about z, the same origin
            for n in range(BLOCK):
                lane = U(n)
                s, c = sincos(q[row + lane])
                for e in range(3):
                    x, y = U(3 * e * BLOCK) + lane, U((3 * e + 1) * BLOCK) + lane
                    z = U((3 * e + 2) * BLOCK) + lane
                    frames[own + x] = scratch[x] * c + scratch[y] * s
                    frames[own + y] = scratch[y] * c - scratch[x] * s
                    frames[own + z] = scratch[z]
            for n in range(3 * BLOCK):
                lane = U(9 * BLOCK) + U(n)
                frames[own + lane] = scratch[lane]


@kernel
def _place(
    parent: int,
    turned: bool,
    rotation: FloatArray,
    translation: FloatArray,
    frames: FloatArray,
    placed: FloatArray,
) -> None:
    """Compute a joint's frame before it moves: its placement behind its parent's frame."""
    if parent < 0:  # the placement itself
        for e in range(9):
            placed[e * BLOCK : (e + 1) * BLOCK] = rotation[e]
        for e in range(3):
            placed[(9 + e) * BLOCK : (10 + e) * BLOCK] = translation[e]
        return
    before = U(parent) * U(SPATIAL_ROWS * BLOCK)
    dx, dy, dz = translation[0], translation[1], translation[2]
    for e in range(3):
        x, o = before + U(3 * e * BLOCK), U((9 + e) * BLOCK)
        y, z = x + U(BLOCK), x + U(2 * BLOCK)
        # origin
        for n in range(BLOCK):
            lane = U(n)
            placed[o + lane] = frames[before + o + lane] + (
                frames[x + lane] * dx + frames[y + lane] * dy + frames[z + lane] * dz
            )
        # row e of the rotation
        for column in range(3):
            c = U((3 * e + column) * BLOCK)
            if turned:
                ax, ay, az = rotation[column], rotation[3 + column], rotation[6 + column]
                for n in range(BLOCK):
                    lane = U(n)
                    placed[c + lane] = (
                        frames[x + lane] * ax + frames[y + lane] * ay + frames[z + lane] * az
                    )
            else:
                for n in range(BLOCK):
                    placed[c + U(n)] = frames[before + c + U(n)]


def _axis(model: Any, data: Any, neutral: FloatArray, joint: int) -> tuple[FloatArray, bool]:
    """Return a joint's axis in its own frame, and whether it slides.

    Raises:
        UnsupportedJoint: If it has not exactly one coordinate, or turns and slides at once.
    """
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
