"""Products, lengths and rotations of small arrays with the same bits on every processor.

numpy's `@`, `dot`, `linalg.norm` and `einsum` leave sums to code written for the processor, which
fuses a product and a sum where it can, or adds in another order. Here terms are added one by one.
"""

import numpy as np
from numpy.typing import NDArray

from evoexp.numeric.elementary import DEGREE, sincos

FloatArray = NDArray[np.float64]


def matrix_product(one: FloatArray, two: FloatArray) -> FloatArray:
    """Return the matrix product of (…, k) and (k,) or (k, m)."""
    columns = one if two.ndim == 1 else one[..., None]
    axis = one.ndim - 1
    total = columns.take(0, axis) * two[0]
    for k in range(1, one.shape[-1]):
        total = total + columns.take(k, axis) * two[k]
    return np.asarray(total)


def length(vector: FloatArray) -> float:
    """Return the Euclidean length of a vector (k,)."""
    return float(np.sqrt(matrix_product(vector, vector)))


def rotation_matrix(angles: tuple[float, float, float]) -> FloatArray:
    """Return the rotation of roll, pitch, yaw [deg]: Rz(yaw) Ry(pitch) Rx(roll), (3, 3)."""
    (sr, cr), (sp, cp), (sy, cy) = (sincos(DEGREE * angle) for angle in angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
