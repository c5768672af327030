"""Two populations of planar arms against each other: in how many configurations each pair collides.

Curkovic, Jerbic & Stipancic 2013: an individual of one population is judged against every
individual of the other, configuration by configuration (Eqs 4–5). One engine serves lines and
envelopes:

- Most arms are far from each other in most configurations. Along eight axes it is known how far
  each arm 1 and each block of eight arms 2 reach toward each other: where they end before they
  meet, no arm of the block can touch. That spares four of five tests of an arm and a block, at the
  price of a load and a comparison each, or once for eight arms and a block.
- The others are tested in single precision, one arm against a block (`pair_tests`).
- What rounding leaves open, two pairs of ten thousand random ones, is decided by `arms.colliding`.

So counts are the same whatever the vector width, and exact but for contacts that rounding hides:
parallel, collinear, touching and vanishing links are decided exactly, and lines and circles nearer
than `segment_predicates.contact_tolerance` touch.

100 × 100 pairs of lines in 4 configurations take 10 … 17 µs in a run of a search and 30 where all
angles are random; blocks of 104 individuals, without a look for axes, took 27 in both.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.planar.pair_tests import (
    Sizes,
    envelope_quantities,
    envelope_reach,
    error_bound,
    line_products,
    sizes_of,
)
from evoexp.collision.planar.planar_arms import (
    OUTLINE_ROWS,
    POINT_ROWS,
    Arm,
    Point,
    checked,
    colliding,
    tolerance_of,
)
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.vector_rows import Eight, transposed
from evoexp.numeric.vectors import (
    LANES,
    Mask,
    Singles,
    Vector,
    any_lane,
    load,
    load_singles,
    select,
    spread,
    spread_single,
    store,
    store_singles,
    upper,
)
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import U

MOST_CONFIGURATIONS = 32767  # counts are int16
LARGEST = 1e150  # [length unit] coordinates below it are decided exactly

_MARGIN = 2.0**-40
"""Added to reaches, whose sums of at most six rounded numbers below 8 err by less than 2^-46."""

_LINE_ROWS = 6
"""Vectors of a block in a configuration: of both links x, y, then how far beside each of them the
other's base lies; for envelopes, how far along them follows."""

_ONE, _NONE = np.float32(1.0), np.float32(0.0)


class Crossings(NamedTuple):
    """Numbers of configurations in which individuals collide."""

    counts: NDArray[np.int16]  # (N1, N2) of each pair
    # (N1,) of each individual of population 1 over all of population 2: C1 of Eq. 4.
    sums_1: IntArray
    sums_2: IntArray  # (N2,) the other way round


class Table(NamedTuple):
    """A population in blocks of eight, the last one filled up by copies of the last individual.

    Coordinates are scaled, so that none is above 1, and count from the base of arm 1.
    """

    blocks: NDArray[np.float32]  # (blocks · K · rows · LANES,) see `_LINE_ROWS`
    # (individuals · K · LANES,) of arm 1 along x, y, x + y, x − y, then against them
    reaches: FloatArray
    # (blocks · K · LANES,) of those in a block that reach farthest; of arm 2 the other way round
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
        ValueError: If the shapes do not fit, there are more than 32767 configurations, something is
            not finite or above 1e150, or a half width or radius is negative.
    """
    enveloped = one.is_enveloped or two.is_enveloped or None
    rows = (OUTLINE_ROWS,) if enveloped else (POINT_ROWS, OUTLINE_ROWS)
    outlines_1 = checked("outlines_1", outlines_1, *rows)
    outlines_2 = checked("outlines_2", outlines_2, *rows)
    sizes = outlines_1.shape[0], outlines_2.shape[0]
    if sizes[0] != sizes[1]:
        raise ValueError(
            "outlines_1 and outlines_2 must have as many configurations, had "
            f"{sizes[0]} and {sizes[1]}"
        )
    if sizes[0] > MOST_CONFIGURATIONS:
        raise ValueError(
            f"outlines_1: at most {MOST_CONFIGURATIONS} configurations, were {sizes[0]}"
        )
    for name, arm, outlines in (("one", one, outlines_1), ("two", two, outlines_2)):
        numbers = np.array([*arm.base, *arm.lengths, arm.half_width, arm.tcp_radius])
        if not (np.abs(numbers) < LARGEST).all() or not (np.abs(outlines) < LARGEST).all():
            raise ValueError(f"{name} and its outlines must be finite and below 1e150, was {arm}")
        if (numbers[4:] < 0.0).any():
            raise ValueError(
                f"{name}: half_width and tcp_radius must be at least 0, were {arm.half_width} and "
                f"{arm.tcp_radius}"
            )
    one, two = one.in_floats, two.in_floats
    num_1, num_2 = outlines_1.shape[2], outlines_2.shape[2]
    sums = np.zeros(num_1, dtype=np.int64), np.zeros(num_2, dtype=np.int64)
    crossings = Crossings(np.zeros((num_1, num_2), dtype=np.int16), *sums)
    tolerance = tolerance_of(one, two)
    count_pairs(one, outlines_1, two, outlines_2, tolerance, enveloped, *crossings)
    return crossings


@kernel
def count_pairs(
    arm_1: Arm,
    outlines_1: FloatArray,
    arm_2: Arm,
    outlines_2: FloatArray,
    tolerance: float,
    enveloped: bool | None,
    counts: NDArray[np.int16],
    sums_1: IntArray,
    sums_2: IntArray,
) -> None:
    """Write the counts of all pairs, and their sums.

    Args:
        arm_1: Arm of population 1.
        outlines_1: (K, 4 | 8, N1), finite.
        arm_2: Arm of population 2.
        outlines_2: (K, 4 | 8, N2), finite.
        tolerance: Of `tolerance_of`; 0: the given points are exact.
        enveloped: None if both arms are lines: the tests of envelopes are not compiled then.
        counts: (N1, N2) int16.
        sums_1: (N1,) int64.
        sums_2: (N2,) int64.
    """
    scale, tau = error_bound(arm_1, arm_2, tolerance, enveloped)
    sizes = sizes_of(arm_1, arm_2, scale)
    # twice: along x ± y, whose unit is sqrt 2
    margin = _MARGIN + 2.0 * (tolerance + envelope_reach(arm_1, arm_2)) * scale
    dx, dy = arm_2.base[0] - arm_1.base[0], arm_2.base[1] - arm_1.base[1]
    one = _table(arm_1, outlines_1, (dx, dy), 1.0, scale, enveloped)
    two = _table(arm_2, outlines_2, (-dx, -dy), -1.0, scale, enveloped)
    num_1, num_2, num_configurations = len(sums_1), len(sums_2), outlines_1.shape[0]
    width = (num_2 + LANES - 1) // LANES * LANES
    # eight rows of certain collisions, one per arm 1, then eight of possible ones
    tally = np.empty(2 * LANES * width, dtype=np.float32)
    for first in range(0, num_1, LANES):
        count = min(LANES, num_1 - first)
        for n in range(len(tally)):
            tally[U(n)] = _NONE
        for begin in range(0, width, LANES):
            pair = one, first, count, two, begin, num_configurations
            _test_block(*pair, sizes, enveloped, margin, tau, tally)
        for r in range(count):
            certain, possible, i = U(r * width), U((r + LANES) * width), U(first + r)
            undecided = 0
            for n in range(num_2):
                undecided += tally[certain + U(n)] != tally[possible + U(n)]
            for n in range(num_2):
                counts[i, U(n)] = np.int16(tally[certain + U(n)])
            # what rounding leaves open
            for n in range(num_2 if undecided > 0 else 0):
                if tally[certain + U(n)] != tally[possible + U(n)]:
                    total = 0
                    for k in range(num_configurations):
                        total += colliding(
                            arm_1, outlines_1, first + r, arm_2, outlines_2, n, k, tolerance
                        )
                    counts[i, U(n)] = total
    _sum_counts(counts, sums_1, sums_2)


@kernel
def _sum_counts(counts: NDArray[np.int16], sums_1: IntArray, sums_2: IntArray) -> None:
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
def _table(
    arm: Arm,
    outlines: FloatArray,  # (K, 4 | 8, N)
    way: Point,
    toward: float,
    scale: float,
    enveloped: bool | None,
) -> Table:
    """Return the table of a population.

    Args:
        way: From its base to the other's.
        toward: 1 for arm 1; −1 for arm 2, which reaches against the axes.
        scale: A power of two.
        enveloped: See `count_pairs`.
    """
    num_configurations, num_rows, num = outlines.shape
    num_blocks, flat = (num + LANES - 1) // LANES, borrowed(outlines.reshape(-1))
    rows = _LINE_ROWS if enveloped is None else _LINE_ROWS + 2
    blocks = np.empty(num_blocks * num_configurations * rows * LANES, dtype=np.float32)
    reaches = np.empty(num_blocks * LANES * num_configurations * LANES)
    block_reaches, filled = np.empty(num_blocks * num_configurations * LANES), np.empty(LANES)
    dx, dy = way[0] * scale, way[1] * scale
    origin_x, origin_y = (0.0, 0.0) if toward > 0.0 else (-dx, -dy)
    for block in range(num_blocks):
        for k in range(num_configurations):
            row, first = k * num_rows, block * LANES
            x, y = _row(flat, row, num, first, filled), _row(flat, row + 1, num, first, filled)
            tip_x = _row(flat, row + 2, num, first, filled)
            tip_y = _row(flat, row + 3, num, first, filled)
            u, v = (x - arm.base[0]) * scale, (y - arm.base[1]) * scale
            w, z = (tip_x - x) * scale, (tip_y - y) * scale
            a, b, c, d = u, v, w, z
            if enveloped is not None:
                a = _row(flat, row + 4, num, first, filled)
                b = _row(flat, row + 5, num, first, filled)
                c = _row(flat, row + 6, num, first, filled)
                d = _row(flat, row + 7, num, first, filled)
            # both vectors, and the other's base beside and along them, from base and elbow
            o, step = U((block * num_configurations + k) * rows * LANES), U(LANES)
            store_singles(blocks, o, a)
            store_singles(blocks, o + step, b)
            store_singles(blocks, o + U(2) * step, c)
            store_singles(blocks, o + U(3) * step, d)
            store_singles(blocks, o + U(4) * step, a * dy - b * dx)
            store_singles(blocks, o + U(5) * step, c * (dy - v) - d * (dx - u))
            if enveloped is not None:
                store_singles(blocks, o + U(6) * step, a * dx + b * dy)
                store_singles(blocks, o + U(7) * step, c * (dx - u) + d * (dy - v))
            # how far arms reach toward the others, each and all of them
            elbow_x, elbow_y = toward * (origin_x + u), toward * (origin_y + v)
            ends = elbow_x, elbow_y, elbow_x + toward * w, elbow_y + toward * z
            each = transposed(_reaches(toward * origin_x, toward * origin_y, ends))
            most = each[0]
            for lane in range(LANES):
                most = upper(most, each[lane])
                if toward > 0.0:
                    store(reaches, U(((first + lane) * num_configurations + k) * LANES), each[lane])
            store(block_reaches, U((block * num_configurations + k) * LANES), most)
    return Table(blocks, reaches, block_reaches)


@inlined
def _row(flat: FloatArray, row: int, num: int, first: int, filled: FloatArray) -> Vector:
    """Return eight numbers of a row of `num`, from `first` on, copies of the last one behind it."""
    begin = row * num
    if first + LANES <= num:
        return load(flat, U(begin + first))
    for lane in range(LANES):
        filled[U(lane)] = flat[U(begin + min(first + lane, num - 1))]
    return load(filled, U(0))


@inlined
def _reaches(x: float, y: float, ends: tuple[Vector, Vector, Vector, Vector]) -> Eight:
    """Return how far base, elbow and tip reach along x, y, x + y, x − y, then against them."""
    a, b, c, d = ends
    return (
        _most(x, a, c),
        _most(y, b, d),
        _most(x + y, a + b, c + d),
        _most(x - y, a - b, c - d),
        _most(-x, 0.0 - a, 0.0 - c),
        _most(-y, 0.0 - b, 0.0 - d),
        _most(-x - y, 0.0 - a - b, 0.0 - c - d),
        _most(y - x, b - a, d - c),
    )


@inlined
def _most(base: float, elbow: Vector, tip: Vector) -> Vector:
    return upper(upper(elbow, tip), spread(base))


@kernel
def _test_block(
    one: Table,
    first: int,
    count: int,
    two: Table,
    begin: int,
    num_configurations: int,
    sizes: Sizes,
    enveloped: bool | None,
    margin: float,
    tau: np.float32,
    tally: NDArray[np.float32],
) -> None:
    """Count the configurations in which arms 1 of a block collide with those of a block of arms 2.

    Args:
        one: Of population 1.
        first: First arm of its block, a multiple of eight.
        count: How many arms 1 there are.
        two: Of population 2.
        begin: First arm of its block, a multiple of eight.
        num_configurations: K.
        sizes: Of both arms.
        enveloped: See `count_pairs`.
        margin: Distance of reaches above which nothing touches.
        tau: See `pair_tests`.
        tally: See `count_pairs`; those of the block are added.
    """
    one, two, tally = borrowed((one, two, tally))
    rows, lanes, column = U(_LINE_ROWS if enveloped is None else _LINE_ROWS + 2), U(LANES), U(begin)
    size, width = U(num_configurations) * lanes, U(len(tally) // (2 * LANES))
    block_1, block_2 = U(first // LANES) * size, U(begin // LANES) * size
    for k in range(U(0), size, lanes):
        least = 0.0 - (load(two.block_reaches, block_2 + k) + margin)
        if any_lane(load(one.block_reaches, block_1 + k) < least):
            continue  # an axis separates all from all
        for r in range(U(0), U(count), U(1)):
            if any_lane(load(one.reaches, (U(first) + r) * size + k) < least):
                continue  # an axis separates this one from all
            own, other = (block_1 + k) * rows + r, (block_2 + k) * rows
            if enveloped is None:
                quantity = line_products(one.blocks, own, two.blocks, other)
            else:
                quantity = envelope_quantities(one.blocks, own, two.blocks, other, sizes)
            _add_where(quantity < -tau, tally, r * width + column)
            _add_where(quantity <= tau, tally, (r + lanes) * width + column)


@inlined
def _add_where(condition: Mask, tally: NDArray[np.float32], place: np.uint64) -> None:
    """Add 1 to the numbers of a vector where a condition holds."""
    more: Singles = select(condition, spread_single(_ONE), spread_single(_NONE))
    store_singles(tally, place, load_singles(tally, place) + more)
