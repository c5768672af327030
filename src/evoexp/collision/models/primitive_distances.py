"""Distances of spheres in encounters of a body with an obstacle or with another body.

Everything here is seen from the obstacle's frame or from the other body's frame: then the shapes of
one side are constants, and only one rigid motion per encounter must be gathered for the other side.
A batch of encounters lives in one flat array, `work`: its rows are `WIDTH` values apart, encounters
innermost. (One array, because LLVM gives up vector code when it would have to check several arrays
for overlaps.)

A sphere, a capsule and a box are one shape: a box (with edges of length 0 where needed), thickened
by a radius.
"""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import U

WIDTH = 64
"""Encounters in `work` at most, and the distance of its rows."""

W = U(WIDTH)

BASE, FRAME, MOTION = U(0), U(12) * W, U(24) * W
"""Rigid motions, 12 rows each: nine of the rotation, row by row, three of the translation."""

CORE = U(36) * W
"""Of the obstacles: half the edges and the thickness of a box.

Radius and half the length of a cylinder.
"""

VALUE, OUTSIDE, INSIDE = U(40) * W, U(41) * W, U(42) * W
"""The least clearance so far, and sums on the way to it."""

STARTS, AXES = U(43) * W, U(46) * W
"""A moved segment: one end, and from there to the other."""

CENTERS = U(49) * W
"""Centres of moved spheres, three rows each."""

FIXED_ROWS = 49


@kernel
def spheres_to_boxes(
    width: int, runs: IntArray, spheres: FloatArray, first: int, stop: int, work: FloatArray
) -> None:
    """Lower VALUE to the signed distances of a body's spheres to thickened boxes.

    Args:
        width: Encounters.
        runs: (runs, 2) first and one-past-last sphere of equal radius.
        spheres: (spheres, 4) centres in the body's frame, and radii.
        first: First run of the body.
        stop: One past its last.
        work: MOTION from the body's frame to the boxes', CORE.
    """
    for run in range(first, stop):
        for n in range(width):
            work[OUTSIDE + U(n)] = np.inf
            work[INSIDE + U(n)] = 0.0
        for i in range(runs[run, 0], runs[run, 1]):
            lx, ly, lz = spheres[i, 0], spheres[i, 1], spheres[i, 2]
            for n in range(width):
                m, c = MOTION + U(n), CORE + U(n)
                x = work[m] * lx + work[m + W] * ly + work[m + U(2) * W] * lz + work[m + U(9) * W]
                y = (
                    work[m + U(3) * W] * lx
                    + work[m + U(4) * W] * ly
                    + work[m + U(5) * W] * lz
                    + work[m + U(10) * W]
                )
                z = (
                    work[m + U(6) * W] * lx
                    + work[m + U(7) * W] * ly
                    + work[m + U(8) * W] * lz
                    + work[m + U(11) * W]
                )
                u, v, w = abs(x) - work[c], abs(y) - work[c + W], abs(z) - work[c + U(2) * W]
                inside = u if u > v else v
                inside = w if w > inside else inside
                u = u if u > 0.0 else 0.0
                v = v if v > 0.0 else 0.0
                w = w if w > 0.0 else 0.0
                outside, best, deepest = (
                    u * u + v * v + w * w,
                    work[OUTSIDE + U(n)],
                    work[INSIDE + U(n)],
                )
                work[OUTSIDE + U(n)] = outside if outside < best else best
                work[INSIDE + U(n)] = inside if inside < deepest else deepest
        radius = spheres[runs[run, 0], 3]
        for n in range(width):
            k = U(n)
            found = (
                np.sqrt(work[OUTSIDE + k]) + work[INSIDE + k] - (work[CORE + U(3) * W + k] + radius)
            )
            best = work[VALUE + k]
            work[VALUE + k] = found if found < best else best


@kernel
def spheres_to_cylinders(
    width: int, runs: IntArray, spheres: FloatArray, first: int, stop: int, work: FloatArray
) -> None:
    """Lower VALUE to the signed distances of a body's spheres to cylinders."""
    for i in range(runs[first, 0], runs[stop - 1, 1]):
        lx, ly, lz, radius = spheres[i, 0], spheres[i, 1], spheres[i, 2], spheres[i, 3]
        for n in range(width):
            m, c = MOTION + U(n), CORE + U(n)
            x = work[m] * lx + work[m + W] * ly + work[m + U(2) * W] * lz + work[m + U(9) * W]
            y = (
                work[m + U(3) * W] * lx
                + work[m + U(4) * W] * ly
                + work[m + U(5) * W] * lz
                + work[m + U(10) * W]
            )
            z = (
                work[m + U(6) * W] * lx
                + work[m + U(7) * W] * ly
                + work[m + U(8) * W] * lz
                + work[m + U(11) * W]
            )
            u, w = np.sqrt(x * x + y * y) - work[c], abs(z) - work[c + W]
            inside = u if u > w else w
            inside = inside if inside < 0.0 else 0.0
            u = u if u > 0.0 else 0.0
            w = w if w > 0.0 else 0.0
            found, best = np.sqrt(u * u + w * w) + inside - radius, work[VALUE + U(n)]
            work[VALUE + U(n)] = found if found < best else best


@kernel
def spheres_to_half_spaces(
    width: int, runs: IntArray, spheres: FloatArray, first: int, stop: int, work: FloatArray
) -> None:
    """Lower VALUE to the signed distances of a body's spheres to half-spaces, z ≤ 0."""
    for i in range(runs[first, 0], runs[stop - 1, 1]):
        lx, ly, lz, radius = spheres[i, 0], spheres[i, 1], spheres[i, 2], spheres[i, 3]
        for n in range(width):
            m = MOTION + U(n)
            z = (
                work[m + U(6) * W] * lx
                + work[m + U(7) * W] * ly
                + work[m + U(8) * W] * lz
                + work[m + U(11) * W]
            )
            found, best = z - radius, work[VALUE + U(n)]
            work[VALUE + U(n)] = found if found < best else best


@kernel
def move(
    width: int, x: float, y: float, z: float, w: float, target: np.uint64, work: FloatArray
) -> None:
    """Write a constant point (w = 1) or direction (w = 0) as MOTION sees it to rows at `target`."""
    for row in range(3):
        a, t, o = MOTION + U(3 * row) * W, MOTION + U(9 + row) * W, target + U(row) * W
        for n in range(width):
            k = U(n)
            turned = work[a + k] * x + work[a + W + k] * y + work[a + U(2) * W + k] * z
            work[o + k] = turned + work[t + k] * w


@kernel
def spheres_to_spheres(
    width: int,
    runs: IntArray,
    spheres: FloatArray,
    one: int,
    other: int,
    other_stop: int,
    work: FloatArray,
) -> None:
    """Lower VALUE to the distances of a run of constant spheres from the spheres at CENTERS.

    Args:
        width: Encounters.
        runs: See `spheres_to_boxes`.
        spheres: See `spheres_to_boxes`.
        one: The run.
        other: First run of the other body; its spheres are at CENTERS.
        other_stop: One past its last.
        work: CENTERS.
    """
    base = runs[other, 0] if other < other_stop else 0
    for two in range(other, other_stop):
        for n in range(width):
            work[OUTSIDE + U(n)] = np.inf
        for j in range(runs[two, 0], runs[two, 1]):
            o = CENTERS + U(j - base) * U(3) * W
            i = runs[one, 0]
            while i + 3 <= runs[one, 1]:
                _three_squares(width, spheres, i, o, work)
                i += 3
            while i < runs[one, 1]:
                lx, ly, lz = spheres[i, 0], spheres[i, 1], spheres[i, 2]
                for n in range(width):
                    k = o + U(n)
                    x, y, z, best = (
                        work[k] - lx,
                        work[k + W] - ly,
                        work[k + U(2) * W] - lz,
                        work[OUTSIDE + U(n)],
                    )
                    found = x * x + y * y + z * z
                    work[OUTSIDE + U(n)] = found if found < best else best
                i += 1
        both = spheres[runs[one, 0], 3] + spheres[runs[two, 0], 3]
        for n in range(width):
            found, best = np.sqrt(work[OUTSIDE + U(n)]) - both, work[VALUE + U(n)]
            work[VALUE + U(n)] = found if found < best else best


@kernel
def _three_squares(width: int, spheres: FloatArray, i: int, o: np.uint64, work: FloatArray) -> None:
    """Lower OUTSIDE to the squared distances of a moved centre from three fixed ones.

    The fixed ones are held in registers.
    """
    ax, ay, az = spheres[i, 0], spheres[i, 1], spheres[i, 2]
    bx, by, bz = spheres[i + 1, 0], spheres[i + 1, 1], spheres[i + 1, 2]
    cx, cy, cz = spheres[i + 2, 0], spheres[i + 2, 1], spheres[i + 2, 2]
    for n in range(width):
        k = o + U(n)
        x, y, z, best = work[k], work[k + W], work[k + U(2) * W], work[OUTSIDE + U(n)]
        a = (x - ax) * (x - ax) + (y - ay) * (y - ay) + (z - az) * (z - az)
        b = (x - bx) * (x - bx) + (y - by) * (y - by) + (z - bz) * (z - bz)
        c = (x - cx) * (x - cx) + (y - cy) * (y - cy) + (z - cz) * (z - cz)
        best = a if a < best else best
        best = b if b < best else best
        work[OUTSIDE + U(n)] = c if c < best else best
