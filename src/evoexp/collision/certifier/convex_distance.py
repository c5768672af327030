"""Bounds of the distance of two convex bodies: closed forms where there are some, GJK elsewhere.

Gilbert, Johnson & Keerthi 1988. Every direction v gives a lower bound, the gap between the two
planes across v that support the bodies; every point found in the difference of the bodies gives an
upper bound. Both hold whenever the iteration stops, so it stops as soon as they decide the caller's
question. These distances decide no verdict; coal's do. They stand here because a verdict on a Panda
in convex pieces takes 4.5 to 22 times as long where coal settles the same intervals, and 8 to 66
times where it takes part in the whole branch and bound (Pinocchio's batches, warm starts).

A body's frame in the world is a row of twelve numbers, as in `motion_bounds`.
"""

import math

import numpy as np

from evoexp.collision.body_table import (
    BOX,
    CONE,
    CYLINDER,
    ELLIPSOID,
    HALF_SPACE,
    HULL,
    SEGMENT,
    BodyTable,
)
from evoexp.collision.certifier.simplex import closest_of_simplex
from evoexp.numeric.compilation import inlined
from evoexp.records import FloatArray

MAX_ITERATIONS = 100

# [-] of the upper bound above `enough`: gap at which GJK ends where `need` is out of reach
LOOSE = 0.05

# [-] of the distance: gap between the bounds at which GJK ends where the distance itself is wanted
CONVERGED = 1e-13


@inlined
def distance_bounds(
    bodies: BodyTable,
    world: FloatArray,
    one: int,
    two: int,
    need: float,
    enough: float,
    converged: float,
    normal: FloatArray,
    simplex: FloatArray,
    scratch: FloatArray,
) -> tuple[float, float]:
    """Return a lower and an upper bound of the distance of two bodies [length unit].

    The two are equal up to rounding unless the iteration stops early.

    Args:
        world: (bodies, 12) frames of the bodies.
        one: Index of a body.
        two: Index of the other.
        need: The iteration stops when the lower bound reaches it.
        enough: The iteration stops when the upper bound is below it or, where `need` is out of
            reach, when the bounds are `LOOSE` apart. −inf: neither.
        converged: The iteration stops when the bounds differ by this part of the distance of the
            cores [-].
        normal: (3,) a direction to begin with, from the second to the first; the direction across
            which the lower bound was found is written back.
        simplex: (4, 3) scratch.
        scratch: (3, 3) scratch.
    """
    kind, size = bodies.kind, bodies.size
    radii = bodies.radius[one] + bodies.radius[two]
    # a half-space and another body: the body's lowest point above the plane
    if kind[one] == HALF_SPACE or kind[two] == HALF_SPACE:
        plane, body = (one, two) if kind[one] == HALF_SPACE else (two, one)
        x, y, z = world[plane, 2], world[plane, 5], world[plane, 8]
        normal[0], normal[1], normal[2] = -x, -y, -z
        _support(bodies, world, body, normal, 1.0, scratch[0])
        distance = x * (scratch[0, 0] - world[plane, 9]) + y * (scratch[0, 1] - world[plane, 10])
        distance += z * (scratch[0, 2] - world[plane, 11]) - radii
        sign = -1.0 if plane == one else 1.0
        normal[0], normal[1], normal[2] = sign * x, sign * y, sign * z
        return distance, distance
    # two balls or capsules: closed form
    if kind[one] == SEGMENT and kind[two] == SEGMENT:
        distance = segment_distance(world[one], size[one, 0], world[two], size[two, 0], normal)
        return distance - radii, distance - radii
    # the balls around both bodies are far enough apart
    x, y = world[one, 9] - world[two, 9], world[one, 10] - world[two, 10]
    z = world[one, 11] - world[two, 11]
    apart = np.sqrt(x * x + y * y + z * z) - bodies.ball[one] - bodies.ball[two]
    if apart >= need:
        return apart, np.inf
    low, high = _gjk(
        bodies, world, one, two, need + radii, enough + radii, converged, normal, simplex, scratch
    )
    return low - radii, high - radii


@inlined
def _gjk(
    bodies: BodyTable,
    world: FloatArray,
    one: int,
    two: int,
    need: float,
    enough: float,
    converged: float,
    v: FloatArray,
    simplex: FloatArray,
    scratch: FloatArray,
) -> tuple[float, float]:
    """Return `distance_bounds` of the two cores, beginning with the direction v."""
    here, there = scratch[0], scratch[1]
    count, low, high = 0, -np.inf, np.inf
    length = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    if not length > 0.0:
        v[0], v[1], v[2], length = 1.0, 0.0, 0.0, 1.0
    for _ in range(MAX_ITERATIONS):
        # the support point of the difference against v, and the gap across v
        _support(bodies, world, one, v, -1.0, here)
        _support(bodies, world, two, v, 1.0, there)
        x, y, z = here[0] - there[0], here[1] - there[1], here[2] - there[2]
        gap = (x * v[0] + y * v[1] + z * v[2]) / length
        low = max(low, gap)
        # the bounds decide, or the simplex cannot grow any more
        if low >= need or high < enough or _holds(simplex, count, x, y, z):
            break
        if count > 0 and high - low <= converged * high:
            break
        if enough > -np.inf and high < need and high - low <= LOOSE * (high - enough):
            break
        # the point of the grown simplex that is closest to the origin is the next direction
        simplex[count, 0], simplex[count, 1], simplex[count, 2] = x, y, z
        count = closest_of_simplex(simplex, count + 1, scratch[2])
        x, y, z = scratch[2, 0], scratch[2, 1], scratch[2, 2]
        squared = x * x + y * y + z * z
        if count == 4 or squared == 0.0:
            return min(low, 0.0), 0.0
        if squared >= high * high:
            break
        high = length = np.sqrt(squared)
        v[0], v[1], v[2] = x, y, z
    return min(low, high), high


@inlined
def _holds(simplex: FloatArray, count: int, x: float, y: float, z: float) -> bool:
    """Return whether a point is one of the simplex's corners."""
    found = False
    for k in range(count):
        found = found or (simplex[k, 0] == x and simplex[k, 1] == y and simplex[k, 2] == z)
    return found


@inlined
def _support(
    bodies: BodyTable,
    world: FloatArray,
    body: int,
    direction: FloatArray,
    sign: float,
    out: FloatArray,
) -> None:
    """Write the farthest point of a body's core in a direction times a sign, in the world."""
    kind, size = bodies.kind[body], bodies.size
    points = bodies.corner_points
    dx, dy, dz = sign * direction[0], sign * direction[1], sign * direction[2]
    w = world[body]
    z = w[2] * dx + w[5] * dy + w[8] * dz
    a, b, c = size[body, 0], size[body, 1], size[body, 2]
    if kind == SEGMENT:
        e = a if z > 0.0 else -a
        out[0], out[1], out[2] = w[9] + w[2] * e, w[10] + w[5] * e, w[11] + w[8] * e
        return
    # the direction, then the point, in the core's own frame
    x, y = w[0] * dx + w[3] * dy + w[6] * dz, w[1] * dx + w[4] * dy + w[7] * dz
    if kind == BOX:
        x, y, z = (a if x > 0.0 else -a), (b if y > 0.0 else -b), (c if z > 0.0 else -c)
    elif kind == ELLIPSOID:
        x, y, z = a * x, b * y, c * z
        norm = np.sqrt(x * x + y * y + z * z)
        x, y, z = a * x / norm, b * y / norm, c * z / norm
    elif kind in (CYLINDER, CONE):
        norm = np.sqrt(x * x + y * y)
        scale = a / norm if norm > 0.0 else 0.0
        if kind == CONE and 2.0 * b * z > a * norm:
            x, y, z = 0.0, 0.0, b
        elif kind == CONE:
            x, y, z = scale * x, scale * y, -b
        else:
            x, y, z = scale * x, scale * y, (b if z > 0.0 else -b)
    elif kind == HALF_SPACE:
        x, y, z = 0.0, 0.0, 0.0
    elif kind == HULL:
        best, chosen = -np.inf, int(bodies.corners[body, 0])
        for k in range(bodies.corners[body, 0], bodies.corners[body, 1]):
            height = x * points[k, 0] + y * points[k, 1] + z * points[k, 2]
            if height > best:
                best, chosen = height, k
        x, y, z = points[chosen, 0], points[chosen, 1], points[chosen, 2]
    for e in range(3):
        out[e] = w[9 + e] + (w[3 * e] * x + w[3 * e + 1] * y + w[3 * e + 2] * z)


@inlined
def segment_distance(
    one: FloatArray, half_one: float, two: FloatArray, half_two: float, across: FloatArray
) -> float:
    """Return the distance of two segments, centred in their frames along the z axes.

    Ericson 2005, section 5.1.9.

    Args:
        one: (12,) a segment's frame.
        half_one: Half its length [length unit].
        two: (12,) the other's frame.
        half_two: Half its length.
        across: (3,), written: the vector from the second's nearest point to the first's.
    """
    rx, ry, rz = one[9] - two[9], one[10] - two[10], one[11] - two[11]
    ux, uy, uz = one[2], one[5], one[8]
    vx, vy, vz = two[2], two[5], two[8]
    b = ux * vx + uy * vy + uz * vz
    d = ux * rx + uy * ry + uz * rz
    e = vx * rx + vy * ry + vz * rz
    best = np.inf
    square = 1.0 - b * b  # of the sine between them
    if square > 0.0:
        # nearest points of the lines, moved onto the segments
        s = min(max((b * e - d) / square, -half_one), half_one)
        t = min(max(e + b * s, -half_two), half_two)
        s = min(max(b * t - d, -half_one), half_one)
        best = _nearer(
            rx + s * ux - t * vx, ry + s * uy - t * vy, rz + s * uz - t * vz, best, across
        )
        if square > 1e-6 and abs(s) < half_one and abs(t) < half_two:
            return math.sqrt(best)
    # every end against the other segment
    for sign in (-1.0, 1.0):
        s = sign * half_one
        t = min(max(e + b * s, -half_two), half_two)
        best = _nearer(
            rx + s * ux - t * vx, ry + s * uy - t * vy, rz + s * uz - t * vz, best, across
        )
        t = sign * half_two
        s = min(max(b * t - d, -half_one), half_one)
        best = _nearer(
            rx + s * ux - t * vx, ry + s * uy - t * vy, rz + s * uz - t * vz, best, across
        )
    return math.sqrt(best)


@inlined
def _nearer(x: float, y: float, z: float, best: float, across: FloatArray) -> float:
    """Return the lesser of a vector's square and the best one; keep the vector if it is less."""
    squared = x * x + y * y + z * z
    if squared < best:
        across[0], across[1], across[2] = x, y, z
        return squared
    return best


@inlined
def separation_later(
    bodies: BodyTable,
    world: FloatArray,
    twists: FloatArray,
    one: int,
    two: int,
    normal: FloatArray,
    later: float,
    scratch: FloatArray,
) -> float:
    """Return the gap of two bodies across a normal, `later` ahead, at constant velocities.

    A point x of a body then stands at x + later (v + ω × x), at a height
    n·x + later (n·v + (n × ω)·x) that is linear in x: the least and the greatest height are those
    of support points in a turned direction. The gap is a concave function of `later`.

    Args:
        world: (bodies, 12) frames of the bodies.
        twists: (joints, 6) from `joint_twists`.
        one: Index of a body.
        two: Index of the other.
        normal: (3,) from the second to the first, of any length.
        later: How far ahead; negative: back.
        scratch: (3, 3) scratch.
    """
    length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    if not length > 0.0:
        return -np.inf
    nx, ny, nz = normal[0] / length, normal[1] / length, normal[2] / length
    gap, turned, point = 0.0, scratch[2], scratch[1]
    for side in range(2):
        body, sign = (one, -1.0) if side == 0 else (two, 1.0)
        joint = bodies.joint[body]
        # the normal turned with the body, and the height that its velocity adds
        turned[0], turned[1], turned[2], moved = nx, ny, nz, 0.0
        if joint >= 0:
            w = twists[joint]
            turned[0] += later * (ny * w[2] - nz * w[1])
            turned[1] += later * (nz * w[0] - nx * w[2])
            turned[2] += later * (nx * w[1] - ny * w[0])
            moved = later * (nx * w[3] + ny * w[4] + nz * w[5])
        _support(bodies, world, body, turned, sign, point)
        tx, ty, tz = turned[0], turned[1], turned[2]
        height = tx * point[0] + ty * point[1] + tz * point[2] + moved
        gap -= sign * height + bodies.radius[body] * np.sqrt(tx * tx + ty * ty + tz * tz)
    return gap
