"""Straight links of planar arms among ellipses.

Which individuals of a population collide on their way.

An ellipse is mapped to the unit circle by an upper triangular matrix; there a segment meets it
where its distance to the origin is at most 1. With P, Q its ends in that frame and s = P·Q, the
nearest point lies between them where P·P − s and Q·Q − s are positive, and then at the squared
distance (P × Q)² / (P·P + Q·Q − 2 s): no division is needed. What is within a relative 1e-9 of
touching counts as touching, so that rounding never lets a contact pass.

Only whether an individual collides is asked for, so any order of tests gives the same answer. First
some positions are tested one after the other, the ones that find most collisions first, and whoever
collides is not tested again; whoever is left goes through all positions, and the chords of its link
ends are tested on the way. Individuals are innermost, in blocks that `load_lanes` gathers.
"""

import numpy as np

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.robots.kinematics import U
from evoexp.robots.planar_ends import LANES, begin_turning, block_ends, load_lanes, turned_ends

AFRESH = 32  # positions after which sines are computed anew, between them turned on
CONTACT = (
    1.0 + 1e-9
)  # [-] squared distance to the centre of the unit circle that still counts as contact
BEYOND = CONTACT  # [-] distance from an axis at which nothing counts as contact any more


@kernel
def paths_collide(starts, ends, lanes, count, arm, ellipses, path, hit):  # type: ignore[no-untyped-def]
    """Find which straight joint-space paths collide (Lavoie & Boudreau 2001, Eq. 3).

    Args:
        starts: (N, individuals) joint angles at the start of each path, relative [rad].
        ends: (N, individuals) at its end.
        lanes: (≥ count) indices of the individuals to test.
        count: How many.
        arm: See `planar_ends.block_ends`.
        ellipses: (E, 5) maps (x, y) → (a x + b y + c, d y + e) to the unit circle; (E,) the first
            link (1, 2, …) that reaches each ellipse.
        path: M; the positions (1 … M) that are tested first; whether all positions follow, with
            chords swept.
        hit: (individuals,) written for those tested: whether each collides.
    """
    rows, num, num_ellipses = len(starts) * LANES, len(starts), len(ellipses[0])
    alive = np.empty(count + LANES, dtype=np.int64)
    block = np.empty(rows), np.empty(rows), np.empty(LANES)
    at = (
        np.empty(LANES),
        np.empty(LANES),
        np.empty(LANES),
        np.empty(rows + LANES),
        np.empty(rows + LANES),
    )
    mapped = (
        np.empty((2, num_ellipses * (rows + LANES))),
        np.empty((2, num_ellipses * (rows + LANES))),
    )
    codes = (
        np.empty((num_ellipses, num + 1), dtype=np.int64),
        np.empty((num_ellipses, num + 1), dtype=np.int64),
    )
    memory = alive, block, at, np.empty((4, rows)), mapped, codes
    _test_paths(starts, ends, lanes, count, arm, ellipses, path, hit, memory)


@kernel
def _test_paths(starts, ends, lanes, count, arm, ellipses, path, hit, memory):  # type: ignore[no-untyped-def]
    """Do what `paths_collide` says, given its memory.

    So that no references are counted in the innermost loops.
    """
    starts, ends, lanes, arm, ellipses, hit, memory = borrowed(
        (starts, ends, lanes, arm, ellipses, hit, memory)
    )
    num_positions, first_positions, chords = path
    alive = memory[0]
    alive[:count] = lanes[:count]
    for k in range(count):
        hit[lanes[k]] = False
    left = count if len(ellipses[0]) > 0 else 0
    for position in first_positions:
        left = _drop_colliding(
            starts, ends, left, arm, ellipses, position, num_positions, hit, memory
        )
    if chords:
        _sweep(starts, ends, left, arm, ellipses, num_positions, hit, memory)


@kernel
def _drop_colliding(  # type: ignore[no-untyped-def]
    starts, ends, count, arm, ellipses, position, num_positions, hit, memory
):
    """Test one position; mark who collides.

    Keep the others in front of `alive` and return how many they are.
    """
    alive, (begin, end, least), (angle, at_x, at_y, x, y), _, (mapped, _), (codes, _) = borrowed(
        memory
    )
    num, kept = len(starts), 0
    for first in range(0, count, LANES):
        load_lanes(starts, alive, first, count, begin)
        load_lanes(ends, alive, first, count, end)
        block_ends(begin, end, arm, position, num_positions, angle, at_x, at_y, x, y)
        least[:] = 1.0
        for e in range(len(ellipses[0])):
            reached = ellipses[1][e]
            _map(ellipses[0][e], reached, num, x, y, U(0), mapped, codes[0])
            _test_links(reached, num, U(0), mapped, codes[0], least)
        for n in range(min(LANES, count - first)):
            individual, free = alive[first + n], least[n] > 0.0
            hit[individual] = not free
            alive[kept] = individual
            kept += free
    return kept


@kernel
def _sweep(starts, ends, count, arm, ellipses, num_positions, hit, memory):  # type: ignore[no-untyped-def]
    """Test all positions, and the chords of all link ends between them."""
    alive, (begin, end, least), (angle, at_x, at_y, x, y), turn, mapped, codes_of = borrowed(memory)
    num, rows = len(starts), len(starts) * LANES
    (before, now), (codes_before, codes) = mapped, codes_of
    for first in range(0, count, LANES):
        load_lanes(starts, alive, first, count, begin)
        load_lanes(ends, alive, first, count, end)
        least[:] = 1.0
        for position in range(num_positions + 1):
            before, now, codes_before, codes = now, before, codes, codes_before
            if position == 0 or position == num_positions:
                block_ends(begin, end, arm, position, num_positions, angle, at_x, at_y, x, y)
            else:
                if position % AFRESH == 1:
                    begin_turning(begin, end, arm, position - 1, num_positions, angle, at_x, turn)
                turned_ends(arm, at_x, at_y, turn, x, y)
            for e in range(len(ellipses[0])):
                reached, place = ellipses[1][e], U(e) * U(rows + LANES)
                _map(ellipses[0][e], reached, num, x, y, place, now, codes[e])
                if position > 0:
                    _test_links(reached, num, place, now, codes[e], least)
                    _test_chords(reached, num, place, before, now, codes_before[e], codes[e], least)
        for n in range(min(LANES, count - first)):
            hit[alive[first + n]] = not least[n] > 0.0


@kernel
def _map(ellipse, reached, num, x, y, place, mapped, codes):  # type: ignore[no-untyped-def]
    """Write link ends in an ellipse's frame.

    And the sides of the unit circle that all of a block's lie beyond.

    Where two ends share a side, nothing between them meets the circle (outcodes, Newman & Sproull
    1979); as the arms of a block are alike, most tests need not be done.
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
def _test_links(reached, num, place, mapped, codes, least):  # type: ignore[no-untyped-def]
    """Lower `least` to 0 or less where a link meets the ellipse."""
    u, v = mapped[0], mapped[1]
    for k in range(reached, num + 1):
        if codes[k - 1] & codes[k] == 0:
            _test(u, v, place + U(k - 1) * U(LANES), u, v, place + U(k) * U(LANES), least)


@kernel
def _test_chords(reached, num, place, before, now, codes_before, codes, least):  # type: ignore[no-untyped-def]
    """The same for the chords of link ends since the position before."""
    for k in range(reached, num + 1):
        if codes_before[k] & codes[k] == 0:
            row = place + U(k) * U(LANES)
            _test(before[0], before[1], row, now[0], now[1], row, least)


@kernel
def _test(u, v, row, p, q, to, least):  # type: ignore[no-untyped-def]
    """Lower `least` to 0 or less where a segment from (u, v) to (p, q) touches the unit circle."""
    for n in range(LANES):
        lane = U(n)
        x_0, y_0, x_1, y_1, lowest = (
            u[row + lane],
            v[row + lane],
            p[to + lane],
            q[to + lane],
            least[lane],
        )
        r, s = x_0 * x_0 + y_0 * y_0, x_1 * x_1 + y_1 * y_1
        inner, nearer = between(x_0, y_0, r, x_1, y_1, s), (r if r < s else s) - CONTACT
        value = inner if inner < nearer else nearer
        least[lane] = value if value < lowest else lowest


@kernel
def between(u, v, r, p, q, s):  # type: ignore[no-untyped-def]
    """Return ≤ 0 if a segment touches the unit circle between its ends (u, v), (p.

    Q) at squared distances r, s.
    """
    turned, along = u * q - v * p, u * p + v * q
    one, two = r - along, s - along
    value = turned * turned - CONTACT * (one + two)
    value = value if one > 0.0 else 1.0
    return value if two > 0.0 else 1.0


@kernel
def first_contact(start, end, arm, ellipses, num_positions, chords):  # type: ignore[no-untyped-def]
    """Find the first contact of one path, in the order of positions, ellipses and links.

    A chord before its position.

    Args:
        start: (N,) joint angles at the start [rad].
        end: (N,) at the end.
        arm: See `planar_ends.block_ends`.
        ellipses: See `paths_collide`.
        num_positions: M.
        chords: Whether chords are swept.

    Returns:
        Position; place of the ellipse; link, or link end, from 1; whether it is a chord that
        touches. All −1 and false if nothing does.
    """
    num = len(start)
    begin, stop = np.repeat(start, LANES), np.repeat(end, LANES)
    angle, at_x, at_y = np.empty(LANES), np.empty(LANES), np.empty(LANES)
    x, y = np.empty((2, (num + 1) * LANES)), np.empty((2, (num + 1) * LANES))
    block_ends(begin, stop, arm, 0, num_positions, angle, at_x, at_y, x[0], y[0])
    for position in range(1, num_positions + 1):
        old, new = (position + 1) % 2, position % 2
        block_ends(begin, stop, arm, position, num_positions, angle, at_x, at_y, x[new], y[new])
        for e in range(len(ellipses[0])):
            ellipse = ellipses[0][e]
            for k in range(num + 1):
                at, root = k * LANES, max(k - 1, 0) * LANES
                here = _mapped(ellipse, x[new, at], y[new, at])
                if chords and _meets(_mapped(ellipse, x[old, at], y[old, at]), here):
                    return position, e, k, True
                if _meets(_mapped(ellipse, x[new, root], y[new, root]), here):
                    return position, e, k, False
    return -1, -1, -1, False


@kernel
def _mapped(ellipse, x, y):  # type: ignore[no-untyped-def]
    p, q = ellipse[0] * x + ellipse[1] * y + ellipse[2], ellipse[3] * y + ellipse[4]
    return p, q, p * p + q * q


@kernel
def _meets(one, two):  # type: ignore[no-untyped-def]
    """Whether a segment touches the unit circle."""
    (u, v, r), (p, q, s) = one, two
    return between(u, v, r, p, q, s) <= 0.0 or r - CONTACT <= 0.0 or s - CONTACT <= 0.0
