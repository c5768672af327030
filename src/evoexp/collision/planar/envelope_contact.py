"""The contact of two arms with envelopes in one configuration, decided in double precision."""

from typing import NamedTuple

from evoexp.collision.planar.link_crossing_kernels import Point
from evoexp.collision.planar.segment_predicates import contact_tolerance, meeting, squared_distance
from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray


class Envelope(NamedTuple):
    """An arm of two links with its envelope [length unit of the scene]."""

    base: Point  # x, y of its first joint
    lengths: Point  # of its links
    half_width: float  # distance of the boundary lines from their link
    tcp_radius: float  # of the circle around the tip


@kernel
def tolerance_of(arm_1: Envelope, arm_2: Envelope) -> float:
    """Return the `contact_tolerance` of two arms [length unit]."""
    size = 0.0
    for arm in (arm_1, arm_2):
        wide = arm.half_width + arm.tcp_radius
        own = max(abs(arm.base[0]), abs(arm.base[1])) + arm.lengths[0] + arm.lengths[1] + wide
        size = max(size, own)
    return contact_tolerance(size)


@kernel
def boundary(
    arm: Envelope, outline: FloatArray, k: int, n: int, link: int, side: float
) -> tuple[float, float, float, float]:
    """Return the ends (x, y, x, y) of a boundary line: side −1 right of the link, +1 left of it."""
    c, s = outline[k, 4 + 2 * link, n], outline[k, 5 + 2 * link, n]
    x, y = -(side * arm.half_width * s), side * arm.half_width * c
    elbow_x, elbow_y = outline[k, 0, n], outline[k, 1, n]
    if link == 0:
        return arm.base[0] + x, arm.base[1] + y, elbow_x + x, elbow_y + y
    return elbow_x + x, elbow_y + y, outline[k, 2, n] + x, outline[k, 3, n] + y


@kernel
def colliding(
    arm_1: Envelope,
    outline_1: FloatArray,
    i: int,
    arm_2: Envelope,
    outline_2: FloatArray,
    j: int,
    k: int,
) -> bool:
    """Return whether two individuals collide in configuration k, decided in double precision."""
    radius_1, radius_2 = arm_1.tcp_radius, arm_2.tcp_radius
    tolerance = tolerance_of(arm_1, arm_2)
    # circle against circle
    cx, cy, fx, fy = outline_1[k, 2, i], outline_1[k, 3, i], outline_2[k, 2, j], outline_2[k, 3, j]
    if _near((fx - cx) * (fx - cx) + (fy - cy) * (fy - cy), radius_1 + radius_2, tolerance):
        return True
    # boundary lines of arm 1 against the circle and the boundary lines of arm 2
    for one in range(4):
        ax, ay, bx, by = boundary(arm_1, outline_1, k, i, one // 2, 2.0 * (one % 2) - 1.0)
        if _near(squared_distance(ax, ay, bx, by, fx, fy), radius_2, tolerance):
            return True
        for two in range(4):
            dx, dy, ex, ey = boundary(arm_2, outline_2, k, j, two // 2, 2.0 * (two % 2) - 1.0)
            if meeting(ax, ay, bx, by, dx, dy, ex, ey, tolerance):
                return True
    # boundary lines of arm 2 against the circle of arm 1
    for two in range(4):
        dx, dy, ex, ey = boundary(arm_2, outline_2, k, j, two // 2, 2.0 * (two % 2) - 1.0)
        if _near(squared_distance(dx, dy, ex, ey, cx, cy), radius_1, tolerance):
            return True
    return False


@kernel
def _near(squared: float, radius: float, tolerance: float) -> bool:
    """Return whether a squared distance from the centre of a circle is in it; of radius 0: none."""
    return radius > 0.0 and squared <= (radius + tolerance) * (radius + tolerance)
