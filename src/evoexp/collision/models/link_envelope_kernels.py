"""Kernels of arms with envelopes.

Two boundary lines per link, at ± half its width, and a circle around the tip.

As in `link_crossing_kernels`, all follows from what each individual has on its own and from four
cross and four dot products of the arms' directions; here the directions are unit vectors, so that
line functions are distances [length unit of the scene]. A pair's configuration takes some 260
operations in single precision for its sixteen pairs of boundary lines, eight of a circle and a
line, and one of two circles; what they leave open is decided in double precision, the lines
exactly. Measured with vectors of eight (AVX2), 100 × 100 pairs in 4 configurations: 220 µs, nearly
all of them this loop, which no longer fits the registers.

Outlines are (K, 8, N): elbow x, y, tip x, y, direction of the first link x, y, of the second x, y.
"""

import math

import numpy as np

from evoexp.collision.models.link_crossing_kernels import directions, sum_counts
from evoexp.collision.models.segment_predicates import touching
from evoexp.numeric.compilation import kernel
from evoexp.robots.kinematics import U

LANES = 104

ROWS = 8
"""Rows of a table: direction of link 1 (x, y), of link 2 (x, y), both links' (across.

Along) of the other's base.
"""

_ONE, _MANY, _NONE = np.int32(1), np.int32(65536), np.int32(0)
_ZERO = np.float32(0.0)
_UNIT = 2.0**-24
_FLOOR = 2.0**-100


@kernel
def outlines(q, base_x, base_y, lengths, out):  # type: ignore[no-untyped-def]
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
def boundary(arm, outline, k, n, link, side):  # type: ignore[no-untyped-def]
    """Ends (x, y, x, y) of a boundary line; side −1 is to the right of the link, +1 to its left."""
    base, _, half_width, _ = arm
    c, s = outline[k, 4 + 2 * link, n], outline[k, 5 + 2 * link, n]
    x, y = -(side * half_width * s), side * half_width * c
    elbow_x, elbow_y = outline[k, 0, n], outline[k, 1, n]
    if link == 0:
        return base[0] + x, base[1] + y, elbow_x + x, elbow_y + y
    return elbow_x + x, elbow_y + y, outline[k, 2, n] + x, outline[k, 3, n] + y


@kernel
def colliding(arm_1, outline_1, i, arm_2, outline_2, j, k):  # type: ignore[no-untyped-def]
    """Whether two individuals collide in configuration k: the careful test."""
    radius_1, radius_2 = arm_1[3], arm_2[3]
    cx, cy, fx, fy = outline_1[k, 2, i], outline_1[k, 3, i], outline_2[k, 2, j], outline_2[k, 3, j]
    reach = radius_1 + radius_2
    if (fx - cx) * (fx - cx) + (fy - cy) * (fy - cy) < reach * reach:
        return True
    for one in range(4):
        ax, ay, bx, by = boundary(arm_1, outline_1, k, i, one // 2, 2.0 * (one % 2) - 1.0)
        if _squared_distance(ax, ay, bx, by, fx, fy) < radius_2 * radius_2:
            return True
        for two in range(4):
            dx, dy, ex, ey = boundary(arm_2, outline_2, k, j, two // 2, 2.0 * (two % 2) - 1.0)
            if touching(ax, ay, bx, by, dx, dy, ex, ey):
                return True
    for two in range(4):
        dx, dy, ex, ey = boundary(arm_2, outline_2, k, j, two // 2, 2.0 * (two % 2) - 1.0)
        if _squared_distance(dx, dy, ex, ey, cx, cy) < radius_1 * radius_1:
            return True
    return False


@kernel
def _squared_distance(ax, ay, bx, by, x, y):  # type: ignore[no-untyped-def]
    """Of a point from a segment."""
    ux, uy, x, y = bx - ax, by - ay, x - ax, y - ay
    squared = ux * ux + uy * uy
    t = min(max((ux * x + uy * y) / squared, 0.0), 1.0) if squared > 0.0 else 0.0
    x, y = x - t * ux, y - t * uy
    return x * x + y * y


@kernel
def _threshold(arm_1, arm_2):  # type: ignore[no-untyped-def]
    """Return the scale of tables, and tau: above all errors of the quantities compared.

    With links ≤ l, bases d apart, half widths and radii ≤ h: every distance is below V = d + 3 l +
    4 h and errs by less than 10 u V, u = 2^-24: the unit vectors' products (4 u), their multiples
    (2 u), and sums of up to six terms. So the product of two errs by less than 21 u V², a sum of
    two squares by less than 32 u V² (40 taken).
    """
    (ax, ay), lengths_1, half_1, radius_1 = arm_1
    (dx, dy), lengths_2, half_2, radius_2 = arm_2
    apart = math.sqrt((dx - ax) * (dx - ax) + (dy - ay) * (dy - ay))
    longest = max(max(lengths_1[0], lengths_1[1]), max(lengths_2[0], lengths_2[1]))
    most = apart + 3.0 * longest + half_1 + half_2 + radius_1 + radius_2
    scale = math.ldexp(1.0, -max(math.frexp(most)[1], -1000))
    return scale, np.float32(40.0 * _UNIT * (most * scale) * (most * scale) + _FLOOR)


@kernel
def _fill_table(outline, lengths, dx, dy, members, scale, out):  # type: ignore[no-untyped-def]
    """Table of some individuals; (dx, dy) leads to the other's base.

    Lanes without an individual are apart.
    """
    num_configurations = outline.shape[0]
    first = lengths[0] * scale
    dx, dy = dx * scale, dy * scale
    for block in range((len(members) + LANES - 1) // LANES):
        count = min(LANES, len(members) - block * LANES)
        for k in range(num_configurations):
            o = U((block * num_configurations + k) * ROWS * LANES)
            for lane in range((count + 7) // 8 * 8):
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


@kernel
def _apart(p, q, least):  # type: ignore[no-untyped-def]
    r = p if p > q else q
    return r if r < least else least


@kernel
def _lines(across, turned, sine, cosine, sizes, least):  # type: ignore[no-untyped-def]
    """Lower `least` to the greater sign product of each pair of two links' boundary lines.

    Args:
        across: Distance of the beginning of the second link from the first's line.
        turned: The other way round.
        sine: Of the angle from the first link to the second.
        cosine: Of it.
        sizes: Length and half width of the first link, of the second.
        least: So far.
    """
    length_1, half_1, length_2, half_2 = sizes
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


@kernel
def _circle(across, along, length, half_width, squared_radius, least):  # type: ignore[no-untyped-def]
    """Lower `least` to distance² − radius² of a circle and a link's nearer boundary line."""
    off, beyond = abs(across) - half_width, along - length
    out = beyond if beyond > -along else -along
    out = out if out > _ZERO else _ZERO
    value = off * off + out * out - squared_radius
    return value if value < least else least


@kernel
def _add_collisions(one, s, two, o, lanes, sizes, tau, seen):  # type: ignore[no-untyped-def]
    """One configuration of an individual (at s) against a block (at o)."""
    low = -tau
    l1, l2, half, squared, m1, m2, wide, other_squared, both_squared = sizes
    ax, ay, bx, by = one[s], one[s + U(LANES)], one[s + U(2 * LANES)], one[s + U(3 * LANES)]
    p1, g1, p2, g2 = (
        one[s + U(4 * LANES)],
        one[s + U(5 * LANES)],
        one[s + U(6 * LANES)],
        one[s + U(7 * LANES)],
    )
    for n in range(lanes):
        j = o + U(n)
        vx, vy, wx, wy = two[j], two[j + U(LANES)], two[j + U(2 * LANES)], two[j + U(3 * LANES)]
        r1, e1, r2, e2 = (
            two[j + U(4 * LANES)],
            two[j + U(5 * LANES)],
            two[j + U(6 * LANES)],
            two[j + U(7 * LANES)],
        )
        c11, c12, c21, c22 = (
            ax * vy - ay * vx,
            ax * wy - ay * wx,
            bx * vy - by * vx,
            bx * wy - by * wx,
        )
        d11, d12, d21, d22 = (
            ax * vx + ay * vy,
            ax * wx + ay * wy,
            bx * vx + by * vy,
            bx * wx + by * wy,
        )
        p12, p22 = p1 + m1 * c11, p2 + m1 * c21  # the other's elbow from the lines of links 1 and 2
        r12, r22 = r1 - l1 * c11, r2 - l1 * c12  # the own elbow from the other's lines
        q1, q2 = p12 + m2 * c12, p22 + m2 * c22  # tips
        t1, t2 = r12 - l2 * c21, r22 - l2 * c22
        h1, h2 = g1 + m1 * d11 + m2 * d12, g2 + m1 * d21 + m2 * d22  # tips along the links
        k1, k2 = e1 + l1 * d11 + l2 * d21, e2 + l1 * d12 + l2 * d22
        away = h2 - l2
        least = away * away + q2 * q2 - both_squared
        least = _lines(p1, r1, c11, d11, (l1, half, m1, wide), least)
        least = _lines(p12, r2, c12, d12, (l1, half, m2, wide), least)
        least = _lines(p2, r12, c21, d21, (l2, half, m1, wide), least)
        least = _lines(p22, r22, c22, d22, (l2, half, m2, wide), least)
        least = _circle(q1, h1, l1, half, other_squared, least)
        least = _circle(q2, h2, l2, half, other_squared, least)
        least = _circle(t1, k1, m1, wide, squared, least)
        least = _circle(t2, k2, m2, wide, squared, least)
        seen[U(n)] += (_ONE if least < low else _NONE) + (_MANY if least <= tau else _NONE)


@kernel
def _count_rows(  # type: ignore[no-untyped-def]
    arm_1, outline_1, one, rows, arm_2, outline_2, two, columns, sizes, tau, counts
):
    """Fill counts[rows, columns].

    `one` is the table of all of population 1, `two` of the columns alone.
    """
    num_configurations = outline_1.shape[0]
    seen = np.empty(LANES, dtype=np.int32)
    for row in range(len(rows)):
        i = rows[row]
        own = (i // LANES) * num_configurations * ROWS * LANES + i % LANES
        for block in range((len(columns) + LANES - 1) // LANES):
            first = block * LANES
            count = min(LANES, len(columns) - first)
            lanes = (count + 7) // 8 * 8
            for n in range(lanes):
                seen[U(n)] = _NONE
            for k in range(num_configurations):
                other = (block * num_configurations + k) * ROWS * LANES
                _add_collisions(
                    one, U(own + k * ROWS * LANES), two, U(other), lanes, sizes, tau, seen
                )
            for n in range(count):
                j, total = columns[first + n], seen[U(n)] & 0xFFFF
                if seen[U(n)] >> 16 != total:
                    total = 0
                    for k in range(num_configurations):
                        total += colliding(arm_1, outline_1, i, arm_2, outline_2, j, k)
                counts[i, j] = total


@kernel
def collisions(  # type: ignore[no-untyped-def]
    arm_1, outline_1, rows, other_rows, arm_2, outline_2, columns, counts, sums_1, sums_2
):
    """Bring a matrix of counts up to date, and its sums.

    Args:
        arm_1: Base (x, y), lengths of two links, half width, radius of the circle: nested tuples.
        outline_1: (K, 8, N1), finite.
        rows: Individuals of population 1 that changed.
        other_rows: Those that did not.
        arm_2: As arm_1.
        outline_2: (K, 8, N2).
        columns: Individuals of population 2 that changed.
        counts: (N1, N2) int16.
        sums_1: (N1,) int64.
        sums_2: (N2,) int64.
    """
    scale, tau = _threshold(arm_1, arm_2)
    sizes = _sizes(arm_1, arm_2, scale)
    dx, dy = arm_2[0][0] - arm_1[0][0], arm_2[0][1] - arm_1[0][1]
    num_1, num_2, size = outline_1.shape[2], outline_2.shape[2], outline_1.shape[0] * ROWS * LANES
    one = np.empty((num_1 + LANES - 1) // LANES * size, dtype=np.float32)
    two = np.empty((num_2 + LANES - 1) // LANES * size, dtype=np.float32)
    _fill_table(outline_1, arm_1[1], dx, dy, np.arange(num_1), scale, one)
    if len(rows) > 0:
        everyone = np.arange(num_2)
        _fill_table(outline_2, arm_2[1], -dx, -dy, everyone, scale, two)
        _count_rows(
            arm_1, outline_1, one, rows, arm_2, outline_2, two, everyone, sizes, tau, counts
        )
    if len(columns) > 0 and len(other_rows) > 0:
        _fill_table(outline_2, arm_2[1], -dx, -dy, columns, scale, two)
        _count_rows(
            arm_1, outline_1, one, other_rows, arm_2, outline_2, two, columns, sizes, tau, counts
        )
    sum_counts(counts, sums_1, sums_2)


@kernel
def _sizes(arm_1, arm_2, scale):  # type: ignore[no-untyped-def]
    _, (l1, l2), half_1, radius_1 = arm_1
    _, (m1, m2), half_2, radius_2 = arm_2
    squared_1, squared_2 = (
        (radius_1 * scale) * (radius_1 * scale),
        (radius_2 * scale) * (radius_2 * scale),
    )
    both = ((radius_1 + radius_2) * scale) * ((radius_1 + radius_2) * scale)
    return (
        np.float32(l1 * scale), np.float32(l2 * scale), np.float32(half_1 * scale),
        np.float32(squared_1),
        np.float32(m1 * scale), np.float32(m2 * scale), np.float32(half_2 * scale),
        np.float32(squared_2),
        np.float32(both),
    )  # fmt: skip
