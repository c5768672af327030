"""Configurations between via-points."""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.records import FloatArray


def interpolate_linear(via_points: FloatArray, substeps: int) -> FloatArray:
    """Return configurations at fractions 1/s, 2/s, … 1 of every segment, (nq, N · s, lanes).

    The via-points are (nq, N + 1, lanes); every s-th result is one, bit for bit. ValueError: s < 1.
    """
    if substeps < 1:
        raise ValueError(f"substeps must be at least 1, was {substeps}")
    nq, num_points, lanes = via_points.shape
    out = np.empty((nq, (num_points - 1) * substeps, lanes))
    interpolate(via_points, substeps, out)
    return out


@kernel
def interpolate(via_points: FloatArray, substeps: int, out: FloatArray) -> None:
    """Run the kernel of `interpolate_linear`; `out` is (nq, N · s, lanes)."""
    nq, num_points, lanes = via_points.shape
    for joint in range(nq):
        j = np.uint64(joint)
        for k in range(num_points - 1):
            before, after = np.uint64(k), np.uint64(k + 1)
            for step in range(1, substeps + 1):
                row, fraction = np.uint64(k * substeps + step - 1), step / substeps
                for lane in range(lanes):
                    a, b = via_points[j, before, lane], via_points[j, after, lane]
                    out[j, row, lane] = b if step == substeps else a + fraction * (b - a)
