"""Lengths and unevenness of strings of via-points (Rana & Zalzala 1995, Eqs. 2–5)."""

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
