"""Contact of segments in the plane: crossing, or at most a tolerance apart.

Ends of links are sums of rounded sines, so links that touch, or lie on one line, may come out a few
units in the last place apart (sin 45° and sin 135° differ by one). `meeting` therefore counts what
is at most a tolerance apart as contact; `contact_tolerance` bounds that rounding, and exceeds that
of the sides in `meeting`: where a side is in doubt, an end is nearer to a line than the tolerance.
"""

from typing import Any

from evoexp.numeric.compilation import inlined, kernel
from evoexp.numeric.vectors import Vector, magnitude, spread, upper

Line = tuple[Any, Any, Any, Any]
"""Where lines begin, x and y, and from there to their ends: of one arm (numbers) or of eight."""

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
    """Return whether the segments ab and cd cross, or are at most `tolerance` apart.

    They cross if the ends of each lie on both sides of the other's line. Segments on one line have
    rounded sides; those that do not touch are told apart by the boxes around them.
    """
    if (
        min(ax, bx) <= max(cx, dx)
        and min(cx, dx) <= max(ax, bx)
        and min(ay, by) <= max(cy, dy)
        and min(cy, dy) <= max(ay, by)
        and _parts(ax, ay, bx, by, cx, cy, dx, dy)
        and _parts(cx, cy, dx, dy, ax, ay, bx, by)
    ):
        return True
    # segments that do not cross are nearest to each other at an end
    least = min(
        min(squared_distance(ax, ay, bx, by, cx, cy), squared_distance(ax, ay, bx, by, dx, dy)),
        min(squared_distance(cx, cy, dx, dy, ax, ay), squared_distance(cx, cy, dx, dy, bx, by)),
    )
    return least <= tolerance * tolerance


@kernel
def _parts(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> bool:
    """Return whether c and d lie on different sides of the line ab."""
    ux, uy = bx - ax, by - ay
    one = ux * (cy - ay) - uy * (cx - ax)
    two = ux * (dy - ay) - uy * (dx - ax)
    return (one > 0.0 and two < 0.0) or (one < 0.0 and two > 0.0)


@kernel
def squared_distance(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> float:
    """Return the squared distance of the point (x, y) from the segment ab, rounded."""
    ux, uy, x, y = bx - ax, by - ay, x - ax, y - ay
    squared = ux * ux + uy * uy
    t = min(max((ux * x + uy * y) / (squared if squared > 0.0 else 1.0), 0.0), 1.0)
    x, y = x - t * ux, y - t * uy
    return x * x + y * y


@inlined
def sign_product(one: Line, two: Line) -> Vector:
    """Return a number < 0 if the ends of each line are on both sides of the other, else ≥ 0."""
    (x, y, u, v), (x_2, y_2, w, z) = one, two
    dx, dy, across = x_2 - x, y_2 - y, u * z - v * w
    first, second = u * dy - v * dx, w * dy - z * dx
    return upper(first * (first + across), second * (second + across))


@inlined
def squared_from_link(
    x: Vector, y: Vector, c: Vector, s: Vector, length: float, half_width: float
) -> Vector:
    """Return the squared distance of points from the nearer of a link's boundary lines.

    Points are seen from the link's beginning; c and s are cosine and sine of its direction.
    """
    along, off = c * x + s * y, magnitude(c * y - s * x) - half_width
    out = upper(upper(0.0 - along, along - length), spread(0.0))
    return off * off + out * out
