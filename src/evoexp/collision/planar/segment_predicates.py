"""Contact of segments in the plane: crossing, or at most a tolerance apart.

Ends of links are sums of rounded sines, so links that touch, or lie on one line, may come out a few
units in the last place apart (sin 45° and sin 135° differ by one). `meeting` therefore counts what
is at most a tolerance apart as contact; `contact_tolerance` bounds that rounding, and exceeds that
of the sides in `meeting`: where a side is in doubt, an end is nearer to a line than the tolerance.
"""

from evoexp.numeric.compilation import inlined, kernel
from evoexp.numeric.vectors import Mask, Number, lower, select, upper

Line = tuple[Number, Number, Number, Number]
"""Both ends of a segment, x and y: of one arm (numbers) or of eight (vectors)."""

ROUNDING = 2.0**-46
"""`contact_tolerance` of coordinates up to 1 [-]."""


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


@inlined
def meeting(one: Line, two: Line, tolerance: float) -> Mask:
    """Return whether two segments cross, or are at most `tolerance` apart.

    They cross if the ends of each lie on both sides of the other's line. Segments on one line have
    rounded sides; those that do not touch are told apart by the boxes around them.
    """
    (ax, ay, bx, by), (cx, cy, dx, dy) = one, two
    overlap = (lower(ax, bx) <= upper(cx, dx)) & (lower(cx, dx) <= upper(ax, bx))
    overlap = overlap & (lower(ay, by) <= upper(cy, dy)) & (lower(cy, dy) <= upper(ay, by))
    crossing = overlap & _parts(one, two) & _parts(two, one)
    # segments that do not cross are nearest to each other at an end
    least = lower(
        lower(squared_distance(one, cx, cy), squared_distance(one, dx, dy)),
        lower(squared_distance(two, ax, ay), squared_distance(two, bx, by)),
    )
    return crossing | (least <= tolerance * tolerance)


@inlined
def _parts(line: Line, other: Line) -> Mask:
    """Return whether the ends of the other lie on different sides of a line."""
    (ax, ay, bx, by), (cx, cy, dx, dy) = line, other
    ux, uy = bx - ax, by - ay
    one = ux * (cy - ay) - uy * (cx - ax)
    two = ux * (dy - ay) - uy * (dx - ax)
    return ((one > 0.0) & (two < 0.0)) | ((one < 0.0) & (two > 0.0))


@inlined
def squared_distance(line: Line, x: Number, y: Number) -> Number:
    """Return the squared distance of the point (x, y) from a segment, rounded."""
    ax, ay, bx, by = line
    ux, uy, vx, vy = bx - ax, by - ay, x - ax, y - ay
    squared, along = ux * ux + uy * uy, ux * vx + uy * vy
    t = lower(upper(along / select(squared > 0.0, squared, 1.0), 0.0), 1.0)
    vx, vy = vx - t * ux, vy - t * uy
    return vx * vx + vy * vy


@inlined
def sign_product(one: Line, two: Line) -> Number:
    """Return a number < 0 if the ends of each segment are on both sides of the other, else ≥ 0."""
    (ax, ay, bx, by), (cx, cy, dx, dy) = one, two
    ux, uy, vx, vy, x, y = bx - ax, by - ay, dx - cx, dy - cy, cx - ax, cy - ay
    first, second, across = ux * y - uy * x, vx * y - vy * x, ux * vy - uy * vx
    return upper(first * (first + across), second * (second + across))
