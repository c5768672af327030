"""Lengths and unevenness of strings of via-points (Rana & Zalzala 1995, Eqs. 2–5)."""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.paths.layout import check_arm_slices
from evoexp.records import FloatArray, IntArray


def path_lengths(
    via_points: FloatArray, arm_slices: np.ndarray, lengths: FloatArray, unevenness: FloatArray
) -> None:
    """Write length and unevenness of every arm's path.

    Args:
        via_points: (nq, N + 1, lanes).
        arm_slices: (arms, 2) rows of each arm.
        lengths: (arms, lanes), written: the sum of the distances d_i of neighbours (Eqs. 2, 3).
        unevenness: (arms, lanes), written: the sum of |d_i − their mean| (Eqs. 4, 5).

    Raises:
        ValueError: If an output has another shape.
    """
    check_arm_slices(arm_slices, len(via_points))
    expected = (len(arm_slices), via_points.shape[2])
    if lengths.shape != expected or unevenness.shape != expected:
        raise ValueError(
            f"outputs must have shape {expected}, were {lengths.shape} and {unevenness.shape}"
        )
    measure_paths(via_points, arm_slices, lengths, unevenness)


@kernel
def measure_paths(
    via_points: FloatArray, arm_slices: IntArray, lengths: FloatArray, unevenness: FloatArray
) -> None:
    """Run the kernel of `path_lengths`."""
    num, lanes = via_points.shape[1] - 1, via_points.shape[2]
    steps = np.empty((num, lanes))
    for arm in range(len(arm_slices)):
        a, first, stop = np.uint64(arm), arm_slices[arm, 0], arm_slices[arm, 1]
        lengths[a, :] = 0.0
        unevenness[a, :] = 0.0
        for k in range(num):
            i, before = np.uint64(k), np.uint64(k)
            after = np.uint64(k + 1)
            steps[i, :] = 0.0
            for joint in range(first, stop):
                j = np.uint64(joint)
                for lane in range(lanes):
                    d = via_points[j, after, lane] - via_points[j, before, lane]
                    steps[i, lane] += d * d
            for lane in range(lanes):
                steps[i, lane] = np.sqrt(steps[i, lane])
            for lane in range(lanes):
                lengths[a, lane] += steps[i, lane]
        for k in range(num):
            i = np.uint64(k)
            for lane in range(lanes):
                unevenness[a, lane] += abs(steps[i, lane] - lengths[a, lane] / num)
