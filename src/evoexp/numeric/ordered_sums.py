"""Products and lengths of small arrays with the same bits on every processor.

numpy's `@`, `dot`, `linalg.norm` and `einsum` leave sums to code written for the processor, which
fuses a product and a sum where it can, or adds in another order. Here terms are added one by one.
"""

import numpy as np
from numpy.typing import NDArray

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
