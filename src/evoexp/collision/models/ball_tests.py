"""Tests of balls around bodies, parts and obstacles: which configurations must be measured exactly.

Every unit has a ball around it. Obstacles are ruled out first by the ball around them, then by the
box around them. Bounds are widened by `MARGIN`, so rounding rules out no contact.
"""

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.models.center_kernels import spatial_point
from evoexp.collision.models.obstacle_kernels import MARGIN
from evoexp.collision.models.packed_shapes import (
    AROUND,
    BOX,
    BOX_THICKNESS,
    FIRST_LISTED,
    HALF_SPACES,
    JOINT,
    REACH,
    SLACK,
    STOP_LISTED,
    PackedObstacles,
    Units,
)
from evoexp.numeric.compilation import inlined, kernel
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import U

LANES = 128
"""Configurations that are judged together: encounters are gathered over all of them."""

Bits = NDArray[np.uint64]  # (LANES,) a word of encounters per configuration


@inlined
def middles_of_balls(
    units: Units, frames: FloatArray, first: np.uint64, middles: FloatArray
) -> None:
    """Write the centres of the balls around the units for eight configurations.

    Args:
        units: The units.
        frames: (joints + 1 · SPATIAL_FRAME,) frames of the joints and of the world.
        first: First lane of the eight.
        middles: (units · 3 · LANES,), written.
    """
    for b in range(len(units.whole)):
        own, joint = U(b) * U(3 * LANES) + first, units.whole[b, JOINT]
        spatial_point(frames, joint, units.ball[b], middles, own, U(LANES))


@kernel
def bound_obstacles(
    lanes: int,
    units: Units,
    obstacles: PackedObstacles,
    middles: FloatArray,
    least: FloatArray,
    best: FloatArray,
) -> None:
    """Lower `best` to a little more than an upper bound of the least clearance from obstacles.

    Some shape of a unit is as near to the centre of its ball as the slack tells, and an obstacle's
    centre belongs to the obstacle. This bound spares a caller that asks for all distances most
    encounters.

    Args:
        lanes: How many configurations.
        units: The units.
        obstacles: The obstacles.
        middles: (units · 3 · LANES,).
        least: (≥ LANES,) scratch.
        best: (3 · LANES,), the first row lowered.
    """
    whole, ball = units.whole, units.ball
    data, listed = obstacles.data, obstacles.listed
    for b in range(len(whole)):
        m, slack, reach = U(b) * U(3 * LANES), ball[b, SLACK], ball[b, REACH]
        for n in range(lanes):
            least[U(n)] = np.inf
        for t in range(whole[b, FIRST_LISTED], whole[b, STOP_LISTED]):
            o = listed[t, 0]
            if listed[t, 1] == HALF_SPACES:
                nx, ny, nz = data[o, 5], data[o, 8], data[o, 11]
                level = nx * data[o, 0] + ny * data[o, 1] + nz * data[o, 2]
                for n in range(lanes):
                    k, lane = m + U(n), U(n)
                    height = (
                        nx * middles[k]
                        + ny * middles[k + U(LANES)]
                        + nz * middles[k + U(2 * LANES)]
                        - level
                    )
                    bound = height + slack + (abs(height) + abs(level) + reach) * (MARGIN - 1.0)
                    best[lane] = bound if bound < best[lane] else best[lane]
            else:
                cx, cy, cz = data[o, 0], data[o, 1], data[o, 2]
                for n in range(lanes):
                    k, lane = m + U(n), U(n)
                    x, y = middles[k] - cx, middles[k + U(LANES)] - cy
                    z = middles[k + U(2 * LANES)] - cz
                    square = x * x + y * y + z * z
                    least[lane] = square if square < least[lane] else least[lane]
        # one square root for the nearest obstacle's centre
        for n in range(lanes):
            distance, before = np.sqrt(least[U(n)]), best[U(n)]
            bound = distance + slack + (distance + reach) * (MARGIN - 1.0)
            best[U(n)] = bound if bound < before else before


@kernel
def bound_pairs(
    lanes: int, units: Units, pairs: IntArray, middles: FloatArray, best: FloatArray
) -> None:
    """Lower `best` to a little more than an upper bound of the clearances of all pairs of units."""
    ball = units.ball
    for p in range(len(pairs)):
        one, two, row = pairs[p, 0], pairs[p, 1], U(pairs[p, 2]) * U(LANES)
        slack, reach = ball[one, SLACK] + ball[two, SLACK], ball[one, REACH] + ball[two, REACH]
        a, b = U(one) * U(3 * LANES), U(two) * U(3 * LANES)
        for n in range(lanes):
            i, j, k = a + U(n), b + U(n), row + U(n)
            x, y = middles[i] - middles[j], middles[i + U(LANES)] - middles[j + U(LANES)]
            z = middles[i + U(2 * LANES)] - middles[j + U(2 * LANES)]
            distance = np.sqrt(x * x + y * y + z * z)
            bound = distance + slack + (distance + reach) * (MARGIN - 1.0)
            best[k] = bound if bound < best[k] else best[k]


@kernel
def mark_obstacles(
    lanes: int,
    b: int,
    units: Units,
    obstacles: PackedObstacles,
    first: int,
    stop: int,
    middles: FloatArray,
    best: FloatArray,
    bits: Bits,
) -> bool:
    """Mark the configurations in which a body's ball may be nearer to obstacles than the best.

    The obstacle's ball is tested first; where it is met in any lane, the box around the obstacle
    decides.

    Args:
        lanes: How many configurations.
        b: The body.
        units: The units.
        obstacles: The obstacles.
        first: First entry of the obstacles' list.
        stop: One past the last, at most 64 on.
        middles: (units · 3 · LANES,).
        best: Least clearances so far.
        bits: Written: bit t − first of a lane's word for entry t.

    Returns:
        Whether anything is marked.
    """
    data, listed = obstacles.data, obstacles.listed
    reach, m = units.ball[b, REACH], U(b) * U(3 * LANES)
    bits[:] = U(0)
    for t in range(first, stop):
        o, bit = listed[t, 0], U(1) << U(t - first)
        if listed[t, 1] == HALF_SPACES:
            _mark_half_space(lanes, data[o], reach, m, middles, best, bit, bits)
        elif _meets_ball(lanes, data[o], reach, m, middles, best):
            _mark_box(lanes, data[o], reach, m, middles, best, bit, bits)
    return _any_marked(lanes, bits)


@kernel
def _any_marked(lanes: int, bits: Bits) -> bool:
    count = 0
    for n in range(lanes):
        count += bits[U(n)] != U(0)
    return count > 0


@kernel
def _mark_half_space(
    lanes: int,
    obstacle: FloatArray,
    reach: float,
    m: np.uint64,
    middles: FloatArray,
    best: FloatArray,
    bit: np.uint64,
    bits: Bits,
) -> None:
    """Mark the lanes in which a unit's ball is lower above a half-space than the best."""
    nx, ny, nz = obstacle[5], obstacle[8], obstacle[11]
    level = nx * obstacle[0] + ny * obstacle[1] + nz * obstacle[2]
    margin = reach * MARGIN + abs(level) * (MARGIN - 1.0)
    for n in range(lanes):
        k, lane = m + U(n), U(n)
        height = (
            nx * middles[k] + ny * middles[k + U(LANES)] + nz * middles[k + U(2 * LANES)] - level
        )
        bits[lane] |= bit if height < best[lane] + margin else U(0)


@kernel
def _meets_ball(
    lanes: int,
    obstacle: FloatArray,
    reach: float,
    m: np.uint64,
    middles: FloatArray,
    best: FloatArray,
) -> bool:
    """Return whether a unit's ball meets the ball around an obstacle in any lane."""
    cx, cy, cz, margin = obstacle[0], obstacle[1], obstacle[2], (reach + obstacle[AROUND]) * MARGIN
    count = 0
    for n in range(lanes):
        k, lane = m + U(n), U(n)
        x, y, z = middles[k] - cx, middles[k + U(LANES)] - cy, middles[k + U(2 * LANES)] - cz
        within = (best[lane] + margin) * MARGIN
        within = within if within > 0.0 else 0.0
        count += x * x + y * y + z * z < within * within
    return count > 0


@kernel
def _mark_box(
    lanes: int,
    obstacle: FloatArray,
    reach: float,
    m: np.uint64,
    middles: FloatArray,
    best: FloatArray,
    bit: np.uint64,
    bits: Bits,
) -> None:
    """Mark the lanes in which a unit's ball is nearer to an obstacle's box than the best."""
    cx, cy, cz = obstacle[0], obstacle[1], obstacle[2]
    xx, xy, xz = obstacle[3], obstacle[4], obstacle[5]
    yx, yy, yz = obstacle[6], obstacle[7], obstacle[8]
    zx, zy, zz = obstacle[9], obstacle[10], obstacle[11]
    a, b, c = obstacle[BOX], obstacle[BOX + 1], obstacle[BOX + 2]
    margin = (reach + obstacle[BOX_THICKNESS]) * MARGIN
    for n in range(lanes):
        k, lane = m + U(n), U(n)
        x, y, z = middles[k] - cx, middles[k + U(LANES)] - cy, middles[k + U(2 * LANES)] - cz
        u = abs(xx * x + yx * y + zx * z) - a
        v = abs(xy * x + yy * y + zy * z) - b
        w = abs(xz * x + yz * y + zz * z) - c
        within = (best[lane] + margin) * MARGIN
        inside = u if u > v else v
        inside = inside if inside > w else w
        deeper = inside < (within if within < 0.0 else 0.0)
        within = within if within > 0.0 else 0.0
        u = u if u > 0.0 else 0.0
        v = v if v > 0.0 else 0.0
        w = w if w > 0.0 else 0.0
        near = u * u + v * v + w * w < within * within
        bits[lane] |= bit if near | deeper else U(0)


@kernel
def mark_pairs(
    lanes: int,
    units: Units,
    pairs: IntArray,
    first: int,
    stop: int,
    middles: FloatArray,
    best: FloatArray,
    bits: Bits,
) -> bool:
    """Mark the configurations in which two units may be nearer than the best so far.

    Args:
        lanes: How many configurations.
        units: The units.
        pairs: (pairs, 3).
        first: First pair.
        stop: One past the last, at most 64 on.
        middles: (units · 3 · LANES,).
        best: Least clearances so far.
        bits: Written: bit p − first of a lane's word for pair p.

    Returns:
        Whether anything is marked.
    """
    ball = units.ball
    bits[:] = U(0)
    for p in range(first, stop):
        one, two, r = pairs[p, 0], pairs[p, 1], U(pairs[p, 2]) * U(LANES)
        a, b = U(one) * U(3 * LANES), U(two) * U(3 * LANES)
        margin, bit = (ball[one, REACH] + ball[two, REACH]) * MARGIN, U(1) << U(p - first)
        for n in range(lanes):
            i, j, lane = a + U(n), b + U(n), U(n)
            x, y = middles[i] - middles[j], middles[i + U(LANES)] - middles[j + U(LANES)]
            z = middles[i + U(2 * LANES)] - middles[j + U(2 * LANES)]
            within = (best[r + lane] + margin) * MARGIN
            within = within if within > 0.0 else 0.0
            bits[lane] |= bit if x * x + y * y + z * z < within * within else U(0)
    return _any_marked(lanes, bits)
