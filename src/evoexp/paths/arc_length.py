"""Arc length of the splines: speeds at equidistant samples and their running integral, in one pass.

Between the samples j and j + 1 the length is that of the cubic through four speeds, h/24 (13 (v[j] + v[j+1]) − v[j−1] −
v[j+2]); the loops leave h/24 out and keep every length at or above a twelfth of the trapezoid's, so that L never falls
where a path turns on the spot. It needs no root beyond those of the trapezoidal rule and no more samples than knots: per
segment S square roots, which hide everything else in these loops. L's origin is arbitrary (not zero).
"""

from typing import Any

import numpy as np

from evoexp.numerics import kernel
from evoexp.paths.spline import square_speeds
from evoexp.paths.workspace import R2, R3, R4, R5, R6, ROW, U1, U2, U3, U4


@kernel
def between(v0: float, v1: float, v2: float, v3: float) -> float:
    """Return 24/h times the length between the samples 1 and 2 of four speeds."""
    inner = v1 + v2
    length = 13.0 * inner - (v0 + v3)
    return length if length > inner else inner


@kernel
def advance_pair(w: Any, knot: Any, other: Any, s: Any, count: Any, u0: float, h: float) -> None:
    """Write four speeds of a two-joint arm from sample `s` on, and the four lengths that they complete."""
    u1, u2, u3 = u0 + h, u0 + 2.0 * h, u0 + 3.0 * h
    for l in range(count):
        a0, m0, a1, m1 = w[knot + l], w[knot + ROW + l], w[knot + R2 + l], w[knot + R3 + l]
        x0, x1, x2 = a1 - a0 - 2.0 * m0 - m1, 6.0 * m0, 3.0 * (m1 - m0)
        a0, m0, a1, m1 = w[other + l], w[other + ROW + l], w[other + R2 + l], w[other + R3 + l]
        y0, y1, y2 = a1 - a0 - 2.0 * m0 - m1, 6.0 * m0, 3.0 * (m1 - m0)
        p3, p2, p1, L = w[s - R6 + l], w[s - R4 + l], w[s - R2 + l], w[s - R3 + l]
        x, y = x0 + u0 * (x1 + u0 * x2), y0 + u0 * (y1 + u0 * y2)
        v0 = np.sqrt(x * x + y * y)
        w[s + l] = v0
        L += between(p3, p2, p1, v0)
        w[s - ROW + l] = L
        x, y = x0 + u1 * (x1 + u1 * x2), y0 + u1 * (y1 + u1 * y2)
        v1 = np.sqrt(x * x + y * y)
        w[s + R2 + l] = v1
        L += between(p2, p1, v0, v1)
        w[s + ROW + l] = L
        x, y = x0 + u2 * (x1 + u2 * x2), y0 + u2 * (y1 + u2 * y2)
        v2 = np.sqrt(x * x + y * y)
        w[s + R4 + l] = v2
        L += between(p1, v0, v1, v2)
        w[s + R3 + l] = L
        x, y = x0 + u3 * (x1 + u3 * x2), y0 + u3 * (y1 + u3 * y2)
        v3 = np.sqrt(x * x + y * y)
        w[s + R6 + l] = v3
        L += between(v0, v1, v2, v3)
        w[s + R5 + l] = L


@kernel
def root(q0: float, q1: float, q2: float, q3: float, q4: float, u: float) -> float:
    """Return the speed at u from the coefficients of its square (which rounding may turn negative near zero)."""
    square = q0 + u * (q1 + u * (q2 + u * (q3 + u * q4)))
    return np.sqrt(square if square > 0.0 else 0.0)  # type: ignore[no-any-return]


@kernel
def advance(w: Any, q: Any, s: Any, count: Any, u0: float, h: float) -> None:
    """As `advance_pair` for any number of joints, from the coefficients of the squared speed at row `q`."""
    u1, u2, u3 = u0 + h, u0 + 2.0 * h, u0 + 3.0 * h
    for l in range(count):
        q0, q1, q2, q3, q4 = w[q + l], w[q + ROW + l], w[q + R2 + l], w[q + R3 + l], w[q + R4 + l]
        p3, p2, p1, L = w[s - R6 + l], w[s - R4 + l], w[s - R2 + l], w[s - R3 + l]
        v0 = root(q0, q1, q2, q3, q4, u0)
        w[s + l] = v0
        L += between(p3, p2, p1, v0)
        w[s - ROW + l] = L
        v1 = root(q0, q1, q2, q3, q4, u1)
        w[s + R2 + l] = v1
        L += between(p2, p1, v0, v1)
        w[s + ROW + l] = L
        v2 = root(q0, q1, q2, q3, q4, u2)
        w[s + R4 + l] = v2
        L += between(p1, v0, v1, v2)
        w[s + R3 + l] = L
        v3 = root(q0, q1, q2, q3, q4, u3)
        w[s + R6 + l] = v3
        L += between(v0, v1, v2, v3)
        w[s + R5 + l] = L


@kernel
def close_ends(w: Any, knot: Any, joints: Any, pitch: Any, first: Any, last: Any, count: Any) -> None:
    """Add the sample at the goal and complete the first and the last two lengths.

    Beyond both ends the speed is that of the parabola through the three samples before.
    """
    for l in range(count):
        w[last + l] = 0.0
    for joint in range(joints):
        row = knot + joint * pitch
        for l in range(count):
            slope = (w[row + R2 + l] - w[row + l]) + w[row + ROW + l] + 2.0 * w[row + R3 + l]
            w[last + l] += slope * slope
    for l in range(count):
        w[last + l] = np.sqrt(w[last + l])
    for l in range(count):
        v3, v2, v1, v0 = w[last - R6 + l], w[last - R4 + l], w[last - R2 + l], w[last + l]
        before = w[last - R3 + l] + between(v3, v2, v1, v0)
        beyond = 3.0 * (v0 - v1) + v2
        w[last - ROW + l] = before
        w[last + ROW + l] = before + between(v2, v1, v0, beyond)
    for l in range(count):
        v0, v1, v2 = w[first + l], w[first + R2 + l], w[first + R4 + l]
        beyond = 3.0 * (v0 - v1) + v2
        w[first + ROW + l] = w[first + R3 + l] - between(beyond, v0, v1, v2)


@kernel
def integrate_speed(w: Any, joints: Any, N: Any, S: Any, count: Any, samples: Any, work: Any) -> None:
    """Fill the rows of speed and length of all samples, for one arm whose knots stand at the scratch's beginning."""
    pitch = (N + U1) * R2
    h = 1.0 / np.float64(S)
    for l in range(U3 * R2):
        w[samples - R6 + l] = 0.0
    for k in range(N):
        knot = k * R2
        q = work
        if joints != U2:
            q = square_speeds(w, knot, joints, pitch, work, count)
        for group in range(S // U4):
            s = samples + (k * S + group * U4) * R2
            u0 = np.float64(group * U4) * h
            if joints == U2:
                advance_pair(w, knot, knot + pitch, s, count, u0, h)
            else:
                advance(w, q, s, count, u0, h)
    close_ends(w, (N - U1) * R2, joints, pitch, samples, samples + N * S * R2, count)
