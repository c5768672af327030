"""Collision models of Pinocchio's models, as tests of bodies build them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from evoexp.collision.bodies.body_collision import BodyCollision, Clearances, Shapes
from evoexp.collision.bodies.clearance_kernels import least_clearances, num_free
from evoexp.records import FloatArray
from evoexp.robots.kinematics import kinematic_table
from evoexp.scenarios.obstacles import ObstacleTable

Pairs = Sequence[tuple[int, int]]


def built(
    model: Any,
    shapes: Shapes,
    obstacles: ObstacleTable,
    pairs: Pairs | None = None,
    ignored: Pairs = (),
    arms: Sequence[int] = (),
) -> BodyCollision:
    """Return the collision model of a model; without pairs, all but neighbours are tested."""
    pairs = default_pairs(model, shapes) if pairs is None else pairs
    return BodyCollision.build(kinematic_table(model), shapes, obstacles, pairs, ignored, arms)


def default_pairs(model: Any, shapes: Shapes) -> list[tuple[int, int]]:
    """Return all pairs of different joints of which neither is the other's parent."""
    own, parents = np.unique(shapes.joint).tolist(), model.parents
    pairs = [(a, b) for k, a in enumerate(own) for b in own[k + 1 :]]
    return [(a, b) for a, b in pairs if parents[b] != a and parents[a] != b]


def num_before_contact(collision: BodyCollision, q: FloatArray) -> int:
    """Return the answer of the kernel `num_free`."""
    return num_free(collision.tables, np.ascontiguousarray(q))


def limited(collision: BodyCollision, q: FloatArray, limit: float) -> Clearances:
    """Return clearances that are not measured above a limit."""
    out = np.empty((3, q.shape[1]))
    least_clearances(collision.tables, limit, False, np.ascontiguousarray(q), out)
    return Clearances(*out)
