"""Bounds of the distance of two convex bodies: closed forms where there are some, GJK elsewhere.

Gilbert, Johnson & Keerthi 1988. Every direction v gives a lower bound, the gap between the two
planes across v that support the bodies; every point found in the difference of the bodies gives an
upper bound. Both hold whenever the iteration stops, so it stops as soon as they decide the caller's
question. These distances decide no verdict; coal's do.

They stand here because coal alone is more than twice as slow. With the balls around bodies in their
place, and coal for all that these leave open, a verdict on a Panda or a UR5 of convex hulls in
MotionBenchMaker's scenes takes 33 to 154 times as long (2 to 8 ms of CPU against 90 to 930), a
proof of an edge 4 to 13 times, a search that accepts proven motions 4 to 7 times, with the same
answers. Where coal takes part in the branch and bound, a verdict takes 8 to 66 times as long.

A body's frame in the world is a row of twelve numbers, as in `motion_bounds`.
"""

import math
from typing import cast

import numpy as np

from evoexp.collision import body_table
from evoexp.numeric.compilation import inlined
from evoexp.records import FloatArray

MAX_ITERATIONS = 100

ZERO, ONE, TWO, THREE = (cast(int, np.int64(k)) for k in range(4))
"""Corners by type int64: numba compiles a function once more for every literal it is given."""

# [-] of the upper bound above `enough`: gap at which GJK ends where `need` is out of reach
LOOSE = 0.05

# [-] of the distance: gap between the bounds at which GJK ends where the distance itself is wanted
CONVERGED = 1e-13


@inlined
def distance_bounds(
    bodies: body_table.BodyTable,
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
    if kind[one] == body_table.HALF_SPACE or kind[two] == body_table.HALF_SPACE:
        plane, body = (one, two) if kind[one] == body_table.HALF_SPACE else (two, one)
        x, y, z = world[plane, 2], world[plane, 5], world[plane, 8]
        normal[0], normal[1], normal[2] = -x, -y, -z
        support(bodies, world, body, normal, 1.0, scratch[0])
        distance = x * (scratch[0, 0] - world[plane, 9]) + y * (scratch[0, 1] - world[plane, 10])
        distance += z * (scratch[0, 2] - world[plane, 11]) - radii
        sign = -1.0 if plane == one else 1.0
        normal[0], normal[1], normal[2] = sign * x, sign * y, sign * z
        return distance, distance
    # two balls or capsules: closed form
    if kind[one] == body_table.SEGMENT and kind[two] == body_table.SEGMENT:
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
    bodies: body_table.BodyTable,
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
        support(bodies, world, one, v, -1.0, here)
        support(bodies, world, two, v, 1.0, there)
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
        count = _closest_of_simplex(simplex, count + 1, scratch[2])
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
def _closest_of_simplex(p: FloatArray, count: int, out: FloatArray) -> int:
    """Write the point of a simplex (4, 3) that is closest to the origin.

    The corners that carry it are moved to the front, and their number is returned; 4 if the origin
    lies within the simplex, and then nothing is written.
    """
    if count == 1:
        out[0], out[1], out[2] = p[0, 0], p[0, 1], p[0, 2]
        return 1
    if count == 2:
        _, keep = _edge(p, ZERO, ONE, np.inf, ZERO, out)
    elif count == 3:
        _, keep = _face(p, ZERO, ONE, TWO, np.inf, ZERO, out)
    else:
        if _within(p):
            return 4
        best, keep = _face(p, ZERO, ONE, TWO, np.inf, ZERO, out)
        for i, j in ((ZERO, ONE), (ZERO, TWO), (ONE, TWO)):
            best, keep = _face(p, i, j, THREE, best, keep, out)
    # the corners that carry the point to the front
    kept = 0
    for k in range(4):
        if (keep >> k) & 1:
            p[kept, 0], p[kept, 1], p[kept, 2] = p[k, 0], p[k, 1], p[k, 2]
            kept += 1
    return kept


@inlined
def _edge(
    p: FloatArray, i: int, j: int, best: float, keep: int, out: FloatArray
) -> tuple[float, int]:
    """Improve the best squared distance, its point and its corners (bits) by those of an edge."""
    ax, ay, az = p[i, 0], p[i, 1], p[i, 2]
    ux, uy, uz = p[j, 0] - ax, p[j, 1] - ay, p[j, 2] - az
    length = ux * ux + uy * uy + uz * uz
    along = -(ax * ux + ay * uy + az * uz)
    if along <= 0.0 or length == 0.0:
        x, y, z, corners = ax, ay, az, 1 << i
    elif along >= length:
        x, y, z, corners = p[j, 0], p[j, 1], p[j, 2], 1 << j
    else:
        u = along / length
        x, y, z, corners = ax + u * ux, ay + u * uy, az + u * uz, (1 << i) | (1 << j)
    squared = x * x + y * y + z * z
    if squared < best:
        out[0], out[1], out[2] = x, y, z
        return squared, corners
    return best, keep


@inlined
def _face(
    p: FloatArray, i: int, j: int, k: int, best: float, keep: int, out: FloatArray
) -> tuple[float, int]:
    """Improve the best as `_edge` does, by a triangle: its interior, or else its edges."""
    ax, ay, az, bx, by, bz, cx, cy, cz = (
        p[i, 0], p[i, 1], p[i, 2], p[j, 0], p[j, 1], p[j, 2], p[k, 0], p[k, 1], p[k, 2],
    )  # fmt: skip
    nx, ny, nz = _cross(bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az)
    square = nx * nx + ny * ny + nz * nz
    if square > 0.0:
        # barycentric coordinates of the origin's foot
        x, y, z = _cross(bx, by, bz, cx, cy, cz)
        u = (nx * x + ny * y + nz * z) / square
        x, y, z = _cross(cx, cy, cz, ax, ay, az)
        v = (nx * x + ny * y + nz * z) / square
        w = 1.0 - u - v
        if u > 0.0 and v > 0.0 and w > 0.0:
            height = (nx * ax + ny * ay + nz * az) / square
            x, y, z = height * nx, height * ny, height * nz
            squared = x * x + y * y + z * z
            if squared < best:
                out[0], out[1], out[2] = x, y, z
                return squared, (1 << i) | (1 << j) | (1 << k)
            return best, keep
    best, keep = _edge(p, i, j, best, keep, out)
    best, keep = _edge(p, i, k, best, keep, out)
    return _edge(p, j, k, best, keep, out)


@inlined
def _within(p: FloatArray) -> bool:
    """Return whether the origin lies strictly within the tetrahedron."""
    # for every face, the corner across it and the origin lie on the same side
    for k in range(4):
        i, j, m = (k + 1) % 4, (k + 2) % 4, (k + 3) % 4
        ax, ay, az = p[i, 0], p[i, 1], p[i, 2]
        nx, ny, nz = _cross(
            p[j, 0] - ax, p[j, 1] - ay, p[j, 2] - az, p[m, 0] - ax, p[m, 1] - ay, p[m, 2] - az
        )  # fmt: skip
        corner = nx * (p[k, 0] - ax) + ny * (p[k, 1] - ay) + nz * (p[k, 2] - az)
        origin = -(nx * ax + ny * ay + nz * az)
        if not corner * origin > 0.0:
            return False
    return True


@inlined
def _cross(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> tuple[float, float, float]:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@inlined
def _holds(simplex: FloatArray, count: int, x: float, y: float, z: float) -> bool:
    found = False
    for k in range(count):
        found = found or (simplex[k, 0] == x and simplex[k, 1] == y and simplex[k, 2] == z)
    return found


@inlined
def support(
    bodies: body_table.BodyTable,
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
    if kind == body_table.SEGMENT:
        e = a if z > 0.0 else -a
        out[0], out[1], out[2] = w[9] + w[2] * e, w[10] + w[5] * e, w[11] + w[8] * e
        return
    # the direction, then the point, in the core's own frame
    x, y = w[0] * dx + w[3] * dy + w[6] * dz, w[1] * dx + w[4] * dy + w[7] * dz
    if kind == body_table.BOX:
        x, y, z = (a if x > 0.0 else -a), (b if y > 0.0 else -b), (c if z > 0.0 else -c)
    elif kind == body_table.ELLIPSOID:
        x, y, z = a * x, b * y, c * z
        norm = np.sqrt(x * x + y * y + z * z)
        x, y, z = a * x / norm, b * y / norm, c * z / norm
    elif kind in (body_table.CYLINDER, body_table.CONE):
        norm = np.sqrt(x * x + y * y)
        scale = a / norm if norm > 0.0 else 0.0
        if kind == body_table.CONE and 2.0 * b * z > a * norm:
            x, y, z = 0.0, 0.0, b
        elif kind == body_table.CONE:
            x, y, z = scale * x, scale * y, -b
        else:
            x, y, z = scale * x, scale * y, (b if z > 0.0 else -b)
    elif kind == body_table.HALF_SPACE:
        x, y, z = 0.0, 0.0, 0.0
    elif kind == body_table.HULL:
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

    Ericson 2005, section 5.1.9. The vector from the second's nearest point to the first's is
    written to `across` (3,).
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
