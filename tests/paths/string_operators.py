"""The kernels of strings of via-points, called for arrays of any number of lanes."""

import numpy as np

from evoexp.paths.lengths import relax_points
from evoexp.paths.redistribution import redistribute_arms


def padded(num_lanes: int) -> int:
    return -(-num_lanes // 8) * 8


def redistribute(
    via_points: np.ndarray,
    arm_slices: np.ndarray,
    num_lanes: int,
    end: str = "natural",
    samples: int = 8,
) -> None:
    if via_points.shape[1] > 2:
        redistribute_arms(via_points, arm_slices, padded(num_lanes), samples, end == "clamped")


def relax(via_points: np.ndarray, delta: float, num_lanes: int) -> None:
    if delta > 0.0:
        relax_points(via_points, delta, padded(num_lanes))
