"""Distances of capsules and obstacles in 80-bit numbers: the truth where coal iterates.

The distance of a point moving along a segment to a convex body is a convex function of its place,
so a search by thirds finds the least one.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from evoexp.records import FloatArray
from evoexp.scenarios.obstacles import ObstacleTable
from references.primitives_numpy import signed_distance

Distance = Callable[[FloatArray], Any]
REAL = np.longdouble
ROUNDS = 150  # [-] (2/3)^150 = 4e-27


def along(start: FloatArray, end: FloatArray, distance: Distance) -> float:
    """Return the least distance of a segment's points, between ends (3,), to a convex body."""
    a, u = start.astype(REAL), end.astype(REAL) - start.astype(REAL)
    if not u.any():
        return float(distance(a))
    low, high = REAL(0), REAL(1)
    for _ in range(ROUNDS):
        one, two = low + (high - low) / 3, high - (high - low) / 3
        if distance(a + one * u) <= distance(a + two * u):
            high = two
        else:
            low = one
    return float(min(distance(a + t * u) for t in (REAL(0), REAL(1), low, high, (low + high) / 2)))


def to_segment(start: FloatArray, end: FloatArray) -> Distance:
    """Return the distance function of a segment."""
    a, u = start.astype(REAL), end.astype(REAL) - start.astype(REAL)
    square = u @ u

    def distance(point: FloatArray) -> Any:
        t = np.clip((point - a) @ u / square, 0, 1) if square > 0 else REAL(0)
        away = point - a - t * u
        return np.sqrt(away @ away)

    return distance


def to_obstacle(table: ObstacleTable, k: int) -> Distance:
    """Return the signed distance function of obstacle k."""
    return lambda point: signed_distance(table, k, point)
