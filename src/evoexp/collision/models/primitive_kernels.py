"""Kernels of bodies made of spheres and capsules.

Least clearances of whole batches of configurations.

Per block of `LANES` configurations: forward kinematics; the centres of balls around bodies and
parts of bodies; balls against obstacles (first the ball around an obstacle, then the box around it)
and against each other. What a ball cannot rule out is an encounter, one bit of a word per
configuration; encounters are listed per body and class of obstacle, or per pair of parts, gathered
into dense rows, and measured exactly, as vectors again (`encounter_kernels`). Bounds are widened by
`MARGIN`, so the result does not depend on what was skipped, nor on the batch.

What limits it, for a 6R arm of 59 spheres and ten obstacles, is the number of encounters: random
configurations have 0.7 with obstacles and 4 between parts of the arm (fewer where only collisions
are asked for), each some 40 ns of gathering and arithmetic, in lists of some ten per batch of 128
that vectors do not fill; they take two thirds of the time. In a population, whose configurations
are alike, encounters are rare: then forward kinematics and the centres of balls take a third, the
balls a quarter, and the call itself, which unpacks the tables' arrays, another third. A single
configuration costs as much as a block of 64, and the call.
"""

from typing import Any

import numpy as np
from numba.core import types
from numba.extending import intrinsic

from evoexp.collision.models.encounter_kernels import (
    HALF_SPACES,
    body_meets_body,
    body_meets_obstacles,
)
from evoexp.collision.models.obstacle_kernels import MARGIN
from evoexp.collision.models.primitive_distances import FIXED_ROWS, VALUE, WIDTH
from evoexp.numeric.compilation import kernel
from evoexp.robots.kinematics import BLOCK, SPATIAL_ROWS, U, block_frames, load_block

BLOCKS = 2
"""Blocks of configurations that are judged together: encounters are gathered over all of them."""

LANES = BLOCKS * BLOCK

WORD = 64
"""Encounters of one configuration that one word of bits can hold."""

GROUP = 8
"""Pairs that are marked together where only collisions are asked for.

What one group finds spares the next.
"""

CLASSES = 3

OBSTACLES, BETWEEN, SELF = range(3)
"""Rows of the result: what a clearance is measured to."""


def _trailing_zeros() -> Any:
    """Return a function for kernels: the index of the lowest bit that is set."""

    @intrinsic
    def lowest_bit(typing_context: Any, value: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.cttz(arguments[0], context.get_constant(types.boolean, True))

        return types.uint64(types.uint64), generate

    return lowest_bit


_lowest_bit = _trailing_zeros()


@kernel
def primitive_clearances(table, units, shapes, obstacles, pairs, limit, decide, q, out):  # type: ignore[no-untyped-def]
    """The kernel of `PrimitiveCollision`, for other kernels.

    Args:
        table: `PrimitiveCollision.tables`, as the next four.
        units: See `primitives.Units`.
        shapes: See `primitives.PackedShapes`.
        obstacles: See `primitives.PackedObstacles`.
        pairs: (pairs, 3) two units, and the row of the result that they count for.
        limit: Above it nothing is asked.
        decide: Whether the first clearance below 0 ends the judgement of a configuration: all rows
            are −inf then.
        q: (nq, configurations) [rad].
        out: (3, configurations), written: rows OBSTACLES, BETWEEN, SELF.
    """
    parent, index_q, prismatic, turned, rotation, translation = table
    num_joints, num_units = U(len(parent)), len(units[0])
    size = (num_joints + U(1)) * U(SPATIAL_ROWS * BLOCK)  # the last frame is the world's
    frames, scratch = np.empty(BLOCKS * size), np.empty(SPATIAL_ROWS * BLOCK)
    for block in range(BLOCKS):
        world = U(block) * size + num_joints * U(SPATIAL_ROWS * BLOCK)
        for row in range(SPATIAL_ROWS):
            frames[world + U(row * BLOCK) : world + U((row + 1) * BLOCK)] = row in (0, 4, 8)
    block_q, place = np.zeros(q.shape[0] * BLOCK), np.empty(LANES, dtype=np.uint64)
    for lane in range(LANES):
        place[lane] = U(lane // BLOCK) * size + U(lane % BLOCK)
    middles, best = np.empty(num_units * 3 * LANES), np.empty(3 * LANES)
    bits, lists = (
        np.empty(LANES, dtype=np.uint64),
        np.empty(_room(units[0], pairs), dtype=np.uint64),
    )
    work = np.empty((FIXED_ROWS + 3 * shapes[3]) * WIDTH)
    for first in range(0, q.shape[1], LANES):
        count = min(LANES, q.shape[1] - first)
        lanes = (count + BLOCK - 1) // BLOCK * BLOCK
        for block in range(lanes // BLOCK):
            begin = first + block * BLOCK
            own = frames[U(block) * size : U(block + 1) * size]
            load_block(q, begin, min(BLOCK, q.shape[1] - begin), 1.0, block_q)
            block_frames(
                parent, index_q, prismatic, turned, rotation, translation, block_q, own, scratch
            )
            _middles(units, own, U(block * BLOCK), middles)
        _begin(num_units, limit, count, middles, best)
        if not decide:
            _bound_obstacles(lanes, units, obstacles, middles, work, best)
            _bound_pairs(lanes, units, pairs, middles, best)
        _judge_obstacles(
            lanes, decide, units, shapes, obstacles, frames, place, middles, bits, lists, work, best
        )
        _judge_pairs(
            lanes, decide, units, shapes, pairs, frames, place, middles, bits, lists, work, best
        )
        for row in range(3):
            for lane in range(count):
                out[row, first + lane] = best[row * LANES + lane]


@kernel
def _room(whole, pairs):  # type: ignore[no-untyped-def]
    """Room for the lists of all encounters that one word of bits can hold."""
    longest = 1
    for b in range(len(whole)):
        longest = max(longest, min(whole[b, 6] - whole[b, 5], WORD))
    return max(2 * CLASSES * longest, min(len(pairs), WORD)) * LANES


@kernel
def _middles(units, frames, first, middles):  # type: ignore[no-untyped-def]
    """Centres of the balls around the units, (units · 3 · LANES,), for one block of lanes."""
    whole, ball = units
    for b in range(len(whole)):
        own, j = U(b) * U(3 * LANES) + first, U(whole[b, 0]) * U(SPATIAL_ROWS * BLOCK)
        x, y, z = ball[b, 0], ball[b, 1], ball[b, 2]
        for row in range(3):
            a, o, m = j + U(3 * row * BLOCK), j + U((9 + row) * BLOCK), own + U(row * LANES)
            for n in range(BLOCK):
                k = U(n)
                turned = (
                    frames[a + k] * x
                    + frames[a + U(BLOCK) + k] * y
                    + frames[a + U(2 * BLOCK) + k] * z
                )
                middles[m + k] = frames[o + k] + turned


@kernel
def _begin(num_units, limit, count, middles, best):  # type: ignore[no-untyped-def]
    """What is best before anything is measured: the limit; NaN where q is.

    −inf, so that all is skipped, in padding.
    """
    best[:] = 0.0
    for b in range(3 * num_units):
        for lane in range(LANES):
            best[U(lane)] += middles[U(b * LANES) + U(lane)] * 0.0
    for lane in range(LANES):
        k = U(lane)
        best[k] = limit + best[k] if lane < count else -np.inf
        best[k + U(LANES)] = best[k]
        best[k + U(2 * LANES)] = best[k]


@kernel
def _bound_obstacles(lanes, units, obstacles, middles, least, best):  # type: ignore[no-untyped-def]
    """Lower `best` to a little more than a bound of the least clearance.

    Some sphere is as near to its ball's centre.

    An obstacle's centre belongs to it. Whoever asks for all distances is spared most encounters by
    this.
    """
    whole, ball = units
    data, listed = obstacles
    for b in range(len(whole)):
        m, slack = U(b) * U(3 * LANES), ball[b, 4]
        for n in range(lanes):
            least[U(n)] = np.inf
        for t in range(whole[b, 5], whole[b, 6]):
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
                    bound = (
                        height + slack + (abs(height) + abs(level) + ball[b, 3]) * (MARGIN - 1.0)
                    )
                    best[lane] = bound if bound < best[lane] else best[lane]
            else:
                cx, cy, cz = data[o, 0], data[o, 1], data[o, 2]
                for n in range(lanes):
                    k, lane = m + U(n), U(n)
                    x, y, z = (
                        middles[k] - cx,
                        middles[k + U(LANES)] - cy,
                        middles[k + U(2 * LANES)] - cz,
                    )
                    square = x * x + y * y + z * z
                    least[lane] = square if square < least[lane] else least[lane]
        for n in range(lanes):
            distance, before = np.sqrt(least[U(n)]), best[U(n)]
            bound = distance + slack + (distance + ball[b, 3]) * (MARGIN - 1.0)
            best[U(n)] = bound if bound < before else before


@kernel
def _bound_pairs(lanes, units, pairs, middles, best):  # type: ignore[no-untyped-def]
    """The same for pairs of units."""
    ball = units[1]
    for p in range(len(pairs)):
        one, two, row = pairs[p, 0], pairs[p, 1], U(pairs[p, 2]) * U(LANES)
        slack, reach = ball[one, 4] + ball[two, 4], ball[one, 3] + ball[two, 3]
        a, b = U(one) * U(3 * LANES), U(two) * U(3 * LANES)
        for n in range(lanes):
            i, j, k = a + U(n), b + U(n), row + U(n)
            x, y = middles[i] - middles[j], middles[i + U(LANES)] - middles[j + U(LANES)]
            z = middles[i + U(2 * LANES)] - middles[j + U(2 * LANES)]
            distance = np.sqrt(x * x + y * y + z * z)
            bound = distance + slack + (distance + reach) * (MARGIN - 1.0)
            best[k] = bound if bound < best[k] else best[k]


@kernel
def _judge_obstacles(  # type: ignore[no-untyped-def]
    lanes, decide, units, shapes, obstacles, frames, place, middles, bits, lists, work, best
):
    listed, whole = obstacles[1], units[0]
    capacity = len(lists) // (2 * CLASSES)
    filled = np.empty(CLASSES, dtype=np.int64)
    for b in range(
        len(whole) - 1, -1, -1
    ):  # from the tip, which is nearest to most things, to the base
        for first in range(whole[b, 5], whole[b, 6], WORD):
            stop = min(first + WORD, whole[b, 6])
            if not _mark_obstacles(lanes, b, units, obstacles, first, stop, middles, best, bits):
                continue
            for c in range(CLASSES):
                filled[c] = 2 * c * capacity
            for lane in range(lanes):
                word = bits[U(lane)]
                while word != U(0):
                    t = U(first) + _lowest_bit(word)
                    word &= word - U(1)
                    at = filled[listed[t, 1]]
                    lists[at], lists[at + capacity] = U(lane), U(listed[t, 0])
                    filled[listed[t, 1]] = at + 1
            for c in range(CLASSES):
                for at in range(2 * c * capacity, filled[c], WIDTH):
                    width = min(WIDTH, filled[c] - at)
                    near = lists[at : at + width], lists[at + capacity : at + capacity + width]
                    body_meets_obstacles(
                        width, c, b, units, shapes, obstacles, near, frames, place, work, best
                    )
        if decide:
            _drop_collided(best)


@kernel
def _judge_pairs(  # type: ignore[no-untyped-def]
    lanes, decide, units, shapes, pairs, frames, place, middles, bits, lists, work, best
):
    filled = np.empty(WORD, dtype=np.int64)
    group = GROUP if decide else WORD
    for first in range(0, len(pairs), group):
        stop = min(first + group, len(pairs))
        if not _mark_pairs(lanes, units, pairs, first, stop, middles, best, bits):
            continue
        for t in range(stop - first):
            filled[t] = t * LANES
        for lane in range(lanes):
            word = bits[U(lane)]
            while word != U(0):
                t = _lowest_bit(word)
                word &= word - U(1)
                lists[filled[t]] = U(lane)
                filled[t] += 1
        for p in range(first, stop):
            begin, end = (p - first) * LANES, filled[p - first]
            for at in range(begin, end, WIDTH):
                width = min(WIDTH, end - at)
                near = lists[at : at + width]
                body_meets_body(
                    width, pairs[p, 0], pairs[p, 1], units, shapes, near, frames, place, work
                )
                base = U(pairs[p, 2] * LANES)
                for n in range(width):
                    k = base + near[U(n)]
                    best[k] = min(best[k], work[VALUE + U(n)])
        if decide:
            _drop_collided(best)


@kernel
def _drop_collided(best):  # type: ignore[no-untyped-def]
    """Nothing more is asked of configurations that collide."""
    for lane in range(LANES):
        k = U(lane)
        drop = best[k] < 0.0 or best[k + U(LANES)] < 0.0 or best[k + U(2 * LANES)] < 0.0
        best[k] = -np.inf if drop else best[k]
        best[k + U(LANES)] = -np.inf if drop else best[k + U(LANES)]
        best[k + U(2 * LANES)] = -np.inf if drop else best[k + U(2 * LANES)]


@kernel
def _mark_obstacles(lanes, b, units, obstacles, first, stop, middles, best, bits):  # type: ignore[no-untyped-def]
    """Mark the configurations in which a body's ball may be nearer to obstacles than the best.

    The obstacle's ball comes first; where it is met anywhere, the box around the obstacle decides.
    """
    data, listed = obstacles
    reach, m = units[1][b, 3], U(b) * U(3 * LANES)
    bits[:] = U(0)
    for t in range(first, stop):
        o, bit = listed[t, 0], U(1) << U(t - first)
        if listed[t, 1] == HALF_SPACES:
            _mark_half_space(lanes, data[o], reach, m, middles, best, bit, bits)
        elif _meets_ball(lanes, data[o], reach, m, middles, best):
            _mark_box(lanes, data[o], reach, m, middles, best, bit, bits)
    count = 0
    for n in range(lanes):
        count += bits[U(n)] != U(0)
    return count > 0


@kernel
def _mark_half_space(lanes, obstacle, reach, m, middles, best, bit, bits):  # type: ignore[no-untyped-def]
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
def _meets_ball(lanes, obstacle, reach, m, middles, best):  # type: ignore[no-untyped-def]
    cx, cy, cz, margin = obstacle[0], obstacle[1], obstacle[2], (reach + obstacle[16]) * MARGIN
    count = 0
    for n in range(lanes):
        k, lane = m + U(n), U(n)
        x, y, z = middles[k] - cx, middles[k + U(LANES)] - cy, middles[k + U(2 * LANES)] - cz
        within = (best[lane] + margin) * MARGIN
        within = within if within > 0.0 else 0.0
        count += x * x + y * y + z * z < within * within
    return count > 0


@kernel
def _mark_box(lanes, obstacle, reach, m, middles, best, bit, bits):  # type: ignore[no-untyped-def]
    cx, cy, cz = obstacle[0], obstacle[1], obstacle[2]
    xx, xy, xz = obstacle[3], obstacle[4], obstacle[5]
    yx, yy, yz = obstacle[6], obstacle[7], obstacle[8]
    zx, zy, zz = obstacle[9], obstacle[10], obstacle[11]
    a, b, c, margin = obstacle[17], obstacle[18], obstacle[19], (reach + obstacle[20]) * MARGIN
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
def _mark_pairs(lanes, units, pairs, first, stop, middles, best, bits):  # type: ignore[no-untyped-def]
    """Mark the configurations in which two units may be nearer than the best so far."""
    ball = units[1]
    bits[:] = U(0)
    for p in range(first, stop):
        a, b, r = (
            U(pairs[p, 0]) * U(3 * LANES),
            U(pairs[p, 1]) * U(3 * LANES),
            U(pairs[p, 2]) * U(LANES),
        )
        margin, bit = (ball[pairs[p, 0], 3] + ball[pairs[p, 1], 3]) * MARGIN, U(1) << U(p - first)
        for n in range(lanes):
            i, j, lane = a + U(n), b + U(n), U(n)
            x, y = middles[i] - middles[j], middles[i + U(LANES)] - middles[j + U(LANES)]
            z = middles[i + U(2 * LANES)] - middles[j + U(2 * LANES)]
            within = (best[r + lane] + margin) * MARGIN
            within = within if within > 0.0 else 0.0
            bits[lane] |= bit if x * x + y * y + z * z < within * within else U(0)
    count = 0
    for n in range(lanes):
        count += bits[U(n)] != U(0)
    return count > 0
