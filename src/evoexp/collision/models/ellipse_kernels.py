"""Straight links of planar arms among ellipses: which of a population's paths collide.

An ellipse is mapped to the unit circle by an upper triangular matrix; there a segment meets it
where its distance to the origin is at most 1. With P, Q its ends in that frame and s = P·Q, the
nearest point lies between them where P·P − s and Q·Q − s are positive, and then at the squared
distance (P × Q)² / (P·P + Q·Q − 2 s): no division is needed. A link within a relative 1e-9 of
touching counts as touching, so that rounding never lets a contact pass.

Any order of tests gives the same answer, because only the existence of a collision is asked for.
First some positions are tested one after the other, beginning with those that find most collisions;
individuals that collide are not tested again. The others go through all positions, and the chords
of their link ends are tested on the way. Individuals are innermost, in blocks gathered by
`load_lanes`.
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import U
from evoexp.robots.planar_ends import (
    LANES,
    PlanarArm,
    begin_turning,
    block_ends,
    load_lanes,
    turned_ends,
)

AFRESH = 32  # positions after which sines are computed anew; between them directions are turned on
CONTACT = 1.0 + 1e-9  # [-] squared distance to the unit circle's centre that counts as contact
BEYOND = CONTACT  # [-] distance from an axis at which nothing counts as contact any more


class Ellipses(NamedTuple):
    """Ellipses around a planar arm.

    Attributes:
        maps: (E, 5) a … e of the maps (x, y) → (a x + b y + c, d y + e) to the unit circle.
        first_links: (E,) the first link (1, 2, …) that reaches each ellipse.
    """

    maps: FloatArray
    first_links: IntArray


class TestedPath(NamedTuple):
    """The positions of a path that are tested.

    Attributes:
        num_positions: M of Eq. 3.
        first_positions: The positions (1 … M) that are tested first.
        chords: Whether all positions follow, with chords swept.
    """

    num_positions: int
    first_positions: IntArray
    chords: bool


class Mapped(NamedTuple):
    """The link ends of a block in the frames of all ellipses, at one position.

    Attributes:
        ends: (2, E · (N + 1) · LANES).
        codes: (E, N + 1) outcodes, see `_map`.
    """

    ends: FloatArray
    codes: IntArray


class Memory(NamedTuple):
    """Scratch for a block of individuals.

    Attributes:
        alive: (count + LANES,) individuals that have not collided.
        begin: (N · LANES,) angles at the start.
        end: (N · LANES,) angles at the end.
        least: (LANES,) at or below 0 where a contact was found.
        angle: (LANES,) of `block_ends`, as the next two.
        at_x: (LANES,).
        at_y: (LANES,).
        x: ((N + 1) · LANES,) link ends.
        y: ((N + 1) · LANES,).
        turn: (4, N · LANES) of `begin_turning`.
        mapped: The link ends at this position.
        other: The link ends at the position before.
    """

    alive: IntArray
    begin: FloatArray
    end: FloatArray
    least: FloatArray
    angle: FloatArray
    at_x: FloatArray
    at_y: FloatArray
    x: FloatArray
    y: FloatArray
    turn: FloatArray
    mapped: Mapped
    other: Mapped


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
        count: How many.
        arm: The arm.
        ellipses: The ellipses.
        path: The positions that are tested.
        hit: (individuals,) written for those tested: whether each collides.
    """
    rows = len(starts) * LANES
    memory = Memory(
        np.empty(count + LANES, dtype=np.int64),
        np.empty(rows),
        np.empty(rows),
        np.empty(LANES),
        np.empty(LANES),
        np.empty(LANES),
        np.empty(LANES),
        np.empty(rows + LANES),
        np.empty(rows + LANES),
        np.empty((4, rows)),
        _empty_ends(len(ellipses.maps), len(starts) + 1),
        _empty_ends(len(ellipses.maps), len(starts) + 1),
    )
    _test_paths(starts, ends, lanes, count, arm, ellipses, path, hit, memory)


@kernel
def _empty_ends(num_ellipses: int, num_ends: int) -> Mapped:
    return Mapped(
        np.empty((2, num_ellipses * num_ends * LANES)),
        np.empty((num_ellipses, num_ends), dtype=np.int64),
    )


@kernel
def _test_paths(
    starts: FloatArray,
    ends: FloatArray,
    lanes: IntArray,
    count: int,
    arm: PlanarArm,
    ellipses: Ellipses,
    path: TestedPath,
    hit: BoolArray,
    memory: Memory,
) -> None:
    """Do the work of `paths_collide` in given memory, so that inner loops count no references."""
    starts, ends, lanes, arm, ellipses, hit, memory = borrowed(
        (starts, ends, lanes, arm, ellipses, hit, memory)
    )
    memory.alive[:count] = lanes[:count]
    for k in range(count):
        hit[lanes[k]] = False
    left, num_positions = count if len(ellipses.maps) > 0 else 0, path.num_positions
    for position in path.first_positions:
        left = _drop_colliding(
            starts, ends, left, arm, ellipses, position, num_positions, hit, memory
        )
    if path.chords:
        _sweep(starts, ends, left, arm, ellipses, num_positions, hit, memory)


@kernel
def _drop_colliding(
    starts: FloatArray,
    ends: FloatArray,
    count: int,
    arm: PlanarArm,
    ellipses: Ellipses,
    position: int,
    num_positions: int,
    hit: BoolArray,
    memory: Memory,
) -> int:
    """Test one position and mark the individuals that collide.

    Moves the others to the front of `alive`, and returns their number.
    """
    memory = borrowed(memory)
    alive, begin, end, least = memory.alive, memory.begin, memory.end, memory.least
    angle, at_x, at_y, x, y = memory.angle, memory.at_x, memory.at_y, memory.x, memory.y
    mapped, codes = memory.mapped.ends, memory.mapped.codes[0]
    num, kept = len(starts), 0
    for first in range(0, count, LANES):
        load_lanes(starts, alive, first, count, begin)
        load_lanes(ends, alive, first, count, end)
        block_ends(begin, end, arm, position, num_positions, angle, at_x, at_y, x, y)
        least[:] = 1.0
        for e in range(len(ellipses.maps)):
            reached = ellipses.first_links[e]
            _map(ellipses.maps[e], reached, num, x, y, U(0), mapped, codes)
            _test_links(reached, num, U(0), mapped, codes, least)
        for n in range(min(LANES, count - first)):
            individual, free = alive[first + n], least[n] > 0.0
            hit[individual] = not free
            alive[kept] = individual
            kept += free
    return kept


@kernel
def _sweep(
    starts: FloatArray,
    ends: FloatArray,
    count: int,
    arm: PlanarArm,
    ellipses: Ellipses,
    num_positions: int,
    hit: BoolArray,
    memory: Memory,
) -> None:
    """Test all positions, and the chords of all link ends between them."""
    memory = borrowed(memory)
    alive, begin, end, least = memory.alive, memory.begin, memory.end, memory.least
    angle, at_x, at_y, x, y = memory.angle, memory.at_x, memory.at_y, memory.x, memory.y
    num, rows, turn = len(starts), len(starts) * LANES, memory.turn
    before, now = memory.other.ends, memory.mapped.ends
    codes_before, codes = memory.other.codes, memory.mapped.codes
    for first in range(0, count, LANES):
        load_lanes(starts, alive, first, count, begin)
        load_lanes(ends, alive, first, count, end)
        least[:] = 1.0
        for position in range(num_positions + 1):
            # link ends: computed anew at the ends of the path, else turned on
            before, now, codes_before, codes = now, before, codes, codes_before
            if position == 0 or position == num_positions:
                block_ends(begin, end, arm, position, num_positions, angle, at_x, at_y, x, y)
            else:
                if position % AFRESH == 1:
                    begin_turning(begin, end, arm, position - 1, num_positions, angle, at_x, turn)
                turned_ends(arm, at_x, at_y, turn, x, y)
            # links here, chords since the position before
            for e in range(len(ellipses.maps)):
                reached, place = ellipses.first_links[e], U(e) * U(rows + LANES)
                _map(ellipses.maps[e], reached, num, x, y, place, now, codes[e])
                if position > 0:
                    _test_links(reached, num, place, now, codes[e], least)
                    _test_chords(reached, num, place, before, now, codes_before[e], codes[e], least)
        for n in range(min(LANES, count - first)):
            hit[alive[first + n]] = not least[n] > 0.0


@kernel
def _map(
    ellipse: FloatArray,
    reached: int,
    num: int,
    x: FloatArray,
    y: FloatArray,
    place: np.uint64,
    mapped: FloatArray,
    codes: IntArray,
) -> None:
    """Write link ends in an ellipse's frame, and their outcodes (Newman & Sproull 1979).

    The outcode of a link end tells beyond which sides of the unit circle it lies in all lanes of
    the block. Where two ends share a side, nothing between them meets the circle; as the arms of a
    block are alike, most tests need not be done.
    """
    a, b, c, d, e = ellipse[0], ellipse[1], ellipse[2], ellipse[3], ellipse[4]
    u, v = mapped[0], mapped[1]
    for k in range(reached - 1, num + 1):
        row, to = U(k) * U(LANES), place + U(k) * U(LANES)
        not_right, not_left, not_above, not_below = 0, 0, 0, 0
        for n in range(LANES):
            lane = U(n)
            p, q = a * x[row + lane] + b * y[row + lane] + c, d * y[row + lane] + e
            u[to + lane], v[to + lane] = p, q
            not_right |= p <= BEYOND
            not_left |= p >= -BEYOND
            not_above |= q <= BEYOND
            not_below |= q >= -BEYOND
        codes[k] = 15 - (not_right + 2 * not_left + 4 * not_above + 8 * not_below)


@kernel
def _test_links(
    reached: int, num: int, place: np.uint64, mapped: FloatArray, codes: IntArray, least: FloatArray
) -> None:
    """Lower `least` to 0 or less where a link meets the ellipse."""
    u, v = mapped[0], mapped[1]
    for k in range(reached, num + 1):
        if codes[k - 1] & codes[k] == 0:
            _test(u, v, place + U(k - 1) * U(LANES), u, v, place + U(k) * U(LANES), least)


@kernel
def _test_chords(
    reached: int,
    num: int,
    place: np.uint64,
    before: FloatArray,
    now: FloatArray,
    codes_before: IntArray,
    codes: IntArray,
    least: FloatArray,
) -> None:
    """Lower `least` to 0 or less where a chord since the position before meets the ellipse."""
    for k in range(reached, num + 1):
        if codes_before[k] & codes[k] == 0:
            row = place + U(k) * U(LANES)
            _test(before[0], before[1], row, now[0], now[1], row, least)


@kernel
def _test(
    u: FloatArray,
    v: FloatArray,
    row: np.uint64,
    p: FloatArray,
    q: FloatArray,
    to: np.uint64,
    least: FloatArray,
) -> None:
    """Lower `least` to 0 or less where a segment from (u, v) to (p, q) touches the unit circle."""
    for n in range(LANES):
        lane = U(n)
        x_0, y_0, x_1, y_1 = u[row + lane], v[row + lane], p[to + lane], q[to + lane]
        lowest = least[lane]
        r, s = x_0 * x_0 + y_0 * y_0, x_1 * x_1 + y_1 * y_1
        inner, nearer = between(x_0, y_0, r, x_1, y_1, s), (r if r < s else s) - CONTACT
        value = inner if inner < nearer else nearer
        least[lane] = value if value < lowest else lowest


@kernel
def between(u: float, v: float, r: float, p: float, q: float, s: float) -> float:
    """Return a number ≤ 0 if a segment touches the unit circle between its ends.

    Args:
        u: Of one end (u, v), at the squared distance r from the centre.
        v: See u.
        r: See u.
        p: Of the other end (p, q), at the squared distance s.
        q: See p.
        s: See p.
    """
    turned, along = u * q - v * p, u * p + v * q
    one, two = r - along, s - along
    value = turned * turned - CONTACT * (one + two)
    value = value if one > 0.0 else 1.0
    return value if two > 0.0 else 1.0
