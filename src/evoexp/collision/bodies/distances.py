"""Points that joints move, and distances of spheres from spheres and obstacles, eight at a time.

A point of eight configurations is three vectors (`numeric.vectors`) side by side.
"""

from typing import NamedTuple

import numpy as np

from evoexp.collision.bodies.body_tables import FIRST_RUN, STOP_RUN, BodyTables
from evoexp.numeric.compilation import inlined
from evoexp.numeric.vectors import LANES, Vector, load, lower, magnitude, root, spread, store, upper
from evoexp.records import FloatArray
from evoexp.robots.forward_kinematics import SPATIAL_FRAME, VECTOR, Eight
from evoexp.robots.kinematics import SPATIAL_ROWS, U
from evoexp.scenarios.obstacles import CYLINDER, HALF_SPACE

LARGEST_CELL = 1e9  # of a map; beyond it, or with NaN, nothing is sure

MARGIN = 1.0 + 1e-9  # bounds are widened by it, so that rounding skips no contact

POINT = U(3) * VECTOR
"""Numbers of a point of eight configurations: x, y, z."""

Row = tuple[Vector, Vector, Vector, Vector]
Motion = tuple[Row, Row, Row]
"""Eight rigid motions: per coordinate a row of the rotation, and the translation."""

Place = tuple[Vector, Vector, Vector]
"""Eight points or directions: x, y, z."""


class Memory(NamedTuple):
    """Scratch for eight configurations."""

    q: FloatArray  # (nq · LANES,) the last ones of a batch, the last of all repeated
    frames: FloatArray  # (joints + 1 · SPATIAL_FRAME,), the world's at the end
    middles: FloatArray  # (units · POINT,) centres of the balls
    centers: FloatArray  # (spheres · POINT,) in the world, or of two bodies, seen from one of them
    least: FloatArray  # (3 · LANES,) rows OBSTACLES, BETWEEN, SELF of the clearances so far
    # (units,) the first of the eight for which centres of a unit's spheres were computed
    known: FloatArray
    placed: FloatArray  # (units,) the same of the ball's centre
    mapped: FloatArray  # (LANES,) of `mapped_distance`


@inlined
def memory_of(tables: BodyTables, nq: int) -> Memory:
    """Return the scratch of a robot, the world's frame in it."""
    num_units, world = len(tables.units), U(len(tables.chain.parent)) * SPATIAL_FRAME
    frames = np.empty(world + SPATIAL_FRAME)
    for row in range(SPATIAL_ROWS):
        one = 1.0 if row in (0, 4, 8) else 0.0
        store(frames, world + U(row) * VECTOR, spread(one))
    return Memory(
        np.zeros(U(nq) * VECTOR),
        frames,
        np.empty(U(num_units) * POINT),
        np.empty(U(len(tables.spheres)) * POINT),
        np.empty(3 * LANES),
        np.full(num_units, -1.0),
        np.full(num_units + 1, -1.0),
        np.empty(LANES),
    )


@inlined
def mapped_distance(tables: BodyTables, m: int, eight: Eight, memory: Memory) -> Vector:
    """Return the bounds of a map at eight configurations; inf where a coordinate is not sound."""
    maps, grids = tables.maps, tables.grids
    for lane in range(LANES):
        place, is_sound = maps[m, 2], True
        for k in range(2):
            at = U(maps[m, k]) * eight.stride + eight.place + U(lane)
            cell = np.floor((eight.q[at] - grids[m, k]) * grids[m, 2 + k])
            is_sound &= abs(cell) < LARGEST_CELL
            if is_sound:
                step = maps[m, 4] if k == 0 else 1
                place += int(cell) % maps[m, 3 + k] * step
        memory.mapped[lane] = tables.bounds[place] if is_sound else np.inf
    return load(memory.mapped, U(0))


@inlined
def turned(row: Row, x: float, y: float, z: float) -> Vector:
    """Return a coordinate of a constant direction after a motion."""
    return row[0] * x + row[1] * y + row[2] * z


@inlined
def moved_point(motion: Motion, x: float, y: float, z: float) -> Place:
    """Return a constant point after a motion."""
    return (
        turned(motion[0], x, y, z) + motion[0][3],
        turned(motion[1], x, y, z) + motion[1][3],
        turned(motion[2], x, y, z) + motion[2][3],
    )


@inlined
def point_at(points: FloatArray, k: np.uint64) -> Place:
    """Return a point that `place_point` or `store_point` wrote."""
    own = U(k) * POINT
    return load(points, own), load(points, own + VECTOR), load(points, own + U(2) * VECTOR)


@inlined
def place_point(
    frames: FloatArray, joint: int, local: FloatArray, points: FloatArray, k: np.uint64
) -> None:
    """Write point k, which is `local` (≥ 3,) in a joint's frame of `spatial_frames`."""
    j, x, y, z = U(joint) * SPATIAL_FRAME, local[0], local[1], local[2]
    for row in range(3):
        a, o = j + U(3 * row) * VECTOR, j + U(9 + row) * VECTOR
        along = (
            load(frames, a) * x + load(frames, a + VECTOR) * y + load(frames, a + U(2) * VECTOR) * z
        )
        store(points, U(k) * POINT + U(row) * VECTOR, load(frames, o) + along)


@inlined
def store_point(points: FloatArray, k: np.uint64, point: Place) -> None:
    """Write a point that `point_at` reads."""
    own = U(k) * POINT
    store(points, own, point[0])
    store(points, own + VECTOR, point[1])
    store(points, own + U(2) * VECTOR, point[2])


@inlined
def squared_distance(a: Place, b: Place | tuple[float, float, float]) -> Vector:
    """Return the squared distance of two points, each of vectors or numbers."""
    x, y, z = a[0] - b[0], a[1] - b[1], a[2] - b[2]
    square: Vector = x * x + y * y + z * z
    return square


@inlined
def seen_from(center: FloatArray, turn: FloatArray, point: Place) -> Place:
    """Return a point as seen from an obstacle's frame, whose rotation has rows `turn` (9,)."""
    x, y, z = point[0] - center[0], point[1] - center[1], point[2] - center[2]
    return (
        turn[0] * x + turn[3] * y + turn[6] * z,
        turn[1] * x + turn[4] * y + turn[7] * z,
        turn[2] * x + turn[5] * y + turn[8] * z,
    )


@inlined
def distance_from_core(kind: int, core: FloatArray, point: Place) -> Vector:
    """Return the signed distance of a point in an obstacle's frame from the obstacle's core.

    The core of spheres, capsules and boxes is a box, with edges of length 0 where needed. Its row
    of `BodyTables.cores` holds a thickness, too, which is left to the caller.
    """
    x, y, z = point
    if kind == HALF_SPACE:
        return z
    nothing, w = spread(0.0), magnitude(z) - core[2]
    if kind == CYLINDER:
        u = root(x * x + y * y) - core[0]
        inside = lower(upper(u, w), nothing)
        u, w = upper(u, nothing), upper(w, nothing)
        return root(u * u + w * w) + inside
    u, v = magnitude(x) - core[0], magnitude(y) - core[1]
    inside = lower(upper(upper(u, v), w), nothing)
    u, v, w = upper(u, nothing), upper(v, nothing), upper(w, nothing)
    return root(u * u + v * v + w * w) + inside


@inlined
def nearest(
    centers: FloatArray, one: np.uint64, end: np.uint64, first: np.uint64, stop: np.uint64
) -> Vector:
    """Return the least squared distance of points `one` … `end` − 1 and `first` … `stop` − 1."""
    i, least = one, spread(np.inf)
    # four of them are held in registers
    while i + U(3) < end:
        p, q = point_at(centers, i), point_at(centers, i + U(1))
        r, s = point_at(centers, i + U(2)), point_at(centers, i + U(3))
        a, b, c, d = least, least, least, least
        for j in range(first, stop):
            other = point_at(centers, U(j))
            a, b = lower(a, squared_distance(p, other)), lower(b, squared_distance(q, other))
            c, d = lower(c, squared_distance(r, other)), lower(d, squared_distance(s, other))
        least = lower(lower(a, b), lower(c, d))
        i += U(4)
    # the rest one by one
    while i < end:
        p = point_at(centers, i)
        for j in range(first, stop):
            least = lower(least, squared_distance(p, point_at(centers, U(j))))
        i += U(1)
    return least


@inlined
def between_spheres(
    tables: BodyTables, centers: FloatArray, one: int, two: int, least: Vector
) -> Vector:
    """Lower a clearance to the least one of two units' spheres, whose centres are in one frame."""
    units, runs, spheres = tables.units, tables.runs, tables.spheres
    for a in range(units[one, FIRST_RUN], units[one, STOP_RUN]):
        i, end = U(runs[a, 0]), U(runs[a, 1])
        for b in range(units[two, FIRST_RUN], units[two, STOP_RUN]):
            first, stop = U(runs[b, 0]), U(runs[b, 1])
            square = nearest(centers, i, end, first, stop)
            least = lower(least, root(square) - (spheres[i, 3] + spheres[first, 3]))
    return least
