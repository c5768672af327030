"""Arc length of the splines: speeds at equidistant samples and their running integral.

The length between the samples j and j + 1 is that of the cubic through four speeds,

    h/24 (13 (v[j] + v[j+1]) − v[j−1] − v[j+2]).

The kernels leave h/24 out and keep every length at or above a twelfth of the trapezoid's, so that L
never falls where a path turns on the spot. The origin of L is arbitrary (not zero).
"""

import numpy as np

from evoexp.numeric.compilation import inlined
from evoexp.numeric.vectors import LANES, Vector, load, select, spread, store
from evoexp.paths.spline import (
    PAIR,
    load_eight,
    slope,
    speed_at_goal,
    speed_of_all,
    speed_of_two,
    square_speed,
    store_rows,
)
from evoexp.paths.workspace import EIGHT, U0, U1, U2, VECTOR, Layout
from evoexp.records import FloatArray


@inlined
def between(v0: Vector, v1: Vector, v2: Vector, v3: Vector) -> Vector:
    """Return 24/h times the length between the samples 1 and 2 of four speeds."""
    inner = v1 + v2
    length = 13.0 * inner - (v0 + v3)
    return select(inner < length, length, inner)


@inlined
def write_speeds(
    w: FloatArray,
    joints: np.uint64,
    N: np.uint64,
    at: Layout,
    ahead: np.uint64,
    segment: np.uint64,
    u: float,
    h: float,
) -> None:
    """Write the speeds at eight samples of a segment, from u on, or at the goal and behind it."""
    if segment == N:
        # beyond the goal the speed is that of the parabola through the last three samples
        v = speed_at_goal(w, N, joints, at)
        p1, p2 = load(w, ahead - VECTOR), load(w, ahead - U2 * VECTOR)
        store(w, ahead, v)
        store(w, ahead + VECTOR, 3.0 * (v - p1) + p2)
        return
    knot = segment * PAIR
    if joints == U2:
        x, y = slope(w, knot), slope(w, knot + at.joint * VECTOR)
        for k in range(LANES):
            store(w, ahead + np.uint64(k) * VECTOR, speed_of_two(x, y, u + k * h))
    else:
        q = square_speed(w, knot, joints, at)
        for k in range(LANES):
            store(w, ahead + np.uint64(k) * VECTOR, speed_of_all(q, u + k * h))


@inlined
def integrate_speed(
    w: FloatArray, joints: np.uint64, N: np.uint64, S: np.uint64, at: Layout
) -> tuple[Vector, Vector]:
    """Write speeds and lengths of all samples of eight paths; return the first and last length.

    The speeds of a block of eight samples are on their way, in the processor's one unit for roots,
    while the lengths of the block before are summed.
    """
    nothing, h = spread(0.0), 1.0 / np.float64(S)
    here = at.speeds
    write_speeds(w, joints, N, at, here, U0, 0.0, h)
    before, first, second = nothing, load(w, here), load(w, here + VECTOR)
    length = between(nothing, nothing, nothing, first) + between(nothing, nothing, first, second)
    origin, segment, begin, stop = nothing, U0, True, S
    for place in range(U0, N * S, VECTOR):
        v, ahead = load_eight(w, here), here + EIGHT
        if begin:
            kept = segment * VECTOR
        if place + VECTOR == stop:
            segment, stop = segment + U1, stop + S
        u = np.float64(place + VECTOR + S - stop) * h
        write_speeds(w, joints, N, at, ahead, segment, u, h)
        after = load(w, ahead), load(w, ahead + VECTOR)
        l1 = length + between(before, v[0], v[1], v[2])
        if place == U0:
            # before the start, too, the speed is that of a parabola
            beyond = 3.0 * (v[0] - v[1]) + v[2]
            length = origin = l1 - between(beyond, v[0], v[1], v[2])
        l2 = l1 + between(v[0], v[1], v[2], v[3])
        l3 = l2 + between(v[1], v[2], v[3], v[4])
        l4 = l3 + between(v[2], v[3], v[4], v[5])
        l5 = l4 + between(v[3], v[4], v[5], v[6])
        l6 = l5 + between(v[4], v[5], v[6], v[7])
        l7 = l6 + between(v[5], v[6], v[7], after[0])
        if begin:
            store(w, at.begins + kept, length)
        begin = place + VECTOR + S == stop
        store_rows(w, at.lengths + place, at.sample, (length, l1, l2, l3, l4, l5, l6, l7))
        before, length = v[7], l7 + between(v[6], v[7], after[0], after[1])
        here = ahead
    # the sample at the goal
    ends = (length, length, length, length, length, length, length, length)
    store_rows(w, at.lengths + N * S, at.sample, ends)
    return origin, length
