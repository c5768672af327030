"""Postures of a planar arm whose tip is at a given place, from any posture to begin with."""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import sincos
from evoexp.records import FloatArray
from evoexp.robots.planar_ends import PlanarArm

DAMPING = 1e-3  # [-] of a step, in units of the squared length of the arm
CLOSE = 1e-9  # [-] of the arm's length: the tip is there
MOST_STEPS = 200


@kernel
def tip(q: FloatArray, arm: PlanarArm) -> tuple[float, float]:
    """Return x and y of the tip at q (N,) [rad]."""
    angle, x, y = arm.base_angle, arm.base_x, arm.base_y
    for k in range(len(q)):
        angle += q[k]
        s, c = sincos(angle)
        x += arm.lengths[k] * c
        y += arm.lengths[k] * s
    return x, y


@kernel
def bring_tip_to(q: FloatArray, target: FloatArray, limits: FloatArray, arm: PlanarArm) -> bool:
    """Turn the joints until the tip is at a place: damped least squares (Nakamura & Hanafusa 1986).

    A step is Jᵀ (J Jᵀ + λ)⁻¹ e, put back within the limits of the joints.

    Args:
        q: (N,) posture to begin with [rad], within its limits; changed.
        target: (2,) where the tip shall be.
        limits: (N, 2) of the joints [rad].

    Returns:
        Whether it is there; if not, q is where the last step ended.
    """
    count, reach = len(q), 0.0
    for k in range(count):
        reach += arm.lengths[k]
    damping, close = DAMPING * reach * reach, CLOSE * reach
    x, y = np.empty(count + 1), np.empty(count + 1)
    for _ in range(MOST_STEPS):
        # joints and tip
        angle = arm.base_angle
        x[0], y[0] = arm.base_x, arm.base_y
        for k in range(count):
            angle += q[k]
            s, c = sincos(angle)
            x[k + 1] = x[k] + arm.lengths[k] * c
            y[k + 1] = y[k] + arm.lengths[k] * s
        off_x, off_y = target[0] - x[count], target[1] - y[count]
        if off_x * off_x + off_y * off_y <= close * close:
            return True
        # J Jᵀ + λ; joint k moves the tip by (−(y − y_k), x − x_k)
        a, b, d = damping, 0.0, damping
        for k in range(count):
            u, v = y[k] - y[count], x[count] - x[k]
            a += u * u
            b += u * v
            d += v * v
        determinant = a * d - b * b
        first = (d * off_x - b * off_y) / determinant
        second = (a * off_y - b * off_x) / determinant
        for k in range(count):
            turned = q[k] + (y[k] - y[count]) * first + (x[count] - x[k]) * second
            q[k] = min(max(turned, limits[k, 0]), limits[k, 1])
    return False
