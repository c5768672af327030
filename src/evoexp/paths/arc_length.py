"""Arc length of the splines: speeds at equidistant samples and their running integral.

The length between the samples j and j + 1 is that of the cubic through four speeds,

    h/24 (13 (v[j] + v[j+1]) − v[j−1] − v[j+2]).

The kernels leave h/24 out and keep every length at or above a twelfth of the trapezoid's, so that L
never falls where a path turns on the spot. The origin of L is arbitrary (not zero). A length is
known one sample later than its speed.
"""

import numpy as np

from evoexp.numeric.compilation import inlined
from evoexp.numeric.vector_rows import Eight
from evoexp.numeric.vectors import Vector, select, spread, store
from evoexp.paths.spline import (
    PAIR,
    slope,
    speed_at_goal,
    speed_of_all,
    speed_of_two,
    square_speed,
    store_rows,
)
from evoexp.paths.workspace import U0, U1, U2, VECTOR, Layout
from evoexp.records import FloatArray


@inlined
def between(v0: Vector, v1: Vector, v2: Vector, v3: Vector) -> Vector:
    """Return 24/h times the length between the samples 1 and 2 of four speeds."""
    inner = v1 + v2
    length = 13.0 * inner - (v0 + v3)
    found: Vector = select(inner < length, length, inner)
    return found


@inlined
def speeds_of_two(w: FloatArray, knot: np.uint64, at: Layout, u: float, h: float) -> Eight:
    """Return the speeds of an arm of two joints at eight samples from u on, h apart."""
    x, y = slope(w, knot), slope(w, knot + at.joint * VECTOR)
    return (
        speed_of_two(x, y, u),
        speed_of_two(x, y, u + h),
        speed_of_two(x, y, u + 2.0 * h),
        speed_of_two(x, y, u + 3.0 * h),
        speed_of_two(x, y, u + 4.0 * h),
        speed_of_two(x, y, u + 5.0 * h),
        speed_of_two(x, y, u + 6.0 * h),
        speed_of_two(x, y, u + 7.0 * h),
    )


@inlined
def speeds_of_all(
    w: FloatArray, knot: np.uint64, joints: np.uint64, at: Layout, u: float, h: float
) -> Eight:
    """Return the speeds of an arm of any number of joints, as `speeds_of_two`."""
    q = square_speed(w, knot, joints, at)
    return (
        speed_of_all(q, u),
        speed_of_all(q, u + h),
        speed_of_all(q, u + 2.0 * h),
        speed_of_all(q, u + 3.0 * h),
        speed_of_all(q, u + 4.0 * h),
        speed_of_all(q, u + 5.0 * h),
        speed_of_all(q, u + 6.0 * h),
        speed_of_all(q, u + 7.0 * h),
    )


@inlined
def integrate_speed(
    w: FloatArray, joints: np.uint64, N: np.uint64, S: np.uint64, at: Layout
) -> tuple[Vector, Vector]:
    """Write the speeds and lengths of all samples of eight paths; see `workspace`.

    Returns:
        Lengths up to the first sample and to the last one.
    """
    h = 1.0 / np.float64(S)
    nothing = spread(0.0)
    p3, p2, p1, length, origin = nothing, nothing, nothing, nothing, nothing
    for k in range(N):
        for block in range(k * S, (k + U1) * S, VECTOR):
            knot, u = k * PAIR, np.float64(block - k * S) * h
            if joints == U2:
                v = speeds_of_two(w, knot, at, u, h)
            else:
                v = speeds_of_all(w, knot, joints, at, u, h)
            l0 = length + between(p3, p2, p1, v[0])
            l1 = l0 + between(p2, p1, v[0], v[1])
            l2 = l1 + between(p1, v[0], v[1], v[2])
            l3 = l2 + between(v[0], v[1], v[2], v[3])
            l4 = l3 + between(v[1], v[2], v[3], v[4])
            l5 = l4 + between(v[2], v[3], v[4], v[5])
            l6 = l5 + between(v[3], v[4], v[5], v[6])
            l7 = l6 + between(v[4], v[5], v[6], v[7])
            if block == U0:
                # before the start the speed is that of the parabola through the first three samples
                beyond = 3.0 * (v[0] - v[1]) + v[2]
                origin = l2 - between(beyond, v[0], v[1], v[2])
                l1 = origin
            if block == k * S:
                store(w, at.begins + k * VECTOR, l1)
            store_rows(w, at.speeds + block, at.sample, v)
            store_rows(w, at.lengths + block, at.sample, (l0, l1, l2, l3, l4, l5, l6, l7))
            p3, p2, p1, length = v[5], v[6], v[7], l7
    # the sample at the goal; beyond it the speed is again that of a parabola
    v0 = speed_at_goal(w, N, joints, at)
    before = length + between(p3, p2, p1, v0)
    beyond = 3.0 * (v0 - p1) + p2
    last = before + between(p2, p1, v0, beyond)
    store_rows(w, at.speeds + N * S, at.sample, (v0, v0, v0, v0, v0, v0, v0, v0))
    ends = (before, last, last, last, last, last, last, last)
    store_rows(w, at.lengths + N * S, at.sample, ends)
    return origin, last
