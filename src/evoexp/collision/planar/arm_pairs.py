"""Two populations of planar arms against each other: in how many configurations each pair collides.

Curkovic, Jerbic & Stipancic 2013: an individual of one population is judged against every
individual of the other, configuration by configuration (Eqs 4–5). One engine serves lines and
envelopes:

- Most arms are far from each other in most configurations. Along eight axes it is known how far
  each arm 1 and each block of eight arms 2 reach toward each other: where they end before they
  meet, no arm of the block can touch. That spares four of five tests of an arm and a block, at the
  price of a load and a comparison each, or once for eight arms and a block.
- The others are tested one arm against a block, as `meeting` of `planar_arms` says.

So counts are the same whatever the vector width: lines and circles nearer than
`planar_arms.contact_tolerance` touch, parallel, collinear and vanishing ones, too.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.planar.planar_arms import (
    POINT_ROWS,
    Arm,
    Line,
    meeting,
    sign_product,
    squared_distance,
    tolerance_of,
)
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vectors import (
    LANES,
    Mask,
    Number,
    Vector,
    any_lane,
    load,
    lower,
    magnitude,
    select,
    spread,
    store,
    transposed,
    upper,
)
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import U

MOST_CONFIGURATIONS = 32767  # counts are int16
LARGEST = 1e70  # [length unit] of coordinates: products of four do not overflow
MARGIN = 2.0**-40
"""Of the greatest distance, added to reaches, whose sums of at most six numbers are rounded."""

Links = tuple[Line, Line]
"""Lines of both links of an arm, or of eight."""


class Crossings(NamedTuple):
    """Numbers of configurations in which individuals collide."""

    counts: NDArray[np.int16]  # (N1, N2) of each pair
    # (N1,) of each individual of population 1 over all of population 2: C1 of Eq. 4.
    sums_1: IntArray
    sums_2: IntArray  # (N2,) the other way round


class Population(NamedTuple):
    """A population in blocks of eight, the last one filled up by copies of the last individual."""

    arm: Arm
    outlines: FloatArray  # (K · rows · width,) of `planar_arms`, width a multiple of eight
    rows: int  # 4, or 8 with the links' directions
    width: int
    # (width · K · LANES,) of arm 1 along x, y, x + y, x − y, then against them
    reaches: FloatArray
    # (width · K,) of those in a block that reach farthest; of arm 2 the other way round
    block_reaches: FloatArray


def count_collisions(
    one: Arm, outlines_1: FloatArray, two: Arm, outlines_2: FloatArray
) -> Crossings:
    """Count the configurations in which arms collide, for every pair of individuals.

    Args:
        one: Arm of population 1.
        outlines_1: (K, 8, N1) from `Arm.outlines`; four rows are enough if no arm has an envelope.
        two: Arm of population 2.
        outlines_2: (K, 8, N2), the same configurations.

    Raises:
        ValueError: If there are more than 32767 configurations, or something is not finite or above
            1e70.
    """
    outlines_1, outlines_2 = np.ascontiguousarray(outlines_1), np.ascontiguousarray(outlines_2)
    num_configurations = len(outlines_1)
    if num_configurations > MOST_CONFIGURATIONS:
        must = f"at most {MOST_CONFIGURATIONS} configurations"
        raise ValueError(f"outlines_1: {must}, were {num_configurations}")
    for name, arm, outlines in (("one", one, outlines_1), ("two", two, outlines_2)):
        numbers = np.array([*arm.base, *arm.lengths, arm.half_width, arm.tcp_radius])
        if not (np.abs(numbers) < LARGEST).all() or not (np.abs(outlines) < LARGEST).all():
            raise ValueError(f"{name} and its outlines must be finite and below 1e70, was {arm}")
    num_1, num_2 = outlines_1.shape[2], outlines_2.shape[2]
    sums = np.zeros(num_1, dtype=np.int64), np.zeros(num_2, dtype=np.int64)
    crossings = Crossings(np.zeros((num_1, num_2), dtype=np.int16), *sums)
    count_pairs(one, outlines_1, two, outlines_2, tolerance_of(one, two), *crossings)
    return crossings


@kernel
def count_pairs(
    arm_1: Arm,
    outlines_1: FloatArray,
    arm_2: Arm,
    outlines_2: FloatArray,
    tolerance: float,
    counts: NDArray[np.int16],
    sums_1: IntArray,
    sums_2: IntArray,
) -> None:
    """Write the fields of `Crossings`.

    Outlines (K, 4 | 8, N1) and (K, 4 | 8, N2) are finite, and hold directions if an arm has an
    envelope; the tolerance is that of `tolerance_of`.
    """
    bounds = _bounds_of(arm_1, arm_2, tolerance)
    one, two = _population(arm_1, outlines_1, 1.0), _population(arm_2, outlines_2, -1.0)
    num_1, num_2, num_configurations = len(sums_1), len(sums_2), outlines_1.shape[0]
    tally = np.empty(LANES * two.width)  # a row per arm 1
    sums_2[:] = 0
    for first in range(0, num_1, LANES):
        count = min(LANES, num_1 - first)
        for n in range(len(tally)):
            tally[U(n)] = 0.0
        for begin in range(0, two.width, LANES):
            _test_block(one, first, count, two, begin, num_configurations, bounds, tally)
        for r in range(count):
            i, total = U(first + r), 0
            for n in range(num_2):
                hits = np.int16(tally[U(r * two.width + n)])
                counts[i, U(n)] = hits
                sums_2[U(n)] += hits
                total += int(hits)
            sums_1[i] = total


class Bounds(NamedTuple):
    """Bounds of what touches."""

    tolerance: float  # `contact_tolerance` of both arms [length unit]
    margin: float  # distance of reaches above which nothing touches [length unit]
    doubt: float  # sign products of lines that are nearer to 0 are left open [length unit⁴]


@kernel
def _bounds_of(arm_1: Arm, arm_2: Arm, tolerance: float) -> Bounds:
    """Return the bounds of two arms.

    With bases d apart, links ≤ l, half widths and radii of sum h, D = d + 3 l + h is the greatest
    distance. A line function, the cross product of a link and a vector to an end of the other, is
    at most l D; the tolerance t moves it by l t, and so the product of two by l² (2 D t + t²).
    Rounding moves the product by less than 16 · 2^-53 l² D², which is less than l² D t.
    """
    (x_1, y_1), (x_2, y_2) = arm_1.base, arm_2.base
    apart = math.sqrt((x_2 - x_1) * (x_2 - x_1) + (y_2 - y_1) * (y_2 - y_1))
    reach = (arm_1.half_width + arm_2.half_width) + (arm_1.tcp_radius + arm_2.tcp_radius)
    (first, second), (third, fourth) = arm_1.lengths, arm_2.lengths
    longest = max(max(first, second), max(third, fourth)) + tolerance  # with rounded ends
    most = apart + 3.0 * longest + reach
    # contact counts twice: along x ± y, whose unit is √2
    margin = 2.0 * (tolerance + reach) + MARGIN * most
    return Bounds(tolerance, margin, 4.0 * longest * longest * most * tolerance)


@kernel
def _population(arm: Arm, outlines: FloatArray, toward: float) -> Population:
    """Return a population (K, 4 | 8, N) in blocks; arm 2 reaches toward −1, against the axes."""
    num_configurations, rows, num = outlines.shape
    width, flat = (num + LANES - 1) // LANES * LANES, borrowed(outlines.reshape(-1))
    padded = np.empty(num_configurations * rows * width)
    for row in range(num_configurations * rows):
        for n in range(width):
            padded[U(row * width + n)] = flat[U(row * num + min(n, num - 1))]
    reaches = np.empty(width * num_configurations * LANES)
    block_reaches, step = np.empty(width * num_configurations), U(width)
    x, y = toward * arm.base[0], toward * arm.base[1]
    for first in range(0, width, LANES):
        for k in range(num_configurations):
            o = U(k * rows * width + first)
            elbow_x, elbow_y = toward * load(padded, o), toward * load(padded, o + step)
            tip_x = toward * load(padded, o + U(2) * step)
            tip_y = toward * load(padded, o + U(3) * step)
            # how far each arm reaches toward the others, and all of them
            each = transposed(
                (
                    _most(x, elbow_x, tip_x),
                    _most(y, elbow_y, tip_y),
                    _most(x + y, elbow_x + elbow_y, tip_x + tip_y),
                    _most(x - y, elbow_x - elbow_y, tip_x - tip_y),
                    _most(-x, 0.0 - elbow_x, 0.0 - tip_x),
                    _most(-y, 0.0 - elbow_y, 0.0 - tip_y),
                    _most(-x - y, 0.0 - elbow_x - elbow_y, 0.0 - tip_x - tip_y),
                    _most(y - x, elbow_y - elbow_x, tip_y - tip_x),
                )
            )
            most = each[0]
            for lane in range(LANES):
                most = upper(most, each[lane])
                store(reaches, U(((first + lane) * num_configurations + k) * LANES), each[lane])
            store(block_reaches, U(first * num_configurations + k * LANES), most)
    return Population(arm, padded, rows, width, reaches, block_reaches)


@inlined
def _most(base: float, elbow: Vector, tip: Vector) -> Vector:
    return upper(upper(elbow, tip), spread(base))


@kernel
def _test_block(
    one: Population,
    first: int,
    count: int,
    two: Population,
    begin: int,
    num_configurations: int,
    bounds: Bounds,
    tally: FloatArray,
) -> None:
    """Count the configurations in which arms 1 of a block, from `first` on, collide.

    Those of population 2 are the block from `begin` on; the tally is that of `count_pairs`.
    """
    one, two, tally = borrowed((one, two, tally))
    lanes, size, column = U(LANES), U(num_configurations * LANES), U(begin)
    arm_1, arm_2 = one.arm, two.arm
    enveloped = arm_1.half_width + arm_1.tcp_radius + arm_2.half_width + arm_2.tcp_radius > 0.0
    x, y = spread(arm_2.base[0]), spread(arm_2.base[1])
    block_1, block_2 = U(first * num_configurations), U(begin * num_configurations)
    for k in range(num_configurations):
        at = U(k) * lanes
        least = 0.0 - (load(two.block_reaches, block_2 + at) + bounds.margin)
        if any_lane(load(one.block_reaches, block_1 + at) < least):
            continue  # an axis separates all from all
        own, other = U(k * one.rows * one.width + first), U(k * two.rows * two.width + begin)
        for r in range(U(0), U(count), U(1)):
            if any_lane(load(one.reaches, (U(first) + r) * size + at) < least):
                continue  # an axis separates this one from all
            ends_1, ends_2 = _numbers(one, own + r), _vectors(two, other)
            links_1 = (arm_1.base[0], arm_1.base[1], ends_1[0], ends_1[1]), ends_1
            links_2 = (x, y, ends_2[0], ends_2[1]), ends_2
            if enveloped:
                turns_1 = _numbers(one, own + r + U(POINT_ROWS * one.width))
                turns_2 = _vectors(two, other + U(POINT_ROWS * two.width))
                hits = _envelopes_touch(arm_1, links_1, turns_1, arm_2, links_2, turns_2, bounds)
            else:
                hits = _links_touch(links_1, links_2, bounds)
            place = r * U(two.width) + column
            store(tally, place, load(tally, place) + select(hits, spread(1.0), 0.0))


@inlined
def _numbers(one: Population, at: np.uint64) -> Line:
    """Return four rows of the outlines of one arm."""
    rows, step = one.outlines, U(one.width)
    return rows[at], rows[at + step], rows[at + U(2) * step], rows[at + U(3) * step]


@inlined
def _vectors(two: Population, at: np.uint64) -> Line:
    """Return four rows of the outlines of eight arms."""
    rows, step = two.outlines, U(two.width)
    x, y = load(rows, at), load(rows, at + step)
    return x, y, load(rows, at + U(2) * step), load(rows, at + U(3) * step)


@inlined
def _links_touch(one: Links, two: Links, bounds: Bounds) -> Mask:
    (first, second), (third, fourth) = one, two
    least = lower(sign_product(first, third), sign_product(first, fourth))
    least = lower(least, lower(sign_product(second, third), sign_product(second, fourth)))
    hits = least < -bounds.doubt
    if any_lane(magnitude(least) <= bounds.doubt):  # rounding leaves it open
        hits = hits | _links_meet(one, two, bounds.tolerance)
    return hits


@kernel
def _links_meet(one: Links, two: Links, tolerance: float) -> Mask:
    (first, second), (third, fourth) = one, two
    hits = meeting(first, third, tolerance) | meeting(first, fourth, tolerance)
    return hits | meeting(second, third, tolerance) | meeting(second, fourth, tolerance)


@inlined
def _envelopes_touch(
    arm_1: Arm, one: Links, turns_1: Line, arm_2: Arm, two: Links, turns_2: Line, bounds: Bounds
) -> Mask:
    """Return whether a boundary line or the circle of one arm meets one of another.

    Turns are the directions of both links.
    """
    tip_1, tip_2 = (one[1][2], one[1][3]), (two[1][2], two[1][3])
    x, y = tip_2[0] - tip_1[0], tip_2[1] - tip_1[1]
    hits = _is_near(x * x + y * y, arm_1.tcp_radius + arm_2.tcp_radius, bounds.tolerance)
    for side_1 in range(2 if arm_1.half_width > 0.0 else 1):
        lines_1 = _beside(one, turns_1, (2 * side_1 - 1) * arm_1.half_width)
        hits = hits | _meets_circle(lines_1, tip_2, arm_2.tcp_radius, bounds.tolerance)
        for side_2 in range(2 if arm_2.half_width > 0.0 else 1):
            lines_2 = _beside(two, turns_2, (2 * side_2 - 1) * arm_2.half_width)
            hits = hits | _links_touch(lines_1, lines_2, bounds)
            if side_1 == 0:
                hits = hits | _meets_circle(lines_2, tip_1, arm_1.tcp_radius, bounds.tolerance)
    return hits


@inlined
def _beside(links: Links, turns: Line, shift: float) -> Links:
    """Return lines parallel to links; to the left of them where the shift is positive."""
    first, second = links
    return _shifted(first, turns[0], turns[1], shift), _shifted(second, turns[2], turns[3], shift)


@inlined
def _shifted(line: Line, cosine: Number, sine: Number, shift: float) -> Line:
    x, y = shift * sine, shift * cosine
    return line[0] - x, line[1] + y, line[2] - x, line[3] + y


@inlined
def _meets_circle(
    lines: Links, center: tuple[Number, Number], radius: float, tolerance: float
) -> Mask:
    one = squared_distance(lines[0], center[0], center[1])
    two = squared_distance(lines[1], center[0], center[1])
    return _is_near(lower(one, two), radius, tolerance)


@inlined
def _is_near(squared: Vector, radius: float, tolerance: float) -> Mask:
    """Return whether a squared distance from the centre of a circle is in it; of radius 0: none."""
    return squared <= ((radius + tolerance) * (radius + tolerance) if radius > 0.0 else -1.0)
