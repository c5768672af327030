"""What the kernels of spheres and capsules read.

Shapes, bodies and their parts, obstacles, as arrays.

A body is all shapes that move with one joint. Bodies of many shapes are cut into parts for the
checks between bodies: the balls around parts are smaller, and rule out more.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from evoexp.collision.models.encounter_kernels import BOXES, CYLINDERS, HALF_SPACES
from evoexp.records import FloatArray
from evoexp.robots.kinematics import KinematicTable
from evoexp.scenarios.obstacles import BOX, CAPSULE, CYLINDER, HALF_SPACE, SPHERE, ObstacleTable

SHORTEST = 1e-100
"""[length unit] A capsule whose ends are nearer than this is a sphere."""

PART = 6
"""Shapes of a part, at most; a capsule counts as `CAPSULE_WEIGHT`."""

CAPSULE_WEIGHT = 4

Pairs = Iterable[tuple[int, int]]


class Shapes(NamedTuple):
    """Capsules fixed to the joints of a model; those whose ends coincide are spheres.

    Attributes:
        joint: (shapes,) index of the Pinocchio joint that moves each; 0 for the world.
        start: (shapes, 3) one end, or the centre, in the joint's frame [length unit].
        end: (shapes, 3) the other end.
        radius: (shapes,) at least 0.
        body: (shapes,) number of the body that each belongs to; None: all shapes of one joint are
            one body, whose number is the joint's.
    """

    joint: np.ndarray
    start: FloatArray
    end: FloatArray
    radius: FloatArray
    body: np.ndarray | None = None

    @property
    def labels(self) -> np.ndarray:
        """(shapes,) number of the body that each belongs to."""
        return self.joint if self.body is None else self.body

    def checked(self, model: Any) -> "Shapes":
        """Return the shapes as arrays of the right types.

        Raises:
            ValueError: If arrays do not fit each other or the model, or a radius is negative.
        """
        joint, radius = (
            np.asarray(self.joint, dtype=np.int64),
            np.asarray(self.radius, dtype=np.float64),
        )
        start, end = (
            np.asarray(self.start, dtype=np.float64),
            np.asarray(self.end, dtype=np.float64),
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


class Units(NamedTuple):
    """Bodies and then parts of bodies, each with a ball around it.

    Attributes:
        whole: (units, 7) frame (a joint of the kinematic table, one past its end: the world); first
            and one-past-last run of spheres; capsule; entry in the list of obstacles that a body is
            checked against.
        ball: (units, 5) centre in the frame, radius, and the least distance of any shape's end from
            this centre, less its own radius.
    """

    whole: np.ndarray
    ball: FloatArray


class PackedShapes(NamedTuple):
    """Spheres and capsules in the frames of the kinematic table, in the order of the units.

    Attributes:
        runs: (runs, 2) first and one-past-last sphere of equal radius.
        spheres: (spheres, 4) centre, radius.
        capsules: (capsules, 8) one end, from there to the other, radius, 1 / squared length.
        most: Greatest number of spheres of a unit.
    """

    runs: np.ndarray
    spheres: FloatArray
    capsules: FloatArray
    most: int


class PackedObstacles(NamedTuple):
    """Obstacles, and the lists of those that each body is checked against.

    Attributes:
        data: (obstacles, 21) centre; rotation, row by row; half the edges and thickness of a box,
            or radius and half the length of a cylinder; radius of a ball around; half the edges and
            thickness of a box around.
        listed: (entries, 2) obstacle, and its class: BOXES, CYLINDERS or HALF_SPACES; body by body.
    """

    data: FloatArray
    listed: np.ndarray


def pack_shapes(
    table: KinematicTable, shapes: Shapes, numbers: np.ndarray, joints: np.ndarray
) -> tuple[Units, PackedShapes, list[list[int]]]:
    """Return the shapes of all bodies, and of each body the units that are its parts.

    Args:
        table: The kinematic table.
        shapes: All shapes.
        numbers: (bodies,) of the bodies.
        joints: (bodies,) that move them.
    """
    world = len(table.parent)
    turn = np.concatenate([np.eye(3)[None], table.alignment.transpose(0, 2, 1)])[shapes.joint]
    start = np.einsum("nij,nj->ni", turn, shapes.start)
    axis = np.einsum("nij,nj->ni", turn, shapes.end - shapes.start)
    square = (axis * axis).sum(axis=1)
    ball = square <= SHORTEST * SHORTEST
    runs: list[tuple[int, int]] = []
    spheres: list[int] = []
    rods: list[int] = []
    parts: list[list[int]] = []
    bodies: list[tuple[Any, ...]] = []
    cuts: list[tuple[Any, ...]] = []
    for k, (number, joint) in enumerate(zip(numbers, joints, strict=True)):
        own, first = np.flatnonzero(shapes.labels == number), (len(runs), len(rods))
        frame = int(joint) - 1 if joint > 0 else world
        rows = []
        for cut in _cut(own, start + 0.5 * axis, ball):
            begin = len(runs), len(rods)
            for radius in np.unique(shapes.radius[cut[ball[cut]]]):
                same = cut[ball[cut] & (shapes.radius[cut] == radius)]
                runs.append((len(spheres), len(spheres) + len(same)))
                spheres.extend(same)
            rods.extend(cut[~ball[cut]])
            rows.append(
                (
                    frame,
                    begin[0],
                    len(runs),
                    begin[1],
                    len(rods),
                    _ball(start, axis, shapes.radius, cut),
                )
            )
        bodies.append(
            (
                frame,
                first[0],
                len(runs),
                first[1],
                len(rods),
                _ball(start, axis, shapes.radius, own),
            )
        )
        only = len(rows) == 1
        parts.append([k] if only else [len(joints) + len(cuts) + n for n in range(len(rows))])
        cuts.extend([] if only else rows)
    rows = bodies + cuts
    whole = np.array([(*row[:5], 0, 0) for row in rows], dtype=np.int64)
    units = Units(whole, np.array([row[5] for row in rows]))
    bounds = np.array(runs, dtype=np.int64).reshape(-1, 2)
    at, of = np.array(spheres, dtype=np.int64), np.array(rods, dtype=np.int64)
    centers = np.column_stack([start[at], shapes.radius[at]])
    capsules = np.column_stack([start[of], axis[of], shapes.radius[of], 1.0 / square[of]])
    packed = PackedShapes(bounds, centers, capsules, 0)
    return (
        units,
        packed._replace(most=max(num_spheres(units, packed, k) for k in range(len(units.ball)))),
        parts,
    )


def num_spheres(units: Units, shapes: PackedShapes, unit: int) -> int:
    """Return how many spheres a unit has."""
    first, stop = units.whole[unit, 1:3]
    return int(shapes.runs[stop - 1, 1] - shapes.runs[first, 0]) if first < stop else 0


def _cut(own: np.ndarray, middle: FloatArray, ball: np.ndarray) -> list[np.ndarray]:
    """Halve a set of shapes, by number, across its longest extent.

    Until every piece is small enough for a part.
    """
    if len(own) == 1 or np.where(ball[own], 1, CAPSULE_WEIGHT).sum() <= PART:
        return [own]
    axis = np.ptp(middle[own], axis=0).argmax()
    order = own[np.argsort(middle[own, axis], kind="stable")]
    half = len(own) // 2
    return _cut(order[:half], middle, ball) + _cut(order[half:], middle, ball)


def _ball(start: FloatArray, axis: FloatArray, radius: FloatArray, own: np.ndarray) -> FloatArray:
    """Return (5,) centre and radius of a ball around some capsules.

    And the slack that `Units` tells of.
    """
    ends, radii = (
        np.concatenate([start[own], start[own] + axis[own]]),
        np.concatenate([radius[own], radius[own]]),
    )
    center = 0.5 * ((ends - radii[:, None]).min(axis=0) + (ends + radii[:, None]).max(axis=0))
    away = np.sqrt(((ends - center) ** 2).sum(axis=1))
    return np.array([*center, (away + radii).max(), (away - radii).min()])


def pack_obstacles(
    obstacles: ObstacleTable,
    numbers: np.ndarray,
    joints: np.ndarray,
    ignored: tuple[tuple[int, int], ...],
) -> tuple[PackedObstacles, np.ndarray]:
    """Return the obstacles, and where each body's list of them begins and ends, (bodies, 2).

    A body is checked against all but the ignored ones; bodies of the world against none.

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
    listed = np.array([(k, classes[k]) for one in lists for k in one], dtype=np.int64).reshape(
        -1, 2
    )
    ends = np.cumsum([0, *map(len, lists)])
    return PackedObstacles(data, listed), np.column_stack([ends[:-1], ends[1:]])
