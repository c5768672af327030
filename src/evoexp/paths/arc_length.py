"""Arc length of the splines: speeds at equidistant samples and their running integral.

The length between the samples j and j + 1 is that of the cubic through four speeds,

    h/24 (13 (v[j] + v[j+1]) − v[j−1] − v[j+2]).

The loops leave h/24 out and keep every length at or above a twelfth of the trapezoid's, so that L
never falls where a path turns on the spot. The origin of L is arbitrary (not zero). Four samples
per pass: with eight, LLVM meets more pairs of rows than it is willing to test for overlap, and does
not vectorise (three times slower).
"""

import math

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.paths.spline import square_speeds
from evoexp.paths.workspace import R2, R3, R4, R5, R6, ROW, U1, U2, U3, U4
from evoexp.records import FloatArray


@kernel
def between(v0: float, v1: float, v2: float, v3: float) -> float:
    """Return 24/h times the length between the samples 1 and 2 of four speeds."""
    inner = v1 + v2
    length = 13.0 * inner - (v0 + v3)
    return length if length > inner else inner


@kernel
def advance_pair(
    w: FloatArray,
    knot: np.uint64,
    other: np.uint64,
    s: np.uint64,
    count: np.uint64,
    u0: float,
    h: float,
) -> None:
    """Write four speeds of a two-joint arm from sample `s` on, and four lengths."""
    u1, u2, u3 = u0 + h, u0 + 2.0 * h, u0 + 3.0 * h
    for lane in range(count):
        a0, m0 = w[knot + lane], w[knot + ROW + lane]
        a1, m1 = w[knot + R2 + lane], w[knot + R3 + lane]
        x0, x1, x2 = a1 - a0 - 2.0 * m0 - m1, 6.0 * m0, 3.0 * (m1 - m0)
        a0, m0 = w[other + lane], w[other + ROW + lane]
        a1, m1 = w[other + R2 + lane], w[other + R3 + lane]
        y0, y1, y2 = a1 - a0 - 2.0 * m0 - m1, 6.0 * m0, 3.0 * (m1 - m0)
        p3, p2, p1, L = w[s - R6 + lane], w[s - R4 + lane], w[s - R2 + lane], w[s - R3 + lane]
        x, y = x0 + u0 * (x1 + u0 * x2), y0 + u0 * (y1 + u0 * y2)
        v0 = np.sqrt(x * x + y * y)
        w[s + lane] = v0
        L += between(p3, p2, p1, v0)
        w[s - ROW + lane] = L
        x, y = x0 + u1 * (x1 + u1 * x2), y0 + u1 * (y1 + u1 * y2)
        v1 = np.sqrt(x * x + y * y)
        w[s + R2 + lane] = v1
        L += between(p2, p1, v0, v1)
        w[s + ROW + lane] = L
        x, y = x0 + u2 * (x1 + u2 * x2), y0 + u2 * (y1 + u2 * y2)
        v2 = np.sqrt(x * x + y * y)
        w[s + R4 + lane] = v2
        L += between(p1, v0, v1, v2)
        w[s + R3 + lane] = L
        x, y = x0 + u3 * (x1 + u3 * x2), y0 + u3 * (y1 + u3 * y2)
        v3 = np.sqrt(x * x + y * y)
        w[s + R6 + lane] = v3
        L += between(v0, v1, v2, v3)
        w[s + R5 + lane] = L


@kernel
def root(q0: float, q1: float, q2: float, q3: float, q4: float, u: float) -> float:
    """Return the speed at u from the coefficients of its square.

    Rounding may make the square negative near zero.
    """
    square = q0 + u * (q1 + u * (q2 + u * (q3 + u * q4)))
    return math.sqrt(square if square > 0.0 else 0.0)


@kernel
def advance(
    w: FloatArray, q: np.uint64, s: np.uint64, count: np.uint64, u0: float, h: float
) -> None:
    """Write four speeds and lengths of an arm of any number of joints, as `advance_pair`.

    The coefficients of the squared speed stand at row `q`.
    """
    u1, u2, u3 = u0 + h, u0 + 2.0 * h, u0 + 3.0 * h
    for lane in range(count):
        q0, q1, q2, q3, q4 = (
            w[q + lane],
            w[q + ROW + lane],
            w[q + R2 + lane],
            w[q + R3 + lane],
            w[q + R4 + lane],
        )
        p3, p2, p1, L = w[s - R6 + lane], w[s - R4 + lane], w[s - R2 + lane], w[s - R3 + lane]
        v0 = root(q0, q1, q2, q3, q4, u0)
        w[s + lane] = v0
        L += between(p3, p2, p1, v0)
        w[s - ROW + lane] = L
        v1 = root(q0, q1, q2, q3, q4, u1)
        w[s + R2 + lane] = v1
        L += between(p2, p1, v0, v1)
        w[s + ROW + lane] = L
        v2 = root(q0, q1, q2, q3, q4, u2)
        w[s + R4 + lane] = v2
        L += between(p1, v0, v1, v2)
        w[s + R3 + lane] = L
        v3 = root(q0, q1, q2, q3, q4, u3)
        w[s + R6 + lane] = v3
        L += between(v0, v1, v2, v3)
        w[s + R5 + lane] = L


@kernel
def close_ends(
    w: FloatArray,
    knot: np.uint64,
    joints: np.uint64,
    pitch: np.uint64,
    first: np.uint64,
    last: np.uint64,
    count: np.uint64,
) -> None:
    """Add the sample at the goal and complete the first and the last two lengths.

    Beyond both ends the speed is that of the parabola through the three samples before.
    """
    for lane in range(count):
        w[last + lane] = 0.0
    for joint in range(joints):
        row = knot + joint * pitch
        for lane in range(count):
            slope = (
                (w[row + R2 + lane] - w[row + lane])
                + w[row + ROW + lane]
                + 2.0 * w[row + R3 + lane]
            )
            w[last + lane] += slope * slope
    for lane in range(count):
        w[last + lane] = np.sqrt(w[last + lane])
    for lane in range(count):
        v3, v2, v1, v0 = (
            w[last - R6 + lane],
            w[last - R4 + lane],
            w[last - R2 + lane],
            w[last + lane],
        )
        before = w[last - R3 + lane] + between(v3, v2, v1, v0)
        beyond = 3.0 * (v0 - v1) + v2
        w[last - ROW + lane] = before
        w[last + ROW + lane] = before + between(v2, v1, v0, beyond)
    for lane in range(count):
        v0, v1, v2 = w[first + lane], w[first + R2 + lane], w[first + R4 + lane]
        beyond = 3.0 * (v0 - v1) + v2
        w[first + ROW + lane] = w[first + R3 + lane] - between(beyond, v0, v1, v2)


@kernel
def integrate_speed(
    w: FloatArray,
    joints: np.uint64,
    N: np.uint64,
    S: np.uint64,
    count: np.uint64,
    samples: np.uint64,
    work: np.uint64,
) -> None:
    """Fill the rows of speed and length of all samples of one arm.

    Its knots stand at the beginning of the scratch.
    """
    pitch = (N + U1) * R2
    h = 1.0 / np.float64(S)
    for lane in range(U3 * R2):
        w[samples - R6 + lane] = 0.0
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
