"""Kernels of crossing links: every individual of a population of two-link arms against another's.

Arm 1 has its base A, elbow B = A + u1, tip C = B + u2; arm 2 D, E = D + v1, F = E + v2. Two links
cross where the ends of each lie on different sides of the other's line. All sixteen line functions
follow from the four cross products u × v (in angles: the sines of Curkovic et al. 2013, Eq. 12) and
from what each individual has on its own; the latter is prepared once per individual. So a
configuration of a pair takes 20 additions and multiplications for its line functions and 15 more
for the sign products of its four link pairs.

Those run in single precision, eight or more lanes at a time. A pair of links is apart where one of
its two products is above `tau`, a bound on all rounding (proved at `_threshold`), and crosses where
both are below −tau; what is neither, two pairs of ten thousand random ones, is decided anew by the
exact predicates. So counts are exact, whatever the vector width.

What limits the speed: by count the multipliers, which do 16 multiplications, 7 minima or maxima and
2 comparisons of the 40 operations. Measured with vectors of eight (AVX2), 100 × 100 pairs in 4
configurations: 42 µs from points to counts and sums, 28 µs of them this loop (5.4 ns per vector),
the rest tables, lengths, sums, checks; fresh or gathered populations alike, for nothing is skipped.

`q` and points are (configurations, rows, individuals), any number of individuals; tables are padded
to blocks.
"""

import math

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.models.segment_predicates import touching
from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import exact_sincos
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import U

LANES = 104
"""Individuals per block of a table; the last block is computed up to the next multiple of eight."""

ROWS = 6
"""Rows of a table, in single precision: u1 (x, y), u2 (x, y), and both links' line functions at the
other's base."""

Point = tuple[float, float]

MOST_CONFIGURATIONS = 32767  # both counters of a pair share an int32, and counts are int16

_ONE, _MANY = np.int32(1), np.int32(65536)
_NONE = np.int32(0)
_UNIT = 2.0**-24  # half a unit in the last place of 1, single precision
_FLOOR = 2.0**-100  # above all that underflow can lose
_LARGEST = 1e300
_HIGHEST = 1000


@kernel
def link_points(
    q: FloatArray,
    base_x: float,
    base_y: float,
    first_length: float,
    second_length: float,
    out: FloatArray,
) -> None:
    """Write elbows and tips.

    Args:
        q: (K, 2, N) angles of the links from +x [rad].
        base_x: Of the first joint [length unit].
        base_y: Likewise.
        first_length: Of the first link [length unit].
        second_length: Of the second.
        out: (K, 4, N), written: elbow x, y, tip x, y.
    """
    num = q.shape[2]
    angles, place = q.reshape(-1), out.reshape(-1)
    for link in range(2 * q.shape[0]):
        directions(angles, U(link * num), num, place, U(2 * link * num), U((2 * link + 1) * num))
    for k in range(q.shape[0]):
        x, y, z, w = (
            U(4 * k * num),
            U((4 * k + 1) * num),
            U((4 * k + 2) * num),
            U((4 * k + 3) * num),
        )
        for n in range(num):
            place[x + U(n)] = base_x + first_length * place[x + U(n)]
            place[y + U(n)] = base_y + first_length * place[y + U(n)]
        for n in range(num):
            place[z + U(n)] = place[x + U(n)] + second_length * place[z + U(n)]
            place[w + U(n)] = place[y + U(n)] + second_length * place[w + U(n)]


@kernel
def directions(
    angles: FloatArray, a: np.uint64, num: int, out: FloatArray, x: np.uint64, y: np.uint64
) -> None:
    """Write cosines and sines of a row of angles at a to x and y, exact at multiples of 90°."""
    for n in range(num):
        s, c = exact_sincos(angles[a + U(n)])
        out[x + U(n)] = c
        out[y + U(n)] = s


@kernel
def substeps(
    genes: FloatArray, start: FloatArray, goal: FloatArray, steps: int, out: FloatArray
) -> None:
    """Write the configurations tested on the way start → genes → goal.

    Args:
        genes: (K, 2, N) [rad].
        start: (2,).
        goal: (2,).
        steps: Parts of each segment.
        out: ((K + 1) · steps − 1, 2, N), written.
    """
    last = genes.shape[0]
    for k in range(last + 1):
        for step in range(1, steps + 1):
            row = k * steps + step - 1
            if row == out.shape[0]:
                return
            t = step / steps
            for joint in range(2):
                for n in range(genes.shape[2]):
                    before = start[joint] if k == 0 else genes[k - 1, joint, n]
                    after = goal[joint] if k == last else genes[k, joint, n]
                    out[row, joint, n] = after if step == steps else before + t * (after - before)


@kernel
def longest_link(base_x: float, base_y: float, points: FloatArray) -> float:
    """Return the greatest squared length of a link; infinite where a coordinate is not finite."""
    first = second = 0.0
    wrong = 0
    for k in range(points.shape[0]):
        for n in range(points.shape[2]):
            x, y = points[U(k), U(0), U(n)], points[U(k), U(1), U(n)]
            u, v = x - base_x, y - base_y
            w, z = points[U(k), U(2), U(n)] - x, points[U(k), U(3), U(n)] - y
            one, two = u * u + v * v, w * w + z * z
            wrong += not (one + two < _LARGEST)
            first = one if one > first else first
            second = two if two > second else second
    return math.inf if wrong > 0 else max(first, second)


@kernel
def _threshold(longest: float, distance: float) -> tuple[float, np.float32]:
    """Return the scale 2^-e of tables, and tau, a bound on the error of line functions' products.

    With links ≤ l, bases d apart and u = 2^-24, every line function is at most V = l (d + 3 l). Its
    error is below 5 u V: the vectors are rounded (2 u), their products and differences (2 u, four
    times), sums of at most three terms follow. So the product of two errs by less than (10 + 1) u
    V² + 25 u² V²; taken are 16. The double precision of what is prepared and the sums of rounded
    vectors add less than 2^-45 V².
    """
    exponent = max(math.frexp(max(longest, distance))[1], -_HIGHEST)
    scale = math.ldexp(1.0, -exponent)
    largest = longest * scale * (distance * scale + 3.0 * longest * scale)
    return scale, np.float32(16.0 * _UNIT * largest * largest + _FLOOR)


@kernel
def _fill_table(
    points: FloatArray,
    base_x: float,
    base_y: float,
    other_x: float,
    other_y: float,
    members: IntArray,
    scale: float,
    out: NDArray[np.float32],
) -> None:
    """Write the table of some individuals of a population.

    Lanes without an individual hold line functions that are apart from everything.
    """
    num_configurations = points.shape[0]
    dx, dy = (other_x - base_x) * scale, (other_y - base_y) * scale
    for block in range((len(members) + LANES - 1) // LANES):
        count = min(LANES, len(members) - block * LANES)
        for k in range(num_configurations):
            o = U((block * num_configurations + k) * ROWS * LANES)
            for lane in range(count):
                n, at = U(members[block * LANES + lane]), o + U(lane)
                x, y = points[U(k), U(0), n], points[U(k), U(1), n]
                u, v = (x - base_x) * scale, (y - base_y) * scale
                w, z = (points[U(k), U(2), n] - x) * scale, (points[U(k), U(3), n] - y) * scale
                out[at] = np.float32(u)
                out[at + U(LANES)] = np.float32(v)
                out[at + U(2 * LANES)] = np.float32(w)
                out[at + U(3 * LANES)] = np.float32(z)
                out[at + U(4 * LANES)] = np.float32(u * dy - v * dx)
                out[at + U(5 * LANES)] = np.float32(
                    w * ((other_y - y) * scale) - z * ((other_x - x) * scale)
                )
            for lane in range(count, (count + 7) // 8 * 8):
                for row in range(ROWS):
                    out[o + U(row * LANES + lane)] = np.float32(row >= 4)


@kernel
def _add_crossings(
    one: NDArray[np.float32],
    own: np.uint64,
    two: NDArray[np.float32],
    other: np.uint64,
    num_configurations: int,
    lanes: int,
    tau: np.float32,
    seen: NDArray[np.int32],
) -> None:
    """Count the configurations in which an individual crosses those of a block.

    Args:
        one: Table of the individual's population.
        own: Offset of the individual in it.
        two: Table of the other population.
        other: Offset of the block in it.
        num_configurations: K.
        lanes: Individuals of the block.
        tau: Bound on rounding.
        seen: (LANES,), written: certain crossings + 65536 · possible ones.
    """
    low = -tau
    for n in range(lanes):
        seen[U(n)] = _NONE
    for k in range(num_configurations):
        s, o = own + U(k * ROWS * LANES), other + U(k * ROWS * LANES)
        ax, ay, bx, by = one[s], one[s + U(LANES)], one[s + U(2 * LANES)], one[s + U(3 * LANES)]
        l1d, l2d = one[s + U(4 * LANES)], one[s + U(5 * LANES)]
        for n in range(lanes):
            j = o + U(n)
            vx, vy, wx, wy = two[j], two[j + U(LANES)], two[j + U(2 * LANES)], two[j + U(3 * LANES)]
            m1a, m2a = two[j + U(4 * LANES)], two[j + U(5 * LANES)]
            # cross products, then line functions at the ends of the other's links
            c11, c12 = ax * vy - ay * vx, ax * wy - ay * wx
            c21, c22 = bx * vy - by * vx, bx * wy - by * wx
            l1e, l2e = l1d + c11, l2d + c21
            l1f, l2f = l1e + c12, l2e + c22
            m1b, m2b = m1a - c11, m2a - c12
            m1c, m2c = m1b - c21, m2b - c22
            # per pair of links the greater sign product, of all four pairs the least
            p, q = l1d * l1e, m1a * m1b
            least = p if p > q else q
            p, q = l1e * l1f, m2a * m2b
            r = p if p > q else q
            least = r if r < least else least
            p, q = l2d * l2e, m1b * m1c
            r = p if p > q else q
            least = r if r < least else least
            p, q = l2e * l2f, m2b * m2c
            r = p if p > q else q
            least = r if r < least else least
            seen[U(n)] += (_ONE if least < low else _NONE) + (_MANY if least <= tau else _NONE)


@kernel
def colliding(
    base_1: Point, points_1: FloatArray, i: int, base_2: Point, points_2: FloatArray, j: int, k: int
) -> bool:
    """Return whether two individuals collide in configuration k, by the exact predicates."""
    ax, ay, dx, dy = base_1[0], base_1[1], base_2[0], base_2[1]
    bx, by, cx, cy = points_1[k, 0, i], points_1[k, 1, i], points_1[k, 2, i], points_1[k, 3, i]
    ex, ey, fx, fy = points_2[k, 0, j], points_2[k, 1, j], points_2[k, 2, j], points_2[k, 3, j]
    return (
        touching(ax, ay, bx, by, dx, dy, ex, ey)
        or touching(ax, ay, bx, by, ex, ey, fx, fy)
        or touching(bx, by, cx, cy, dx, dy, ex, ey)
        or touching(bx, by, cx, cy, ex, ey, fx, fy)
    )


@kernel
def _count_rows(
    base_1: Point,
    points_1: FloatArray,
    one: NDArray[np.float32],
    rows: IntArray,
    base_2: Point,
    points_2: FloatArray,
    two: NDArray[np.float32],
    columns: IntArray,
    tau: np.float32,
    counts: NDArray[np.int16],
) -> None:
    """Fill counts[rows, columns] from the tables `one` of population 1 and `two` of the columns."""
    num_configurations, dense = points_1.shape[0], len(columns) == points_2.shape[2]
    seen = np.empty(LANES, dtype=np.int32)
    for row in range(len(rows)):
        i = rows[row]
        own = U((i // LANES) * num_configurations * ROWS * LANES + i % LANES)
        for block in range((len(columns) + LANES - 1) // LANES):
            first = block * LANES
            count = min(LANES, len(columns) - first)
            lanes = (count + 7) // 8 * 8
            other = U(block * num_configurations * ROWS * LANES)
            _add_crossings(one, own, two, other, num_configurations, lanes, tau, seen)
            # pairs that rounding leaves open are counted
            undecided = 0
            if dense:
                for n in range(count):
                    certain, possible = seen[U(n)] & 0xFFFF, seen[U(n)] >> 16
                    counts[U(i), U(first + n)] = certain
                    undecided += certain != possible
            else:
                for n in range(count):
                    certain, possible = seen[U(n)] & 0xFFFF, seen[U(n)] >> 16
                    counts[U(i), U(columns[first + n])] = certain
                    undecided += certain != possible
            if undecided > 0:
                chosen = columns[first : first + count]
                _decide(base_1, points_1, i, base_2, points_2, chosen, seen, counts)


@kernel
def _decide(
    base_1: Point,
    points_1: FloatArray,
    i: int,
    base_2: Point,
    points_2: FloatArray,
    columns: IntArray,
    seen: NDArray[np.int32],
    counts: NDArray[np.int16],
) -> None:
    """Count those pairs of a row anew that rounding leaves open, by the exact predicates."""
    for n in range(len(columns)):
        if (seen[n] >> 16) != (seen[n] & 0xFFFF):
            j, total = columns[n], 0
            for k in range(points_1.shape[0]):
                total += colliding(base_1, points_1, i, base_2, points_2, j, k)
            counts[i, j] = total


@kernel
def sum_counts(counts: NDArray[np.int16], sums_1: IntArray, sums_2: IntArray) -> None:
    """Write the sums of a matrix's rows and columns."""
    for j in range(counts.shape[1]):
        sums_2[U(j)] = 0
    for i in range(counts.shape[0]):
        total = 0
        for j in range(counts.shape[1]):
            total += counts[U(i), U(j)]
        sums_1[U(i)] = total
        for j in range(counts.shape[1]):
            sums_2[U(j)] += counts[U(i), U(j)]


@kernel
def crossings(
    base_1: Point,
    points_1: FloatArray,
    rows: IntArray,
    other_rows: IntArray,
    base_2: Point,
    points_2: FloatArray,
    columns: IntArray,
    counts: NDArray[np.int16],
    sums_1: IntArray,
    sums_2: IntArray,
) -> bool:
    """Bring a matrix of counts up to date, and its sums.

    Args:
        base_1: x, y of the base of arm 1.
        points_1: (K, 4, N1).
        rows: Individuals of population 1 that changed.
        other_rows: Those that did not.
        base_2: x, y of the base of arm 2.
        points_2: (K, 4, N2).
        columns: Individuals of population 2 that changed.
        counts: (N1, N2) int16.
        sums_1: (N1,) int64.
        sums_2: (N2,) int64.

    Returns:
        False, with nothing written, if a coordinate is not finite.
    """
    # scale of the tables, bound on rounding
    (x_1, y_1), (x_2, y_2) = base_1, base_2
    squared = max(longest_link(x_1, y_1, points_1), longest_link(x_2, y_2, points_2))
    apart = (x_2 - x_1) * (x_2 - x_1) + (y_2 - y_1) * (y_2 - y_1)
    if not squared + apart < _LARGEST:
        return False
    scale, tau = _threshold(math.sqrt(squared), math.sqrt(apart))
    num_1, num_2, size = points_1.shape[2], points_2.shape[2], points_1.shape[0] * ROWS * LANES
    one = np.empty((num_1 + LANES - 1) // LANES * size, dtype=np.float32)
    two = np.empty((num_2 + LANES - 1) // LANES * size, dtype=np.float32)
    _fill_table(points_1, x_1, y_1, x_2, y_2, np.arange(num_1), scale, one)
    # changed rows against all columns, then the other rows against changed columns
    if len(rows) > 0:
        everyone = np.arange(num_2)
        _fill_table(points_2, x_2, y_2, x_1, y_1, everyone, scale, two)
        _count_rows(base_1, points_1, one, rows, base_2, points_2, two, everyone, tau, counts)
    if len(columns) > 0 and len(other_rows) > 0:
        _fill_table(points_2, x_2, y_2, x_1, y_1, columns, scale, two)
        _count_rows(base_1, points_1, one, other_rows, base_2, points_2, two, columns, tau, counts)
    sum_counts(counts, sums_1, sums_2)
    return True
