"""Cubic splines through the via-points over their index: second derivatives and squared speeds.

On segment k, with u in [0, 1], a and m (a sixth of the second derivative) at both ends:

    s(u)  = a0 + u (b0 + u (b1/2 + u b2/3)),   s'(u) = b0 + u (b1 + u b2),
    b0 = a1 − a0 − 2 m0 − m1,   b1 = 6 m0,   b2 = 3 (m1 − m0).
"""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.paths.workspace import R2, R3, R4, ROW, U1, U2
from evoexp.records import FloatArray


@kernel
def fit_spline(
    via_points: FloatArray,
    joint: np.uint64,
    lane0: np.uint64,
    count: np.uint64,
    N: np.uint64,
    pivots: FloatArray,
    w: FloatArray,
    knots: np.uint64,
) -> None:
    """Copy one joint's coordinates to `knots` in w and solve for m (Thomas algorithm)."""
    pivot = pivots[0]
    for lane in range(count):
        a, a_next = via_points[joint, 0, lane0 + lane], via_points[joint, 1, lane0 + lane]
        w[knots + lane] = a
        w[knots + ROW + lane] = (a_next - a) * pivot
    for i in range(U1, N):
        row = knots + i * R2
        pivot = pivots[i]
        for lane in range(count):
            a_last, a = via_points[joint, i - U1, lane0 + lane], via_points[joint, i, lane0 + lane]
            a_next = via_points[joint, i + U1, lane0 + lane]
            w[row + lane] = a
            w[row + ROW + lane] = ((a_last - a) + (a_next - a) - w[row - ROW + lane]) * pivot
    row = knots + N * R2
    pivot = pivots[N]
    for lane in range(count):
        a_last, a = via_points[joint, N - U1, lane0 + lane], via_points[joint, N, lane0 + lane]
        w[row + lane] = a
        w[row + ROW + lane] = ((a_last - a) - w[row - ROW + lane]) * pivot
    for back in range(N):
        k = N - U1 - back
        row = knots + k * R2
        pivot = pivots[k]
        for lane in range(count):
            w[row + ROW + lane] -= pivot * w[row + R3 + lane]


@kernel
def square_speed(w: FloatArray, knot: np.uint64, out: np.uint64, count: np.uint64) -> None:
    """Write the five coefficients of s'(u)² of one joint on the segment that begins at `knot`."""
    for lane in range(count):
        a0, m0 = w[knot + lane], w[knot + ROW + lane]
        a1, m1 = w[knot + R2 + lane], w[knot + R3 + lane]
        b0, b1, b2 = a1 - a0 - 2.0 * m0 - m1, 6.0 * m0, 3.0 * (m1 - m0)
        w[out + lane] = b0 * b0
        w[out + ROW + lane] = 2.0 * b0 * b1
        w[out + R2 + lane] = b1 * b1 + 2.0 * b0 * b2
        w[out + R3 + lane] = 2.0 * b1 * b2
        w[out + R4 + lane] = b2 * b2


@kernel
def add_square_speed(
    w: FloatArray, knot: np.uint64, given: np.uint64, out: np.uint64, count: np.uint64
) -> None:
    """Write to `out` the coefficients at `given` plus those of one joint more.

    Written in place, the loop would not vectorise.
    """
    for lane in range(count):
        a0, m0 = w[knot + lane], w[knot + ROW + lane]
        a1, m1 = w[knot + R2 + lane], w[knot + R3 + lane]
        b0, b1, b2 = a1 - a0 - 2.0 * m0 - m1, 6.0 * m0, 3.0 * (m1 - m0)
        w[out + lane] = w[given + lane] + b0 * b0
        w[out + ROW + lane] = w[given + ROW + lane] + 2.0 * b0 * b1
        w[out + R2 + lane] = w[given + R2 + lane] + (b1 * b1 + 2.0 * b0 * b2)
        w[out + R3 + lane] = w[given + R3 + lane] + 2.0 * b1 * b2
        w[out + R4 + lane] = w[given + R4 + lane] + b2 * b2


@kernel
def square_speeds(
    w: FloatArray,
    knot: np.uint64,
    joints: np.uint64,
    pitch: np.uint64,
    work: np.uint64,
    count: np.uint64,
) -> np.uint64:
    """Write the coefficients of |s'(u)|² over all joints of an arm; return their row.

    It is `work`, or eight rows on.
    """
    here, there = work, work + U2 * R4
    square_speed(w, knot, here, count)
    for joint in range(U1, joints):
        add_square_speed(w, knot + joint * pitch, here, there, count)
        here, there = there, here
    return here
