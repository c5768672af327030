"""The point of a simplex that is closest to the origin, for GJK: by looking at all its faces."""

from typing import cast

import numpy as np

from evoexp.numeric.compilation import inlined
from evoexp.records import FloatArray

ZERO, ONE, TWO, THREE = (cast(int, np.int64(k)) for k in range(4))
"""Corners by type int64: numba compiles a function once more for every literal it is given."""


@inlined
def closest_of_simplex(p: FloatArray, count: int, out: FloatArray) -> int:
    """Find the point of a simplex that is closest to the origin, and the corners that carry it.

    Args:
        p: (4, 3) corners; those that carry the point are moved to the front.
        count: How many corners there are.
        out: (3,), written: the point.

    Returns:
        Number of the corners that carry the point; 4 if the origin lies within the simplex, and
        then nothing is written.
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
        best, keep = _face(p, ZERO, ONE, THREE, best, keep, out)
        best, keep = _face(p, ZERO, TWO, THREE, best, keep, out)
        best, keep = _face(p, ONE, TWO, THREE, best, keep, out)
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
