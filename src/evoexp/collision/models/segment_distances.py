"""Distances of capsules' axes, in encounters; see `primitive_distances`.

The distance of a point that moves along a segment to a convex body is a convex function of its
place on the segment: it is least where its slope changes sign. For boxes the slope (of half the
squared distance) is piecewise linear with kinks where a coordinate reaches a face, so the place is
found by evaluating it at six kinks and one linear interpolation. For cylinders it is bracketed in
the same way and found by Newton steps that fall back to bisection.
"""

import numpy as np

from evoexp.collision.models.primitive_distances import AXES, CORE, STARTS, VALUE, W
from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray
from evoexp.robots.kinematics import U

SEARCHES = 100  # [-] steps along a segment beside a cylinder at most; some five are taken
SHORT = 1e-15  # [-] of the segment's length: the search ends with a step below it
TINY = 1e-150  # [length unit] components of axes below it count as 0: their squares would underflow


@kernel
def _clamped(value: float, least: float, most: float) -> float:
    return min(max(value, least), most)


@kernel
def _beyond(value: float, half: float) -> float:
    """Return the signed distance of a coordinate outside ±half; 0 inside."""
    return value - min(max(value, -half), half)


@kernel
def _inverse(value: float) -> float:
    """Return 1 / value; 0 for values so small that the quotient would overflow."""
    tiny = abs(value) < TINY
    return (0.0 if tiny else 1.0) / (1.0 if tiny else value)


@kernel
def _slope(
    t: float,
    px: float,
    py: float,
    pz: float,
    ux: float,
    uy: float,
    uz: float,
    a: float,
    b: float,
    c: float,
) -> float:
    """Return the slope of half the squared distance of the point p + t u from a box."""
    return (
        ux * _beyond(px + t * ux, a) + uy * _beyond(py + t * uy, b) + uz * _beyond(pz + t * uz, c)
    )


@kernel
def _narrowed(
    t: float, slope: float, low: float, low_slope: float, high: float, high_slope: float
) -> tuple[float, float, float, float]:
    """Return a bracket of the zero of a rising slope, narrowed by one more value of the slope."""
    rises = slope <= 0.0 and t > low
    falls = slope >= 0.0 and t < high
    return (
        t if rises else low,
        slope if rises else low_slope,
        t if falls else high,
        slope if falls else high_slope,
    )


@kernel
def _crossing(p: float, u: float, inverse: float, half: float) -> tuple[float, float, float, float]:
    """Return the two t at which p + t u meets ±half, and those at which it enters and leaves."""
    one, two = (-half - p) * inverse, (half - p) * inverse
    within = np.inf if abs(p) <= half else -np.inf
    enter = -within if inverse == 0.0 else min(one, two)
    leave = within if inverse == 0.0 else max(one, two)
    return one, two, enter, leave


@kernel
def segment_to_boxes(width: int, radius: float, work: FloatArray) -> None:
    """Lower VALUE to the signed distances of the segments at STARTS, AXES to thickened boxes.

    The segments have a radius. Where a segment enters a box, the distance is that of the middle of
    the part inside: not above 0.
    """
    for n in range(width):
        s, e, k = STARTS + U(n), AXES + U(n), CORE + U(n)
        px, py, pz = work[s], work[s + W], work[s + U(2) * W]
        ux, uy, uz = work[e], work[e + W], work[e + U(2) * W]
        a, b, c = work[k], work[k + W], work[k + U(2) * W]
        x1, x2, x_in, x_out = _crossing(px, ux, _inverse(ux), a)
        y1, y2, y_in, y_out = _crossing(py, uy, _inverse(uy), b)
        z1, z2, z_in, z_out = _crossing(pz, uz, _inverse(uz), c)
        low, high = 0.0, 1.0
        at_low, at_high = (
            _slope(0.0, px, py, pz, ux, uy, uz, a, b, c),
            _slope(1.0, px, py, pz, ux, uy, uz, a, b, c),
        )
        slope = _slope(x1, px, py, pz, ux, uy, uz, a, b, c)
        low, at_low, high, at_high = _narrowed(x1, slope, low, at_low, high, at_high)
        slope = _slope(x2, px, py, pz, ux, uy, uz, a, b, c)
        low, at_low, high, at_high = _narrowed(x2, slope, low, at_low, high, at_high)
        slope = _slope(y1, px, py, pz, ux, uy, uz, a, b, c)
        low, at_low, high, at_high = _narrowed(y1, slope, low, at_low, high, at_high)
        slope = _slope(y2, px, py, pz, ux, uy, uz, a, b, c)
        low, at_low, high, at_high = _narrowed(y2, slope, low, at_low, high, at_high)
        slope = _slope(z1, px, py, pz, ux, uy, uz, a, b, c)
        low, at_low, high, at_high = _narrowed(z1, slope, low, at_low, high, at_high)
        slope = _slope(z2, px, py, pz, ux, uy, uz, a, b, c)
        low, at_low, high, at_high = _narrowed(z2, slope, low, at_low, high, at_high)
        steepness = at_low - at_high
        t = low + (high - low) * (at_low / (1.0 if steepness == 0.0 else steepness))
        t = high if at_high <= 0.0 else t
        t = low if at_low >= 0.0 else t
        enter, leave = max(max(x_in, y_in), max(z_in, 0.0)), min(min(x_out, y_out), min(z_out, 1.0))
        t = 0.5 * (enter + leave) if enter < leave else _clamped(t, 0.0, 1.0)
        u, v, w = abs(px + t * ux) - a, abs(py + t * uy) - b, abs(pz + t * uz) - c
        p, q, r = max(u, 0.0), max(v, 0.0), max(w, 0.0)
        signed = np.sqrt(p * p + q * q + r * r) + min(max(u, max(v, w)), 0.0)
        found, best = signed - (work[k + U(3) * W] + radius), work[VALUE + U(n)]
        work[VALUE + U(n)] = found if found < best else best


@kernel
def _cylinder_slope(
    t: float,
    px: float,
    py: float,
    pz: float,
    ux: float,
    uy: float,
    uz: float,
    radius: float,
    half: float,
) -> tuple[float, float]:
    """Return slope and curvature of half the squared distance of p + t u from a cylinder."""
    x, y, e = px + t * ux, py + t * uy, _beyond(pz + t * uz, half)
    along, flat = x * ux + y * uy, ux * ux + uy * uy
    rho = np.sqrt(x * x + y * y)
    out = rho > radius
    rho = rho if out else 1.0
    share = radius / rho
    slope = ((1.0 - share) * along if out else 0.0) + e * uz
    bend = along / rho
    curvature = ((1.0 - share) * flat + share * bend * bend if out else 0.0) + (
        uz * uz if e != 0.0 else 0.0
    )
    return slope, curvature


@kernel
def segment_to_cylinders(width: int, radius: float, work: FloatArray) -> None:
    """Lower VALUE to the signed distances of the segments at STARTS, AXES to cylinders.

    This is no vector code, because the searches differ in length.
    """
    for n in range(width):
        s, e, k = STARTS + U(n), AXES + U(n), CORE + U(n)
        px, py, pz = work[s], work[s + W], work[s + U(2) * W]
        ux, uy, uz = work[e], work[e + W], work[e + U(2) * W]
        t = _beside_cylinder(px, py, pz, ux, uy, uz, work[k], work[k + W])
        x, y, z = px + t * ux, py + t * uy, pz + t * uz
        u, w = np.sqrt(x * x + y * y) - work[k], abs(z) - work[k + W]
        p, r = max(u, 0.0), max(w, 0.0)
        work[VALUE + U(n)] = min(
            work[VALUE + U(n)], np.sqrt(p * p + r * r) + min(max(u, w), 0.0) - radius
        )


@kernel
def _beside_cylinder(
    px: float, py: float, pz: float, ux: float, uy: float, uz: float, radius: float, half: float
) -> float:
    """Return the t in [0, 1] at which p + t u is nearest to a cylinder.

    Where the segment enters the cylinder, t is the middle of the part inside.
    """
    flat = ux * ux + uy * uy
    still = max(abs(ux), abs(uy)) < TINY
    flat = 1.0 if still else flat
    nearest = 0.0 if still else -(px * ux + py * uy) / flat  # to the cylinder's axis
    x, y = px + nearest * ux, py + nearest * uy
    room = radius * radius - (x * x + y * y)
    reach = np.inf if still else np.sqrt(max(room, 0.0) / flat)
    z1, z2, z_in, z_out = _crossing(pz, uz, _inverse(uz), half)
    enter, leave = max(max(nearest - reach, z_in), 0.0), min(min(nearest + reach, z_out), 1.0)
    if room > 0.0 and enter < leave:
        return 0.5 * (enter + leave)
    low, high = 0.0, 1.0
    for candidate in (0.0, 1.0, z1, z2, nearest, nearest - reach, nearest + reach):
        kink = _clamped(candidate, 0.0, 1.0)
        slope, _ = _cylinder_slope(kink, px, py, pz, ux, uy, uz, radius, half)
        low = max(low, kink) if slope <= 0.0 else low
        high = min(high, kink) if slope >= 0.0 else high
    if low >= high:
        return high
    return _zero_of_slope(px, py, pz, ux, uy, uz, radius, half, low, high)


@kernel
def _zero_of_slope(
    px: float,
    py: float,
    pz: float,
    ux: float,
    uy: float,
    uz: float,
    radius: float,
    half: float,
    low: float,
    high: float,
) -> float:
    t, last = 0.5 * (low + high), high - low
    for _ in range(SEARCHES):
        slope, curvature = _cylinder_slope(t, px, py, pz, ux, uy, uz, radius, half)
        low = t if slope <= 0.0 else low
        high = t if slope >= 0.0 else high
        step = slope / curvature if curvature > 0.0 else np.inf
        good = low < t - step < high and abs(step) < 0.5 * last
        following = t - step if good else 0.5 * (low + high)
        last = abs(following - t)
        t = following
        if last < SHORT:
            break
    return t


@kernel
def segment_to_half_spaces(width: int, radius: float, work: FloatArray) -> None:
    """Lower VALUE to the signed distances of the segments' lower ends to half-spaces."""
    for n in range(width):
        z, w, best = (
            work[STARTS + U(2) * W + U(n)],
            work[AXES + U(2) * W + U(n)],
            work[VALUE + U(n)],
        )
        found = (z if w > 0.0 else z + w) - radius
        work[VALUE + U(n)] = found if found < best else best


@kernel
def segment_to_points(
    width: int, capsule: FloatArray, p: np.uint64, both: float, work: FloatArray
) -> None:
    """Lower VALUE to the distance of one constant segment from the points at offset p, less `both`.

    Args:
        width: Encounters.
        capsule: (8,) one end of its axis, from there to the other end, radius, 1 / squared length.
        p: Offset in `work`.
        both: Sum of both radii.
        work: The points.
    """
    sx, sy, sz = capsule[0], capsule[1], capsule[2]
    vx, vy, vz, inverse = capsule[3], capsule[4], capsule[5], capsule[7]
    for n in range(width):
        k = p + U(n)
        x, y, z = work[k] - sx, work[k + W] - sy, work[k + U(2) * W] - sz
        t = (x * vx + y * vy + z * vz) * inverse
        t = t if t > 0.0 else 0.0
        t = t if t < 1.0 else 1.0
        x, y, z = x - t * vx, y - t * vy, z - t * vz
        found, best = np.sqrt(x * x + y * y + z * z) - both, work[VALUE + U(n)]
        work[VALUE + U(n)] = found if found < best else best


@kernel
def segments_to_point(
    width: int, point: FloatArray, inverse: float, both: float, work: FloatArray
) -> None:
    """Lower VALUE to the distance of a constant point from the segments, less `both`."""
    cx, cy, cz = point[0], point[1], point[2]
    for n in range(width):
        s, e = STARTS + U(n), AXES + U(n)
        x, y, z = cx - work[s], cy - work[s + W], cz - work[s + U(2) * W]
        vx, vy, vz = work[e], work[e + W], work[e + U(2) * W]
        t = (x * vx + y * vy + z * vz) * inverse
        t = t if t > 0.0 else 0.0
        t = t if t < 1.0 else 1.0
        x, y, z = x - t * vx, y - t * vy, z - t * vz
        found, best = np.sqrt(x * x + y * y + z * z) - both, work[VALUE + U(n)]
        work[VALUE + U(n)] = found if found < best else best


@kernel
def segment_to_segments(
    width: int, capsule: FloatArray, other: float, both: float, work: FloatArray
) -> None:
    """Lower VALUE to the distance of a constant segment from those at STARTS, AXES, less `both`.

    The foot of the common perpendicular, clamped to the first segment, is projected to the second,
    clamped, and back: that is the least of a convex function of two places (Ericson 2005, section
    5.1.9). It comes from cross products, whose errors stay harmless when the segments are nearly
    parallel; for parallel ones any foot serves.

    Args:
        width: Encounters.
        capsule: See `segment_to_points`.
        other: 1 / squared length of the other segment.
        both: Sum of both radii.
        work: STARTS, AXES.
    """
    sx, sy, sz = capsule[0], capsule[1], capsule[2]
    ux, uy, uz, inverse = capsule[3], capsule[4], capsule[5], capsule[7]
    for n in range(width):
        s, e = STARTS + U(n), AXES + U(n)
        x, y, z = work[s] - sx, work[s + W] - sy, work[s + U(2) * W] - sz
        vx, vy, vz = work[e], work[e + W], work[e + U(2) * W]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        square = nx * nx + ny * ny + nz * nz
        foot = (y * vz - z * vy) * nx + (z * vx - x * vz) * ny + (x * vy - y * vx) * nz
        a = foot / (1.0 if square == 0.0 else square)
        a = a if a > 0.0 else 0.0
        a = a if a < 1.0 else 1.0
        b = ((a * ux - x) * vx + (a * uy - y) * vy + (a * uz - z) * vz) * other
        b = b if b > 0.0 else 0.0
        b = b if b < 1.0 else 1.0
        x, y, z = x + b * vx, y + b * vy, z + b * vz
        a = (x * ux + y * uy + z * uz) * inverse
        a = a if a > 0.0 else 0.0
        a = a if a < 1.0 else 1.0
        x, y, z = x - a * ux, y - a * uy, z - a * uz
        found, best = np.sqrt(x * x + y * y + z * z) - both, work[VALUE + U(n)]
        work[VALUE + U(n)] = found if found < best else best
