"""The plain way for whole populations: numpy on all sphere centres, all obstacles, all pairs.

Configurations last.
"""

from typing import Any

import numpy as np

from evoexp.records import FloatArray
from evoexp.robots.kinematics import KinematicTable
from evoexp.scenarios.obstacles import BOX, CAPSULE, CYLINDER, SPHERE, ObstacleTable


def sphere_centers(
    table: KinematicTable, joint: np.ndarray, local: FloatArray, q: FloatArray
) -> FloatArray:
    """Return the centres of spheres in the world, (spheres, 3, configurations).

    Args:
        table: Of revolute joints.
        joint: (spheres,) index into the table.
        local: (spheres, 3) in the table's frames.
        q: (nq, configurations) [rad].
    """
    rotations, origins = [], []
    for k, before in enumerate(table.parent):
        s, c = np.sin(q[table.index_q[k]]), np.cos(q[table.index_q[k]])
        zero = np.zeros_like(s)
        turn = np.array([[c, -s, zero], [s, c, zero], [zero, zero, zero + 1.0]])
        own = np.einsum("ij,jkn->ikn", table.rotation[k].reshape(3, 3), turn)
        shift = table.translation[k]
        first = before < 0
        rotations.append(own if first else np.einsum("ijn,jkn->ikn", rotations[before], own))
        rest = np.tile(shift[:, None], q.shape[1])
        origins.append(
            rest if first else origins[before] + np.tensordot(shift, rotations[before], (0, 1))
        )
    turns, places = np.array(rotations)[joint], np.array(origins)[joint]
    return np.asarray(np.einsum("sijn,sj->sin", turns, local) + places)


def to_obstacles(
    centers: FloatArray, radius: FloatArray, table: ObstacleTable, checked: np.ndarray
) -> FloatArray:
    """Return the least clearance to obstacles, (configurations,); checked: (spheres, obstacles)."""
    least = np.full(centers.shape[2], np.inf)
    for k in range(len(table.kind)):
        own = checked[:, k]
        turn = table.rotation[k].reshape(3, 3)
        x, y, z = np.einsum("ij,sin->jsn", turn, centers[own] - table.center[k][:, None])
        a, b, c = table.size[k]
        if table.kind[k] == SPHERE:
            distance = np.sqrt(x * x + y * y + z * z) - a
        elif table.kind[k] == CAPSULE:
            distance = np.sqrt(x * x + y * y + (z - np.clip(z, -b, b)) ** 2) - a
        elif table.kind[k] == BOX:
            distance = _from_excess(np.abs(x) - a, np.abs(y) - b, np.abs(z) - c)
        elif table.kind[k] == CYLINDER:
            distance = _from_excess(np.sqrt(x * x + y * y) - a, np.abs(z) - b)
        else:
            distance = z
        least = np.minimum(least, (distance - radius[own, None]).min(axis=0))
    return least


def to_self(
    centers: FloatArray, radius: FloatArray, one: np.ndarray, two: np.ndarray
) -> FloatArray:
    """Return the least clearance of pairs of spheres, (configurations,); one, two: (pairs,)."""
    away = centers[one] - centers[two]
    distance = np.sqrt(np.einsum("pin,pin->pn", away, away)) - (radius[one] + radius[two])[:, None]
    return np.asarray(distance.min(axis=0))


def _from_excess(*excess: FloatArray) -> Any:
    outside = np.sqrt(sum(np.maximum(one, 0.0) ** 2 for one in excess))
    return outside + np.minimum(np.maximum.reduce(excess), 0.0)
