"""Whether an arm collides with eight others: quantities in single precision, and their error.

Arm 1 has its base A, elbow B = A + u1, tip C = B + u2; arm 2 D, E = D + v1, F = E + v2. Two lines
cross where the ends of each lie on different sides of the other. All follows from the cross
products u × v (in angles: the sines of Curkovic et al. 2013, Eq. 12), for circles from dot
products, too, and from what each individual has on its own, which is prepared once
(`arm_pairs.Table`): its two vectors, and where the other's base lies beside and along them.

For lines these are the link vectors, and a configuration of a pair takes 20 additions and
multiplications for its sixteen line functions and 15 more for the sign products of its four link
pairs. For envelopes they are unit vectors, so that line functions are distances [of the tables'
unit], and a configuration takes some 260 operations for sixteen pairs of boundary lines, eight of a
circle and a line, and one of two circles.

Each function returns the least of its quantities: above `tau` all of them say apart, below −tau one
of them says collision, between them rounding leaves it open. tau is a bound on their errors, proved
at `error_bound`.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from evoexp.collision.planar.planar_arms import Arm
from evoexp.numeric.compilation import inlined, kernel
from evoexp.numeric.vectors import LANES, Singles, load_singles, magnitude, select, spread_single
from evoexp.robots.kinematics import U

Block = NDArray[np.float32]

_UNIT = 2.0**-24  # half a unit in the last place of 1, single precision
_FLOOR = 2.0**-100  # above all that underflow can lose
_LOWEST = -1000  # binary exponent of the smallest scene
_ZERO = np.float32(0.0)
_STEP = U(LANES)


class Sizes(NamedTuple):
    """Sizes of two arms in the scale of tables."""

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
def error_bound(
    arm_1: Arm, arm_2: Arm, tolerance: float, enveloped: bool | None
) -> tuple[float, np.float32]:
    """Return the scale 2^-e of tables, and tau.

    With links ≤ l, bases d apart, half widths and radii that sum up to h, and u = 2^-24, every
    distance is at most D = d + 3 l + h; l has room for rounded ends of links, which the tolerance
    t bounds.

    Lines: every line function is at most V = l D. Its error is below 5 u V: the vectors are rounded
    (2 u), their products and differences (2 u, four times), sums of at most three terms follow. So
    the product of two errs by less than (10 + 1) u V² + 25 u² V²; taken are 16. The double
    precision of what is prepared and the sums of rounded vectors add less than 2^-45 V².

    Envelopes: every distance errs by less than 10 u D: the unit vectors' products (4 u), their
    multiples (2 u), and sums of up to six terms. So the product of two errs by less than 21 u D², a
    sum of two squares by less than 32 u D² (40 taken).

    What counts as contact moves distances by t, and so their products by 2 D t + t².
    """
    (x_1, y_1), (x_2, y_2) = arm_1.base, arm_2.base
    (first, second), (third, fourth) = arm_1.lengths, arm_2.lengths
    apart = math.sqrt((x_2 - x_1) * (x_2 - x_1) + (y_2 - y_1) * (y_2 - y_1))
    longest = max(max(first, second), max(third, fourth)) + tolerance
    most = apart + 3.0 * longest + envelope_reach(arm_1, arm_2)
    scale = math.ldexp(1.0, -max(math.frexp(most)[1], _LOWEST))
    largest, near = most * scale, tolerance * scale
    unit, roundings = (longest * scale, 16.0) if enveloped is None else (1.0, 40.0)
    error = roundings * _UNIT * largest * largest + near * (2.0 * largest + near)
    return scale, np.float32(unit * unit * error + _FLOOR)


@kernel
def envelope_reach(arm_1: Arm, arm_2: Arm) -> float:
    """Return a bound on how much nearer envelopes come than lines, half widths and radii."""
    return (arm_1.half_width + arm_2.half_width) + (arm_1.tcp_radius + arm_2.tcp_radius)


@kernel
def sizes_of(arm_1: Arm, arm_2: Arm, scale: float) -> Sizes:
    """Return the sizes of two arms in the scale of tables."""
    (l1, l2), (m1, m2) = arm_1.lengths, arm_2.lengths
    one, two = arm_1.tcp_radius * scale, arm_2.tcp_radius * scale
    half, wide = arm_1.half_width * scale, arm_2.half_width * scale
    return Sizes(
        np.float32(l1 * scale), np.float32(l2 * scale), np.float32(half), np.float32(one * one),
        np.float32(m1 * scale), np.float32(m2 * scale), np.float32(wide), np.float32(two * two),
        np.float32((one + two) * (one + two)),
    )  # fmt: skip


@inlined
def line_products(one: Block, s: np.uint64, two: Block, o: np.uint64) -> Singles:
    """Return the least of the greater sign products of the four pairs of links.

    Args:
        one: Blocks of arm 1.
        s: Place of the individual there.
        two: Blocks of arm 2.
        o: Place of the block there.
    """
    ax, ay, bx, by = one[s], one[s + _STEP], one[s + U(2) * _STEP], one[s + U(3) * _STEP]
    l1d, l2d = one[s + U(4) * _STEP], one[s + U(5) * _STEP]
    vx, vy, wx, wy = _vectors(two, o)
    m1a, m2a = load_singles(two, o + U(4) * _STEP), load_singles(two, o + U(5) * _STEP)
    # cross products, then line functions at the ends of the other's links
    c11, c12 = ax * vy - ay * vx, ax * wy - ay * wx
    c21, c22 = bx * vy - by * vx, bx * wy - by * wx
    l1e, l2e = l1d + c11, l2d + c21
    l1f, l2f = l1e + c12, l2e + c22
    m1b, m2b = m1a - c11, m2a - c12
    m1c, m2c = m1b - c21, m2b - c22
    first = _lesser(_greater(l1d * l1e, m1a * m1b), _greater(l1e * l1f, m2a * m2b))
    second = _lesser(_greater(l2d * l2e, m1b * m1c), _greater(l2e * l2f, m2b * m2c))
    return _lesser(first, second)


@inlined
def envelope_quantities(
    one: Block, s: np.uint64, two: Block, o: np.uint64, sizes: Sizes
) -> Singles:
    """Return the least of sign products of boundary lines, and squared distances of circles.

    The arguments are those of `line_products`, and the sizes of both arms.
    """
    l1, l2, m1, m2 = sizes.l1, sizes.l2, sizes.m1, sizes.m2
    half, wide = sizes.half, sizes.wide
    ax, ay, bx, by = one[s], one[s + _STEP], one[s + U(2) * _STEP], one[s + U(3) * _STEP]
    p1, p2 = one[s + U(4) * _STEP], one[s + U(5) * _STEP]
    g1, g2 = one[s + U(6) * _STEP], one[s + U(7) * _STEP]
    vx, vy, wx, wy = _vectors(two, o)
    r1, r2 = load_singles(two, o + U(4) * _STEP), load_singles(two, o + U(5) * _STEP)
    e1, e2 = load_singles(two, o + U(6) * _STEP), load_singles(two, o + U(7) * _STEP)
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
    least = away * away + q2 * q2 - sizes.both_squared
    least = _boundary_products(spread_single(p1), r1, c11, d11, l1, half, m1, wide, least)
    least = _boundary_products(p12, r2, c12, d12, l1, half, m2, wide, least)
    least = _boundary_products(spread_single(p2), r12, c21, d21, l2, half, m1, wide, least)
    least = _boundary_products(p22, r22, c22, d22, l2, half, m2, wide, least)
    least = _circle_distance(q1, h1, l1, half, sizes.other_squared, least)
    least = _circle_distance(q2, h2, l2, half, sizes.other_squared, least)
    least = _circle_distance(t1, k1, m1, wide, sizes.squared, least)
    return _circle_distance(t2, k2, m2, wide, sizes.squared, least)


@inlined
def _vectors(two: Block, o: np.uint64) -> tuple[Singles, Singles, Singles, Singles]:
    """Return the links' vectors of eight arms 2, x, y of the first and of the second."""
    x, y = load_singles(two, o), load_singles(two, o + _STEP)
    return x, y, load_singles(two, o + U(2) * _STEP), load_singles(two, o + U(3) * _STEP)


@inlined
def _boundary_products(
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
        turned: Distance of the beginning of the first link from the second's line.
        sine: Of the angle from the first link to the second.
        cosine: Likewise.
        length_1: Of the first link.
        half_1: Its half width.
        length_2: Of the second link.
        half_2: Its half width.
        least: The least quantity so far.
    """
    shift, step = half_2 * cosine, length_2 * sine
    twist, fall = half_1 * cosine, length_1 * sine
    left, right = across + shift, across - shift  # of the second's boundary lines
    front, rear = turned + twist, turned - twist
    a, b, c, d = left - half_1, left + half_1, right - half_1, right + half_1
    e, f, g, h = front - half_2, front + half_2, rear - half_2, rear + half_2
    # lines (side of the first, side of the second): (+, +) a e, (−, +) b g, (+, −) c f, (−, −) d h
    least = _lesser(least, _greater(e * (e - fall), a * (a + step)))
    least = _lesser(least, _greater(g * (g - fall), b * (b + step)))
    least = _lesser(least, _greater(f * (f - fall), c * (c + step)))
    return _lesser(least, _greater(h * (h - fall), d * (d + step)))


@inlined
def _circle_distance(
    across: Singles,
    along: Singles,
    length: np.float32,
    half_width: np.float32,
    squared_radius: np.float32,
    least: Singles,
) -> Singles:
    """Lower `least` to distance² − radius² of a circle and a link's nearer boundary line."""
    off = magnitude(across) - half_width
    out = _greater(_greater(_ZERO - along, along - length), spread_single(_ZERO))
    return _lesser(least, off * off + out * out - squared_radius)


@inlined
def _lesser(one: Singles, two: Singles) -> Singles:
    """Return the lesser of two numbers, lane by lane."""
    lesser: Singles = select(two < one, two, one)
    return lesser


@inlined
def _greater(one: Singles, two: Singles) -> Singles:
    """Return the greater of two numbers, lane by lane."""
    greater: Singles = select(one < two, two, one)
    return greater
