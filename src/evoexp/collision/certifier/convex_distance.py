"""Bounds of the distance of two convex bodies: closed forms where there are some, GJK elsewhere.

Gilbert, Johnson & Keerthi 1988. Every direction v gives a lower bound, the gap between the two
planes across v that support the bodies; every point found in the difference of the bodies gives an
upper bound. Both hold whenever the iteration stops, so it stops as soon as they decide what is
asked. Nothing here is the last word: coal is.

A body's frame in the world is a row of twelve numbers, as in `motion_bounds`.
"""

import numpy as np

from evoexp.collision.body_table import BOX, CONE, CYLINDER, ELLIPSOID, HALF_SPACE, HULL, SEGMENT
from evoexp.collision.certifier.simplex import closest_of_simplex
from evoexp.numeric.compilation import inlined

MAX_ITERATIONS = 100

LOOSE = (
    0.05  # [-] of what is left above `enough`: gap at which GJK ends where `need` is out of reach
)

# [-] of the distance: gap between the bounds at which GJK ends where the distance itself is wanted
CONVERGED = 1e-13


@inlined
def distance_bounds(bodies, world, one, two, need, enough, converged, normal, simplex, scratch):  # type: ignore[no-untyped-def]
    """A lower and an upper bound of the distance of two bodies.

    Equal up to rounding unless stopped early.

    Args:
        bodies: `BodyTable` as a tuple.
        world: (bodies, 12) frames of the bodies.
        one: Index of a body.
        two: Index of the other.
        need: Stops when the lower bound is not below it.
        enough: Stops when the upper bound is below it; where `need` is out of reach, when it is
            known how far: `LOOSE`. −inf: never.
        converged: And when the two are apart by this part of the distance of the cores [-].
        normal: (3,) a direction to begin with, from the second to the first; the last one, across
            which the lower bound was found, is written back.
        simplex: (4, 3) scratch.
        scratch: (3, 3) scratch.
    """
    kind, size, swept = bodies[1], bodies[5], bodies[6]
    radii = swept[one] + swept[two]
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
    if kind[one] == SEGMENT and kind[two] == SEGMENT:
        distance = (
            segment_distance(world[one], size[one, 0], world[two], size[two, 0], normal) - radii
        )
        return distance, distance
    x, y, z = (
        world[one, 9] - world[two, 9],
        world[one, 10] - world[two, 10],
        world[one, 11] - world[two, 11],
    )
    apart = np.sqrt(x * x + y * y + z * z) - bodies[11][one] - bodies[11][two]
    if apart >= need:
        return apart, np.inf
    low, high = _gjk(
        bodies, world, one, two, need + radii, enough + radii, converged, normal, simplex, scratch
    )
    return low - radii, high - radii


@inlined
def _gjk(bodies, world, one, two, need, enough, converged, v, simplex, scratch):  # type: ignore[no-untyped-def]
    """`distance_bounds` of the two cores, from the direction v on."""
    here, there = scratch[0], scratch[1]
    count, low, high = 0, -np.inf, np.inf
    length = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    if not length > 0.0:
        v[0], v[1], v[2], length = 1.0, 0.0, 0.0, 1.0
    for _ in range(MAX_ITERATIONS):
        _support(bodies, world, one, v, -1.0, here)
        _support(bodies, world, two, v, 1.0, there)
        x, y, z = here[0] - there[0], here[1] - there[1], here[2] - there[2]
        gap = (x * v[0] + y * v[1] + z * v[2]) / length
        low = max(low, gap)
        if low >= need or high < enough or _holds(simplex, count, x, y, z):
            break
        if count > 0 and high - low <= converged * high:
            break
        if enough > -np.inf and high < need and high - low <= LOOSE * (high - enough):
            break
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
def _holds(simplex, count, x, y, z):  # type: ignore[no-untyped-def]
    found = False
    for k in range(count):
        found = found or (simplex[k, 0] == x and simplex[k, 1] == y and simplex[k, 2] == z)
    return found


@inlined
def _support(bodies, world, body, direction, sign, out):  # type: ignore[no-untyped-def]
    """Write the farthest point of a body's core in a direction, times a sign."""
    kind, size, corners, points = bodies[1][body], bodies[5], bodies[7], bodies[8]
    dx, dy, dz = sign * direction[0], sign * direction[1], sign * direction[2]
    w = world[body]
    z = w[2] * dx + w[5] * dy + w[8] * dz
    a, b, c = size[body, 0], size[body, 1], size[body, 2]
    if kind == SEGMENT:
        e = a if z > 0.0 else -a
        out[0], out[1], out[2] = w[9] + w[2] * e, w[10] + w[5] * e, w[11] + w[8] * e
        return
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
        best, chosen = -np.inf, corners[body, 0]
        for k in range(corners[body, 0], corners[body, 1]):
            height = x * points[k, 0] + y * points[k, 1] + z * points[k, 2]
            if height > best:
                best, chosen = height, k
        x, y, z = points[chosen, 0], points[chosen, 1], points[chosen, 2]
    for e in range(3):
        out[e] = w[9 + e] + (w[3 * e] * x + w[3 * e + 1] * y + w[3 * e + 2] * z)


@inlined
def segment_distance(one, half_one, two, half_two, across):  # type: ignore[no-untyped-def]
    """Distance of two segments of given half lengths along the z axes of their frames, centred.

    Writes its vector.
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
        s = min(max((b * e - d) / square, -half_one), half_one)
        t = min(max(e + b * s, -half_two), half_two)
        s = min(max(b * t - d, -half_one), half_one)
        best = _nearer(
            rx + s * ux - t * vx, ry + s * uy - t * vy, rz + s * uz - t * vz, best, across
        )
        if square > 1e-6 and abs(s) < half_one and abs(t) < half_two:
            return np.sqrt(best)
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
    return np.sqrt(best)


@inlined
def _nearer(x, y, z, best, across):  # type: ignore[no-untyped-def]
    squared = x * x + y * y + z * z
    if squared < best:
        across[0], across[1], across[2] = x, y, z
        return squared
    return best


@inlined
def separation_later(bodies, world, twists, one, two, normal, later, scratch):  # type: ignore[no-untyped-def]
    """The gap of two bodies across a normal, `later` ahead.

    If all their points kept their velocities.

    A point x then stands at x + later (v + ω × x), at a height n·x + later (n·v + (n × ω)·x) that
    is linear in x: the least and greatest are supports in a turned direction. In `later` the gap is
    concave.

    Args:
        bodies: `BodyTable` as a tuple.
        world: (bodies, 12) frames of the bodies.
        twists: (joints, 6) from `joint_twists`.
        one: Index of a body.
        two: Index of the other.
        normal: (3,) from the second to the first, of any length.
        later: Ahead (or back).
        scratch: (3, 3) scratch.
    """
    length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
    if not length > 0.0:
        return -np.inf
    nx, ny, nz = normal[0] / length, normal[1] / length, normal[2] / length
    gap, turned, point = 0.0, scratch[2], scratch[1]
    for side in range(2):
        body, sign = (one, -1.0) if side == 0 else (two, 1.0)
        joint = bodies[0][body]
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
        gap -= sign * height + bodies[6][body] * np.sqrt(tx * tx + ty * ty + tz * tz)
    return gap
