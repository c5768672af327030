"""Redistribution of via-points to equal arc length, lengths and relaxation (Rana & Zalzala 1995).

A cubic spline through the via-points over their index has speeds at equidistant samples; their
running integral is the arc length. Via-point i moves to where the length is L·i/N. Between two
samples the speed is taken as linear, which inverts in closed form. Eight paths of an arm are
treated at a time, as vectors; what differs from path to path is read number by number.

On segment k, with u in [0, 1], a and m (a sixth of the second derivative) at both ends:

    s(u)  = a0 + u (b0 + u (b1/2 + u b2/3)),   s'(u) = b0 + u (b1 + u b2),
    b0 = a1 − a0 − 2 m0 − m1,   b1 = 6 m0,   b2 = 3 (m1 − m0).

Accuracy: root mean square (and largest) distance from the converged points in units of their
spacing, 100 paths of 21 points in the plane, fresh walks and populations just crossed over:

    8 samples per segment   0.6e-3 … 1.7e-3   (0.8e-2 … 1.2e-2)
    16 samples              1.1e-4 … 2.6e-4   (1.4e-3 … 2.1e-3)
    16 chords               0.8e-3 … 1.1e-3   (0.4e-2 … 0.5e-2)

Gauss's rule with a polynomial inverse needs as many roots for that: near a cusp, which crossed-over
paths have, the speed is hardly smooth.
"""

import numpy as np

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vectors import (
    LANES,
    Vector,
    ceiling,
    load,
    magnitude,
    root,
    select,
    spread,
    store,
)
from evoexp.records import FloatArray, IntArray

VECTOR, ONE = np.uint64(LANES), np.uint64(1)
PAIR = np.uint64(2 * LANES)  # places of a knot: eight a, eight m
LONGEST = 1e300  # a longer path has overflowed (garbage in a padded lane) and stays as it is


@kernel
def spline_pivots(num: int, is_clamped: bool) -> FloatArray:
    """Return the reciprocal pivots (N + 1,) of the equations for m.

    Inside, m[i−1] + 4 m[i] + m[i+1] = a[i−1] − 2 a[i] + a[i+1]. Clamped ends (slope zero) add the
    first equation 2 m[0] + m[1] = a[1] − a[0] and the last, m[N−1] + 2 m[N] = a[N−1] − a[N].
    Natural ones have m[0] = m[N] = 0, which a reciprocal of zero achieves.
    """
    pivots = np.zeros(num + 1)
    pivots[0] = 0.5 if is_clamped else 0.0
    for i in range(1, num):
        pivots[i] = 1.0 / (4.0 - pivots[i - 1])
    pivots[num] = 1.0 / (2.0 - pivots[num - 1]) if is_clamped else 0.0
    return pivots


@inlined
def fit_splines(
    via_points: FloatArray,  # see `redistribute_arms`, flat
    first: np.uint64,  # place of point 0 of the arm's first joint
    pitch: np.uint64,  # distance of two points
    joints: np.uint64,
    N: np.uint64,
    pivots: FloatArray,
    knots: FloatArray,  # (joints · (N + 1) · 16,) written: a and m of knot i of joint j
) -> None:
    """Copy the coordinates of eight paths and solve for m (Thomas algorithm)."""
    for joint in range(joints):
        source, knot = first + joint * (N + ONE) * pitch, joint * (N + ONE) * PAIR
        before, here = load(via_points, source), load(via_points, source + pitch)
        # forward: the equations of `spline_pivots`, each freed of the unknown before
        m = (here - before) * pivots[0]
        store(knots, knot, before)
        store(knots, knot + VECTOR, m)
        for i in range(ONE, N):
            after = load(via_points, source + (i + ONE) * pitch)
            m = ((before - here) + (after - here) - m) * pivots[i]
            store(knots, knot + i * PAIR, here)
            store(knots, knot + i * PAIR + VECTOR, m)
            before, here = here, after
        m = ((before - here) - m) * pivots[N]
        store(knots, knot + N * PAIR, here)
        store(knots, knot + N * PAIR + VECTOR, m)
        # backward: the unknowns
        for back in range(N):
            place = knot + (N - ONE - back) * PAIR + VECTOR
            m = load(knots, place) - m * pivots[N - ONE - back]
            store(knots, place, m)


@inlined
def slope(knots: FloatArray, knot: np.uint64) -> tuple[Vector, Vector, Vector]:
    """Return b0, b1, b2 of one joint on the segment that begins at a knot."""
    a0, m0 = load(knots, knot), load(knots, knot + VECTOR)
    a1, m1 = load(knots, knot + PAIR), load(knots, knot + PAIR + VECTOR)
    return a1 - a0 - 2.0 * m0 - m1, 6.0 * m0, 3.0 * (m1 - m0)


@inlined
def write_speeds(
    knots: FloatArray, joints: np.uint64, N: np.uint64, S: np.uint64, speeds: FloatArray
) -> None:
    """Write the speeds |s'| of eight paths at all samples, and at one beyond the goal."""
    h, pitch = 1.0 / np.float64(S), (N + ONE) * PAIR
    for k in range(N):
        x, place = slope(knots, k * PAIR), k * S * VECTOR
        if joints == np.uint64(2):
            y = slope(knots, pitch + k * PAIR)
            for s in range(S):
                u = np.float64(s) * h
                one, two = x[0] + u * (x[1] + u * x[2]), y[0] + u * (y[1] + u * y[2])
                store(speeds, place + s * VECTOR, root(one * one + two * two))
            continue
        # coefficients of the square, which rounding may make negative
        b0, b1, b2 = x
        q0, q1, q2 = b0 * b0, 2.0 * b0 * b1, b1 * b1 + 2.0 * b0 * b2
        q3, q4 = 2.0 * b1 * b2, b2 * b2
        for joint in range(ONE, joints):
            b0, b1, b2 = slope(knots, joint * pitch + k * PAIR)
            q0, q1, q2 = q0 + b0 * b0, q1 + 2.0 * b0 * b1, q2 + (b1 * b1 + 2.0 * b0 * b2)
            q3, q4 = q3 + 2.0 * b1 * b2, q4 + b2 * b2
        for s in range(S):
            u = np.float64(s) * h
            square = q0 + u * (q1 + u * (q2 + u * (q3 + u * q4)))
            store(speeds, place + s * VECTOR, root(select(square > 0.0, square, spread(0.0))))
    # at the goal; beyond it the speed is that of the parabola through the last three samples
    squares, goal = spread(0.0), N * S * VECTOR
    for joint in range(joints):
        knot = joint * pitch + (N - ONE) * PAIR
        a0, m0 = load(knots, knot), load(knots, knot + VECTOR)
        a1, m1 = load(knots, knot + PAIR), load(knots, knot + PAIR + VECTOR)
        end = (a1 - a0) + m0 + 2.0 * m1
        squares = squares + end * end
    v, p1, p2 = root(squares), load(speeds, goal - VECTOR), load(speeds, goal - PAIR)
    store(speeds, goal, v)
    store(speeds, goal + VECTOR, 3.0 * (v - p1) + p2)


@inlined
def between(v0: Vector, v1: Vector, v2: Vector, v3: Vector) -> Vector:
    """Return 24/h times the length between the samples 1 and 2 of four speeds.

    It is that of the cubic through them, h/24 (13 (v1 + v2) − v0 − v3), yet at or above a twelfth
    of the trapezoid's, so that lengths never fall where a path turns on the spot.
    """
    inner = v1 + v2
    length = 13.0 * inner - (v0 + v3)
    return select(inner < length, length, inner)


@inlined
def integrate_speed(speeds: FloatArray, num_samples: np.uint64, lengths: FloatArray) -> None:
    """Write the lengths up to all samples; their origin is arbitrary (not zero)."""
    v0, v1, v2 = spread(0.0), load(speeds, np.uint64(0)), load(speeds, VECTOR)
    length = between(v0, v0, v0, v1) + between(v0, v0, v1, v2)
    for s in range(num_samples):
        place = s * VECTOR
        v3 = load(speeds, place + PAIR)
        following = length + between(v0, v1, v2, v3)
        if s == np.uint64(0):
            # before the start, too, the speed is that of a parabola
            length = following - between(3.0 * (v1 - v2) + v3, v1, v2, v3)
        store(lengths, place, length)
        length, v0, v1, v2 = following, v1, v2, v3
    store(lengths, num_samples * VECTOR, length)


@inlined
def find_places(
    speeds: FloatArray,
    lengths: FloatArray,
    N: np.uint64,
    S: np.uint64,
    segments: IntArray,  # (N · 8,) written: the segment of every target
    places: FloatArray,  # (N · 8,) written: u of every target in it
) -> None:
    """Find every target L·i/N of eight paths."""
    n, h, origin = np.float64(N), 1.0 / np.float64(S), load(lengths, np.uint64(0))
    total = load(lengths, N * S * VECTOR) - origin
    per_part = n / total
    # every segment is entered at the first target at or after its begin, of several the last one
    segments[:] = 0
    for k in range(ONE, N):
        target = ceiling((load(lengths, k * S * VECTOR) - origin) * per_part)
        target = select(target < n, target, spread(n))  # NaN, too, becomes a valid index
        store(places, k * VECTOR, select(target > 0.0, target, spread(0.0)))
    for k in range(ONE, N):
        for lane in range(VECTOR):
            segments[np.uint64(places[k * VECTOR + lane]) * VECTOR + lane] = k
    around = np.empty(4 * LANES)  # speeds and lengths at the samples around eight targets
    for i in range(ONE, N):
        own, target = i * VECTOR, origin + total * (np.float64(i) / n)
        store(places, own, target)
        for lane in range(VECTOR):
            # the last segment entered up to here; its last sample not beyond the target
            place = own + lane
            segment = max(segments[place], segments[place - VECTOR])
            segments[place] = segment
            at, step, limit = np.uint64(segment) * S, S >> ONE, places[place]
            while step > np.uint64(0):
                if lengths[(at + step) * VECTOR + lane] <= limit:
                    at += step
                step >>= ONE
            sample = at * VECTOR + lane
            around[lane], around[lane + VECTOR] = speeds[sample], speeds[sample + VECTOR]
            around[lane + PAIR] = lengths[sample]
            around[lane + PAIR + VECTOR] = lengths[sample + VECTOR]
            places[place] = np.float64(at - np.uint64(segment) * S)
        # between two samples the speed is linear
        v0, v1 = load(around, np.uint64(0)), load(around, VECTOR)
        l0, l1 = load(around, PAIR), load(around, PAIR + VECTOR)
        length, both, r = l1 - l0, v0 + v1, target - l0
        r = select(r > 0.0, r, spread(0.0))
        r = select(r < length, r, length)
        begin = length * v0
        below = begin + root(begin * begin + r * length * (v1 - v0) * both)
        x = select(below > 0.0, r * both / below, spread(0.0))
        store(places, own, (load(places, own) + select(x < 1.0, x, spread(1.0))) * h)


@inlined
def point_at(knots: FloatArray, knot: np.uint64, u: float) -> float:
    """Return s(u) of one path on the segment that begins at a knot."""
    a0, m0, a1, m1 = (
        knots[knot],
        knots[knot + VECTOR],
        knots[knot + PAIR],
        knots[knot + PAIR + VECTOR],
    )
    point: float = a0 + u * ((a1 - a0 - 2.0 * m0 - m1) + u * (3.0 * m0 + u * (m1 - m0)))
    return point


@kernel
def redistribute_arms(
    # (nq, N + 1, lanes) paths, N ≥ 2, any unit common to the joints of an arm; lanes fill vectors
    via_points: FloatArray,
    arm_slices: IntArray,  # (arms, 2) first and last-plus-one joint of each arm
    num_lanes: int,  # that are treated, a multiple of eight; those behind are left alone
    samples: int,  # speeds per segment, a power of two
    is_clamped: bool,  # whether the splines' slopes at both ends are zero
) -> None:
    """Move the via-points of every arm's path to equal arc length along its spline, in place.

    The end points keep their bits; a path without length keeps all of them. Lengths come from
    speeds by a rule of fourth order: 8 per segment are about as accurate as 16 chords, 16 about
    five times better.
    """
    N, S = np.uint64(via_points.shape[1] - 1), np.uint64(samples)
    flat, pitch = borrowed(via_points.reshape(-1)), np.uint64(via_points.shape[2])
    pivots = spline_pivots(via_points.shape[1] - 1, is_clamped)
    most = np.uint64(np.max(arm_slices[:, 1] - arm_slices[:, 0]))
    knots = np.empty(most * (N + ONE) * PAIR)
    speeds, lengths = np.empty((N * S + np.uint64(2)) * VECTOR), np.empty((N * S + ONE) * VECTOR)
    places, segments = np.empty((N + ONE) * VECTOR), np.empty((N + ONE) * VECTOR, dtype=np.int64)
    for arm in range(len(arm_slices)):
        joint = np.uint64(arm_slices[arm, 0])
        joints = np.uint64(arm_slices[arm, 1]) - joint
        for start in range(np.uint64(0), np.uint64(num_lanes), VECTOR):
            first = joint * (N + ONE) * pitch + start
            fit_splines(flat, first, pitch, joints, N, pivots, knots)
            write_speeds(knots, joints, N, S, speeds)
            integrate_speed(speeds, N * S, lengths)
            find_places(speeds, lengths, N, S, segments, places)
            # the splines there; paths without length and overflown ones stay
            for lane in range(VECTOR):
                total = lengths[N * S * VECTOR + lane] - lengths[lane]
                if 0.0 < total < LONGEST:
                    for j in range(joints):
                        place, rows = first + j * (N + ONE) * pitch + lane, j * (N + ONE) * PAIR
                        for i in range(ONE, N):
                            own = i * VECTOR + lane
                            knot = rows + np.uint64(segments[own]) * PAIR + lane
                            flat[place + i * pitch] = point_at(knots, knot, places[own])


@kernel
def measure_paths(
    via_points: FloatArray, arm_slices: IntArray, lengths: FloatArray, unevenness: FloatArray
) -> None:
    """Write length and unevenness of every arm's path, each (arms, lanes).

    The via-points are (nq, N + 1, lanes), lanes a multiple of eight. The length is the sum of the
    distances d_i of neighbours (Eqs. 2, 3), the unevenness that of |d_i − their mean| (Eqs. 4, 5).
    """
    num, pitch = np.uint64(via_points.shape[1] - 1), np.uint64(via_points.shape[2])
    points, steps = borrowed(via_points.reshape(-1)), np.empty(num * VECTOR)
    lengths_of_arms, unevenness_of_arms = borrowed((lengths.reshape(-1), unevenness.reshape(-1)))
    for arm in range(len(arm_slices)):
        first, stop = np.uint64(arm_slices[arm, 0]), np.uint64(arm_slices[arm, 1])
        for lane in range(np.uint64(0), pitch, VECTOR):
            # Eqs. 2, 3: distances of neighbours
            length = spread(0.0)
            for i in range(num):
                squared = spread(0.0)
                for j in range(first, stop):
                    place = (j * (num + ONE) + i) * pitch + lane
                    d = load(points, place + pitch) - load(points, place)
                    squared = squared + d * d
                step = root(squared)
                store(steps, i * VECTOR, step)
                length = length + step
            # Eqs. 4, 5
            mean, uneven = length / np.float64(num), spread(0.0)
            for i in range(num):
                uneven = uneven + magnitude(load(steps, i * VECTOR) - mean)
            store(lengths_of_arms, np.uint64(arm) * pitch + lane, length)
            store(unevenness_of_arms, np.uint64(arm) * pitch + lane, uneven)


@kernel
def relax_points(via_points: FloatArray, delta: float, num_lanes: int) -> None:
    """Move via-points (nq, N + 1, lanes) by `delta` toward the middle of their neighbours.

    This is one sweep of the loop of Rana & Zalzala 1995, Eqs. 8 and 9, as it is written: point i
    sees point i − 1 as already moved. The ends stay. `num_lanes` is a multiple of eight.
    """
    flat, pitch = borrowed(via_points.reshape(-1)), np.uint64(via_points.shape[2])
    num_points = np.uint64(via_points.shape[1])
    for joint in range(via_points.shape[0]):
        for lane in range(0, num_lanes, LANES):
            start = np.uint64(joint) * num_points * pitch + np.uint64(lane)
            before, a = load(flat, start), load(flat, start + pitch)
            for i in range(1, via_points.shape[1] - 1):
                place = start + np.uint64(i) * pitch
                after = load(flat, place + pitch)
                middle = (before + after) / 2.0
                before = a + delta * (middle - a)  # (Eqs 8, 9)
                store(flat, place, before)
                a = after
