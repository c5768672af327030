"""The task of a mobile arm's posture over absolute link angles, for optimisers.

x = (φ1, φ2, φ3) [rad] are the directions of the three links; one equation ties them: the
end-effector's height.
"""

from typing import NamedTuple

import numpy as np

from evoexp.objectives.placement_kernels import Model
from evoexp.records import FloatArray

INSIDE = 1e-11  # [rad], of torques [-]: on a limit, in spite of rounding, is within it
TURN = 360.0  # [deg]


class Directions(NamedTuple):
    """Task, weights and limits of the criteria over the links' directions."""

    lengths: FloatArray  # (3,) l1, l2, l3
    target: FloatArray  # (2,) X_e, Y_e
    force: FloatArray  # (2,)
    weights: FloatArray  # ε, λ, δ of Eq. 14, α1, α2, α3 of Eq. 11
    avoided: FloatArray  # (n, 5) γ, link, place, X_o, Y_o of Eq. 12
    joint_limits: FloatArray  # (3, 2) θ1, θ2, θ3 [rad]
    torque_limits: FloatArray  # (3, 2)

    def bounds(self) -> FloatArray:
        """Return the finite limits, (m, 3); see `placement_programme.measure`."""
        limits = np.concatenate([self.joint_limits, self.torque_limits])
        rows = [
            (float(k), sign, limit)
            for k, (least, greatest) in enumerate(limits)
            for sign, limit in ((1.0, least), (-1.0, greatest))
            if np.isfinite(limit)
        ]
        return np.array(rows, dtype=np.float64).reshape(len(rows), 3)

    def theta(self, x: FloatArray) -> FloatArray:
        """Return θ1, θ2 [deg] of x, both in [−180, 180)."""
        angles = np.degrees(np.array([x[0], x[1] - x[0]]))
        wrapped: FloatArray = angles - TURN * np.floor((angles + TURN / 2) / TURN)
        return wrapped

    def directions(self, theta: FloatArray, theta_3: float) -> FloatArray:
        """Return x of joint angles θ1, θ2 and θ3 [deg]."""
        x: FloatArray = np.radians(np.cumsum([theta[0], theta[1], theta_3]))
        return x


def directions_of(model: Model, angle_limits: FloatArray) -> Directions:
    """Return the criteria of a planner's model.

    Args:
        model: The planner's model.
        angle_limits: (2, 2) of the planner's genes [deg]; a range of less than a turn limits θ1 or
            θ2.
    """
    task, joints = np.array(model.task), model.limits[:3].copy()
    for k, (least, greatest) in enumerate(angle_limits):
        if greatest - least < TURN:
            joints[k] = max(least, joints[k, 0]), min(greatest, joints[k, 1])
    inside = INSIDE * np.array([1.0, -1.0])
    limits = np.radians(joints) + inside, model.limits[3:] + inside
    weights = np.array(model.weights[:6])
    return Directions(task[:3], task[3:5], task[5:7], weights, model.avoided, *limits)
