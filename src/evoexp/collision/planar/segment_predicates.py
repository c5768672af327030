"""Exact decisions about segments in the plane: parallel, collinear, touching, of length zero.

`orientation` first takes the plain determinant where its sign is beyond doubt, and else sums
without error (Shewchuk 1997, "Adaptive precision floating-point arithmetic and fast robust
geometric predicates": two-sum, two-product, expansions), from `+ − ×` alone. The answer is that of
rational arithmetic on the given coordinates while these lie below 1e150 and, where not zero, within
280 decades of the greatest.

Ends of links are sums of rounded sines, so links that touch, or lie on one line, may come out a few
units in the last place apart (sin 45° and sin 135° differ by one). `meeting` therefore counts what
is at most a tolerance apart as contact; `contact_tolerance` bounds that rounding.
"""

import math

import numpy as np

from evoexp.numeric.compilation import kernel

ROUNDING = 2.0**-46
"""`contact_tolerance` of coordinates up to 1 [-]."""

_FILTER = 3.3306690738754716e-16  # (3 + 16 u) u with u = 2^-53: relative error of the determinant
_UNDERFLOW = 1e-300  # products that small have lost bits
_SPLITTER = 134217729.0  # 2^27 + 1
_HIGH = 480  # coordinates are brought to 2^480: neither overflow, nor the loss of small tails
_MOST = 1000


@kernel
def orientation(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> float:
    """Return a number > 0, = 0 or < 0 as c lies left of, on or right of the line from a to b.

    It is zero, too, if two of the points coincide.
    """
    left, right = (ax - cx) * (by - cy), (ay - cy) * (bx - cx)
    value = left - right
    if abs(value) > _FILTER * (abs(left) + abs(right)) + _UNDERFLOW:
        return value
    greatest = max(abs(ax), abs(ay), abs(bx), abs(by), abs(cx), abs(cy))
    if greatest == 0.0:
        return 0.0
    s = math.ldexp(1.0, min(_HIGH - math.frexp(greatest)[1], _MOST))
    return _exact(ax * s, ay * s, bx * s, by * s, cx * s, cy * s)


@kernel
def touching(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> bool:
    """Return whether the segments ab and cd have a point in common, their ends included."""
    # boxes around the segments
    if max(ax, bx) < min(cx, dx) or max(cx, dx) < min(ax, bx):
        return False
    if max(ay, by) < min(cy, dy) or max(cy, dy) < min(ay, by):
        return False
    # both ends of one on the same side of the other's line
    c, d = orientation(ax, ay, bx, by, cx, cy), orientation(ax, ay, bx, by, dx, dy)
    if (c > 0.0 and d > 0.0) or (c < 0.0 and d < 0.0):
        return False
    a, b = orientation(cx, cy, dx, dy, ax, ay), orientation(cx, cy, dx, dy, bx, by)
    if (a > 0.0 and b > 0.0) or (a < 0.0 and b < 0.0):
        return False
    # ends of both on different sides
    if ((c > 0.0 and d < 0.0) or (c < 0.0 and d > 0.0)) and (
        (a > 0.0 and b < 0.0) or (a < 0.0 and b > 0.0)
    ):
        return True
    # an end of one on the other
    return (
        (c == 0.0 and _between(ax, ay, bx, by, cx, cy))
        or (d == 0.0 and _between(ax, ay, bx, by, dx, dy))
        or (a == 0.0 and _between(cx, cy, dx, dy, ax, ay))
        or (b == 0.0 and _between(cx, cy, dx, dy, bx, by))
    )


@kernel
def contact_tolerance(size: float) -> float:
    """Return the distance up to which rounding cannot tell two planar arms from touching ones.

    With u = 2^-53, and angles within ±π, the computed end of a link is off by at most 46 u · size:

    - angles by 40 u: 2 π u from degrees to radians, 3 π u between two configurations, 24 u where
      the end-effector's place is given (two arctangents and an arccosine);
    - sine and cosine by 1.2 u each, their multiples and the sums of them by 4 u.

    Two arms are thus off by 92 u · size against each other, and the distance of two segments is
    rounded by less than 20 u · size: 128 u · size = 2^-46 · size exceed both. What touches in exact
    arithmetic always counts; what is more than twice the tolerance apart never does.

    Args:
        size: Greatest coordinate that an end can have, and that of an obstacle, if it is one
            [length unit].
    """
    return ROUNDING * size


@kernel
def meeting(
    ax: float,
    ay: float,
    bx: float,
    by: float,
    cx: float,
    cy: float,
    dx: float,
    dy: float,
    tolerance: float,
) -> bool:
    """Return whether the segments ab and cd touch, or are at most `tolerance` apart."""
    if touching(ax, ay, bx, by, cx, cy, dx, dy):
        return True
    # segments that do not cross are nearest to each other at an end
    least = min(
        min(squared_distance(ax, ay, bx, by, cx, cy), squared_distance(ax, ay, bx, by, dx, dy)),
        min(squared_distance(cx, cy, dx, dy, ax, ay), squared_distance(cx, cy, dx, dy, bx, by)),
    )
    return tolerance > 0.0 and least <= tolerance * tolerance


@kernel
def _between(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> bool:
    """Return whether c, a point of the line ab, lies on the segment."""
    return min(ax, bx) <= cx <= max(ax, bx) and min(ay, by) <= cy <= max(ay, by)


@kernel
def _exact(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> float:
    """Return a number of the determinant's sign, by sums without error."""
    x, x_tail = _difference(ax, cx)
    y, y_tail = _difference(by, cy)
    u, u_tail = _difference(bx, cx)
    v, v_tail = _difference(ay, cy)
    if x_tail == 0.0 and y_tail == 0.0 and u_tail == 0.0 and v_tail == 0.0:
        left, left_tail = _product(x, y)
        right, right_tail = _product(u, v)
        return left - right if left != right else left_tail - right_tail  # rounding is monotone
    terms = np.empty(12)  # ax by − ay bx + bx cy − by cx + cx ay − cy ax
    terms[0], terms[1] = _product(ax, by)
    terms[2], terms[3] = _product(-ay, bx)
    terms[4], terms[5] = _product(bx, cy)
    terms[6], terms[7] = _product(-by, cx)
    terms[8], terms[9] = _product(cx, ay)
    terms[10], terms[11] = _product(-cy, ax)
    for k in range(1, 12):  # terms[:k] is an expansion: its parts do not overlap and grow
        carry = terms[k]
        for e in range(k):
            carry, terms[e] = _sum(terms[e], carry)
        terms[k] = carry
    for k in range(11, -1, -1):
        if terms[k] != 0.0:
            return float(terms[k])
    return 0.0


@kernel
def _sum(a: float, b: float) -> tuple[float, float]:
    """Return a + b rounded, and the rounding error."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@kernel
def _difference(a: float, b: float) -> tuple[float, float]:
    return _sum(a, -b)


@kernel
def _product(a: float, b: float) -> tuple[float, float]:
    """Return a b rounded, and the rounding error (Dekker, Veltkamp)."""
    product = a * b
    c = _SPLITTER * a
    a_high = c - (c - a)
    a_low = a - a_high
    c = _SPLITTER * b
    b_high = c - (c - b)
    b_low = b - b_high
    return product, a_low * b_low - (
        ((product - a_high * b_high) - a_low * b_high) - a_high * b_low
    )


@kernel
def squared_distance(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> float:
    """Return the squared distance of the point (x, y) from the segment ab, rounded."""
    ux, uy, x, y = bx - ax, by - ay, x - ax, y - ay
    squared = ux * ux + uy * uy
    t = min(max((ux * x + uy * y) / (squared if squared > 0.0 else 1.0), 0.0), 1.0)
    x, y = x - t * ux, y - t * uy
    return x * x + y * y
