"""Kernels of arms with envelopes: two boundary lines per link, and a circle around the tip.

As in `link_crossing_kernels`, all follows from what each individual has on its own and from four
cross and four dot products of the arms' directions; here the directions are unit vectors, so that
line functions are distances [length unit of the scene]. A pair's configuration takes some 260
operations in single precision for its sixteen pairs of boundary lines, eight of a circle and a
line, and one of two circles, for eight individuals at a time (`numeric.vectors`); cases that
rounding leaves open are decided in double precision, the lines exactly.

Outlines are (K, 8, N): elbow x, y, tip x, y, direction of the first link x, y, of the second x, y.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.planar.crossing_blocks import add_where, greater, lesser
from evoexp.collision.planar.envelope_contact import Envelope, colliding, tolerance_of
from evoexp.collision.planar.link_crossing_kernels import Point, directions, sum_counts
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vectors import LANES, Singles, load_singles, magnitude, spread_single
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import U

ROWS = 8
"""Vectors of a block in a configuration: direction of link 1 (x, y), of link 2 (x, y), and where
the other's base lies across and along either link."""

_ZERO = np.float32(0.0)
_UNIT = 2.0**-24
_FLOOR = 2.0**-100


class Sizes(NamedTuple):
    """Sizes of two arms in the scale of tables, single precision."""

    l1: np.float32  # length of arm 1's first link
    l2: np.float32  # of its second
    half: np.float32  # its half width
    squared: np.float32  # square of its circle's radius
    m1: np.float32  # length of arm 2's first link
    m2: np.float32  # of its second
    wide: np.float32  # its half width
    other_squared: np.float32  # square of its circle's radius
    both_squared: np.float32  # square of the sum of the radii


@kernel
def outlines(q: FloatArray, base_x: float, base_y: float, lengths: Point, out: FloatArray) -> None:
    """Fill out (K, 8, N) from q (K, 2, N) [rad]."""
    num, (first, second) = q.shape[2], lengths
    angles, place = q.reshape(-1), out.reshape(-1)
    for k in range(q.shape[0]):
        x, y, z, w = (
            U(8 * k * num),
            U((8 * k + 1) * num),
            U((8 * k + 2) * num),
            U((8 * k + 3) * num),
        )
        c, s, d, t = (
            U((8 * k + 4) * num),
            U((8 * k + 5) * num),
            U((8 * k + 6) * num),
            U((8 * k + 7) * num),
        )
        directions(angles, U(2 * k * num), num, place, c, s)
        directions(angles, U((2 * k + 1) * num), num, place, d, t)
        for n in range(num):
            place[x + U(n)] = base_x + first * place[c + U(n)]
            place[y + U(n)] = base_y + first * place[s + U(n)]
        for n in range(num):
            place[z + U(n)] = place[x + U(n)] + second * place[d + U(n)]
            place[w + U(n)] = place[y + U(n)] + second * place[t + U(n)]


@kernel
def _threshold(arm_1: Envelope, arm_2: Envelope) -> tuple[float, np.float32]:
    """Return the scale of tables, and tau, a bound on the errors of the quantities compared.

    With links ≤ l, bases d apart, half widths and radii ≤ h: every distance is below V = d + 3 l +
    4 h and errs by less than 10 u V, u = 2^-24: the unit vectors' products (4 u), their multiples
    (2 u), and sums of up to six terms. So the product of two errs by less than 21 u V², a sum of
    two squares by less than 32 u V² (40 taken). What counts as contact, t, adds 2 V t + t².
    """
    (ax, ay), (dx, dy) = arm_1.base, arm_2.base
    apart = math.sqrt((dx - ax) * (dx - ax) + (dy - ay) * (dy - ay))
    (first, second), (third, fourth) = arm_1.lengths, arm_2.lengths
    longest = max(max(first, second), max(third, fourth))
    most = apart + 3.0 * longest + arm_1.half_width + arm_2.half_width
    most = most + arm_1.tcp_radius + arm_2.tcp_radius
    scale = math.ldexp(1.0, -max(math.frexp(most)[1], -1000))
    largest, near = most * scale, tolerance_of(arm_1, arm_2) * scale
    contact = near * (2.0 * largest + near)
    return scale, np.float32(40.0 * _UNIT * largest * largest + contact + _FLOOR)


@kernel
def _fill_table(
    outline: FloatArray,
    lengths: Point,
    dx: float,
    dy: float,
    members: IntArray,
    scale: float,
    out: NDArray[np.float32],
) -> None:
    """Write the blocks of some individuals; (dx, dy) leads from their base to the other's.

    The last block is filled up by copies of the last individual.
    """
    num_configurations = outline.shape[0]
    first = lengths[0] * scale
    dx, dy = dx * scale, dy * scale
    for block in range((len(members) + LANES - 1) // LANES):
        count = min(LANES, len(members) - block * LANES)
        for k in range(num_configurations):
            o = U((block * num_configurations + k) * ROWS * LANES)
            for lane in range(LANES):
                n, at = members[block * LANES + min(lane, count - 1)], o + U(lane)
                c, s, d, t = outline[k, 4, n], outline[k, 5, n], outline[k, 6, n], outline[k, 7, n]
                x, y = dx - first * c, dy - first * s  # from the elbow
                out[at] = np.float32(c)
                out[at + U(LANES)] = np.float32(s)
                out[at + U(2 * LANES)] = np.float32(d)
                out[at + U(3 * LANES)] = np.float32(t)
                out[at + U(4 * LANES)] = np.float32(c * dy - s * dx)
                out[at + U(5 * LANES)] = np.float32(c * dx + s * dy)
                out[at + U(6 * LANES)] = np.float32(d * y - t * x)
                out[at + U(7 * LANES)] = np.float32(d * x + t * y)


@inlined
def _apart(p: Singles, q: Singles, least: Singles) -> Singles:
    """Return the lesser of `least` and the greater of two sign products."""
    found: Singles = lesser(least, greater(q, p))
    return found


@inlined
def _lines(
    across: Singles,
    turned: Singles,
    sine: Singles,
    cosine: Singles,
    length_1: np.float32,
    half_1: np.float32,
    length_2: np.float32,
    half_2: np.float32,
    least: Singles,
) -> Singles:
    """Lower `least` to the greater sign product of each pair of two links' boundary lines.

    Args:
        across: Distance of the beginning of the second link from the first's line.
        sine: Of the angle from the first link to the second.
        length_1: Of the first link.
        half_1: Its half width.
        half_2: Its half width.
    """
    shift, step = half_2 * cosine, length_2 * sine
    twist, fall = half_1 * cosine, length_1 * sine
    left, right = across + shift, across - shift  # of the second's boundary lines
    front, rear = turned + twist, turned - twist
    a, b, c, d = left - half_1, left + half_1, right - half_1, right + half_1
    e, f, g, h = front - half_2, front + half_2, rear - half_2, rear + half_2
    # lines (side of the first, side of the second): (+, +) a e, (−, +) b g, (+, −) c f, (−, −) d h
    least = _apart(a * (a + step), e * (e - fall), least)
    least = _apart(b * (b + step), g * (g - fall), least)
    least = _apart(c * (c + step), f * (f - fall), least)
    return _apart(d * (d + step), h * (h - fall), least)


@inlined
def _circle(
    across: Singles,
    along: Singles,
    length: np.float32,
    half_width: np.float32,
    squared_radius: np.float32,
    least: Singles,
) -> Singles:
    """Lower `least` to distance² − radius² of a circle and a link's nearer boundary line."""
    off = magnitude(across) - half_width
    out = greater(greater(_ZERO - along, along - length), spread_single(_ZERO))
    return lesser(least, off * off + out * out - squared_radius)


@inlined
def _least_quantity(
    one: NDArray[np.float32],
    s: np.uint64,
    two: NDArray[np.float32],
    o: np.uint64,
    sizes: Sizes,
) -> Singles:
    """Return the least of all that tells whether an arm collides with those of a block.

    Args:
        one: Blocks of arm 1.
        s: Place of the individual there.
        two: Blocks of arm 2.
        o: Place of the block there.
        sizes: Of both arms.

    Returns:
        Above 0 where arms are apart, below where they collide.
    """
    l1, l2, m1, m2 = sizes.l1, sizes.l2, sizes.m1, sizes.m2
    half, wide, squared = sizes.half, sizes.wide, sizes.squared
    other_squared, both_squared = sizes.other_squared, sizes.both_squared
    ax, ay, bx, by = one[s], one[s + U(LANES)], one[s + U(2 * LANES)], one[s + U(3 * LANES)]
    p1, g1 = one[s + U(4 * LANES)], one[s + U(5 * LANES)]
    p2, g2 = one[s + U(6 * LANES)], one[s + U(7 * LANES)]
    vx, vy = load_singles(two, o), load_singles(two, o + U(LANES))
    wx, wy = load_singles(two, o + U(2 * LANES)), load_singles(two, o + U(3 * LANES))
    r1, e1 = load_singles(two, o + U(4 * LANES)), load_singles(two, o + U(5 * LANES))
    r2, e2 = load_singles(two, o + U(6 * LANES)), load_singles(two, o + U(7 * LANES))
    # sines and cosines of the angles between links
    c11, c12 = ax * vy - ay * vx, ax * wy - ay * wx
    c21, c22 = bx * vy - by * vx, bx * wy - by * wx
    d11, d12 = ax * vx + ay * vy, ax * wx + ay * wy
    d21, d22 = bx * vx + by * vy, bx * wx + by * wy
    p12, p22 = p1 + m1 * c11, p2 + m1 * c21  # the other's elbow from the lines of links 1 and 2
    r12, r22 = r1 - l1 * c11, r2 - l1 * c12  # the own elbow from the other's lines
    q1, q2 = p12 + m2 * c12, p22 + m2 * c22  # tips
    t1, t2 = r12 - l2 * c21, r22 - l2 * c22
    h1, h2 = g1 + m1 * d11 + m2 * d12, g2 + m1 * d21 + m2 * d22  # tips along the links
    k1, k2 = e1 + l1 * d11 + l2 * d21, e2 + l1 * d12 + l2 * d22
    # both circles, sixteen pairs of lines, eight pairs of a circle and a line
    away = h2 - l2
    least = away * away + q2 * q2 - both_squared
    least = _lines(spread_single(p1), r1, c11, d11, l1, half, m1, wide, least)
    least = _lines(p12, r2, c12, d12, l1, half, m2, wide, least)
    least = _lines(spread_single(p2), r12, c21, d21, l2, half, m1, wide, least)
    least = _lines(p22, r22, c22, d22, l2, half, m2, wide, least)
    least = _circle(q1, h1, l1, half, other_squared, least)
    least = _circle(q2, h2, l2, half, other_squared, least)
    least = _circle(t1, k1, m1, wide, squared, least)
    return _circle(t2, k2, m2, wide, squared, least)


@kernel
def _count_rows(
    arm_1: Envelope,
    outline_1: FloatArray,
    one: NDArray[np.float32],
    rows: IntArray,
    arm_2: Envelope,
    outline_2: FloatArray,
    two: NDArray[np.float32],
    columns: IntArray,
    sizes: Sizes,
    tau: np.float32,
    counts: NDArray[np.int16],
) -> None:
    """Fill counts[rows, columns] from the tables `one` of population 1 and `two` of the columns."""
    one, two = borrowed((one, two))
    num_configurations, num_columns = outline_1.shape[0], len(columns)
    size, blocks = num_configurations * ROWS * LANES, (num_columns + LANES - 1) // LANES
    found = np.empty(2 * LANES * blocks, dtype=np.float32)  # certain collisions, then possible ones
    for row in range(len(rows)):
        i = rows[row]
        own = i // LANES * size + i % LANES
        for n in range(len(found)):
            found[U(n)] = _ZERO
        for block in range(blocks):
            certain, possible = U(block * LANES), U((blocks + block) * LANES)
            for k in range(num_configurations):
                place = k * ROWS * LANES
                least = _least_quantity(one, U(own + place), two, U(block * size + place), sizes)
                add_where(least < -tau, found, certain)
                add_where(least <= tau, found, possible)
        # pairs that rounding leaves open are counted anew
        for n in range(num_columns):
            j, total = columns[n], int(found[U(n)])
            if found[U(blocks * LANES + n)] != found[U(n)]:
                total = 0
                for k in range(num_configurations):
                    total += colliding(arm_1, outline_1, i, arm_2, outline_2, j, k)
            counts[i, j] = total


@kernel
def collisions(
    arm_1: Envelope,
    outline_1: FloatArray,
    rows: IntArray,
    other_rows: IntArray,
    arm_2: Envelope,
    outline_2: FloatArray,
    columns: IntArray,
    counts: NDArray[np.int16],
    sums_1: IntArray,
    sums_2: IntArray,
) -> None:
    """Bring a matrix of counts up to date, and its sums.

    Args:
        arm_1: Arm of population 1.
        outline_1: (K, 8, N1), finite.
        rows: Individuals of population 1 that changed.
        other_rows: Those that did not.
        arm_2: Arm of population 2.
        outline_2: (K, 8, N2).
        columns: Individuals of population 2 that changed.
        counts: (N1, N2) int16.
        sums_1: (N1,) int64.
        sums_2: (N2,) int64.
    """
    scale, tau = _threshold(arm_1, arm_2)
    sizes = _sizes(arm_1, arm_2, scale)
    (ax, ay), (bx, by) = arm_1.base, arm_2.base
    dx, dy = bx - ax, by - ay
    num_1, num_2, size = outline_1.shape[2], outline_2.shape[2], outline_1.shape[0] * ROWS * LANES
    one = np.empty((num_1 + LANES - 1) // LANES * size, dtype=np.float32)
    two = np.empty((num_2 + LANES - 1) // LANES * size, dtype=np.float32)
    _fill_table(outline_1, arm_1.lengths, dx, dy, np.arange(num_1), scale, one)
    # changed rows against all columns, then the other rows against changed columns
    if len(rows) > 0:
        everyone = np.arange(num_2)
        _fill_table(outline_2, arm_2.lengths, -dx, -dy, everyone, scale, two)
        _count_rows(
            arm_1, outline_1, one, rows, arm_2, outline_2, two, everyone, sizes, tau, counts
        )
    if len(columns) > 0 and len(other_rows) > 0:
        _fill_table(outline_2, arm_2.lengths, -dx, -dy, columns, scale, two)
        _count_rows(
            arm_1, outline_1, one, other_rows, arm_2, outline_2, two, columns, sizes, tau, counts
        )
    sum_counts(counts, sums_1, sums_2)


@kernel
def _sizes(arm_1: Envelope, arm_2: Envelope, scale: float) -> Sizes:
    """Return the sizes of two arms in the scale of tables."""
    (l1, l2), (m1, m2) = arm_1.lengths, arm_2.lengths
    one, two = arm_1.tcp_radius * scale, arm_2.tcp_radius * scale
    both = (arm_1.tcp_radius + arm_2.tcp_radius) * scale
    half, wide = arm_1.half_width * scale, arm_2.half_width * scale
    return Sizes(
        np.float32(l1 * scale), np.float32(l2 * scale), np.float32(half), np.float32(one * one),
        np.float32(m1 * scale), np.float32(m2 * scale), np.float32(wide), np.float32(two * two),
        np.float32(both * both),
    )  # fmt: skip
