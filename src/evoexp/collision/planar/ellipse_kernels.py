"""Straight links of planar arms among ellipses: which of a population's paths collide.

An ellipse is mapped to the unit circle by an upper triangular matrix; there a segment meets it
where its distance to the origin is at most 1. With P, Q its ends in that frame and s = P·Q, the
nearest point lies between them where P·P − s and Q·Q − s are positive, and then at the squared
distance (P × Q)² / (P·P + Q·Q − 2 s): no division is needed. A link within a relative 1e-9 of
touching counts as touching, so that rounding never lets a contact pass.

Any order of tests gives the same answer, because only the existence of a collision is asked for.
First some positions are tested one after the other, beginning with those that find most collisions;
individuals that collide are not tested again. The others go through all positions, and the chords
of their link ends are tested on the way. Eight individuals at a time are gathered by `load_lanes`;
most ellipses are excluded for all eight of them at once, by boxes around both.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vectors import (
    LANES,
    Vector,
    least_lane,
    load,
    lower,
    mask_bits,
    select,
    spread,
    store,
)
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import U
from evoexp.robots.planar_ends import (
    VECTOR,
    PlanarArm,
    begin_turning,
    block_ends,
    load_lanes,
    turned_ends,
)

AFRESH = 32  # positions after which sines are computed anew; between them directions are turned on
CONTACT = 1.0 + 1e-9  # [-] squared distance to the unit circle's centre that counts as contact
WIDER = 1e-6  # [-] by which boxes are larger than ellipses: far more than CONTACT and rounding


class Ellipses(NamedTuple):
    """Ellipses around a planar arm."""

    # (E, 5) a … e of the maps (x, y) → (a x + b y + c, d y + e) to the unit circle
    maps: FloatArray
    first_links: IntArray  # (E,) the first link (1, 2, …) that reaches each ellipse


class TestedPath(NamedTuple):
    """The positions of a path that are tested."""

    num_positions: int  # m of Eq. 3.
    first_positions: IntArray  # the positions (1 … M) that are tested first
    chords: bool  # whether all positions follow, with chords swept


class Boxes(NamedTuple):
    """Boxes around ellipses, along x and y, filled up to whole vectors by boxes without a point."""

    least_x: FloatArray  # (ellipses,), as the rest
    greatest_x: FloatArray
    least_y: FloatArray
    greatest_y: FloatArray
    first: int  # the first link end that any ellipse needs
    # (vectors of ellipses, N + 1) bits of those that the link before each end, or the end itself,
    # may reach
    reached: IntArray


class Memory(NamedTuple):
    """Scratch for eight individuals."""

    alive: IntArray  # (count + LANES,) individuals that have not collided
    begin: FloatArray  # (N · LANES,) angles at the start
    end: FloatArray  # (N · LANES,) angles at the end
    gaps: FloatArray  # (LANES,) at or below 0 where a contact was found
    x: FloatArray  # (2, (N + 1) · LANES) link ends at even and odd positions
    y: FloatArray  # likewise
    codes: IntArray  # (2, vectors of ellipses, N + 1) outcodes of the link ends, see `_write_codes`
    turn: FloatArray  # (N · 4 · LANES) of `begin_turning`


class PathChecks(NamedTuple):
    """Boxes and scratch that all checks of an arm among the same ellipses share."""

    boxes: Boxes  # around the ellipses
    memory: Memory  # scratch


@kernel
def paths_collide(
    starts: FloatArray,
    ends: FloatArray,
    lanes: IntArray,
    count: int,
    arm: PlanarArm,
    ellipses: Ellipses,
    path: TestedPath,
    hit: BoolArray,
) -> None:
    """Find which straight joint-space paths collide (Lavoie & Boudreau 2001, Eq. 3).

    Args:
        starts: (N, individuals) joint angles at the start of each path, relative [rad].
        ends: (N, individuals) at its end.
        lanes: (≥ count) indices of the individuals to test.
        path: The positions that are tested.
        hit: (individuals,) written for those tested: whether each collides.
    """
    checks = prepare_checks(ellipses, len(starts), count)
    check_paths(starts, ends, lanes, count, arm, ellipses, path, hit, checks)


@kernel
def prepare_checks(ellipses: Ellipses, num: int, count: int) -> PathChecks:
    """Make boxes and scratch for `check_paths`: an arm of `num` links, at most `count` paths."""
    rows, vectors = num * LANES, (len(ellipses.maps) + LANES - 1) // LANES
    memory = Memory(
        np.empty(count + LANES, dtype=np.int64),
        np.empty(rows),
        np.empty(rows),
        np.empty(LANES),
        np.empty((2, rows + LANES)),
        np.empty((2, rows + LANES)),
        np.empty((2, vectors, num + 1), dtype=np.int64),
        np.empty(4 * rows),
    )
    return PathChecks(_boxes(ellipses, num, vectors), memory)


@kernel
def _boxes(ellipses: Ellipses, num: int, vectors: int) -> Boxes:
    """Return boxes around ellipses for an arm of `num` links."""
    size = vectors * LANES
    boxes = Boxes(
        np.full(size, np.inf),
        np.full(size, -np.inf),
        np.full(size, np.inf),
        np.full(size, -np.inf),
        max(0, min(num + 1, ellipses.first_links.min() if size > 0 else num + 1) - 1),
        np.zeros((vectors, num + 1), dtype=np.int64),
    )
    for e in range(len(ellipses.maps)):
        # (x, y) as a function of the place on the unit circle
        a, b, c, d, f = ellipses.maps[e]
        middle_x, middle_y = (b * f / d - c) / a, -f / d
        half_x, half_y = np.sqrt(1.0 + b / d * (b / d)) / abs(a), 1.0 / abs(d)
        half_x += WIDER * half_x + 1e-9 * abs(middle_x)
        half_y += WIDER * half_y + 1e-9 * abs(middle_y)
        boxes.least_x[e], boxes.greatest_x[e] = middle_x - half_x, middle_x + half_x
        boxes.least_y[e], boxes.greatest_y[e] = middle_y - half_y, middle_y + half_y
        for k in range(ellipses.first_links[e], num + 1):
            boxes.reached[e // LANES, k] |= 1 << e % LANES
    return boxes


@kernel
def check_paths(
    starts: FloatArray,
    ends: FloatArray,
    lanes: IntArray,
    count: int,
    arm: PlanarArm,
    ellipses: Ellipses,
    path: TestedPath,
    hit: BoolArray,
    checks: PathChecks,
) -> None:
    """Do the work of `paths_collide` with what is prepared, as often as paths are to be tested.

    Args:
        starts: As of `paths_collide`, and so are all but `checks`.
        checks: Of `prepare_checks`; given, so that inner loops count no references.
    """
    starts, ends, lanes, arm, ellipses, hit, (boxes, memory) = borrowed(
        (starts, ends, lanes, arm, ellipses, hit, checks)
    )
    alive, begin, end, x, y = memory.alive, memory.begin, memory.end, memory.x, memory.y
    alive[:count] = lanes[:count]
    for k in range(count):
        hit[lanes[k]] = False
    left, num_positions = count if len(ellipses.maps) > 0 else 0, path.num_positions
    # single positions, of those that have not collided so far
    for position in path.first_positions:
        kept = 0
        for first in range(0, left, LANES):
            load_lanes(starts, alive, first, left, begin)
            load_lanes(ends, alive, first, left, end)
            block_ends(begin, end, arm, position, num_positions, x[0], y[0])
            _write_codes(boxes, x[0], y[0], memory.codes[0])
            gaps = _test_links(ellipses, boxes, memory, 0, False, spread(1.0))
            kept = _note(gaps, memory, first, left, kept, hit)
        left = kept
    # all positions, with chords
    for first in range(0, left if path.chords else 0, LANES):
        load_lanes(starts, alive, first, left, begin)
        load_lanes(ends, alive, first, left, end)
        _note(_sweep(arm, ellipses, boxes, num_positions, memory), memory, first, left, first, hit)


@inlined
def _note(gaps: Vector, memory: Memory, first: int, count: int, kept: int, hit: BoolArray) -> int:
    """Write which of a block collide, move the others to `kept` among those alive, and count on."""
    alive = memory.alive
    store(memory.gaps, U(0), gaps)
    for n in range(min(LANES, count - first)):
        individual, free = alive[first + n], memory.gaps[n] > 0.0
        hit[individual] = not free
        alive[kept] = individual
        kept += free
    return kept


@inlined
def _sweep(
    arm: PlanarArm, ellipses: Ellipses, boxes: Boxes, num_positions: int, memory: Memory
) -> Vector:
    """Test all positions of a block, and the chords of all link ends between them."""
    gaps, x, y, turn = spread(1.0), memory.x, memory.y, memory.turn
    begin, end = memory.begin, memory.end
    for position in range(num_positions + 1):
        now = position % 2
        # link ends: computed anew at the ends of the path and now and then, else turned on
        if position == num_positions:
            block_ends(begin, end, arm, position, num_positions, x[now], y[now])
        elif position == 0:
            begin_turning(begin, end, arm, 0, num_positions, turn, x[now], y[now])
        else:
            if position % AFRESH == 1 and position > 1:
                begin_turning(begin, end, arm, position - 1, num_positions, turn, x[now], y[now])
            turned_ends(arm, turn, x[now], y[now])
        _write_codes(boxes, x[now], y[now], memory.codes[now])
        # links here, chords since the position before
        if position > 0:
            gaps = _test_links(ellipses, boxes, memory, now, True, gaps)
    return gaps


@inlined
def _write_codes(boxes: Boxes, x: FloatArray, y: FloatArray, codes: IntArray) -> None:
    """Write the outcodes of all link ends of a block (Newman & Sproull 1979).

    The outcode tells for eight ellipses, one per bit, whether the end lies beyond the left, the
    right, the lower or the upper side of their boxes in all lanes; each side has eight bits. Where
    two ends share a side, nothing between them meets the ellipse.
    """
    for k in range(boxes.first, codes.shape[1]):
        u, v = load(x, U(k) * VECTOR), load(y, U(k) * VECTOR)
        left, right = least_lane(u), -least_lane(0.0 - u)
        low, high = least_lane(v), -least_lane(0.0 - v)
        for vector in range(codes.shape[0]):
            at = U(vector) * VECTOR
            codes[vector, k] = (
                mask_bits(right < load(boxes.least_x, at))
                | mask_bits(load(boxes.greatest_x, at) < left) << 8
                | mask_bits(high < load(boxes.least_y, at)) << 16
                | mask_bits(load(boxes.greatest_y, at) < low) << 24
            )


@inlined
def _test_links(
    ellipses: Ellipses, boxes: Boxes, memory: Memory, now: int, chords: bool, gaps: Vector
) -> Vector:
    """Lower `gaps` where a link, or a chord since the position before, meets an ellipse.

    Args:
        memory: With link ends and outcodes.
        now: Where the link ends of this position are.
        chords: Whether chords are tested.
    """
    x, y, codes, before = memory.x[now], memory.y[now], memory.codes, 1 - now
    for vector in range(codes.shape[1]):
        for k in range(boxes.first + 1, codes.shape[2]):
            # bits of the ellipses that no box excludes
            reached, here = boxes.reached[vector, k], codes[now, vector, k]
            by_link = reached & ~_excluded(codes[now, vector, k - 1] & here)
            by_chord = reached & ~_excluded(codes[before, vector, k] & here) if chords else 0
            if by_link | by_chord == 0:
                continue
            to, root = U(k) * VECTOR, U(k - 1) * VECTOR
            for e in range(vector * LANES, min(len(ellipses.maps), (vector + 1) * LANES)):
                bit = 1 << e % LANES
                if (by_link | by_chord) & bit == 0:
                    continue
                a, b, c = ellipses.maps[e, 0], ellipses.maps[e, 1], ellipses.maps[e, 2]
                d, f = ellipses.maps[e, 3], ellipses.maps[e, 4]
                q = load(y, to)
                p, q = a * load(x, to) + b * q + c, d * q + f
                if by_link & bit != 0:
                    v = load(y, root)
                    gaps = lower(gaps, gap(a * load(x, root) + b * v + c, d * v + f, p, q))
                if by_chord & bit != 0:
                    v = load(memory.y[before], to)
                    u = a * load(memory.x[before], to) + b * v + c
                    gaps = lower(gaps, gap(u, d * v + f, p, q))
    return gaps


@inlined
def _excluded(shared: int) -> int:
    """Return the bits of the ellipses of which two outcodes share a side."""
    return (shared | shared >> 8 | shared >> 16 | shared >> 24) & 255


@inlined
def gap(u: Any, v: Any, p: Any, q: Any) -> Any:
    """Return a number ≤ 0 if a segment from (u, v) to (p, q) touches the unit circle.

    Numbers are floats or vectors.
    """
    r, s = u * u + v * v, p * p + q * q
    turned, along = u * q - v * p, u * p + v * q
    one, two = r - along, s - along
    at_ends = lower(r, s) - CONTACT
    between = turned * turned - CONTACT * (one + two)
    between = select(one > 0.0, between, at_ends)
    between = select(two > 0.0, between, at_ends)
    return lower(between, at_ends)
