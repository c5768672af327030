"""Distances of capsules' axes from points, from each other and from obstacles; see `body_tables`.

The distance of a point that moves along a segment to a convex body is a convex function of its
place on the segment: it is least where its slope changes sign. For boxes the slope (of half the
squared distance) is piecewise linear with kinks where a coordinate reaches a face, so the place is
found by evaluating it at six kinks and one linear interpolation. For cylinders it is bracketed in
the same way and found by Newton steps that fall back to bisection, until the last of eight ends.
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.bodies.body_tables import Place
from evoexp.numeric.compilation import inlined
from evoexp.numeric.vectors import (
    Mask,
    Vector,
    any_lane,
    lower,
    magnitude,
    root,
    select,
    spread,
    upper,
)
from evoexp.records import FloatArray
from evoexp.scenarios.obstacles import CYLINDER, HALF_SPACE

SEARCHES = 100  # [-] steps along a segment beside a cylinder at most; some five are taken
SHORT = 1e-15  # [-] of the segment's length: the search ends with a step below it
TINY = 1e-150  # [length unit] components of axes below it count as 0: their squares would underflow


class Segments(NamedTuple):
    """Eight moved axes of capsules: point t of [0, 1] is start + t · axis [length unit]."""

    start: Place  # one end
    axis: Place  # from there to the other


Core = tuple[Vector, Vector, Vector]
"""Half the edges of a box that obstacles are, or that is around cylinders."""


class Bracket(NamedTuple):
    """Where a rising slope changes sign, and its values there."""

    low: Vector
    at_low: Vector
    high: Vector
    at_high: Vector


class Crossing(NamedTuple):
    """The two t at which a segment meets both faces, and those at which it enters and leaves."""

    one: Vector
    two: Vector
    enter: Vector
    leave: Vector


@inlined
def _clamped(value: Vector) -> Vector:
    found: Vector = lower(upper(value, spread(0.0)), spread(1.0))
    return found


@inlined
def _beyond(value: Vector, half: Vector) -> Vector:
    """Return the signed distance of a coordinate outside ±half; 0 inside."""
    return value - lower(upper(value, 0.0 - half), half)


@inlined
def _inverse(value: Vector) -> Vector:
    """Return 1 / value; 0 for values so small that the quotient would overflow."""
    tiny, zero, one = magnitude(value) < TINY, spread(0.0), spread(1.0)
    found: Vector = select(tiny, zero, one) / select(tiny, one, value)
    return found


@inlined
def _slope(t: Vector, segments: Segments, core: Core) -> Vector:
    """Return the slope of half the squared distance of points of segments from boxes."""
    (px, py, pz), (ux, uy, uz) = segments
    return (
        ux * _beyond(px + t * ux, core[0])
        + uy * _beyond(py + t * uy, core[1])
        + uz * _beyond(pz + t * uz, core[2])
    )


@inlined
def _narrowed(t: Vector, segments: Segments, core: Core, bracket: Bracket) -> Bracket:
    slope = _slope(t, segments, core)
    rises = (slope <= 0.0) & (bracket.low < t)
    falls = (slope >= 0.0) & (t < bracket.high)
    return Bracket(
        select(rises, t, bracket.low),
        select(rises, slope, bracket.at_low),
        select(falls, t, bracket.high),
        select(falls, slope, bracket.at_high),
    )


@inlined
def _crossing(p: Vector, u: Vector, half: Vector) -> Crossing:
    """Return where p + t u meets ±half."""
    inverse = _inverse(u)
    one, two = (0.0 - half - p) * inverse, (half - p) * inverse
    still = inverse == 0.0
    within = select(magnitude(p) <= half, spread(np.inf), spread(-np.inf))
    enter, leave = (
        select(still, 0.0 - within, lower(one, two)),
        select(still, within, upper(one, two)),
    )
    return Crossing(one, two, enter, leave)


@inlined
def nearest_on_segments(kind: int, half_edges: FloatArray, segments: Segments) -> Place:
    """Return the points of segments that are nearest to an obstacle's core.

    Segments are seen from its frame. Where one enters the core, the point is the middle of the part
    inside.
    """
    (px, py, pz), (ux, uy, uz) = segments
    core = spread(half_edges[0]), spread(half_edges[1]), spread(half_edges[2])
    if kind == HALF_SPACE:
        t = select(uz > 0.0, spread(0.0), spread(1.0))
    elif kind == CYLINDER:
        t = _beside_cylinder(segments, core)
    else:
        t = _beside_box(segments, core)
    return px + t * ux, py + t * uy, pz + t * uz


@inlined
def _beside_box(segments: Segments, core: Core) -> Vector:
    """Return the t in [0, 1] at which segments are nearest to boxes."""
    (px, py, pz), (ux, uy, uz) = segments
    zero, one = spread(0.0), spread(1.0)
    x, y, z = _crossing(px, ux, core[0]), _crossing(py, uy, core[1]), _crossing(pz, uz, core[2])
    bracket = Bracket(zero, _slope(zero, segments, core), one, _slope(one, segments, core))
    bracket = _narrowed(x.one, segments, core, bracket)
    bracket = _narrowed(x.two, segments, core, bracket)
    bracket = _narrowed(y.one, segments, core, bracket)
    bracket = _narrowed(y.two, segments, core, bracket)
    bracket = _narrowed(z.one, segments, core, bracket)
    bracket = _narrowed(z.two, segments, core, bracket)
    low, at_low, high, at_high = bracket
    steepness = at_low - at_high
    t = low + (high - low) * (at_low / select(steepness == 0.0, one, steepness))
    t = select(at_high <= 0.0, high, t)
    t = select(at_low >= 0.0, low, t)
    enter = upper(upper(x.enter, y.enter), upper(z.enter, zero))
    leave = lower(lower(x.leave, y.leave), lower(z.leave, one))
    place: Vector = select(enter < leave, 0.5 * (enter + leave), _clamped(t))
    return place


@inlined
def _cylinder_slope(t: Vector, segments: Segments, core: Core) -> tuple[Vector, Vector]:
    """Return slope and curvature of half the squared distance of points from cylinders."""
    (px, py, pz), (ux, uy, uz) = segments
    zero = spread(0.0)
    x, y, e = px + t * ux, py + t * uy, _beyond(pz + t * uz, core[2])
    along, flat = x * ux + y * uy, ux * ux + uy * uy
    rho = root(x * x + y * y)
    out = core[0] < rho
    rho = select(out, rho, spread(1.0))
    share = core[0] / rho
    slope = select(out, (1.0 - share) * along, zero) + e * uz
    bend = along / rho
    curvature = select(out, (1.0 - share) * flat + share * bend * bend, zero) + select(
        e == 0.0, zero, uz * uz
    )
    return slope, curvature


@inlined
def _beside_cylinder(segments: Segments, core: Core) -> Vector:
    """Return the t in [0, 1] at which segments are nearest to cylinders."""
    (px, py, pz), (ux, uy, uz) = segments
    zero, one = spread(0.0), spread(1.0)
    flat = ux * ux + uy * uy
    still = upper(magnitude(ux), magnitude(uy)) < TINY
    flat = select(still, one, flat)
    nearest = select(still, zero, (0.0 - (px * ux + py * uy)) / flat)  # to the cylinder's axis
    x, y = px + nearest * ux, py + nearest * uy
    room = core[0] * core[0] - (x * x + y * y)
    reach = select(still, spread(np.inf), root(upper(room, zero) / flat))
    z = _crossing(pz, uz, core[2])
    enter = upper(upper(nearest - reach, z.enter), zero)
    leave = lower(lower(nearest + reach, z.leave), one)
    inside = (room > 0.0) & (enter < leave)
    low, high = zero, one
    for candidate in (zero, one, z.one, z.two, nearest, nearest - reach, nearest + reach):
        kink = _clamped(candidate)
        slope, _ = _cylinder_slope(kink, segments, core)
        low = select(slope <= 0.0, upper(low, kink), low)
        high = select(slope >= 0.0, lower(high, kink), high)
    searched = select(inside, spread(-1.0), high - low)
    t = select(inside, 0.5 * (enter + leave), high)
    return _zero_of_slope(segments, core, low, high, t, searched > 0.0)


@inlined
def _zero_of_slope(
    segments: Segments, core: Core, low: Vector, high: Vector, found: Vector, active: Mask
) -> Vector:
    """Return where slopes within a bracket change sign, and what is found already elsewhere."""
    one, infinite = spread(1.0), spread(np.inf)
    t: Vector = select(active, 0.5 * (low + high), found)
    last, going = high - low, active
    for _ in range(SEARCHES):
        if not any_lane(going):
            break
        slope, curvature = _cylinder_slope(t, segments, core)
        low, high = select(slope <= 0.0, t, low), select(slope >= 0.0, t, high)
        bent = curvature > 0.0
        step = select(bent, slope / select(bent, curvature, one), infinite)
        newton = t - step
        good = (low < newton) & (newton < high) & (magnitude(step) < 0.5 * last)
        following = select(good, newton, 0.5 * (low + high))
        last = magnitude(following - t)
        t = select(going, following, t)
        going = going & (last >= SHORT)
    return t


@inlined
def segment_to_point(segment: Segments, inverse: float, point: Place) -> Vector:
    """Return the distance of a point from a segment, whose squared length is 1 / `inverse`."""
    (px, py, pz), (vx, vy, vz) = segment
    x, y, z = point[0] - px, point[1] - py, point[2] - pz
    t = _clamped((x * vx + y * vy + z * vz) * inverse)
    x, y, z = x - t * vx, y - t * vy, z - t * vz
    distance: Vector = root(x * x + y * y + z * z)
    return distance


@inlined
def segment_to_segments(capsule: FloatArray, segments: Segments, other: float) -> Vector:
    """Return the distances of a constant segment from others.

    The foot of the common perpendicular, clamped to the first segment, is projected to the second,
    clamped, and back: that is the least of a convex function of two places (Ericson 2005, section
    5.1.9). It comes from cross products, whose errors stay harmless when the segments are nearly
    parallel; for parallel ones any foot serves. The capsule is a row of `BodyTables.capsules`; the
    others' squared length is 1 / `other`.
    """
    (px, py, pz), (vx, vy, vz) = segments
    ux, uy, uz, inverse = capsule[3], capsule[4], capsule[5], capsule[7]
    x, y, z = px - capsule[0], py - capsule[1], pz - capsule[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = nx * nx + ny * ny + nz * nz
    foot = (y * vz - z * vy) * nx + (z * vx - x * vz) * ny + (x * vy - y * vx) * nz
    a = _clamped(foot / select(square == 0.0, spread(1.0), square))
    b = ((a * ux - x) * vx + (a * uy - y) * vy + (a * uz - z) * vz) * other
    b = _clamped(b)
    x, y, z = x + b * vx, y + b * vy, z + b * vz
    a = _clamped((x * ux + y * uy + z * uz) * inverse)
    x, y, z = x - a * ux, y - a * uy, z - a * uz
    distance: Vector = root(x * x + y * y + z * z)
    return distance
