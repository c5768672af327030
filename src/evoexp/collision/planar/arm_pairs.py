"""Two populations of planar arms against each other: in how many configurations each pair collides.

Curkovic, Jerbic & Stipancic 2013: an individual of one population is judged against every
individual of the other, configuration by configuration (Eqs 4–5). One engine serves lines and
envelopes:

- Most arms are far from each other in most configurations. Along eight axes it is known how far
  each arm 1 and each block of eight arms 2 reach toward each other: where they end before they
  meet, no arm of the block can touch. That spares four of five tests of an arm and a block, at the
  price of a load and a comparison each, or once for eight arms and a block.
- The others are tested one arm against a block: all pairs of lines by the signs of cross products
  (in angles: the sines of Eq. 12), circles by squared distances.
- What rounding leaves open is decided by `planar_arms.colliding`.

So counts are the same whatever the vector width, and exact but for what rounding hides: lines and
circles nearer than `segment_predicates.contact_tolerance` touch, parallel, collinear and vanishing
ones, too.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.planar.planar_arms import (
    POINT_ROWS,
    Arm,
    Bounds,
    bounds_of,
    colliding,
    tolerance_of,
)
from evoexp.collision.planar.segment_predicates import Line, sign_product, squared_from_link
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vector_rows import transposed
from evoexp.numeric.vectors import (
    LANES,
    Mask,
    Vector,
    any_lane,
    load,
    lower,
    select,
    spread,
    store,
    upper,
)
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import U

MOST_CONFIGURATIONS = 32767  # counts are int16
LARGEST = 1e70  # [length unit] of coordinates: products of four do not overflow


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
    bounds = bounds_of(arm_1, arm_2, tolerance)
    one, two = _population(arm_1, outlines_1, 1.0), _population(arm_2, outlines_2, -1.0)
    num_1, num_2, num_configurations = len(sums_1), len(sums_2), outlines_1.shape[0]
    # eight rows of certain collisions, one per arm 1, then eight of possible ones
    tally = np.empty(2 * LANES * two.width)
    sums_2[:] = 0
    for first in range(0, num_1, LANES):
        count = min(LANES, num_1 - first)
        for n in range(len(tally)):
            tally[U(n)] = 0.0
        for begin in range(0, two.width, LANES):
            _test_block(one, first, count, two, begin, num_configurations, bounds, tally)
        for r in range(count):
            certain, possible, i = U(r * two.width), U((r + LANES) * two.width), U(first + r)
            for n in range(num_2):
                counts[i, U(n)] = np.int16(tally[certain + U(n)])
            for n in range(num_2):
                if tally[certain + U(n)] != tally[possible + U(n)]:  # rounding leaves it open
                    total = 0
                    for k in range(num_configurations):
                        total += colliding(
                            arm_1, outlines_1, first + r, arm_2, outlines_2, n, k, tolerance
                        )
                    counts[i, U(n)] = total
            sums_1[i] = 0
            for n in range(num_2):
                sums_1[i] += counts[i, U(n)]
                sums_2[U(n)] += counts[i, U(n)]


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
            links_1 = _links(arm_1.base[0], arm_1.base[1], *_numbers(one, own + r))
            links_2 = _links(x, y, *_vectors(two, other))
            circles = spread(np.inf)
            if enveloped:
                turns_1 = _numbers(one, own + r + U(POINT_ROWS * one.width))
                turns_2 = _vectors(two, other + U(POINT_ROWS * two.width))
                lines = _boundary_products(arm_1, links_1, turns_1, arm_2, links_2, turns_2)
                circles = _circle_distances(arm_1, links_1, turns_1, arm_2, links_2, turns_2)
            else:
                lines = _sign_products(links_1, links_2)
            hits = (lines < -bounds.lines) | (circles < -bounds.circles)
            near = (lines <= bounds.lines) | (circles <= bounds.circles)
            _add_where(hits, tally, r * U(two.width) + column)
            _add_where(near, tally, (r + lanes) * U(two.width) + column)


@inlined
def _links(base_x: Any, base_y: Any, x: Any, y: Any, tip_x: Any, tip_y: Any) -> tuple[Line, Line]:
    return (base_x, base_y, x - base_x, y - base_y), (x, y, tip_x - x, tip_y - y)


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
def _sign_products(one: tuple[Line, Line], two: tuple[Line, Line]) -> Vector:
    """Return the least sign product of the four pairs of lines."""
    (first, second), (third, fourth) = one, two
    least = lower(sign_product(first, third), sign_product(first, fourth))
    return lower(least, lower(sign_product(second, third), sign_product(second, fourth)))


@inlined
def _boundary_products(
    arm_1: Arm,
    one: tuple[Line, Line],
    turns_1: Line,
    arm_2: Arm,
    two: tuple[Line, Line],
    turns_2: Line,
) -> Vector:
    """Return the least sign product of the boundary lines of two arms, or of links without such."""
    least, half_1, half_2 = spread(np.inf), arm_1.half_width, arm_2.half_width
    for side_1 in range(2 if half_1 > 0.0 else 1):
        first = _beside(one, turns_1, (2 * side_1 - 1) * half_1)
        for side_2 in range(2 if half_2 > 0.0 else 1):
            second = _beside(two, turns_2, (2 * side_2 - 1) * half_2)
            least = lower(least, _sign_products(first, second))
    return least


@inlined
def _beside(links: tuple[Line, Line], turns: Line, shift: float) -> tuple[Line, Line]:
    """Return lines parallel to links."""
    (x, y, u, v), (elbow_x, elbow_y, w, z), (c, s, d, t) = links[0], links[1], turns
    second = (elbow_x - shift * t, elbow_y + shift * d, w, z)
    return (x - shift * s, y + shift * c, u, v), second


@inlined
def _circle_distances(
    arm_1: Arm,
    one: tuple[Line, Line],
    turns_1: Line,
    arm_2: Arm,
    two: tuple[Line, Line],
    turns_2: Line,
) -> Vector:
    """Return the least squared distance, less radius², of circles from lines and each other."""
    (x_1, y_1, u, v), (x_2, y_2, w, z) = one[1], two[1]
    x_1, y_1, x_2, y_2 = x_1 + u, y_1 + v, x_2 + w, y_2 + z  # the tips
    both = arm_1.tcp_radius + arm_2.tcp_radius
    between = (x_2 - x_1) * (x_2 - x_1) + (y_2 - y_1) * (y_2 - y_1) - both * both
    of_second = _circle_distance(arm_1, one, turns_1, x_2, y_2, arm_2.tcp_radius)
    of_first = _circle_distance(arm_2, two, turns_2, x_1, y_1, arm_1.tcp_radius)
    return lower(between, lower(of_second, of_first))


@inlined
def _circle_distance(
    arm: Arm, links: tuple[Line, Line], turns: Line, x: Vector, y: Vector, radius: float
) -> Vector:
    """Return the squared distance, less radius², of a circle around (x, y) from an arm's lines."""
    (elbow_x, elbow_y, _, _), (c, s, d, t), half = links[1], turns, arm.half_width
    one = squared_from_link(x - links[0][0], y - links[0][1], c, s, arm.lengths[0], half)
    two = squared_from_link(x - elbow_x, y - elbow_y, d, t, arm.lengths[1], half)
    return lower(one, two) - radius * radius


@inlined
def _add_where(condition: Mask, tally: FloatArray, place: np.uint64) -> None:
    """Add 1 to the numbers of a vector where a condition holds."""
    more: Vector = select(condition, spread(1.0), spread(0.0))
    store(tally, place, load(tally, place) + more)
