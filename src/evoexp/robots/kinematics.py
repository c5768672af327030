"""The kinematic table of a Pinocchio model, frames of whole batches by it, and poses.

The table is derived from any `pin.Model` whose joints have one degree of freedom. Each joint's
frame is turned so that the joint moves about (or along) its own z axis: the rotation of a revolute
joint then mixes two columns only.

Kernels compute the frames of eight configurations at a time, in vectors. Eight neighbours are read
where they stand in a batch; the last ones, if they are fewer, are copied to a batch of eight first
(`eight_of`). Poses are 12 numbers: nine of the rotation, row by row, then the position. Every sum
is taken in a fixed order, so a pose has the same bits on every machine.
"""

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from evoexp.errors import EvoexpError, SettingError
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.elementary import length, matrix_product, sincos
from evoexp.numeric.vectors import LANES, Vector, load, spread, store
from evoexp.records import BoolArray, FloatArray, IntArray

U = np.uint64

SPATIAL_ROWS = 12
"""Rows of a joint's frame in space: nine of its rotation, three of its origin."""

VECTOR = U(LANES)
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
SPATIAL_FRAME = U(SPATIAL_ROWS * LANES)
"""Numbers of a frame of eight configurations."""
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


class Eight(NamedTuple):
    """Eight neighbours of a batch of configurations."""

    q: FloatArray  # the batch, flat: coordinate k of the first one stands at k · stride + place
    place: np.uint64  # of the first one
    stride: np.uint64  # from one coordinate to the next


@inlined
def eight_of(q: FloatArray, first: int, count: int, padded: FloatArray) -> Eight:
    """Return eight neighbours of a batch; where fewer are left, the last one counts repeatedly.

    Args:
        q: Rows of `count` numbers, flat.
        count: Configurations.
        padded: (nq · LANES,) written where fewer are left.
    """
    if first + LANES <= count:
        return Eight(q, U(first), U(count))
    for row in range(U(len(q)) // U(count)):
        for lane in range(LANES):
            place = row * count + min(first + lane, count - 1)
            padded[row * LANES + lane] = q[place]
    return Eight(padded, U(0), VECTOR)


@inlined
def coordinate(eight: Eight, k: int) -> Vector:
    """Return coordinate k of eight configurations."""
    return load(eight.q, U(k) * eight.stride + eight.place)


@inlined
def spatial_frames(chain: KinematicChain, eight: Eight, unit: float, frames: FloatArray) -> None:
    """Compute the frames of all joints of eight configurations.

    Args:
        unit: Factor of every coordinate, which makes it [rad], or a length for prismatic joints.
        frames: (joints · SPATIAL_FRAME,), written: the rotation row by row, then the origin.
    """
    for k in range(len(chain.parent)):
        own, moved = U(k) * SPATIAL_FRAME, coordinate(eight, chain.index_q[k]) * unit
        before = U(chain.parent[k]) * SPATIAL_FRAME
        rotation, translation = chain.rotation[k], chain.translation[k]
        dx, dy, dz = translation[0], translation[1], translation[2]
        if chain.rule[k, 0] != 1.0 or chain.rule[k, 1] != 0.0:  # it follows another joint
            moved = moved * chain.rule[k, 0] + chain.rule[k, 1]
        s, c = sincos(moved)
        for e in range(3):
            row, at = U(3 * e) * VECTOR, U(9 + e) * VECTOR
            # row e of the frame where the joint stands at 0
            if chain.parent[k] < 0:
                x, y = spread(rotation[3 * e]), spread(rotation[3 * e + 1])
                z, origin = spread(rotation[3 * e + 2]), spread(translation[e])
            else:
                x, y = load(frames, before + row), load(frames, before + row + VECTOR)
                z = load(frames, before + row + U(2) * VECTOR)
                origin = load(frames, before + at) + (x * dx + y * dy + z * dz)
                if chain.turned[k]:
                    x, y, z = (
                        x * rotation[0] + y * rotation[3] + z * rotation[6],
                        x * rotation[1] + y * rotation[4] + z * rotation[7],
                        x * rotation[2] + y * rotation[5] + z * rotation[8],
                    )
            if chain.prismatic[k]:  # the same rotation, the origin moved along z
                origin = origin + z * moved
            else:  # x and y turned about z, the same origin
                x, y = x * c + y * s, y * c - x * s
            store(frames, own + row, x)
            store(frames, own + row + VECTOR, y)
            store(frames, own + row + U(2) * VECTOR, z)
            store(frames, own + at, origin)


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
