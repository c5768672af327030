"""Distances of capsules and obstacles, slowly and plainly, in 80-bit numbers.

The truth where coal iterates.

The distance of a point moving along a segment to a convex body is a convex function of its place,
so a search by thirds finds the least one.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from evoexp.records import FloatArray
from evoexp.scenarios.obstacles import BOX, CAPSULE, CYLINDER, SPHERE, ObstacleTable

Distance = Callable[[FloatArray], Any]
REAL = np.longdouble
ROUNDS = 150  # [-] (2/3)^150 = 4e-27


def along(start: FloatArray, end: FloatArray, distance: Distance) -> float:
    """Return the least distance of a segment's points to a convex body.

    Args:
        start: (3,).
        end: (3,).
        distance: Of points (3,) to the body.
    """
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
    center, turn = table.center[k].astype(REAL), table.rotation[k].reshape(3, 3).astype(REAL)
    a, b, c = table.size[k].astype(REAL)

    def distance(point: FloatArray) -> Any:
        x, y, z = (point - center) @ turn
        if table.kind[k] == SPHERE:
            return np.sqrt(x * x + y * y + z * z) - a
        if table.kind[k] == CAPSULE:
            return np.sqrt(x * x + y * y + (z - np.clip(z, -b, b)) ** 2) - a
        if table.kind[k] == BOX:
            excess = np.array([abs(x) - a, abs(y) - b, abs(z) - c])
        elif table.kind[k] == CYLINDER:
            excess = np.array([np.sqrt(x * x + y * y) - a, abs(z) - b])
        else:
            return z
        outside = np.maximum(excess, 0)
        return np.sqrt(outside @ outside) + min(excess.max(), REAL(0))

    return distance
