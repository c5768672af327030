"""Forward kinematics of eight configurations at a time, in vectors."""

import numpy as np

from evoexp.numeric.compilation import inlined
from evoexp.numeric.elementary import sincos
from evoexp.numeric.vectors import LANES, load, spread, store
from evoexp.records import FloatArray
from evoexp.robots.kinematics import PLANAR_ROWS, SPATIAL_ROWS, KinematicChain, U

VECTOR = U(LANES)
PLANAR_FRAME, SPATIAL_FRAME = U(PLANAR_ROWS * LANES), U(SPATIAL_ROWS * LANES)
"""Numbers of a frame of eight configurations."""


@inlined
def spatial_frames(
    chain: KinematicChain,
    q: FloatArray,
    place: np.uint64,
    stride: np.uint64,
    unit: float,
    frames: FloatArray,
) -> None:
    """Compute the frames of all joints, with the bits of `kinematics.block_frames`.

    Args:
        chain: The joints.
        q: Flat; coordinate k of eight configurations stands at k · stride + place.
        place: Of the first of them.
        stride: From one coordinate to the next.
        unit: Factor of every coordinate, which makes it [rad], or a length for prismatic joints.
        frames: (joints · SPATIAL_FRAME,), written: the rotation row by row, then the origin.
    """  # fmt: skip
    for k in range(len(chain.parent)):
        own, moved = U(k) * SPATIAL_FRAME, load(q, U(chain.index_q[k]) * stride + place) * unit
        before = U(chain.parent[k]) * SPATIAL_FRAME
        rotation, translation = chain.rotation[k], chain.translation[k]
        dx, dy, dz = translation[0], translation[1], translation[2]
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


@inlined
def planar_frames(
    chain: KinematicChain,
    q: FloatArray,
    place: np.uint64,
    stride: np.uint64,
    unit: float,
    frames: FloatArray,
) -> None:
    """Compute the frames of a planar table, each a turn about z and a point of the plane.

    Args:
        chain: The joints.
        q: See `spatial_frames`, as for the next three.
        place: See there.
        stride: See there.
        unit: See there.
        frames: (joints · PLANAR_FRAME,), written: sine and cosine of the angle from the world's x
            axis, x, y.
    """  # fmt: skip
    for k in range(len(chain.parent)):
        own, before = U(k) * PLANAR_FRAME, U(chain.parent[k]) * PLANAR_FRAME
        dx, dy = chain.translation[k, 0], chain.translation[k, 1]
        c0, s0 = chain.rotation[k, 0], chain.rotation[k, 3]
        s, c = sincos(load(q, U(chain.index_q[k]) * stride + place) * unit)
        s, c = s0 * c + c0 * s, c0 * c - s0 * s
        x, y = spread(dx), spread(dy)
        if chain.parent[k] >= 0:  # angles add up; the origin stands in the parent's frame
            sb, cb = load(frames, before), load(frames, before + VECTOR)
            x = load(frames, before + U(2) * VECTOR) + (cb * dx - sb * dy)
            y = load(frames, before + U(3) * VECTOR) + (sb * dx + cb * dy)
            s, c = sb * c + cb * s, cb * c - sb * s
        store(frames, own, s)
        store(frames, own + VECTOR, c)
        store(frames, own + U(2) * VECTOR, x)
        store(frames, own + U(3) * VECTOR, y)
