"""Tests of balls around bodies, parts and obstacles: which configurations must be measured exactly.

Every unit has a ball around it. Obstacles are ruled out first by the ball around them, then by the
box around them. Bounds are widened by `MARGIN`, so rounding rules out no contact. Eight
configurations are tested at a time, as vectors (`numeric.vectors`); the answers of up to 64 are the
bits of a word.
"""

import numpy as np

from evoexp.collision.bodies.center_kernels import spatial_point
from evoexp.collision.bodies.packed_shapes import (
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
from evoexp.collision.models.obstacle_kernels import MARGIN
from evoexp.numeric.compilation import inlined, kernel
from evoexp.numeric.vectors import LANES as EIGHT
from evoexp.numeric.vectors import (
    Mask,
    Vector,
    load,
    lower,
    magnitude,
    mask_bits,
    root,
    spread,
    store,
    upper,
)
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import U

BATCH = 128
"""Configurations that are judged together: encounters are gathered over all of them."""

WORD = 64
"""Configurations whose answers fit a word of bits."""

Point = tuple[Vector, Vector, Vector]


@inlined
def middles_of_balls(
    units: Units, frames: FloatArray, first: np.uint64, middles: FloatArray
) -> None:
    """Write the centres of the balls around the units for eight configurations.

    Args:
        units: The units.
        frames: (joints + 1 · SPATIAL_FRAME,) frames of the joints and of the world.
        first: First of the eight in the batch.
        middles: (units · 3 · BATCH,), written.
    """
    for b in range(len(units.whole)):
        own, joint = U(b) * U(3 * BATCH) + first, units.whole[b, JOINT]
        spatial_point(frames, joint, units.ball[b], middles, own, U(BATCH))


@inlined
def _middle(middles: FloatArray, unit: int, n: int) -> Point:
    """Return the centres of a unit's ball in eight configurations from n on."""
    m = U(unit) * U(3 * BATCH) + U(n)
    return load(middles, m), load(middles, m + U(BATCH)), load(middles, m + U(2 * BATCH))


@inlined
def _height(obstacle: FloatArray, middle: Point) -> tuple[Vector, float]:
    """Return how high points are above a half-space, and its level along its normal."""
    nx, ny, nz = obstacle[5], obstacle[8], obstacle[11]
    level = nx * obstacle[0] + ny * obstacle[1] + nz * obstacle[2]
    return nx * middle[0] + ny * middle[1] + nz * middle[2] - level, level


@inlined
def _squared_distance(obstacle: FloatArray, middle: Point) -> Vector:
    """Return the squared distance of points from an obstacle's centre."""
    x, y, z = middle[0] - obstacle[0], middle[1] - obstacle[1], middle[2] - obstacle[2]
    square: Vector = x * x + y * y + z * z
    return square


@inlined
def _bound(distance: Vector, slack: float, scale: Vector) -> Vector:
    """Return a little more than a distance and a slack."""
    return distance + slack + scale * (MARGIN - 1.0)


@kernel
def bound_obstacles(
    lanes: int, units: Units, obstacles: PackedObstacles, middles: FloatArray, best: FloatArray
) -> None:
    """Lower `best` to a little more than an upper bound of the least clearance from obstacles.

    Some shape of a unit is as near to the centre of its ball as the slack tells, and an obstacle's
    centre belongs to the obstacle. This bound spares a caller that asks for all distances most
    encounters.

    Args:
        lanes: How many configurations, a multiple of eight.
        units: The units.
        middles: (units · 3 · BATCH,).
        best: (3 · BATCH,), the first row lowered.
    """
    whole, ball = units.whole, units.ball
    data, listed = obstacles.data, obstacles.listed
    for b in range(len(whole)):
        slack, reach = ball[b, SLACK], ball[b, REACH]
        for n in range(0, lanes, EIGHT):
            middle, square, found = _middle(middles, b, n), spread(np.inf), load(best, U(n))
            for t in range(whole[b, FIRST_LISTED], whole[b, STOP_LISTED]):
                obstacle = data[listed[t, 0]]
                if listed[t, 1] == HALF_SPACES:
                    height, level = _height(obstacle, middle)
                    scale = magnitude(height) + abs(level) + reach
                    found = lower(found, _bound(height, slack, scale))
                else:
                    square = lower(square, _squared_distance(obstacle, middle))
            # one square root for the nearest obstacle's centre
            distance = root(square)
            store(best, U(n), lower(found, _bound(distance, slack, distance + reach)))


@kernel
def bound_pairs(
    lanes: int, units: Units, pairs: IntArray, middles: FloatArray, best: FloatArray
) -> None:
    """Lower `best` to a little more than an upper bound of the clearances of all pairs of units."""
    ball = units.ball
    for p in range(len(pairs)):
        one, two, row = pairs[p, 0], pairs[p, 1], U(pairs[p, 2]) * U(BATCH)
        slack, reach = ball[one, SLACK] + ball[two, SLACK], ball[one, REACH] + ball[two, REACH]
        for n in range(0, lanes, EIGHT):
            distance = root(_squared_between(middles, one, two, n))
            bound = _bound(distance, slack, distance + reach)
            store(best, row + U(n), lower(load(best, row + U(n)), bound))


@inlined
def _squared_between(middles: FloatArray, one: int, two: int, n: int) -> Vector:
    """Return the squared distance of the centres of two units' balls."""
    a, b = _middle(middles, one, n), _middle(middles, two, n)
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    return x * x + y * y + z * z


@inlined
def near_obstacle(
    units: Units,
    unit: int,
    obstacle: FloatArray,
    kind: int,
    first: int,
    stop: int,
    middles: FloatArray,
    best: FloatArray,
) -> np.uint64:
    """Return in which configurations a body's ball may be nearer to an obstacle than the best.

    The obstacle's ball is tested first; where it is met in any of the configurations, the box
    around the obstacle decides.

    Args:
        units: The units.
        obstacle: Its row in `PackedObstacles.data`.
        first: First configuration.
        stop: One past the last, at most `WORD` on.
        middles: (units · 3 · BATCH,).
        best: (≥ BATCH,) least clearances so far.

    Returns:
        Bit k for configuration first + k.
    """
    reach, word = units.ball[unit, REACH], U(0)
    if kind == HALF_SPACES:
        for n in range(first, stop, EIGHT):
            height, level = _height(obstacle, _middle(middles, unit, n))
            margin = reach * MARGIN + abs(level) * (MARGIN - 1.0)
            word |= U(mask_bits(height < load(best, U(n)) + margin)) << U(n - first)
        return word
    around = (reach + obstacle[AROUND]) * MARGIN
    for n in range(first, stop, EIGHT):
        within = upper(spread(0.0), (load(best, U(n)) + around) * MARGIN)
        square = _squared_distance(obstacle, _middle(middles, unit, n))
        word |= U(mask_bits(square < within * within)) << U(n - first)
    if word == U(0):
        return word
    met, word = word, U(0)
    thickness = (reach + obstacle[BOX_THICKNESS]) * MARGIN
    for n in range(first, stop, EIGHT):
        within = (load(best, U(n)) + thickness) * MARGIN
        meets = _meets_box(obstacle, _middle(middles, unit, n), within)
        word |= U(mask_bits(meets)) << U(n - first)
    return word & met


@inlined
def _meets_box(obstacle: FloatArray, middle: Point, within: Vector) -> Mask:
    """Return whether points are nearer to the box around an obstacle than `within`."""
    zero = spread(0.0)
    x, y, z = middle[0] - obstacle[0], middle[1] - obstacle[1], middle[2] - obstacle[2]
    u = magnitude(obstacle[3] * x + obstacle[6] * y + obstacle[9] * z) - obstacle[BOX]
    v = magnitude(obstacle[4] * x + obstacle[7] * y + obstacle[10] * z) - obstacle[BOX + 1]
    w = magnitude(obstacle[5] * x + obstacle[8] * y + obstacle[11] * z) - obstacle[BOX + 2]
    deeper = upper(upper(u, v), w) < lower(zero, within)
    within = upper(zero, within)
    u, v, w = upper(u, zero), upper(v, zero), upper(w, zero)
    return (u * u + v * v + w * w < within * within) | deeper


@inlined
def near_pair(
    units: Units,
    one: int,
    two: int,
    row: int,
    first: int,
    stop: int,
    middles: FloatArray,
    best: FloatArray,
) -> np.uint64:
    """Return in which configurations two units may be nearer than the best so far.

    Args:
        units: The units.
        row: Row of `best`.
        first: First configuration.
        stop: One past the last, at most `WORD` on.
        middles: (units · 3 · BATCH,).
        best: (3 · BATCH,) least clearances so far.

    Returns:
        Bit k for configuration first + k.
    """
    margin, word = (units.ball[one, REACH] + units.ball[two, REACH]) * MARGIN, U(0)
    for n in range(first, stop, EIGHT):
        so_far = load(best, U(row * BATCH + n))
        within = upper(spread(0.0), (so_far + margin) * MARGIN)
        square = _squared_between(middles, one, two, n)
        word |= U(mask_bits(square < within * within)) << U(n - first)
    return word
