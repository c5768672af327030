"""The arrays that the kernels of bodies read, and distances of points and spheres in them.

Tables are two flat arrays, and named views of their blocks: numba takes some 60 ns to recognise an
array, and a robot among obstacles has twenty of them: a call for a few configurations would take
longer for the tables than for the answer.

A point of eight configurations is three vectors (`numeric.vectors`) side by side.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.numeric.compilation import inlined, view_part
from evoexp.numeric.vectors import LANES, Vector, load, lower, magnitude, root, spread, store, upper
from evoexp.records import FloatArray, IntArray
from evoexp.robots.kinematics import SPATIAL_FRAME, SPATIAL_ROWS, VECTOR, Eight, KinematicChain, U
from evoexp.scenarios.obstacles import CYLINDER, HALF_SPACE, ObstacleTable

JOINT, FIRST_RUN, STOP_RUN, FIRST_CAPSULE, STOP_CAPSULE = range(5)
FIRST_BALL, FIRST_HALF_SPACE, STOP_ENTRY, FIRST_PART, STOP_PART = range(5, 10)
"""Columns of `BodyTables.units`. Entries are balls around obstacles first, then half-spaces; parts
are units."""

REACH = 3  # column of `BodyTables.balls` behind the centre
THICKNESS, AROUND = 3, 4  # columns of `BodyTables.cores` behind half the edges
OBSTACLES, BETWEEN, SELF = range(3)
"""Rows of the clearances: to obstacles, between arms, between parts of one arm."""

LARGEST_CELL = 1e9  # of a map; beyond it, or with NaN, nothing is sure

MARGIN = 1.0 + 1e-9  # bounds are widened by it, so that rounding skips no contact

POINT = U(3) * VECTOR
"""Numbers of a point of eight configurations: x, y, z."""

Row = tuple[Vector, Vector, Vector, Vector]
Motion = tuple[Row, Row, Row]
"""Eight rigid motions: per coordinate a row of the rotation, and the translation."""

Place = tuple[Vector, Vector, Vector]
"""Eight points or directions: x, y, z."""

FlatTables = tuple[FloatArray, IntArray]
"""All numbers, and all integers behind each block's first place and number of rows."""


class BodyTables(NamedTuple):
    """A robot made of spheres and capsules among obstacles.

    Units are bodies and then parts of bodies, each with a ball around it. All points are in the
    frames of the kinematic table.
    """

    chain: KinematicChain  # the joints
    obstacles: ObstacleTable  # the obstacles
    # (obstacles, 5) half the edges and the thickness of a box that an obstacle is, or that is
    # around a cylinder, and the radius of a ball around it [length unit]
    cores: FloatArray
    # (units, 10) frame (a joint of the kinematic table, one past its end: the world), then first
    # and one-past-last run of spheres, capsule, entry and part, by the columns above
    units: IntArray
    balls: FloatArray  # (units, 4) centre in the joint's frame, radius
    runs: IntArray  # (runs, 2) first and one-past-last sphere of equal radius
    spheres: FloatArray  # (spheres, 4) centre in the joint's frame, radius
    # (capsules, 8) one end, from there to the other, radius, 1 / squared length
    capsules: FloatArray
    entries: FloatArray  # (entries, 4) coefficients of a body and an obstacle; see `_entry`
    owners: IntArray  # (entries,) the obstacle of each
    # (pairs, 5) two bodies, first and one-past-last pair of their parts, row of the result
    pairs: IntArray
    parts: IntArray  # (part pairs, 2) two units
    # (maps, 5) two coordinates, first place among the bounds, and numbers of cells along both
    maps: IntArray
    grids: FloatArray  # (maps, 4) where the first cells begin along both, then 1 / step of both
    bounds: FloatArray  # (cells,) of distances from below, map by map [length unit]
    scale: float  # bound of all coordinates while joints that slide stand at 0 [length unit]


def flattened(tables: BodyTables) -> FlatTables:
    """Return all numbers, and all integers behind a header of places and rows, block by block."""
    blocks: list[np.ndarray] = [*tables.chain, *tables.obstacles, *tables[2:-1]]
    blocks.append(np.array([tables.scale]))
    sizes = {np.dtype(np.float64): 0, np.dtype(np.int64): 2 * len(blocks)}
    header: list[int] = []
    parts: dict[Any, list[np.ndarray]] = {kind: [] for kind in sizes}
    for block in blocks:
        kind = np.dtype(np.float64 if block.dtype == np.float64 else np.int64)
        header += [sizes[kind], len(block)]
        parts[kind].append(block.ravel().astype(kind))
        sizes[kind] += block.size
    numbers, indices = parts.values()
    return np.concatenate(numbers), np.concatenate([np.array(header, dtype=np.int64), *indices])


@inlined
def named_tables(n: FloatArray, i: IntArray) -> BodyTables:
    """Return the blocks of the flat arrays as views."""
    chain = KinematicChain(
        _column(i, i, 0), _column(i, i, 1), _column(i, i, 2), _column(i, i, 3),
        _rows(n, i, 4, 9), _rows(n, i, 5, 3), _rows(n, i, 6, 2),
    )  # fmt: skip
    obstacles = ObstacleTable(
        _column(i, i, 7), _rows(n, i, 8, 3), _rows(n, i, 9, 9), _rows(n, i, 10, 3)
    )
    return BodyTables(
        chain, obstacles, _rows(n, i, 11, 5), _rows(i, i, 12, 10), _rows(n, i, 13, 4),
        _rows(i, i, 14, 2), _rows(n, i, 15, 4), _rows(n, i, 16, 8), _rows(n, i, 17, 4),
        _column(i, i, 18), _rows(i, i, 19, 5), _rows(i, i, 20, 2), _rows(i, i, 21, 5),
        _rows(n, i, 22, 4), _column(n, i, 23), n[i[2 * 24]],
    )  # fmt: skip


@inlined
def _rows(array: Any, indices: IntArray, block: int, width: int) -> Any:
    """Return a block of a flat array, row by row."""
    rows = indices[2 * block + 1]
    return view_part(array, indices[2 * block], rows * width).reshape(rows, width)


@inlined
def _column(array: Any, indices: IntArray, block: int) -> Any:
    """Return a block of a flat array whose rows are single numbers."""
    return view_part(array, indices[2 * block], indices[2 * block + 1])


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
