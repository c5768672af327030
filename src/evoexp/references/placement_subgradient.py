"""A projected subgradient method for a mobile arm's posture, compiled: the same bits everywhere.

Pin & Culioli (1992), whom Chen & Zalzala (1995) compare with, solved the minimax problem by a
subgradient method; its details are not printed. Here, every step has a given length and goes
against the slope of E along the surface of postures that reach the target, and is followed by a
projection onto that surface. All starts are computed together, innermost in memory.
"""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import sincos
from evoexp.records import FloatArray
from evoexp.references.placement_model import Directions

H = 1e-6  # [rad] of central differences; within it of a kink, the slope is between both sides
PROJECTIONS = 3  # Newton steps back to the surface
LANES = 32  # starts come in multiples of it: a rest would not be vector code


@kernel
def costs_of(
    x: FloatArray, model: Directions, across: FloatArray, up: FloatArray, costs: FloatArray
) -> None:
    """Write E of Eq. 14, without any cap, at many places.

    Args:
        x: (3, ≥ places) directions [rad].
        model: The criteria.
        across: (3, ≥ places) written: the links' extents along x.
        up: (3, ≥ places) written: along y.
        costs: (places,) written.
    """
    lengths, target, force = model.lengths, model.target, model.force
    weights, avoided = model.weights, model.avoided
    # the links
    for n in range(len(costs)):
        s1, c1 = sincos(x[0, n])
        s2, c2 = sincos(x[1, n])
        s3, c3 = sincos(x[2, n])
        up[0, n], up[1, n], up[2, n] = lengths[0] * s1, lengths[1] * s2, lengths[2] * s3
        across[0, n], across[1, n], across[2, n] = lengths[0] * c1, lengths[1] * c2, lengths[2] * c3
    # torques and manipulability (Eqs. 8, 10, 11, 13)
    for n in range(len(costs)):
        jx3, jy3 = -up[2, n], across[2, n]
        jx2, jy2 = jx3 - up[1, n], jy3 + across[1, n]
        jx1, jy1 = jx2 - up[0, n], jy2 + across[0, n]
        t1 = jx1 * force[0] + jy1 * force[1]
        t2, t3 = jx2 * force[0] + jy2 * force[1], jx3 * force[0] + jy3 * force[1]
        norm = t3 * t3 + t2 * t2 + t1 * t1
        largest = max(max(abs(weights[5] * t3), abs(weights[4] * t2)), abs(weights[3] * t1))
        xx = jx3 * jx3 + jx2 * jx2 + jx1 * jx1
        yy = jy3 * jy3 + jy2 * jy2 + jy1 * jy1
        xy = jx3 * jy3 + jx2 * jy2 + jx1 * jy1
        manipulability = weights[2] / max(xx * yy - xy * xy, 1e-300)
        costs[n] = weights[0] * norm + weights[1] * largest + manipulability
    # obstacles (Eq. 12); of each link the share before the point that avoids
    for m in range(len(avoided)):
        link = int(avoided[m, 1])
        one = (avoided[m, 2] if link == 1 else 1.0) if link >= 1 else 0.0
        two = (avoided[m, 2] if link == 2 else 1.0) if link >= 2 else 0.0
        three = avoided[m, 2] if link == 3 else 0.0
        for n in range(len(costs)):
            dx = target[0] - (across[2, n] + across[1, n] + across[0, n]) - avoided[m, 3]
            dx = dx + one * across[0, n] + two * across[1, n] + three * across[2, n]
            dy = -avoided[m, 4] + one * up[0, n] + two * up[1, n] + three * up[2, n]
            costs[n] += avoided[m, 0] / max(dx * dx + dy * dy, 1e-300)


@kernel
def slide(
    x: FloatArray, steps: FloatArray, model: Directions, ends: FloatArray, costs: FloatArray
) -> None:
    """Follow the method from every start.

    Args:
        x: (3, starts) directions that reach the target [rad]; overwritten. A multiple of `LANES`
            starts.
        steps: (steps,) their lengths [rad].
        model: The criteria.
        ends: (3, starts) written: the best place on every way.
        costs: (starts,) written: E there.
    """
    num, lengths = len(costs), model.lengths
    scratch = np.empty((5, 3, num))
    across, up, slope, normal, probe = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4]
    above, below, along, moves = np.empty(num), np.empty(num), np.empty(num), np.ones(num)
    costs_of(x, model, across, up, costs)
    _copy(x, ends)
    for step in steps:
        # slopes of E by differences, normals of the surface
        for k in range(3):
            _copy(x, probe)
            for n in range(num):
                probe[k, n] = x[k, n] + H
            costs_of(probe, model, across, up, above)
            for n in range(num):
                probe[k, n] = x[k, n] - H
            costs_of(probe, model, across, up, below)
            for n in range(num):
                slope[k, n] = (above[n] - below[n]) / (2.0 * H)
                normal[k, n] = lengths[k] * sincos(x[k, n])[1]
        # slopes along the surface
        for n in range(num):
            a, b, c = normal[0, n], normal[1, n], normal[2, n]
            inner = slope[0, n] * a + slope[1, n] * b + slope[2, n] * c
            square = a * a + b * b + c * c
            share = inner / square if square > 0.0 else 0.0
            a, b, c = slope[0, n] - share * a, slope[1, n] - share * b, slope[2, n] - share * c
            slope[0, n], slope[1, n], slope[2, n] = a, b, c
            along[n] = a * a + b * b + c * c
        # a step, and back to the surface
        for n in range(num):
            moves[n] = moves[n] if along[n] > 0.0 else 0.0  # a way ends where there is no slope
            along[n] = np.sqrt(along[n] if along[n] > 0.0 else 1.0)
        for k in range(3):
            for n in range(num):
                x[k, n] -= moves[n] * step * slope[k, n] / along[n]
        _project(x, model, moves, normal, above)
        costs_of(x, model, across, up, below)
        # the best place so far
        _heights(x, model, normal, above)
        for n in range(num):
            if below[n] < costs[n] and abs(above[n]) < 1e-9:
                costs[n] = below[n]
                ends[0, n], ends[1, n], ends[2, n] = x[0, n], x[1, n], x[2, n]


@kernel
def _copy(x: FloatArray, out: FloatArray) -> None:
    """Write directions (3, starts) into `out`."""
    for k in range(3):
        for n in range(x.shape[1]):
            out[k, n] = x[k, n]


@kernel
def _project(
    x: FloatArray, model: Directions, moves: FloatArray, normal: FloatArray, heights: FloatArray
) -> None:
    """Bring the end-effectors back to their height, by the shortest way to first order.

    Args:
        x: (3, starts) directions [rad].
        model: The criteria.
        moves: (starts,) 1, or 0 for a start that does not move.
        normal: (3, starts) overwritten.
        heights: (starts,) overwritten.
    """
    for _ in range(PROJECTIONS):
        _heights(x, model, normal, heights)
        for n in range(len(heights)):
            a, b, c = normal[0, n], normal[1, n], normal[2, n]
            square = a * a + b * b + c * c
            heights[n] = moves[n] * heights[n] / square if square > 0.0 else 0.0
        for k in range(3):
            for n in range(len(heights)):
                x[k, n] -= heights[n] * normal[k, n]


@kernel
def _heights(x: FloatArray, model: Directions, normal: FloatArray, heights: FloatArray) -> None:
    """Write the end-effectors' heights above their target (starts,), derivatives (3, starts)."""
    for n in range(len(heights)):
        heights[n] = -model.target[1]
    for k in range(3):
        for n in range(len(heights)):
            s, c = sincos(x[k, n])
            heights[n] += model.lengths[k] * s
            normal[k, n] = model.lengths[k] * c
