"""Robots as spheres and capsules in space, among obstacles of all kinds.

Any Pinocchio model whose joints have one coordinate, any number of arms; planar arms are trees with
z = 0. Angles are radians here, as in Pinocchio. Shapes, pairs and obstacles are packed into the
kernels' tables: a body is all shapes of one number, and bodies of many shapes are cut into parts,
since the balls around parts are smaller, and rule out more.
"""

import functools
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numba
import numpy as np

from evoexp.collision.bodies import body_tables
from evoexp.collision.bodies.clearance_kernels import least_clearances, num_free
from evoexp.collision.distance_maps import DistanceMap
from evoexp.numeric.compilation import KernelAddress, kernel
from evoexp.numeric.vectors import LANES
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import KinematicTable
from evoexp.scenarios.obstacles import (
    BOX,
    CAPSULE,
    CYLINDER,
    HALF_SPACE,
    SPHERE,
    ObstacleTable,
    obstacle_table,
)

SHORTEST = 1e-100  # [length unit] a capsule whose ends are nearer than this is a sphere
PART = 6  # most shapes of a part; a capsule counts as `CAPSULE_WEIGHT`
CAPSULE_WEIGHT = 4

BodyPair = tuple[int, int]


class Shapes(NamedTuple):
    """Capsules fixed to the joints of a model; those whose ends coincide are spheres."""

    joint: IntArray  # (shapes,) index of the Pinocchio joint that moves each; 0 for the world
    start: FloatArray  # (shapes, 3) one end, or the centre, in the joint's frame [length unit]
    end: FloatArray  # (shapes, 3) the other end
    radius: FloatArray  # (shapes,) at least 0
    body: IntArray  # (shapes,) number of the body that each belongs to

    def of(self, chosen: BoolArray) -> "Shapes":
        """Return some of the shapes."""
        columns: tuple[Any, ...] = self
        return Shapes(*(column[chosen] for column in columns))

    @classmethod
    def joined(cls, parts: Iterable["Shapes"]) -> "Shapes":
        """Return the shapes of several bodies together."""
        return cls(*map(np.concatenate, zip(*parts, strict=True)))


def pack_tables(
    table: KinematicTable,
    shapes: Shapes,
    obstacles: ObstacleTable,
    pairs: Iterable[BodyPair],
    ignored: Iterable[BodyPair],
    arms: Sequence[int],
    maps: Sequence[DistanceMap],
) -> body_tables.BodyTables:
    """Return the tables of a robot among obstacles; see `BodyCollision.build`."""
    kind, size = obstacles.without_ellipses().kind, obstacles.size
    numbers, first = np.unique(shapes.body, return_index=True)
    joints = shapes.joint[first]
    tables = _pack_bodies(table, shapes, obstacles, numbers, joints)
    # half the edges and the thickness of a box that an obstacle is, or that is around a cylinder
    cores = tables.cores
    cores[kind == SPHERE, body_tables.THICKNESS] = size[kind == SPHERE, 0]
    cores[kind == BOX, : body_tables.THICKNESS] = size[kind == BOX]
    cores[kind == CYLINDER, : body_tables.THICKNESS] = size[kind == CYLINDER][:, [0, 0, 1]]
    cores[kind == CAPSULE, 2 : body_tables.THICKNESS + 1] = size[kind == CAPSULE, 1::-1]
    edges = np.where((kind == CYLINDER)[:, None], size, cores[:, : body_tables.THICKNESS])
    cores[:, body_tables.AROUND] = (
        np.sqrt((edges * edges).sum(axis=1)) + cores[:, body_tables.THICKNESS]
    )
    # a bound of all coordinates
    reach = np.sqrt((tables.chain.translation**2).sum(axis=1)).sum()
    reach += (
        np.sqrt((tables.balls[:, :3] ** 2).sum(axis=1)) + tables.balls[:, body_tables.REACH]
    ).max()
    outside = np.sqrt((obstacles.center**2).sum(axis=1)) + cores[:, body_tables.AROUND]
    tables = tables._replace(scale=float(reach + max(outside, default=0.0)))
    entries, owners = _pack_entries(tables, numbers, joints, set(ignored))
    body_arms = [arms[joint] if arms else 0 for joint in joints]
    body_pairs, parts = _pack_pairs(tables, numbers, body_arms, pairs)
    first = np.cumsum([0, *(each.bounds.size for each in maps)])
    rows = [(*m.coordinates, k, *m.bounds.shape) for m, k in zip(maps, first, strict=False)]
    return tables._replace(
        entries=entries,
        owners=owners,
        pairs=body_pairs,
        parts=parts,
        maps=np.array(rows, dtype=np.int64).reshape(-1, 5),
        grids=np.array([(*m.low, *(1.0 / m.step)) for m in maps]).reshape(-1, 4),
        bounds=np.concatenate([np.empty(0), *(m.around.ravel() for m in maps)]),
    )


def _pack_bodies(
    table: KinematicTable,
    shapes: Shapes,
    obstacles: ObstacleTable,
    numbers: IntArray,
    joints: IntArray,
) -> body_tables.BodyTables:
    """Return tables of all shapes, body by body and part by part, without entries and pairs."""
    # ends and axes in the table's frames
    turn = np.concatenate([np.eye(3)[None], table.alignment.transpose(0, 2, 1)])[shapes.joint]
    start, axis = _turned(turn, shapes.start), _turned(turn, shapes.end - shapes.start)
    radius, square = shapes.radius, (axis * axis).sum(axis=1)
    is_sphere = square <= SHORTEST * SHORTEST
    # units and the balls around them; a body of one part is that part itself
    bodies, parts = list[tuple[int, ...]](), list[tuple[int, ...]]()
    balls, part_balls = list[FloatArray](), list[FloatArray]()
    runs, spheres, capsules = list[tuple[int, int]](), list[int](), list[int]()
    for k, (number, joint) in enumerate(zip(numbers, joints, strict=True)):
        own = np.flatnonzero(shapes.body == number)
        frame = joint - 1 if joint > 0 else len(table.chain.parent)
        pieces = _cut(own, start + 0.5 * axis, is_sphere)
        begin, next_part = (len(runs), len(capsules)), len(numbers) + len(parts)
        for piece in pieces:
            first = len(runs), len(capsules)
            # runs of spheres of equal radius, then the capsules
            for size in np.unique(radius[piece[is_sphere[piece]]]):
                same = piece[is_sphere[piece] & (radius[piece] == size)]
                runs.append((len(spheres), len(spheres) + len(same)))
                spheres.extend(same)
            capsules.extend(piece[~is_sphere[piece]])
            if len(pieces) > 1:
                span = first[0], len(runs), first[1], len(capsules)
                parts.append((frame, *span, 0, 0, 0, 0, 0))
                part_balls.append(_ball(start, axis, radius, piece))
        places = (next_part, next_part + len(pieces)) if len(pieces) > 1 else (k, k + 1)
        bodies.append((frame, begin[0], len(runs), begin[1], len(capsules), 0, 0, 0, *places))
        balls.append(_ball(start, axis, radius, own))
    of, filled_later = capsules, list[Any]([*[np.empty(0)] * 7, 0.0])
    return body_tables.BodyTables(
        table.chain,
        obstacles,
        np.zeros((len(obstacles.kind), body_tables.AROUND + 1)),
        np.array(bodies + parts, dtype=np.int64),
        np.array(balls + part_balls),
        np.array(runs, dtype=np.int64).reshape(-1, 2),
        np.column_stack([start[spheres], radius[spheres]]),
        np.column_stack([start[of], axis[of], radius[of], 1.0 / square[of]]),
        *filled_later,
    )


def _turned(turn: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return vectors (n, 3) turned by a rotation each, (n, 3, 3), with terms added in order."""
    terms = turn * vectors[:, None, :]
    return np.asarray(terms[..., 0] + terms[..., 1] + terms[..., 2])


def _cut(own: IntArray, middle: FloatArray, is_sphere: BoolArray) -> list[IntArray]:
    """Halve a set of shapes, given by their indices, across its longest extent into parts."""
    if len(own) == 1 or np.where(is_sphere[own], 1, CAPSULE_WEIGHT).sum() <= PART:
        return [own]
    axis = np.ptp(middle[own], axis=0).argmax()
    order = own[np.argsort(middle[own, axis], kind="stable")]
    half = len(own) // 2
    return _cut(order[:half], middle, is_sphere) + _cut(order[half:], middle, is_sphere)


def _ball(start: FloatArray, axis: FloatArray, radius: FloatArray, own: IntArray) -> FloatArray:
    ends = np.concatenate([start[own], start[own] + axis[own]])
    radii = np.concatenate([radius[own], radius[own]])
    center = 0.5 * ((ends - radii[:, None]).min(axis=0) + (ends + radii[:, None]).max(axis=0))
    away = np.sqrt(((ends - center) ** 2).sum(axis=1))
    return np.array([*center, (away + radii).max()])


def _pack_entries(
    tables: body_tables.BodyTables, numbers: IntArray, joints: IntArray, ignored: set[BodyPair]
) -> tuple[FloatArray, IntArray]:
    """Return entries and owners, and write their places into the units.

    A body is checked against all obstacles but the ignored ones; bodies of the world against none.
    """
    kind = tables.obstacles.kind
    balls, flats = np.flatnonzero(kind != HALF_SPACE), np.flatnonzero(kind == HALF_SPACE)
    entries: list[FloatArray] = []
    owners: list[int] = []
    for b, (number, joint) in enumerate(zip(numbers.tolist(), joints, strict=True)):
        ends = [len(owners)]
        for group in (balls, flats):
            chosen = [o for o in group.tolist() if joint > 0 and (number, o) not in ignored]
            entries += [
                _entry(tables, o, float(tables.balls[b, body_tables.REACH])) for o in chosen
            ]
            owners += chosen
            ends.append(len(owners))
        tables.units[b, body_tables.FIRST_BALL : body_tables.STOP_ENTRY + 1] = ends
    return np.array(entries).reshape(-1, 4), np.array(owners, dtype=np.int64)


def _entry(tables: body_tables.BodyTables, o: int, reach: float) -> FloatArray:
    """Return the coefficients of a function of a ball's centre m: positive where it is far enough.

    The function is m² + (e0, e1, e2) · m + e3 for a ball of radius R around an obstacle at c:
    |m − c|² − R² multiplied out. Of a half-space it is linear.
    """
    center = tables.obstacles.center[o]
    if tables.obstacles.kind[o] == HALF_SPACE:
        normal = tables.obstacles.rotation[o, [2, 5, 8]]
        level = (normal * center).sum() + reach * body_tables.MARGIN
        return tables.scale * np.array([*normal, -level])
    within = (float(tables.cores[o, body_tables.AROUND]) + reach) * body_tables.MARGIN
    return np.array([*(-2.0 * center), (center**2).sum() - within * within])


def _pack_pairs(
    tables: body_tables.BodyTables,
    numbers: IntArray,
    arms: Sequence[int],
    pairs: Iterable[BodyPair],
) -> tuple[IntArray, IntArray]:
    """Return pairs of bodies, and pairs of their parts; the part with more spheres comes first.

    It stays in its frame where they are measured.
    """
    body = {int(number): k for k, number in enumerate(numbers)}
    units, runs = tables.units, tables.runs
    counts = [
        int((runs[first:stop, 1] - runs[first:stop, 0]).sum())
        for first, stop in units[:, body_tables.FIRST_RUN : body_tables.STOP_RUN + 1].tolist()
    ]
    of_bodies: list[tuple[int, ...]] = []
    of_parts: list[tuple[int, int]] = []
    for one, two in pairs:
        a, b, first = body[one], body[two], len(of_parts)
        between = arms[a] != arms[b] and min(arms[a], arms[b]) >= 0
        for i in range(*units[a, body_tables.FIRST_PART : body_tables.STOP_PART + 1].tolist()):
            for j in range(*units[b, body_tables.FIRST_PART : body_tables.STOP_PART + 1].tolist()):
                of_parts.append((i, j) if counts[i] >= counts[j] else (j, i))
        of_bodies.append(
            (a, b, first, len(of_parts), body_tables.BETWEEN if between else body_tables.SELF)
        )
    return (
        np.array(of_bodies, dtype=np.int64).reshape(-1, 5),
        np.array(of_parts, dtype=np.int64).reshape(-1, 2),
    )


class Clearances(NamedTuple):
    """Least clearances of a batch: negative where shapes overlap, +inf where nothing is met."""

    # (configurations,) least distance of the robot's shapes to obstacles [length unit]
    to_obstacles: FloatArray
    between_arms: FloatArray  # (configurations,) least distance of shapes of two arms
    # (configurations,) least distance of shapes of one arm; +inf where those are no pairs, or
    # count as two arms
    to_self: FloatArray | float = np.inf

    @property
    def least(self) -> FloatArray:
        """Smallest of the three; a configuration collides where it is negative."""
        return np.minimum(np.minimum(self.to_obstacles, self.between_arms), self.to_self)


@kernel
def leading_free(hits: BoolArray) -> int:
    """Return how many configurations come before the eight of the first hit; all without any."""
    for k in range(len(hits)):
        if hits[k]:
            return k // LANES * LANES
    return len(hits)


class FreeTest(NamedTuple):
    """A collision model as kernels of other rooms ask it: a kernel's address, and its tables.

    The kernel takes the tables and a contiguous batch (nq, configurations) [rad], and answers as
    `num_free` does.
    """

    num_free: KernelAddress
    tables: Any

    @classmethod
    def of(cls, function: Callable[..., int], tables: Any) -> "FreeTest":
        """Return the test of a kernel that is compiled for tables like these."""
        kinds = numba.int64(numba.typeof(tables), numba.float64[:, ::1])
        return cls(_address(function, kinds), tables)


_address = functools.cache(KernelAddress)


class BodyCollision(NamedTuple):
    """Spheres and capsules on one robot, the obstacles around it, and the pairs to be checked."""

    tables: body_tables.FlatTables  # robot, obstacles and pairs, as kernels take them
    nq: int  # coordinates of the robot

    @classmethod
    def build(
        cls,
        table: KinematicTable,
        shapes: Shapes,
        obstacles: ObstacleTable,
        pairs: Iterable[BodyPair],
        ignored: Iterable[BodyPair] = (),
        arms: Sequence[int] = (),
        maps: Sequence[DistanceMap] = (),
    ) -> "BodyCollision":
        """Return the collision model of a robot among obstacles, ready for batches.

        Args:
            table: The robot's kinematic table.
            shapes: Its spheres and capsules; those of the world (a pedestal) are checked against
                bodies only.
            pairs: Numbers of bodies that are checked against each other.
            ignored: Pairs (body, obstacle) that are not checked: the floor that the first link
                stands on.
            arms: Which arm each joint of the model belongs to, the world included; all to one if
                empty. Negative numbers belong to every arm.
            maps: Distances of pairs that their shapes do not tell.
        """
        packed = pack_tables(table, shapes, obstacles, pairs, ignored, arms, maps)
        return cls(body_tables.flattened(packed), table.num_coordinates)

    @classmethod
    def of_pair(
        cls, table: KinematicTable, shapes: Shapes, pair: tuple[int, int]
    ) -> "BodyCollision":
        """Return the collision model of two bodies alone."""
        return cls.build(table, shapes.of(np.isin(shapes.body, pair)), obstacle_table(()), (pair,))

    def clearance(self, q: FloatArray) -> Clearances:
        """Return the clearances of a batch of configurations.

        They are exact, but for a capsule whose axis enters a box or a cylinder: its clearance is
        some value ≤ −radius.

        Args:
            q: (nq, configurations) [rad], lengths for prismatic joints. NaN where q holds NaN.

        Raises:
            ValueError: If q has another number of rows than the model has coordinates.
        """
        return Clearances(*self._measured(q, np.inf))

    def collides(self, q: FloatArray) -> BoolArray:
        """Return which configurations collide, (configurations,); true for NaN.

        The answer is the sign of `clearance`, found in less time.

        Raises:
            ValueError: If q has another number of rows than the model has coordinates.
        """
        return np.asarray(~(self._measured(q, 0.0)[0] >= 0.0))  # all rows are the same

    def _measured(self, q: FloatArray, limit: float) -> FloatArray:
        """Return clearances (3, configurations) up to a limit; at a limit of 0 their signs only."""
        q = contiguous_batch(q, self.nq)
        out = np.empty((3, q.shape[1]))
        least_clearances(self.tables, limit, limit == 0.0, q, out)
        return out

    @property
    def free_test(self) -> FreeTest:
        """The test of configurations for kernels of other rooms."""
        return FreeTest.of(num_free, self.tables)


def contiguous_batch(q: FloatArray, nq: int) -> FloatArray:
    """Return configurations (nq, configurations) as kernels take them.

    Raises:
        ValueError: If q has another shape.
    """
    q = np.ascontiguousarray(q, dtype=np.float64)
    if q.ndim != 2 or q.shape[0] != nq:
        raise ValueError(f"q must have shape ({nq}, configurations), was {q.shape}")
    return q
