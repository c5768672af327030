"""Shapes, bodies and their parts, and obstacles, packed into arrays for the kernels.

A body is all shapes that move with one joint. Bodies of many shapes are cut into parts for the
checks between bodies: the balls around parts are smaller, and rule out more.
"""

import functools
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.bodies.packed_shapes import (
    BOXES,
    CYLINDERS,
    FIRST_RUN,
    HALF_SPACES,
    STOP_RUN,
    PackedObstacles,
    PackedShapes,
    Units,
)
from evoexp.records import BoolArray, FloatArray, IntArray
from evoexp.robots.kinematics import KinematicTable
from evoexp.scenarios.obstacles import BOX, CAPSULE, CYLINDER, HALF_SPACE, SPHERE, ObstacleTable

SHORTEST = 1e-100  # [length unit] a capsule whose ends are nearer than this is a sphere
PART = 6  # most shapes of a part; a capsule counts as `CAPSULE_WEIGHT`
CAPSULE_WEIGHT = 4

Pairs = Iterable[tuple[int, int]]


class Shapes(NamedTuple):
    """Capsules fixed to the joints of a model; those whose ends coincide are spheres."""

    joint: IntArray  # (shapes,) index of the Pinocchio joint that moves each; 0 for the world
    start: FloatArray  # (shapes, 3) one end, or the centre, in the joint's frame [length unit]
    end: FloatArray  # (shapes, 3) the other end
    radius: FloatArray  # (shapes,) at least 0
    # (shapes,) number of the body that each belongs to; None: all shapes of one joint are one body,
    # whose number is the joint's
    body: IntArray | None = None

    @property
    def labels(self) -> IntArray:
        """(shapes,) number of the body that each belongs to."""
        return self.joint if self.body is None else self.body

    def checked(self, model: Any) -> "Shapes":
        """Return the shapes as arrays of the right types.

        Raises:
            ValueError: If arrays do not fit each other or the model, or a radius is negative.
        """
        joint = np.asarray(self.joint, dtype=np.int64)
        start, end, radius = (
            np.asarray(given, dtype=np.float64) for given in (self.start, self.end, self.radius)
        )
        if joint.ndim != 1 or len(joint) == 0:
            raise ValueError(
                f"shapes.joint must have shape (shapes,) with one shape at least, was {joint.shape}"
            )
        for name, points in (("start", start), ("end", end)):
            if points.shape != (len(joint), 3) or not np.isfinite(points).all():
                raise ValueError(
                    f"shapes.{name} must be finite, of shape ({len(joint)}, 3), was {points.shape}"
                )
        if radius.shape != joint.shape or not np.all((radius >= 0.0) & np.isfinite(radius)):
            raise ValueError(
                f"shapes.radius must be finite, at least 0, of shape {joint.shape}, was "
                f"{radius.tolist()}"
            )
        if joint.min() < 0 or joint.max() >= model.njoints:
            raise ValueError(
                f"shapes.joint must be joints of the model, 0 to {model.njoints - 1}, was "
                f"{joint.tolist()}"
            )
        if self.body is not None and len(self.body) != len(joint):
            raise ValueError(f"shapes.body must have shape {joint.shape}, was {self.body.shape}")
        body = None if self.body is None else np.asarray(self.body, dtype=np.int64)
        return Shapes(joint, start, end, radius, body)


def pack_shapes(
    table: KinematicTable, shapes: Shapes, numbers: IntArray, joints: IntArray
) -> tuple[Units, PackedShapes, list[list[int]]]:
    """Pack the shapes of all bodies, body by body and part by part.

    Args:
        numbers: (bodies,) of the bodies.
        joints: (bodies,) that move them.

    Returns:
        The units, their shapes, and for each body the indices of the units that are its parts.
    """
    # ends and axes in the table's frames
    world = len(table.parent)
    turn = np.concatenate([np.eye(3)[None], table.alignment.transpose(0, 2, 1)])[shapes.joint]
    start = _turned(turn, shapes.start)
    axis = _turned(turn, shapes.end - shapes.start)
    own = [np.flatnonzero(shapes.labels == number) for number in numbers]
    bodies = [
        _pack_body(start[of].tobytes(), axis[of].tobytes(), shapes.radius[of].tobytes())
        for of in own
    ]
    # indices count over all bodies
    first_run = _before([len(body.runs) for body in bodies])
    first_center = _before([len(body.centers) for body in bodies])
    first_rod = _before([len(body.capsules) for body in bodies])
    rows = [
        body.rows + np.array([joint - 1 if joint > 0 else world, run, run, rod, rod, 0, 0])
        for body, joint, run, rod in zip(bodies, joints, first_run, first_rod, strict=True)
    ]
    counts = [len(body.rows) - 1 for body in bodies]
    first_part = len(bodies) + _before(counts)
    # a body of one part is that part itself
    parts = [
        list(range(first, first + count)) if count else [k]
        for k, (first, count) in enumerate(zip(first_part.tolist(), counts, strict=True))
    ]
    units = Units(
        np.concatenate([row[:1] for row in rows] + [row[1:] for row in rows]),
        np.concatenate([body.balls[:1] for body in bodies] + [body.balls[1:] for body in bodies]),
    )
    packed = PackedShapes(
        np.concatenate([b.runs + n for b, n in zip(bodies, first_center, strict=True)]),
        np.concatenate([body.centers for body in bodies]),
        np.concatenate([body.capsules for body in bodies]),
        0,
    )
    most = max(num_spheres(units, packed, k) for k in range(len(units.ball)))
    return units, packed._replace(most=most), parts


def _before(counts: list[int]) -> IntArray:
    """Return for each count the sum of those before it."""
    return np.cumsum([0, *counts])[:-1]


class _Body(NamedTuple):
    """One body's shapes, packed; indices count from its own first run and first capsule."""

    # (1 + parts, 7) columns of `Units.whole`, the frame 0: of the body, then of its parts, which
    # are none where it has only one
    rows: IntArray
    balls: FloatArray  # (1 + parts, 5) rows of `Units.ball`
    runs: IntArray  # (runs, 2) first and one-past-last sphere of equal radius
    centers: FloatArray  # (spheres, 4) with their radii
    capsules: FloatArray  # (capsules, 8) start, axis, radius, 1 / length²


@functools.lru_cache(maxsize=512)
def _pack_body(start_bytes: bytes, axis_bytes: bytes, radius_bytes: bytes) -> _Body:
    """Pack the shapes of one body; a robot's bodies are the same in every scene around it."""
    radius = np.frombuffer(radius_bytes)
    start, axis = (np.frombuffer(given).reshape(-1, 3) for given in (start_bytes, axis_bytes))
    square = (axis * axis).sum(axis=1)
    ball = square <= SHORTEST * SHORTEST
    everything = np.arange(len(radius))
    runs: list[tuple[int, int]] = []
    spheres: list[int] = []
    rods: list[int] = []
    rows: list[tuple[int, ...]] = []
    balls = [_ball(start, axis, radius, everything)]
    cuts = _cut(everything, start + 0.5 * axis, ball)
    for cut in cuts:
        begin = len(runs), len(rods)
        # runs of spheres of equal radius, then the capsules
        for size in np.unique(radius[cut[ball[cut]]]):
            same = cut[ball[cut] & (radius[cut] == size)]
            runs.append((len(spheres), len(spheres) + len(same)))
            spheres.extend(same)
        rods.extend(cut[~ball[cut]])
        rows.append((0, begin[0], len(runs), begin[1], len(rods), 0, 0))
        balls.append(_ball(start, axis, radius, cut))
    at, of = np.array(spheres, dtype=np.int64), np.array(rods, dtype=np.int64)
    count = 1 if len(cuts) == 1 else 1 + len(cuts)
    whole = (0, 0, len(runs), 0, len(rods), 0, 0)
    return _Body(
        np.array([whole, *rows], dtype=np.int64)[:count],
        np.array(balls)[:count],
        np.array(runs, dtype=np.int64).reshape(-1, 2),
        np.column_stack([start[at], radius[at]]),
        np.column_stack([start[of], axis[of], radius[of], 1.0 / square[of]]),
    )


def _turned(turn: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return vectors (n, 3) turned by a rotation each, (n, 3, 3), with terms added in order."""
    terms = turn * vectors[:, None, :]
    return np.asarray(terms[..., 0] + terms[..., 1] + terms[..., 2])


def num_spheres(units: Units, shapes: PackedShapes, unit: int) -> int:
    """Return how many spheres a unit has."""
    first, stop = units.whole[unit, FIRST_RUN], units.whole[unit, STOP_RUN]
    return int(shapes.runs[stop - 1, 1] - shapes.runs[first, 0]) if first < stop else 0


def _cut(own: IntArray, middle: FloatArray, ball: BoolArray) -> list[IntArray]:
    """Halve a set of shapes across its longest extent until every piece is a part.

    Args:
        own: Indices of the shapes.
        middle: (shapes, 3) their middles.
        ball: (shapes,) whether each is a sphere.
    """
    if len(own) == 1 or np.where(ball[own], 1, CAPSULE_WEIGHT).sum() <= PART:
        return [own]
    axis = np.ptp(middle[own], axis=0).argmax()
    order = own[np.argsort(middle[own, axis], kind="stable")]
    half = len(own) // 2
    return _cut(order[:half], middle, ball) + _cut(order[half:], middle, ball)


def _ball(start: FloatArray, axis: FloatArray, radius: FloatArray, own: IntArray) -> FloatArray:
    """Return a row of `Units.ball` (5,) for some capsules."""
    ends = np.concatenate([start[own], start[own] + axis[own]])
    radii = np.concatenate([radius[own], radius[own]])
    center = 0.5 * ((ends - radii[:, None]).min(axis=0) + (ends + radii[:, None]).max(axis=0))
    away = np.sqrt(((ends - center) ** 2).sum(axis=1))
    return np.array([*center, (away + radii).max(), (away - radii).min()])


def pack_obstacles(
    obstacles: ObstacleTable,
    numbers: IntArray,
    joints: IntArray,
    ignored: tuple[tuple[int, int], ...],
) -> tuple[PackedObstacles, IntArray]:
    """Pack the obstacles, and list for each body those that it is checked against.

    A body is checked against all but the ignored ones; bodies of the world against none.

    Args:
        numbers: (bodies,) of the bodies.
        joints: (bodies,) that move them.
        ignored: Pairs (body's number, obstacle).

    Returns:
        The obstacles, and the first and one-past-last entry of each body's list, (bodies, 2).

    Raises:
        SettingError: If an obstacle is an ellipse.
        ValueError: If an ignored pair names no joint with shapes, or no obstacle.
    """
    kind, size = obstacles.without_ellipses().kind, obstacles.size
    for number, k in ignored:
        if number not in numbers or not 0 <= k < len(kind):
            must = (
                f"pairs (joint, obstacle), of joints {numbers.tolist()} and obstacles 0 to "
                f"{len(kind) - 1}"
            )
            raise ValueError(f"ignored must hold {must}, was {(number, k)}")
    # half the edges and thickness of a box, or radius and half the length of a cylinder
    core = np.zeros((len(kind), 4))
    core[kind == SPHERE, 3] = size[kind == SPHERE, 0]
    core[kind == BOX, :3] = size[kind == BOX]
    core[kind == CYLINDER, :2] = size[kind == CYLINDER, :2]
    core[kind == CAPSULE, 2:] = size[kind == CAPSULE, 1::-1]
    box = core.copy()
    box[kind == CYLINDER, :3] = size[kind == CYLINDER][:, [0, 0, 1]]
    around = np.sqrt((core[:, :3] ** 2).sum(axis=1)) + core[:, 3]
    data = np.column_stack([obstacles.center, obstacles.rotation, core, around, box])
    classes = np.select([kind == CYLINDER, kind == HALF_SPACE], [CYLINDERS, HALF_SPACES], BOXES)
    skipped = {(int(number), int(k)) for number, k in ignored}
    lists = [
        [k for k in range(len(kind)) if joint > 0 and (int(number), k) not in skipped]
        for number, joint in zip(numbers, joints, strict=True)
    ]
    entries = [(k, classes[k]) for one in lists for k in one]
    listed = np.array(entries, dtype=np.int64).reshape(-1, 2)
    ends = np.cumsum([0, *map(len, lists)])
    return PackedObstacles(data, listed), np.column_stack([ends[:-1], ends[1:]])
