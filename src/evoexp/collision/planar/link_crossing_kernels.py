"""Kernels of crossing links: every individual of a population of two-link arms against another's.

Arm 1 has its base A, elbow B = A + u1, tip C = B + u2; arm 2 D, E = D + v1, F = E + v2. Two links
cross where the ends of each lie on different sides of the other's line. All sixteen line functions
follow from the four cross products u × v (in angles: the sines of Curkovic et al. 2013, Eq. 12) and
from what each individual has on its own; the latter is prepared once per individual. So a
configuration of a pair takes 20 additions and multiplications for its line functions and 15 more
for the sign products of its four link pairs.

Those run in single precision, on eight individuals at a time (`crossing_blocks`), and only where no
axis separates them: that spares most. A pair of links is apart where one of its two products is
above `tau`, a bound on all rounding (proved at `_threshold`), and crosses where both are below
−tau; what is neither, two pairs of ten thousand random ones, is decided by the exact predicates. So
counts are the same whatever the vector width, and exact but for contacts that rounding hides:
links nearer than `segment_predicates.contact_tolerance` touch.

100 × 100 pairs in 4 configurations take 10 … 17 µs in a run of a search and 30 where all angles are
random; blocks of 104 individuals, without a look for axes, took 27 in both.

`q` and points are (configurations, rows, individuals), any number of individuals; tables are padded
to blocks.
"""

import math

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.planar.crossing_blocks import (
    MARGIN,
    Table,
    cross_block,
    farthest_of,
    fill_table,
    new_table,
)
from evoexp.collision.planar.segment_predicates import contact_tolerance, meeting
from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.elementary import exact_sincos
from evoexp.numeric.vectors import LANES, least_lane, load, mask_bits, spread, upper
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import U

Point = tuple[float, float]
Members = tuple[Point, FloatArray, Table, IntArray]  # base, points, table and some individuals

MOST_CONFIGURATIONS = 32767  # both counters of a pair share an int32, and counts are int16

_UNIT = 2.0**-24  # half a unit in the last place of 1, single precision
_FLOOR = 2.0**-100  # above all that underflow can lose
_LARGEST = 1e300
_HIGHEST = 1000
_ALL_LANES = 2**LANES - 1


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
        first_length: Of the first link [length unit].
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
    flat, num = borrowed(points.reshape(-1)), U(points.shape[2])
    whole = points.shape[2] // LANES * LANES
    most, sums, undefined = spread(0.0), spread(0.0), spread(0.0)
    longest, wrong = 0.0, 0
    for k in range(points.shape[0]):
        row = U(4 * k) * num
        for n in range(0, whole, LANES):
            place = row + U(n)
            x, y = load(flat, place), load(flat, place + num)
            u, v = x - base_x, y - base_y
            w, z = load(flat, place + U(2) * num) - x, load(flat, place + U(3) * num) - y
            one, two = u * u + v * v, w * w + z * z
            both = one + two
            most, sums = upper(most, upper(one, two)), upper(sums, both)
            undefined = undefined + (both - both)  # NaN from infinity or NaN on
        for n in range(whole, points.shape[2]):
            place = row + U(n)
            x, y = flat[place], flat[place + num]
            u, v = x - base_x, y - base_y
            w, z = flat[place + U(2) * num] - x, flat[place + U(3) * num] - y
            one, two = u * u + v * v, w * w + z * z
            wrong += not (one + two < _LARGEST)
            longest = max(longest, one, two)
    in_range = mask_bits(undefined < 1.0) & mask_bits(sums < _LARGEST)
    if wrong > 0 or in_range != _ALL_LANES:
        return math.inf
    return max(longest, -least_lane(0.0 - most))


@kernel
def _threshold(longest: float, distance: float, tolerance: float) -> tuple[float, np.float32]:
    """Return the scale 2^-e of tables, and tau, a bound on the error of line functions' products.

    With links ≤ l, bases d apart and u = 2^-24, every line function is at most V = l (d + 3 l). Its
    error is below 5 u V: the vectors are rounded (2 u), their products and differences (2 u, four
    times), sums of at most three terms follow. So the product of two errs by less than (10 + 1) u
    V² + 25 u² V²; taken are 16. The double precision of what is prepared and the sums of rounded
    vectors add less than 2^-45 V². A shift by the tolerance t, which makes two links touch that are
    t apart, alters line functions by l t at most, and so products by 2 V l t + l² t².
    """
    exponent = max(math.frexp(max(longest, distance))[1], -_HIGHEST)
    scale = math.ldexp(1.0, -exponent)
    largest = longest * scale * (distance * scale + 3.0 * longest * scale)
    moved = longest * scale * (tolerance * scale)
    shift = moved * (2.0 * largest + moved)
    return scale, np.float32(16.0 * _UNIT * largest * largest + shift + _FLOOR)


@kernel
def tolerance_of(base_1: Point, lengths_1: Point, base_2: Point, lengths_2: Point) -> float:
    """Return the `contact_tolerance` of two arms [length unit]."""
    size_1 = max(abs(base_1[0]), abs(base_1[1])) + lengths_1[0] + lengths_1[1]
    size_2 = max(abs(base_2[0]), abs(base_2[1])) + lengths_2[0] + lengths_2[1]
    return contact_tolerance(max(size_1, size_2))


@kernel
def colliding(
    base_1: Point,
    points_1: FloatArray,
    i: int,
    base_2: Point,
    points_2: FloatArray,
    j: int,
    k: int,
    tolerance: float,
) -> bool:
    """Return whether two individuals collide in configuration k, by the exact predicates."""
    ax, ay, dx, dy = base_1[0], base_1[1], base_2[0], base_2[1]
    bx, by, cx, cy = points_1[k, 0, i], points_1[k, 1, i], points_1[k, 2, i], points_1[k, 3, i]
    ex, ey, fx, fy = points_2[k, 0, j], points_2[k, 1, j], points_2[k, 2, j], points_2[k, 3, j]
    return (
        meeting(ax, ay, bx, by, dx, dy, ex, ey, tolerance)
        or meeting(ax, ay, bx, by, ex, ey, fx, fy, tolerance)
        or meeting(bx, by, cx, cy, dx, dy, ex, ey, tolerance)
        or meeting(bx, by, cx, cy, ex, ey, fx, fy, tolerance)
    )


@kernel
def _count_rows(
    first: Members,
    second: Members,
    tau: np.float32,
    tolerance: float,
    counts: NDArray[np.int16],
) -> None:
    """Fill counts[rows, columns] from the tables of all of population 1 and of the columns."""
    (base_1, points_1, table_1, rows), (base_2, points_2, table_2, columns) = first, second
    one, two = borrowed((table_1, table_2))
    size, num_columns = points_1.shape[0] * LANES, len(columns)
    width = (num_columns + LANES - 1) // LANES * LANES
    most, found = np.empty(size), np.empty(2 * LANES * width, dtype=np.float32)
    # eight rows by eight columns at a time
    for place in range(0, len(rows), LANES):
        group = rows[place : place + LANES]
        farthest_of(one[1], group, size, most)
        for n in range(len(found)):
            found[U(n)] = np.float32(0.0)
        for begin in range(0, num_columns, LANES):
            cross_block(one, group, most, two, begin, tau, found)
        for r in range(len(group)):
            certain, possible = U(r * width), U((r + LANES) * width)
            i, undecided = U(group[r]), 0
            for n in range(num_columns):
                undecided += found[certain + U(n)] != found[possible + U(n)]
            if num_columns == points_2.shape[2]:
                for n in range(num_columns):
                    counts[i, U(n)] = np.int16(found[certain + U(n)])
            else:
                for n in range(num_columns):
                    counts[i, U(columns[U(n)])] = np.int16(found[certain + U(n)])
            # what rounding leaves open, by the exact predicates
            for n in range(num_columns if undecided > 0 else 0):
                if found[certain + U(n)] != found[possible + U(n)]:
                    j, total = columns[n], 0
                    for k in range(points_1.shape[0]):
                        total += colliding(
                            base_1, points_1, group[r], base_2, points_2, j, k, tolerance
                        )
                    counts[i, U(j)] = total


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
    tolerance: float,
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
        tolerance: Of `tolerance_of`; 0: the given points are exact.
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
    scale, tau = _threshold(math.sqrt(squared), math.sqrt(apart), tolerance)
    margin = MARGIN + 2.0 * tolerance * scale  # along x ± y, whose unit is sqrt 2
    num, num_1, num_2 = points_1.shape[0], points_1.shape[2], points_2.shape[2]
    one, two = new_table(num_1, num, num_1 + LANES), new_table(num_2, num, num_2 // LANES + 1)
    fill_table(points_1, base_1, base_2, np.arange(num_1), scale, True, margin, one)
    # changed rows against all columns, then the other rows against changed columns
    for some_rows, some in ((rows, np.arange(num_2)), (other_rows, columns)):
        if len(some_rows) > 0 and len(some) > 0:
            fill_table(points_2, base_2, base_1, some, scale, False, margin, two)
            first, second = (base_1, points_1, one, some_rows), (base_2, points_2, two, some)
            _count_rows(first, second, tau, tolerance, counts)
    sum_counts(counts, sums_1, sums_2)
    return True
