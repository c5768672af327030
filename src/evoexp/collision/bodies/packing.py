"""Shapes, bodies and their parts, pairs and obstacles, packed into the tables of the kernels.

A body is all shapes that move with one joint, unless shapes name their bodies. Bodies of many
shapes are cut into parts: the balls around parts are smaller, and rule out more.
"""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evoexp.collision.bodies.body_shapes import Shapes
from evoexp.collision.bodies.body_tables import (
    AROUND,
    FIRST_BALL,
    FIRST_PART,
    FIRST_RUN,
    REACH,
    STOP_CAPSULE,
    STOP_ENTRY,
    STOP_PART,
    STOP_RUN,
    THICKNESS,
    BodyTables,
)
from evoexp.collision.bodies.distances import MARGIN
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import KinematicTable
from evoexp.scenarios.obstacles import BOX, CAPSULE, CYLINDER, HALF_SPACE, SPHERE, ObstacleTable

OBSTACLES, BETWEEN, SELF = range(3)
"""Rows of the clearances: to obstacles, between arms, between parts of one arm."""

SHORTEST = 1e-100  # [length unit] a capsule whose ends are nearer than this is a sphere
PART = 6  # most shapes of a part; a capsule counts as `CAPSULE_WEIGHT`
CAPSULE_WEIGHT = 4

BodyPair = tuple[int, int]


def pack_tables(
    table: KinematicTable,
    shapes: Shapes,
    obstacles: ObstacleTable,
    pairs: Sequence[BodyPair],
    ignored: Sequence[BodyPair],
    arms: Sequence[int],
) -> BodyTables:
    """Return the tables of a robot among obstacles.

    Args:
        table: The kinematic table.
        shapes: Checked shapes of the robot.
        obstacles: What does not move.
        pairs: Numbers of two bodies each that are checked against each other.
        ignored: Pairs (body's number, obstacle) that are not checked.
        arms: The arm of each joint of the model; negative numbers belong to every arm.

    Raises:
        SettingError: If an obstacle is an ellipse.
        ValueError: If pairs name no bodies or no obstacles.
    """
    kind, size = obstacles.without_ellipses().kind, obstacles.size
    numbers, first = np.unique(shapes.labels, return_index=True)
    joints = shapes.joint[first]
    tables = _pack_bodies(table, shapes, obstacles, numbers, joints)
    # half the edges and the thickness of a box that an obstacle is, or that is around a cylinder
    cores = tables.cores
    cores[kind == SPHERE, THICKNESS] = size[kind == SPHERE, 0]
    cores[kind == BOX, :THICKNESS] = size[kind == BOX]
    cores[kind == CYLINDER, :THICKNESS] = size[kind == CYLINDER][:, [0, 0, 1]]
    cores[kind == CAPSULE, 2 : THICKNESS + 1] = size[kind == CAPSULE, 1::-1]
    edges = np.where((kind == CYLINDER)[:, None], size, cores[:, :THICKNESS])
    cores[:, AROUND] = np.sqrt((edges * edges).sum(axis=1)) + cores[:, THICKNESS]
    # a bound of all coordinates
    reach = np.sqrt((tables.chain.translation**2).sum(axis=1)).sum()
    reach += (np.sqrt((tables.balls[:, :3] ** 2).sum(axis=1)) + tables.balls[:, REACH]).max()
    outside = np.sqrt((obstacles.center**2).sum(axis=1)) + cores[:, AROUND]
    tables = tables._replace(scale=float(reach + max(outside, default=0.0)))
    entries, owners = _pack_entries(tables, numbers, joints, ignored)
    body_pairs, parts = _pack_pairs(tables, numbers, [arms[joint] for joint in joints], pairs)
    return tables._replace(entries=entries, owners=owners, pairs=body_pairs, parts=parts)


def _pack_bodies(
    table: KinematicTable,
    shapes: Shapes,
    obstacles: ObstacleTable,
    numbers: IntArray,
    joints: IntArray,
) -> BodyTables:
    """Return tables of all shapes, body by body and part by part, without entries and pairs."""
    # ends and axes in the table's frames
    world = len(table.parent)
    turn = np.concatenate([np.eye(3)[None], table.alignment.transpose(0, 2, 1)])[shapes.joint]
    start = _turned(turn, shapes.start)
    axis = _turned(turn, shapes.end - shapes.start)
    bodies, units = [], []
    num_runs, num_spheres, num_capsules = 0, 0, 0
    next_part = len(numbers)
    for k, (number, joint) in enumerate(zip(numbers, joints, strict=True)):
        own = shapes.labels == number
        body = _pack_body(start[own].tobytes(), axis[own].tobytes(), shapes.radius[own].tobytes())
        bodies.append(body._replace(runs=body.runs + num_spheres))
        # frame, shapes, entries; a body of one part is that part itself
        rows = np.zeros((len(body.rows), STOP_PART + 1), dtype=np.int64)
        rows[:, 0] = joint - 1 if joint > 0 else world
        rows[:, FIRST_RUN : STOP_RUN + 1] = body.rows[:, :2] + num_runs
        rows[:, STOP_RUN + 1 : STOP_CAPSULE + 1] = body.rows[:, 2:] + num_capsules
        count = len(rows) - 1
        rows[0, FIRST_PART:] = (next_part, next_part + count) if count else (k, k + 1)
        units.append(rows)
        next_part += count
        num_runs += len(body.runs)
        num_spheres += len(body.spheres)
        num_capsules += len(body.capsules)
    runs, spheres, capsules = (
        np.concatenate([body[column] for body in bodies]) for column in range(2, 5)
    )
    nothing = np.empty(0, dtype=np.int64)
    return BodyTables(
        table.chain,
        obstacles,
        np.zeros((len(obstacles.kind), AROUND + 1)),
        np.concatenate([rows[:1] for rows in units] + [rows[1:] for rows in units]),
        np.concatenate([body.balls[:1] for body in bodies] + [body.balls[1:] for body in bodies]),
        runs,
        spheres,
        capsules,
        np.empty((0, 4)),
        nothing,
        nothing,
        nothing,
        0.0,
    )


class _Body(NamedTuple):
    """One body's shapes, packed; indices count from its own first run, sphere and capsule."""

    # (1 + parts, 4) first and one-past-last run and capsule: of the body, then of its parts, which
    # are none where it has only one
    rows: IntArray
    balls: FloatArray  # (1 + parts, 4) as `BodyTables.balls`, as those below
    runs: IntArray
    spheres: FloatArray
    capsules: FloatArray


@functools.lru_cache(maxsize=512)
def _pack_body(start_bytes: bytes, axis_bytes: bytes, radius_bytes: bytes) -> _Body:
    """Pack the shapes of one body; a robot's bodies are the same in every scene around it."""
    radius = np.frombuffer(radius_bytes)
    start, axis = (np.frombuffer(points).reshape(-1, 3) for points in (start_bytes, axis_bytes))
    square = (axis * axis).sum(axis=1)
    is_sphere = square <= SHORTEST * SHORTEST
    everything = np.arange(len(radius))
    runs: list[tuple[int, int]] = []
    spheres: list[int] = []
    capsules: list[int] = []
    rows, balls = [], [_ball(start, axis, radius, everything)]
    for part in _cut(everything, start + 0.5 * axis, is_sphere):
        first_run, first_capsule = len(runs), len(capsules)
        # runs of spheres of equal radius, then the capsules
        for size in np.unique(radius[part[is_sphere[part]]]):
            same = part[is_sphere[part] & (radius[part] == size)]
            runs.append((len(spheres), len(spheres) + len(same)))
            spheres.extend(same)
        capsules.extend(part[~is_sphere[part]])
        rows.append((first_run, len(runs), first_capsule, len(capsules)))
        balls.append(_ball(start, axis, radius, part))
    at, of = np.array(spheres, dtype=np.int64), np.array(capsules, dtype=np.int64)
    count = 1 if len(rows) == 1 else 1 + len(rows)
    return _Body(
        np.array([(0, len(runs), 0, len(capsules)), *rows], dtype=np.int64)[:count],
        np.array(balls)[:count],
        np.array(runs, dtype=np.int64).reshape(-1, 2),
        np.column_stack([start[at], radius[at]]),
        np.column_stack([start[of], axis[of], radius[of], 1.0 / square[of]]),
    )


def _turned(turn: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return vectors (n, 3) turned by a rotation each, (n, 3, 3), with terms added in order."""
    terms = turn * vectors[:, None, :]
    return np.asarray(terms[..., 0] + terms[..., 1] + terms[..., 2])


def _cut(own: IntArray, middle: FloatArray, is_sphere: BoolArray) -> list[IntArray]:
    """Halve a set of shapes across its longest extent until every piece is a part.

    Args:
        own: Indices of the shapes.
        middle: (shapes, 3) their middles.
        is_sphere: (shapes,) whether each is a sphere.
    """
    if len(own) == 1 or np.where(is_sphere[own], 1, CAPSULE_WEIGHT).sum() <= PART:
        return [own]
    axis = np.ptp(middle[own], axis=0).argmax()
    order = own[np.argsort(middle[own, axis], kind="stable")]
    half = len(own) // 2
    return _cut(order[:half], middle, is_sphere) + _cut(order[half:], middle, is_sphere)


def _ball(start: FloatArray, axis: FloatArray, radius: FloatArray, own: IntArray) -> FloatArray:
    """Return the centre and radius of a ball around some capsules, (4,)."""
    ends = np.concatenate([start[own], start[own] + axis[own]])
    radii = np.concatenate([radius[own], radius[own]])
    center = 0.5 * ((ends - radii[:, None]).min(axis=0) + (ends + radii[:, None]).max(axis=0))
    away = np.sqrt(((ends - center) ** 2).sum(axis=1))
    return np.array([*center, (away + radii).max()])


def _pack_entries(
    tables: BodyTables, numbers: IntArray, joints: IntArray, ignored: Sequence[BodyPair]
) -> tuple[FloatArray, IntArray]:
    """Return entries and owners, and write their places into the units.

    A body is checked against all obstacles but the ignored ones; bodies of the world against none.
    """
    kind = tables.obstacles.kind
    for number, k in ignored:
        if number not in numbers or not 0 <= k < len(kind):
            must = (
                f"pairs (joint, obstacle), of joints {numbers.tolist()} and obstacles 0 to "
                f"{len(kind) - 1}"
            )
            raise ValueError(f"ignored must hold {must}, was {(number, k)}")
    skipped = {(int(number), int(k)) for number, k in ignored}
    balls, flats = np.flatnonzero(kind != HALF_SPACE), np.flatnonzero(kind == HALF_SPACE)
    entries: list[FloatArray] = []
    owners: list[int] = []
    for b, (number, joint) in enumerate(zip(numbers.tolist(), joints, strict=True)):
        ends = [len(owners)]
        for group in (balls, flats):
            chosen = [o for o in group.tolist() if joint > 0 and (number, o) not in skipped]
            entries += [_entry(tables, o, float(tables.balls[b, REACH])) for o in chosen]
            owners += chosen
            ends.append(len(owners))
        tables.units[b, FIRST_BALL : STOP_ENTRY + 1] = ends
    return np.array(entries).reshape(-1, 4), np.array(owners, dtype=np.int64)


def _entry(tables: BodyTables, o: int, reach: float) -> FloatArray:
    """Return the coefficients of a function of a ball's centre m: positive where it is far enough.

    The function is m² + (e0, e1, e2) · m + e3 for a ball of radius R around an obstacle at c:
    |m − c|² − R² multiplied out. Of a half-space it is linear.
    """
    center = tables.obstacles.center[o]
    if tables.obstacles.kind[o] == HALF_SPACE:
        normal = tables.obstacles.rotation[o, [2, 5, 8]]
        level = (normal * center).sum() + reach * MARGIN
        return tables.scale * np.array([*normal, -level])
    within = (float(tables.cores[o, AROUND]) + reach) * MARGIN
    return np.array([*(-2.0 * center), (center**2).sum() - within * within])


def _pack_pairs(
    tables: BodyTables, numbers: IntArray, arms: Sequence[int], pairs: Sequence[BodyPair]
) -> tuple[IntArray, IntArray]:
    """Return pairs of bodies, and pairs of their parts; the part with more spheres comes first.

    It stays in its frame where they are measured.
    """
    body = {int(number): k for k, number in enumerate(numbers)}
    units, runs = tables.units, tables.runs
    counts = [
        int((runs[first:stop, 1] - runs[first:stop, 0]).sum())
        for first, stop in units[:, FIRST_RUN : STOP_RUN + 1].tolist()
    ]
    of_bodies: list[tuple[int, ...]] = []
    of_parts: list[tuple[int, int]] = []
    for one, two in pairs:
        if one not in body or two not in body or one == two:
            raise ValueError(
                f"pairs must hold two different joints of {numbers.tolist()} each, was {(one, two)}"
            )
        a, b, first = body[one], body[two], len(of_parts)
        between = arms[a] != arms[b] and min(arms[a], arms[b]) >= 0
        for i in range(*units[a, FIRST_PART : STOP_PART + 1].tolist()):
            for j in range(*units[b, FIRST_PART : STOP_PART + 1].tolist()):
                of_parts.append((i, j) if counts[i] >= counts[j] else (j, i))
        of_bodies.append((a, b, first, len(of_parts), BETWEEN if between else SELF))
    return (
        np.array(of_bodies, dtype=np.int64).reshape(-1, 5),
        np.array(of_parts, dtype=np.int64).reshape(-1, 2),
    )
