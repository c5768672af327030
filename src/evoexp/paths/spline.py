"""Cubic splines through the via-points over their index: second derivatives and squared speeds.

On segment k, with u in [0, 1], a and m (a sixth of the second derivative) at both ends:

    s(u)  = a0 + u (b0 + u (b1/2 + u b2/3)),   s'(u) = b0 + u (b1 + u b2),
    b0 = a1 − a0 − 2 m0 − m1,   b1 = 6 m0,   b2 = 3 (m1 − m0).
"""

from typing import Any

from evoexp.numerics import kernel
from evoexp.paths.workspace import R2, R3, R4, ROW, U1, U2


@kernel
def fit_spline(via_points: Any, joint: Any, lane: Any, count: Any, N: Any, pivots: Any, w: Any, knots: Any) -> None:
    """Copy one joint's coordinates to the scratch w at `knots` and solve for m beside them (Thomas algorithm)."""
    pivot = pivots[0]
    for l in range(count):
        a, a_next = via_points[joint, 0, lane + l], via_points[joint, 1, lane + l]
        w[knots + l] = a
        w[knots + ROW + l] = (a_next - a) * pivot
    for i in range(U1, N):
        row = knots + i * R2
        pivot = pivots[i]
        for l in range(count):
            a_last, a = via_points[joint, i - U1, lane + l], via_points[joint, i, lane + l]
            a_next = via_points[joint, i + U1, lane + l]
            w[row + l] = a
            w[row + ROW + l] = ((a_last - a) + (a_next - a) - w[row - ROW + l]) * pivot
    row = knots + N * R2
    pivot = pivots[N]
    for l in range(count):
        a_last, a = via_points[joint, N - U1, lane + l], via_points[joint, N, lane + l]
        w[row + l] = a
        w[row + ROW + l] = ((a_last - a) - w[row - ROW + l]) * pivot
    for back in range(N):
        i = N - U1 - back
        row = knots + i * R2
        pivot = pivots[i]
        for l in range(count):
            w[row + ROW + l] -= pivot * w[row + R3 + l]


@kernel
def square_speed(w: Any, knot: Any, out: Any, count: Any) -> None:
    """Write the five coefficients of s'(u)² of one joint on the segment that begins at `knot`."""
    for l in range(count):
        a0, m0, a1, m1 = w[knot + l], w[knot + ROW + l], w[knot + R2 + l], w[knot + R3 + l]
        b0, b1, b2 = a1 - a0 - 2.0 * m0 - m1, 6.0 * m0, 3.0 * (m1 - m0)
        w[out + l] = b0 * b0
        w[out + ROW + l] = 2.0 * b0 * b1
        w[out + R2 + l] = b1 * b1 + 2.0 * b0 * b2
        w[out + R3 + l] = 2.0 * b1 * b2
        w[out + R4 + l] = b2 * b2


@kernel
def add_square_speed(w: Any, knot: Any, given: Any, out: Any, count: Any) -> None:
    """Write to `out` the coefficients at `given` plus those of one joint more (in place would not vectorise)."""
    for l in range(count):
        a0, m0, a1, m1 = w[knot + l], w[knot + ROW + l], w[knot + R2 + l], w[knot + R3 + l]
        b0, b1, b2 = a1 - a0 - 2.0 * m0 - m1, 6.0 * m0, 3.0 * (m1 - m0)
        w[out + l] = w[given + l] + b0 * b0
        w[out + ROW + l] = w[given + ROW + l] + 2.0 * b0 * b1
        w[out + R2 + l] = w[given + R2 + l] + (b1 * b1 + 2.0 * b0 * b2)
        w[out + R3 + l] = w[given + R3 + l] + 2.0 * b1 * b2
        w[out + R4 + l] = w[given + R4 + l] + b2 * b2


@kernel
def square_speeds(w: Any, knot: Any, joints: Any, pitch: Any, work: Any, count: Any) -> Any:
    """Return where the coefficients of |s'(u)|² over all joints of an arm were written (`work`, or eight rows on)."""
    here, there = work, work + U2 * R4
    square_speed(w, knot, here, count)
    for joint in range(U1, joints):
        add_square_speed(w, knot + joint * pitch, here, there, count)
        here, there = there, here
    return here
