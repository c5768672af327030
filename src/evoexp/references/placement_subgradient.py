"""A projected subgradient method for a mobile arm's posture, compiled: the same bits everywhere.

Pin & Culioli (1992), whom Chen & Zalzala (1995) compare with, solved the minimax problem by one; its details are not
printed. Here: steps of given lengths against the slope of E along the surface of postures that reach the target, each
followed by a projection onto that surface.
"""

import numpy as np

from evoexp.numerics import kernel, sincos

H = 1e-6  # [rad] of central differences; beside a kink the slope is that of the side where x is, or between both
PROJECTIONS = 3  # Newton steps back to the surface


@kernel
def cost_of(x, lengths, target, force, weights, avoided):  # type: ignore[no-untyped-def]
    """Return E of Eq. 14 at directions x (3,) [rad], without any cap; see `placement_model.Directions`."""
    across, up = np.empty(3), np.empty(3)
    for k in range(3):
        s, c = sincos(x[k])
        across[k], up[k] = lengths[k] * c, lengths[k] * s
    jx, jy, norm, largest, xx, yy, xy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(2, -1, -1):
        jx -= up[k]
        jy += across[k]
        torque = jx * force[0] + jy * force[1]
        norm += torque * torque
        largest = max(largest, abs(weights[3 + k] * torque))
        xx += jx * jx
        yy += jy * jy
        xy += jx * jy
    total = weights[0] * norm + weights[1] * largest + weights[2] / max(xx * yy - xy * xy, 1e-300)
    for n in range(len(avoided)):
        px, py = target[0] - jy - avoided[n, 3], -avoided[n, 4]
        for k in range(int(avoided[n, 1])):
            share = avoided[n, 2] if k + 1 == int(avoided[n, 1]) else 1.0
            px += share * across[k]
            py += share * up[k]
        total += avoided[n, 0] / max(px * px + py * py, 1e-300)
    return total


@kernel
def slide(starts, steps, lengths, target, force, weights, avoided, ends, costs):  # type: ignore[no-untyped-def]
    """Follow the method from every start.

    Args:
        starts: (3, starts) directions that reach the target [rad].
        steps: (steps,) their lengths [rad].
        lengths: As of `cost_of`, and so are the next four.
        ends: (3, starts) written: the best place of every way.
        costs: (starts,) written: E there.
    """
    slope, normal, x, probe = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for start in range(starts.shape[1]):
        x[:] = starts[:, start]
        costs[start] = cost_of(x, lengths, target, force, weights, avoided)
        ends[:, start] = x
        for step in steps:
            inner, square = 0.0, 0.0
            for k in range(3):
                probe[:] = x
                probe[k] = x[k] + H
                above = cost_of(probe, lengths, target, force, weights, avoided)
                probe[k] = x[k] - H
                slope[k] = (above - cost_of(probe, lengths, target, force, weights, avoided)) / (2.0 * H)
                normal[k] = lengths[k] * sincos(x[k])[1]
                inner += slope[k] * normal[k]
                square += normal[k] * normal[k]
            along = 0.0
            for k in range(3):
                slope[k] -= inner / square * normal[k] if square > 0.0 else 0.0
                along += slope[k] * slope[k]
            if not along > 0.0:
                break
            for k in range(3):
                x[k] -= step * slope[k] / np.sqrt(along)
            _project(x, lengths, target)
            cost = cost_of(x, lengths, target, force, weights, avoided)
            if cost < costs[start] and abs(_height(x, lengths, target)) < 1e-9:
                costs[start] = cost
                ends[:, start] = x


@kernel
def _project(x, lengths, target):  # type: ignore[no-untyped-def]
    """Bring the end-effector back to its height, by the shortest way to first order."""
    for _ in range(PROJECTIONS):
        off, square = _height(x, lengths, target), 0.0
        for k in range(3):
            square += (lengths[k] * sincos(x[k])[1]) ** 2
        if square > 0.0:
            for k in range(3):
                x[k] -= off / square * lengths[k] * sincos(x[k])[1]


@kernel
def _height(x, lengths, target):  # type: ignore[no-untyped-def]
    """Return by how much the end-effector is above its target."""
    height = -target[1]
    for k in range(3):
        height += lengths[k] * sincos(x[k])[0]
    return height
