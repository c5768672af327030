"""Lengths and unevenness of strings of via-points, and relaxation (Rana & Zalzala 1995)."""

import numpy as np

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.vectors import LANES, load, magnitude, root, spread, store
from evoexp.records import FloatArray, IntArray

VECTOR, ONE = np.uint64(LANES), np.uint64(1)


@kernel
def measure_paths(
    via_points: FloatArray, arm_slices: IntArray, lengths: FloatArray, unevenness: FloatArray
) -> None:
    """Write length and unevenness of every arm's path, each (arms, lanes).

    The via-points are (nq, N + 1, lanes), lanes a multiple of eight. The length is the sum of the
    distances d_i of neighbours (Eqs. 2, 3), the unevenness that of |d_i − their mean| (Eqs. 4, 5).
    """
    num, pitch = np.uint64(via_points.shape[1] - 1), np.uint64(via_points.shape[2])
    points, steps = borrowed(via_points.reshape(-1)), np.empty(num * VECTOR)
    lengths_of_arms, unevenness_of_arms = borrowed((lengths.reshape(-1), unevenness.reshape(-1)))
    for arm in range(len(arm_slices)):
        first, stop = np.uint64(arm_slices[arm, 0]), np.uint64(arm_slices[arm, 1])
        for lane in range(np.uint64(0), pitch, VECTOR):
            # Eqs. 2, 3: distances of neighbours
            length = spread(0.0)
            for i in range(num):
                squared = spread(0.0)
                for j in range(first, stop):
                    place = (j * (num + ONE) + i) * pitch + lane
                    d = load(points, place + pitch) - load(points, place)
                    squared = squared + d * d
                step = root(squared)
                store(steps, i * VECTOR, step)
                length = length + step
            # Eqs. 4, 5
            mean, uneven = length / np.float64(num), spread(0.0)
            for i in range(num):
                uneven = uneven + magnitude(load(steps, i * VECTOR) - mean)
            store(lengths_of_arms, np.uint64(arm) * pitch + lane, length)
            store(unevenness_of_arms, np.uint64(arm) * pitch + lane, uneven)


@kernel
def relax_points(via_points: FloatArray, delta: float, num_lanes: int) -> None:
    """Move via-points (nq, N + 1, lanes) by `delta` toward the middle of their neighbours.

    This is one sweep of the loop of Rana & Zalzala 1995, Eqs. 8 and 9, as it is written: point i
    sees point i − 1 as already moved. The ends stay. `num_lanes` is a multiple of eight.
    """
    flat, pitch = borrowed(via_points.reshape(-1)), np.uint64(via_points.shape[2])
    num_points = np.uint64(via_points.shape[1])
    for joint in range(via_points.shape[0]):
        for lane in range(0, num_lanes, LANES):
            start = np.uint64(joint) * num_points * pitch + np.uint64(lane)
            before, a = load(flat, start), load(flat, start + pitch)
            for i in range(1, via_points.shape[1] - 1):
                place = start + np.uint64(i) * pitch
                after = load(flat, place + pitch)
                middle = (before + after) / 2.0
                before = a + delta * (middle - a)  # (Eqs 8, 9)
                store(flat, place, before)
                a = after
