"""Relaxation: a path pulled tight like an elastic string (Rana & Zalzala 1995, Eqs 8 and 9)."""

import numpy as np

from evoexp.numeric.compilation import borrowed, kernel
from evoexp.numeric.vectors import LANES, load, store
from evoexp.records import FloatArray


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
