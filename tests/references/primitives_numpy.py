"""The plain way for whole populations: numpy on all sphere centres, all obstacles, all pairs.

Configurations last. Distances of points are as good as the type of their numbers.
"""

from typing import Any

import numpy as np

from evoexp.records import FloatArray
from evoexp.robots.kinematics import KinematicChain
from evoexp.scenarios.obstacles import BOX, CAPSULE, CYLINDER, SPHERE, ObstacleTable


def sphere_centers(
    table: KinematicChain,  # of revolute joints
    joint: np.ndarray,  # (spheres,) index into the table
    local: FloatArray,  # (spheres, 3) in the table's frames
    q: FloatArray,  # (nq, configurations) [rad]
) -> FloatArray:
    """Return the centres of spheres in the world, (spheres, 3, configurations)."""
    rotations, origins = [], []
    for k, before in enumerate(table.parent):
        s, c = np.sin(q[table.index_q[k]]), np.cos(q[table.index_q[k]])
        zero = np.zeros_like(s)
        turn = np.array([[c, -s, zero], [s, c, zero], [zero, zero, zero + 1.0]])
        rotation = np.einsum("ij,jkn->ikn", table.rotation[k].reshape(3, 3), turn)
        origin = np.tile(table.translation[k][:, None], q.shape[1])
        if before >= 0:
            rotation = np.einsum("ijn,jkn->ikn", rotations[before], rotation)
            shift = np.tensordot(table.translation[k], rotations[before], (0, 1))
            origin = origins[before] + shift
        rotations.append(rotation)
        origins.append(origin)
    turns, places = np.array(rotations)[joint], np.array(origins)[joint]
    return np.asarray(np.einsum("sijn,sj->sin", turns, local) + places)


def signed_distance(table: ObstacleTable, k: int, points: Any) -> Any:
    """Return the signed distances of points (…, 3) from obstacle k, in the type of the points."""
    kind, turn = table.kind[k], table.rotation[k].reshape(3, 3).astype(points.dtype)
    x, y, z = np.moveaxis((points - table.center[k].astype(points.dtype)) @ turn, -1, 0)
    a, b, c = table.size[k].astype(points.dtype)
    if kind == SPHERE:
        return np.sqrt(x * x + y * y + z * z) - a
    if kind == CAPSULE:
        return np.sqrt(x * x + y * y + (z - np.clip(z, -b, b)) ** 2) - a
    if kind not in (BOX, CYLINDER):  # a half space
        return z
    box, round_ = (abs(x) - a, abs(y) - b, abs(z) - c), (np.sqrt(x * x + y * y) - a, abs(z) - b)
    excess = np.array(box if kind == BOX else round_)
    outside = np.maximum(excess, 0)
    return np.sqrt((outside * outside).sum(axis=0)) + np.minimum(excess.max(axis=0), 0)


def to_obstacles(
    centers: FloatArray, radius: FloatArray, table: ObstacleTable, checked: np.ndarray
) -> FloatArray:
    """Return the least clearance to obstacles, (configurations,); checked: (spheres, obstacles)."""
    least, points = np.full(centers.shape[2], np.inf), np.moveaxis(centers, 1, -1)
    for k, own in enumerate(checked.T):
        clearance = signed_distance(table, k, points[own]) - radius[own, None]
        least = np.minimum(least, clearance.min(axis=0))
    return least


def to_self(
    centers: FloatArray, radius: FloatArray, one: np.ndarray, two: np.ndarray
) -> FloatArray:
    """Return the least clearance of pairs of spheres, (configurations,); one, two: (pairs,)."""
    away = centers[one] - centers[two]
    distance = np.sqrt(np.einsum("pin,pin->pn", away, away)) - (radius[one] + radius[two])[:, None]
    return np.asarray(distance.min(axis=0))
