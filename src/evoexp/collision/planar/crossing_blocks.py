"""Arms of two links in blocks of eight: what their line functions need, and how far they reach.

`link_crossing_kernels` says what line functions are. Coordinates are scaled, so that no link and no
distance of bases is above 1, and count from the base of arm 1.

Most arms are far from each other in most configurations. Along eight axes it is known how far each
arm 1 reaches at most, and how far the arms 2 of a block reach at least: where an arm 1 ends before
a block begins, no arm of the block can touch it. That spares four of five tests of an arm and a
block, at the price of a load and a comparison each, or once for eight arms and a block.
"""

import numpy as np
from numpy.typing import NDArray

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
    lower,
    select,
    spread,
    spread_single,
    store,
    store_singles,
    upper,
)
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import U

ROWS = 6
"""Vectors of a block in a configuration: u1 (x, y), u2 (x, y), and both links' line functions at
the other's base."""

MARGIN = 2.0**-40
"""Added to reaches, whose sums of at most six rounded numbers below 8 err by less than 2^-46."""

_ONE, _NONE = np.float32(1.0), np.float32(0.0)

Point = tuple[float, float]
Table = tuple[NDArray[np.float32], FloatArray]


@kernel
def new_table(num_members: int, num_configurations: int, num_reaches: int) -> Table:
    """Return memory for `fill_table`: the blocks of some individuals, and reaches."""
    num_blocks = (num_members + LANES - 1) // LANES
    blocks = np.empty(num_blocks * num_configurations * ROWS * LANES, dtype=np.float32)
    return blocks, np.empty(num_reaches * num_configurations * LANES)


@kernel
def fill_table(
    points: FloatArray,
    base: Point,
    other: Point,
    members: IntArray,
    scale: float,
    is_first: bool,
    margin: float,
    table: Table,
) -> None:
    """Write the blocks of some individuals of a population, and their reaches.

    The last block is filled up by copies of the last individual.

    Args:
        points: (K, 4, N) elbow x, y, tip x, y.
        base: Of the population's arm.
        other: Base of the other arm.
        scale: A power of two.
        is_first: Whether this is arm 1, whose reaches are written one by one; else those of blocks
            are.
        margin: Added to the reaches of arm 1: `MARGIN`, and what counts as contact.
        table: Written; block by block and configuration by configuration.
    """
    blocks, reaches = borrowed(table)
    num, flat = points.shape[0], borrowed(points.reshape(-1))
    dx, dy = (other[0] - base[0]) * scale, (other[1] - base[1]) * scale
    # the base in the frame of arm 1
    origin_x, origin_y = (0.0, 0.0) if is_first else (-dx, -dy)
    own = np.empty(4 * LANES)
    for block in range((len(members) + LANES - 1) // LANES):
        for k in range(num):
            x, y, tip_x, tip_y = load_arms(flat, points.shape[2], members, block * LANES, k, own)
            u, v = (x - base[0]) * scale, (y - base[1]) * scale
            w, z = (tip_x - x) * scale, (tip_y - y) * scale
            place = block * num + k
            o = U(place * ROWS * LANES)
            store_singles(blocks, o, u)
            store_singles(blocks, o + U(LANES), v)
            store_singles(blocks, o + U(2 * LANES), w)
            store_singles(blocks, o + U(3 * LANES), z)
            store_singles(blocks, o + U(4 * LANES), u * dy - v * dx)
            at_base = w * ((other[1] - y) * scale) - z * ((other[0] - x) * scale)
            store_singles(blocks, o + U(5 * LANES), at_base)
            elbow_x, elbow_y = origin_x + u, origin_y + v
            ends = elbow_x, elbow_y, elbow_x + w, elbow_y + z
            if is_first:
                most = transposed(farthest(origin_x, origin_y, ends, margin))
                store_reaches(reaches, block * LANES, k, num, most)
            else:
                store(
                    reaches,
                    U(place * LANES),
                    least_of(transposed(nearest(origin_x, origin_y, ends))),
                )


@inlined
def load_arms(
    points: FloatArray, num: int, members: IntArray, first: int, k: int, own: FloatArray
) -> tuple[Vector, Vector, Vector, Vector]:
    """Return elbow x, y and tip x, y of eight members from `first` on, in configuration k.

    Args:
        points: See `fill_table`; flat.
        num: Number of individuals there.
        members: See `fill_table`; if they are as many as there are individuals, they are in order.
        first: A multiple of eight.
        own: (32,) scratch.
    """
    o, last = U(4 * k * num + first), len(members) - 1
    if last + 1 == num and first + LANES <= num:
        x, y = load(points, o), load(points, o + U(num))
        return x, y, load(points, o + U(2 * num)), load(points, o + U(3 * num))
    for lane in range(LANES):
        n = members[U(min(first + lane, last))]
        for row in range(4):
            own[U(row * LANES + lane)] = points[U((4 * k + row) * num + n)]
    x, y = load(own, U(0)), load(own, U(LANES))
    return x, y, load(own, U(2 * LANES)), load(own, U(3 * LANES))


@inlined
def spans(x: float, y: float, ends: tuple[Vector, Vector, Vector, Vector]) -> Eight:
    """Return the least and then the greatest x, y, x + y, x − y of base, elbow and tip."""
    a, b, c, d = ends
    low_x, high_x = lower(lower(a, c), spread(x)), upper(upper(a, c), spread(x))
    low_y, high_y = lower(lower(b, d), spread(y)), upper(upper(b, d), spread(y))
    p, q, r = a + b, c + d, spread(x + y)
    low_p, high_p = lower(lower(p, q), r), upper(upper(p, q), r)
    s, t, m = a - b, c - d, spread(x - y)
    low_m, high_m = lower(lower(s, t), m), upper(upper(s, t), m)
    return low_x, low_y, low_p, low_m, high_x, high_y, high_p, high_m


@inlined
def farthest(
    x: float, y: float, ends: tuple[Vector, Vector, Vector, Vector], margin: float
) -> Eight:
    """Return how far arms reach at most along ±x, ±y, ±(x + y), ±(x − y), and a margin more."""
    a, b, c, d, e, f, g, h = spans(x, y, ends)
    return (
        e + margin,
        f + margin,
        g + margin,
        h + margin,
        margin - a,
        margin - b,
        margin - c,
        margin - d,
    )


@inlined
def nearest(x: float, y: float, ends: tuple[Vector, Vector, Vector, Vector]) -> Eight:
    """Return how far arms reach at least along the axes of `farthest`."""
    a, b, c, d, e, f, g, h = spans(x, y, ends)
    return a, b, c, d, 0.0 - e, 0.0 - f, 0.0 - g, 0.0 - h


@inlined
def least_of(vectors: Eight) -> Vector:
    """Return the least of eight vectors, lane by lane."""
    a, b, c, d, e, f, g, h = vectors
    found: Vector = lower(lower(lower(a, b), lower(c, d)), lower(lower(e, f), lower(g, h)))
    return found


@inlined
def store_reaches(reaches: FloatArray, first: int, k: int, num: int, most: Eight) -> None:
    """Write the reaches of eight arms in configuration k of `num`."""
    pitch, place = U(num * LANES), U((first * num + k) * LANES)
    store(reaches, place, most[0])
    store(reaches, place + pitch, most[1])
    store(reaches, place + U(2) * pitch, most[2])
    store(reaches, place + U(3) * pitch, most[3])
    store(reaches, place + U(4) * pitch, most[4])
    store(reaches, place + U(5) * pitch, most[5])
    store(reaches, place + U(6) * pitch, most[6])
    store(reaches, place + U(7) * pitch, most[7])


@kernel
def farthest_of(reaches: FloatArray, group: IntArray, size: int, most: FloatArray) -> None:
    """Write how far any of some arms reaches in each configuration.

    Args:
        reaches: Of arms 1.
        group: The arms, at least one.
        size: Numbers per arm.
        most: (size,) written.
    """
    reaches, most = borrowed((reaches, most))
    for k in range(0, size, LANES):
        found = load(reaches, U(group[0] * size + k))
        for r in range(1, len(group)):
            found = upper(found, load(reaches, U(group[r] * size + k)))
        store(most, U(k), found)


@kernel
def cross_block(
    one: Table,
    group: IntArray,
    most: FloatArray,
    two: Table,
    begin: int,
    tau: np.float32,
    found: NDArray[np.float32],
) -> None:
    """Count the configurations in which some arms 1 cross those of a block of arms 2.

    Args:
        one: Of all arms 1.
        group: Eight arms 1 or fewer.
        most: How far any of them reaches, see `farthest_of`.
        two: Of the arms 2.
        begin: First arm of the block, a multiple of eight.
        tau: Bound on rounding.
        found: Eight rows of certain crossings, one per arm 1, then eight of possible ones; those of
            the block are added.
    """
    (blocks_1, reaches_1), (blocks_2, reaches_2) = borrowed((one, two))
    most, found = borrowed((most, found))
    size, column, lanes = U(len(most)), U(begin), U(LANES)
    width, block = U(len(found) // (2 * LANES)), U(begin // LANES) * size
    for k in range(U(0), size, U(LANES)):
        least = load(reaches_2, block + k)
        if any_lane(load(most, U(k)) < least):
            continue  # an axis separates all from all
        for r in range(U(0), U(len(group)), U(1)):
            i = U(group[r])
            if any_lane(load(reaches_1, i * size + k) < least):
                continue  # an axis separates this one from all
            own = (i // lanes * size + k) * U(ROWS) + i % lanes
            product = least_product(blocks_1, own, blocks_2, (block + k) * U(ROWS))
            add_where(product < -tau, found, r * width + column)
            add_where(product < tau, found, (r + lanes) * width + column)


@inlined
def add_where(condition: Mask, found: NDArray[np.float32], place: np.uint64) -> None:
    """Add 1 to the numbers of a vector where a condition holds."""
    more: Singles = select(condition, spread_single(_ONE), spread_single(_NONE))
    store_singles(found, place, load_singles(found, place) + more)


@inlined
def least_product(
    one: NDArray[np.float32], s: np.uint64, two: NDArray[np.float32], o: np.uint64
) -> Singles:
    """Return the sign products that tell whether an arm crosses those of a block.

    Args:
        one: Blocks of arm 1.
        s: Place of the individual there.
        two: Blocks of arm 2.
        o: Place of the block there.

    Returns:
        Per pair of links the greater sign product, of all four pairs the least: above 0 where arms
        are apart, below where they cross.
    """
    ax, ay = one[s], one[s + U(LANES)]
    bx, by = one[s + U(2 * LANES)], one[s + U(3 * LANES)]
    l1d, l2d = one[s + U(4 * LANES)], one[s + U(5 * LANES)]
    vx, vy = load_singles(two, o), load_singles(two, o + U(LANES))
    wx, wy = load_singles(two, o + U(2 * LANES)), load_singles(two, o + U(3 * LANES))
    m1a, m2a = load_singles(two, o + U(4 * LANES)), load_singles(two, o + U(5 * LANES))
    # cross products, then line functions at the ends of the other's links
    c11, c12 = ax * vy - ay * vx, ax * wy - ay * wx
    c21, c22 = bx * vy - by * vx, bx * wy - by * wx
    l1e, l2e = l1d + c11, l2d + c21
    l1f, l2f = l1e + c12, l2e + c22
    m1b, m2b = m1a - c11, m2a - c12
    m1c, m2c = m1b - c21, m2b - c22
    first = lesser(greater(l1d * l1e, m1a * m1b), greater(l1e * l1f, m2a * m2b))
    second = lesser(greater(l2d * l2e, m1b * m1c), greater(l2e * l2f, m2b * m2c))
    return lesser(first, second)


@inlined
def lesser(one: Singles, two: Singles) -> Singles:
    """Return the lesser of two numbers, lane by lane."""
    found: Singles = select(two < one, two, one)
    return found


@inlined
def greater(one: Singles, two: Singles) -> Singles:
    """Return the greater of two numbers, lane by lane."""
    found: Singles = select(one < two, two, one)
    return found
