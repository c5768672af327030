"""The same operations written as loops over single paths, with scipy and math: slow and obvious."""

import math

import numpy as np
import scipy

DENSE = 512  # sub-intervals per segment; 4-point Gauss on each


def redistributed(path, end_condition):
    """Return the points (N + 1, joints) at equal arc length along the spline through `path`."""
    num = len(path) - 1
    spline = scipy.interpolate.CubicSpline(np.arange(num + 1), path, bc_type=end_condition)
    edges = np.arange(num * DENSE + 1) / DENSE
    nodes, weights = np.polynomial.legendre.leggauss(4)
    pieces = np.zeros(num * DENSE)
    for node, weight in zip(nodes, weights, strict=True):
        at = edges[:-1] + (node + 1) / 2 / DENSE
        pieces += weight / 2 / DENSE * np.linalg.norm(spline(at, 1), axis=1)
    length = np.concatenate([[0.0], np.cumsum(pieces)])
    if length[-1] == 0.0:
        return path.copy()
    out = path.copy()
    for i in range(1, num):
        out[i] = spline(np.interp(i * length[-1] / num, length, edges))
    return out


def walked(start, goal, num, uniforms, step, max_turn):
    """Return the random walk (N + 1, joints) of one arm with true angles."""
    start, goal, uniforms = np.array(start), np.array(goal), list(uniforms)
    joints, length = len(start), step * math.dist(start, goal) / num
    path = [start]
    for _ in range(num - 1):
        d = goal - path[-1]
        if joints == 1:
            path.append(path[-1] + length * np.sign(d))
            continue
        angles = [math.atan2(d[1], d[0])] + [
            math.atan2(d[k], math.hypot(*d[:k])) for k in range(2, joints)
        ]
        angles = [a + (2 * uniforms.pop(0) - 1) * max_turn for a in angles]
        move, rest = np.zeros(joints), length
        for k in range(joints - 1, 0, -1):
            move[k] = rest * math.sin(angles[k - 1])
            rest *= math.cos(angles[k - 1])
        move[0] = rest
        path.append(path[-1] + move)
    return np.array([*path, goal])
