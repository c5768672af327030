"""Forward kinematics of batches: eight configurations at a time, in vectors.

Eight neighbours are read where they stand in a batch; the last ones, if they are fewer, are copied
to a batch of eight first (`eight_of`).
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import inlined
from evoexp.numeric.elementary import sincos
from evoexp.numeric.vectors import LANES, Vector, load, spread, store
from evoexp.records import FloatArray
from evoexp.robots.kinematics import SPATIAL_ROWS, KinematicChain, U

VECTOR = U(LANES)
SPATIAL_FRAME = U(SPATIAL_ROWS * LANES)
"""Numbers of a frame of eight configurations."""


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
