"""Straight links of planar arms among ellipses: which individuals of a population collide on their way.

An ellipse is mapped to the unit circle by an upper triangular matrix; there a segment meets it where its distance to the
origin is at most 1. With P, Q the ends of a segment in that frame, s = P·Q, a = P·P − s and b = Q·Q − s, the nearest
point lies between the ends where a > 0 and b > 0, at the squared distance (P × Q)² / (a + b): no division is needed.
What is within a relative 1e-9 of touching counts as touching, so that rounding never lets a contact pass.

Only whether an individual collides is asked for, so any order of tests gives the same answer. First all positions are
tested one after the other, the ones that find most collisions first, and whoever collides is not tested again; whoever
is left has the chords of its link ends tested. Individuals are innermost, in blocks that `lanes` gathers.
"""

import numpy as np

from evoexp.numerics import kernel
from evoexp.robots.kinematics import U
from evoexp.robots.planar_ends import LANES, block_ends, load_lanes

CONTACT = 1.0 + 1e-9  # [-] squared distance to the centre of the unit circle that still counts as contact


@kernel
def paths_collide(starts, ends, lanes, count, arm, ellipses, path, hit):  # type: ignore[no-untyped-def]
    """Find which straight joint-space paths collide (Lavoie & Boudreau 2001, Eq. 3).

    Args:
        starts: (N, individuals) joint angles at the start of each path, relative [rad].
        ends: (N, individuals) at its end.
        lanes: (≥ count) indices of the individuals to test.
        count: How many.
        arm: See `block_ends`.
        ellipses: (E, 5) centre and matrix a, b, d of the map (x, y) → (a x + b y, d y); (E,) the first link that
            reaches the ellipse.
        path: Order (M,) of the positions 1 … M, and whether chords are swept.
        hit: (individuals,) written for those tested: whether each collides.
    """
    order, chords = path
    alive = lanes[:count].copy()
    for k in range(count):
        hit[alive[k]] = False
    left = count
    for position in order:
        left = _drop_colliding(starts, ends, alive, left, arm, ellipses, position, len(order), hit)
    if chords:
        _sweep(starts, ends, alive, left, arm, ellipses, len(order), hit)


@kernel
def _drop_colliding(  # type: ignore[no-untyped-def]
    starts, ends, alive, count, arm, ellipses, position, num_positions, hit
):
    """Test one position; mark who collides, keep the others in front of `alive` and return how many they are."""
    rows = len(starts) * LANES
    begin, end, angle, least = np.empty(rows), np.empty(rows), np.empty(LANES), np.empty(LANES)
    x, y = np.empty(rows + LANES), np.empty(rows + LANES)
    u, v, r = np.empty(rows + LANES), np.empty(rows + LANES), np.empty(rows + LANES)
    kept = 0
    for first in range(0, count, LANES):
        load_lanes(starts, alive, first, count, begin)
        load_lanes(ends, alive, first, count, end)
        block_ends(begin, end, arm, position, num_positions, angle, x, y)
        least[:] = 1.0
        for e in range(len(ellipses[0])):
            _into_circle(ellipses, e, len(starts), x, y, U(0), u, v, r, least)
            _links(ellipses[1][e], len(starts), U(0), u, v, r, least)
        for n in range(min(LANES, count - first)):
            individual, free = alive[first + n], least[n] > 0.0
            hit[individual] = not free
            alive[kept] = individual
            kept += free
    return kept


@kernel
def _sweep(starts, ends, alive, count, arm, ellipses, num_positions, hit):  # type: ignore[no-untyped-def]
    """Test the chords of all link ends between successive positions, and the link ends at the start."""
    num, rows = len(starts), len(starts) * LANES
    begin, end, angle, least = np.empty(rows), np.empty(rows), np.empty(LANES), np.empty(LANES)
    x, y = np.empty(rows + LANES), np.empty(rows + LANES)
    memory = np.empty((2, 3, len(ellipses[0]) * (rows + LANES)))
    for first in range(0, count, LANES):
        load_lanes(starts, alive, first, count, begin)
        load_lanes(ends, alive, first, count, end)
        least[:] = 1.0
        for position in range(num_positions + 1):
            before, now = memory[(position + 1) % 2], memory[position % 2]
            block_ends(begin, end, arm, position, num_positions, angle, x, y)
            for e in range(len(ellipses[0])):
                place = U(e) * U(rows + LANES)
                _into_circle(ellipses, e, num, x, y, place, now[0], now[1], now[2], least)
                if position > 0:
                    _chords(ellipses[1][e], num, place, before, now, least)
        for n in range(min(LANES, count - first)):
            hit[alive[first + n]] = not least[n] > 0.0


@kernel
def _into_circle(ellipses, e, num, x, y, place, u, v, r, least):  # type: ignore[no-untyped-def]
    """Write link ends in the frame of ellipse `e`, and their squared distances; lower `least` where one is inside."""
    maps, reached = ellipses
    cx, cy, a, b, d = maps[e, 0], maps[e, 1], maps[e, 2], maps[e, 3], maps[e, 4]
    for k in range(max(reached[e] - 1, 0), num + 1):
        row, to = U(k) * U(LANES), place + U(k) * U(LANES)
        for n in range(LANES):
            lane = U(n)
            dx, dy = x[row + lane] - cx, y[row + lane] - cy
            p, q = a * dx + b * dy, d * dy
            squared = p * p + q * q
            u[to + lane], v[to + lane], r[to + lane] = p, q, squared
            inside, lowest = squared - CONTACT, least[lane]
            least[lane] = inside if inside < lowest else lowest


@kernel
def _links(reached, num, place, u, v, r, least):  # type: ignore[no-untyped-def]
    """Lower `least` to 0 or less where a link meets the ellipse between its ends."""
    for k in range(reached, num + 1):
        row, to = place + U(k - 1) * U(LANES), place + U(k) * U(LANES)
        for n in range(LANES):
            lane = U(n)
            p, q, s, t = u[row + lane], v[row + lane], u[to + lane], v[to + lane]
            turned, along = p * t - q * s, p * s + q * t
            one, two = r[row + lane] - along, r[to + lane] - along
            value, lowest = turned * turned - CONTACT * (one + two), least[lane]
            value = value if one > 0.0 else 1.0
            value = value if two > 0.0 else 1.0
            least[lane] = value if value < lowest else lowest


@kernel
def _chords(reached, num, place, before, now, least):  # type: ignore[no-untyped-def]
    """The same for the chords of link ends from one position to the next."""
    u_0, v_0, r_0, u, v, r = before[0], before[1], before[2], now[0], now[1], now[2]
    for k in range(reached, num + 1):
        at = place + U(k) * U(LANES)
        for n in range(LANES):
            lane = at + U(n)
            p, q, s, t = u_0[lane], v_0[lane], u[lane], v[lane]
            turned, along = p * t - q * s, p * s + q * t
            one, two = r_0[lane] - along, r[lane] - along
            value, lowest = turned * turned - CONTACT * (one + two), least[U(n)]
            value = value if one > 0.0 else 1.0
            value = value if two > 0.0 else 1.0
            least[U(n)] = value if value < lowest else lowest


@kernel
def first_contact(start, end, arm, ellipses, num_positions, chords):  # type: ignore[no-untyped-def]
    """Find the first contact of one path, in the order of positions, ellipses and links, a chord before its position.

    Args:
        start: (N,) joint angles at the start [rad].
        end: (N,) at the end.
        arm: See `block_ends`.
        ellipses: See `paths_collide`.
        num_positions: M.
        chords: Whether chords are swept.

    Returns:
        Position, ellipse, link or link end (0, 1, …; the base is link end −1), whether it is a chord that touches; all
        −1 and false if nothing does.
    """
    num = len(start)
    begin, stop, angle = np.repeat(start, LANES), np.repeat(end, LANES), np.empty(LANES)
    x, y = np.empty((2, (num + 1) * LANES)), np.empty((2, (num + 1) * LANES))
    block_ends(begin, stop, arm, 0, num_positions, angle, x[0], y[0])
    for position in range(1, num_positions + 1):
        old, new = (position + 1) % 2, position % 2
        block_ends(begin, stop, arm, position, num_positions, angle, x[new], y[new])
        for e in range(len(ellipses[0])):
            for k in range(num + 1):
                at, before = k * LANES, max(k - 1, 0) * LANES
                here = _mapped(ellipses[0][e], x[new, at], y[new, at])
                if chords and _meets(_mapped(ellipses[0][e], x[old, at], y[old, at]), here):
                    return position, e, k - 1, True
                if _meets(_mapped(ellipses[0][e], x[new, before], y[new, before]), here):
                    return position, e, k - 1, False
    return -1, -1, -1, False


@kernel
def _mapped(ellipse, x, y):  # type: ignore[no-untyped-def]
    dx, dy = x - ellipse[0], y - ellipse[1]
    return ellipse[2] * dx + ellipse[3] * dy, ellipse[4] * dy


@kernel
def _meets(one, two):  # type: ignore[no-untyped-def]
    """Whether a segment meets the unit circle's disc; the comparisons of `_into_circle` and `_links`."""
    (p, q), (s, t) = one, two
    r_0, r = p * p + q * q, s * s + t * t
    turned, along = p * t - q * s, p * s + q * t
    a, b = r_0 - along, r - along
    between = a > 0.0 and b > 0.0 and turned * turned - CONTACT * (a + b) <= 0.0
    return between or r_0 - CONTACT <= 0.0 or r - CONTACT <= 0.0
