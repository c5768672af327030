"""Crossings of links whose points are exact: no tolerance for rounded sines."""

import numpy as np

from evoexp.collision.planar.arm_pairs import Crossings, count_pairs
from evoexp.collision.planar.planar_arms import Arm
from evoexp.records import FloatArray

Base = tuple[float, float]


def count_exactly(
    base_1: Base, points_1: FloatArray, base_2: Base, points_2: FloatArray
) -> Crossings:
    """Count crossings of points (K, 4, N1) and (K, 4, N2) as they are given."""
    first, second = (np.ascontiguousarray(points) for points in (points_1, points_2))
    sums = (np.zeros(points.shape[2], dtype=np.int64) for points in (first, second))
    counted = Crossings(np.zeros((first.shape[2], second.shape[2]), dtype=np.int16), *sums)
    arms = longest_arm(base_1, first), longest_arm(base_2, second)
    count_pairs(arms[0], first, arms[1], second, 0.0, None, *counted)
    return counted


def longest_arm(base: Base, points: FloatArray) -> Arm:
    """Return an arm whose links are no shorter than those of any individual."""
    elbow, tip = points[:, :2], points[:, 2:]
    steps = elbow - np.array(base)[:, None], tip - elbow
    first, second = (float(np.hypot(*np.moveaxis(step, 1, 0)).max()) for step in steps)
    return Arm((float(base[0]), float(base[1])), (first, second))
