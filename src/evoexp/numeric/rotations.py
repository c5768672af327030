"""Rotations of three angles, with the same bits on every processor."""

import numpy as np

from evoexp.numeric.elementary import DEGREE, sincos
from evoexp.numeric.ordered_sums import FloatArray


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
