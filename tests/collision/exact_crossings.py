"""Crossings of links whose points are exact: no tolerance for rounded sines."""

import numpy as np

from evoexp.collision.planar import link_crossing_kernels as kernels
from evoexp.collision.planar.link_crossings import Crossings, everyone, no_crossings
from evoexp.records import FloatArray

Base = tuple[float, float]


def count_exactly(
    base_1: Base, points_1: FloatArray, base_2: Base, points_2: FloatArray
) -> Crossings:
    """Count crossings of points (K, 4, N1) and (K, 4, N2) as they are given."""
    first, second = (np.ascontiguousarray(points) for points in (points_1, points_2))
    counted = no_crossings(first.shape[2], second.shape[2])
    rows, others, columns = everyone(counted)
    assert kernels.crossings(base_1, first, rows, others, base_2, second, columns, 0.0, *counted)
    return counted
