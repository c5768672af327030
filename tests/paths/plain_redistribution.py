"""Redistribution of one path after the other, number by number: slow, and the same bits.

Every operation stands in the order in which the kernels have it for each of their paths; nothing is
a vector, transposed, or on its way while something else is done.
"""

import math

import numpy as np

from evoexp.paths.workspace import spline_pivots


def plainly_redistributed(path, end_condition, samples):
    """Return the points of one arm's path (N + 1, joints) at equal arc length."""
    N, joints = len(path) - 1, path.shape[1]
    columns = [[float(a) for a in column] for column in path.T]
    pivots = [float(p) for p in spline_pivots(N, end_condition)]
    sixths = [_sixths(a, pivots) for a in columns]
    speeds = _speeds(columns, sixths, samples)
    lengths = _lengths(speeds)
    origin, total = lengths[0], lengths[-1] - lengths[0]
    if not 0.0 < total < 1e300:
        return path.copy()
    moved = path.copy()
    for i in range(1, N):
        target = origin + total * (i / N)
        segment = 0
        for k in range(1, N):
            if math.ceil((lengths[k * samples] - origin) * (N / total)) <= i:
                segment = k
        first = segment * samples
        inside = sum(length <= target for length in lengths[first + 1 : first + samples])
        at = first + inside
        u = (inside + _part(target, speeds[at : at + 2], lengths[at : at + 2])) * (1.0 / samples)
        for joint in range(joints):
            a, m = columns[joint], sixths[joint]
            a0, a1, m0, m1 = a[segment], a[segment + 1], m[segment], m[segment + 1]
            inner = 3.0 * m0 + u * (m1 - m0)
            moved[i, joint] = a0 + u * ((a1 - a0 - 2.0 * m0 - m1) + u * inner)
    return moved


def _sixths(a, pivots):
    """Return sixths of the spline's second derivatives (Thomas algorithm)."""
    N = len(a) - 1
    m = [(a[1] - a[0]) * pivots[0]]
    for i in range(1, N):
        m.append(((a[i - 1] - a[i]) + (a[i + 1] - a[i]) - m[-1]) * pivots[i])
    m.append(((a[N - 1] - a[N]) - m[-1]) * pivots[N])
    for k in range(N - 1, -1, -1):
        m[k] = m[k] - m[k + 1] * pivots[k]
    return m


def _speeds(columns, sixths, samples):
    """Return the speeds at all samples, the goal's last."""
    N, found = len(columns[0]) - 1, []
    for k in range(N):
        slopes = []
        for a, m in zip(columns, sixths, strict=True):
            b0 = a[k + 1] - a[k] - 2.0 * m[k] - m[k + 1]
            slopes.append((b0, 6.0 * m[k], 3.0 * (m[k + 1] - m[k])))
        found += [_speed(slopes, j / samples) for j in range(samples)]
    squares = 0.0
    for a, m in zip(columns, sixths, strict=True):
        end = (a[N] - a[N - 1]) + m[N - 1] + 2.0 * m[N]
        squares += end * end
    return [*found, math.sqrt(squares)]


def _speed(slopes, u):
    if len(slopes) == 2:
        one, two = (b0 + u * (b1 + u * b2) for b0, b1, b2 in slopes)
        return math.sqrt(one * one + two * two)
    q = None
    for b0, b1, b2 in slopes:
        own = b0 * b0, 2.0 * b0 * b1, b1 * b1 + 2.0 * b0 * b2, 2.0 * b1 * b2, b2 * b2
        q = own if q is None else tuple(x + y for x, y in zip(q, own, strict=True))
    square = q[0] + u * (q[1] + u * (q[2] + u * (q[3] + u * q[4])))
    return math.sqrt(square if square > 0.0 else 0.0)


def _lengths(v):
    """Return lengths up to all samples."""
    beyond = 3.0 * (v[-1] - v[-2]) + v[-3]
    v = [0.0, 0.0, 0.0, *v, beyond]  # the sum begins where there is no speed yet
    sums = [_between(v[0:4])]
    for j in range(1, len(v) - 3):
        sums.append(sums[-1] + _between(v[j : j + 4]))
    lengths = sums[1:]
    start = 3.0 * (v[3] - v[4]) + v[5]
    lengths[0] = lengths[1] - _between([start, v[3], v[4], v[5]])
    return lengths


def _between(v):
    inner = v[1] + v[2]
    length = 13.0 * inner - (v[0] + v[3])
    return length if inner < length else inner


def _part(target, speeds, lengths):
    """Return where a target lies between two samples, from 0 to 1."""
    length, both = lengths[1] - lengths[0], speeds[0] + speeds[1]
    r = min(max(target - lengths[0], 0.0), length)
    begin = length * speeds[0]
    below = begin + math.sqrt(begin * begin + r * length * (speeds[1] - speeds[0]) * both)
    return min(r * both / below, 1.0) if below > 0.0 else 0.0


def run_plainly(via_points, arm_slices, end_condition, samples):
    """Return strings (nq, N + 1, lanes) with every arm's path redistributed."""
    found = via_points.copy()
    for first, stop in arm_slices:
        for lane in range(via_points.shape[2]):
            path = np.ascontiguousarray(via_points[first:stop, :, lane].T)
            found[first:stop, :, lane] = plainly_redistributed(path, end_condition, samples).T
    return found
