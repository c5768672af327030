"""The criteria of a mobile arm's posture once more, over absolute link angles, with derivatives: for optimisers.

x = (φ1, φ2, φ3) [rad] are the directions of the three links; one equation ties them: the end-effector's height. All
functions take complex numbers, too, so that a complex step gives derivatives without any cancellation.
"""

from typing import Any, NamedTuple

import numpy as np

from evoexp.objectives.placement_criteria import Model
from evoexp.records import FloatArray

STEP = 1e-30  # of the complex step: its square vanishes beside anything
TURN = 360.0  # [deg]


class Directions(NamedTuple):
    """Criteria as functions of the links' directions.

    Attributes:
        lengths: (3,) l1, l2, l3.
        target: (2,) X_e, Y_e.
        force: (2,).
        weights: ε, λ, δ of Eq. 14, α1, α2, α3 of Eq. 11.
        avoided: (n, 5) γ, link, place, X_o, Y_o of Eq. 12.
        joint_limits: (3, 2) θ1, θ2, θ3 [rad].
        torque_limits: (3, 2).
    """

    lengths: FloatArray
    target: FloatArray
    force: FloatArray
    weights: FloatArray
    avoided: FloatArray
    joint_limits: FloatArray
    torque_limits: FloatArray

    def links(self, x: Any) -> tuple[Any, Any]:
        """Return the links as vectors, X and Y of each, both (3, …)."""
        shape = (3,) + (1,) * (np.ndim(x) - 1)
        lengths = self.lengths.reshape(shape)
        return lengths * np.cos(x), lengths * np.sin(x)

    def torques(self, x: Any) -> Any:
        """Return τ (3, …) of Eq. 8."""
        across, up = self.links(x)
        moments = up * -self.force[0] + across * self.force[1]
        return np.stack([moments[0] + moments[1] + moments[2], moments[1] + moments[2], moments[2]])

    def height(self, x: Any) -> Any:
        """Return by how much the end-effector is above its target."""
        return self.links(x)[1].sum(axis=0) - self.target[1]

    def smooth(self, x: Any) -> Any:
        """Return the differentiable part of E: ε E1 + δ E_man + Σ γ E_obs."""
        across, up = self.links(x)
        epsilon, _, delta = self.weights[:3]
        total = epsilon * (self.torques(x) ** 2).sum(axis=0)
        if delta:
            jx = -np.cumsum(up[::-1], axis=0)[::-1]
            jy = np.cumsum(across[::-1], axis=0)[::-1]
            determinant = (jx**2).sum(axis=0) * (jy**2).sum(axis=0) - (jx * jy).sum(axis=0) ** 2
            total = total + delta / determinant
        platform = self.target[0] - across.sum(axis=0)
        for gamma, link, place, x_o, y_o in self.avoided:
            parts = np.clip(int(link) - np.arange(3), 0, 1) * 1.0
            if link:
                parts[int(link) - 1] = place
            parts = parts.reshape((3,) + (1,) * (np.ndim(x) - 1))
            px, py = platform + (parts * across).sum(axis=0), (parts * up).sum(axis=0)
            total = total + gamma / ((px - x_o) ** 2 + (py - y_o) ** 2)
        return total

    def weighted_torques(self, x: Any) -> Any:
        """Return α τ (3, …) of Eq. 11."""
        return self.torques(x) * self.weights[3:6].reshape((3,) + (1,) * (np.ndim(x) - 1))

    def cost(self, x: Any) -> Any:
        """Return E of Eq. 14, without any cap; real x only."""
        return self.smooth(x) + self.weights[1] * np.abs(self.weighted_torques(x)).max(axis=0)

    def margins(self, x: Any) -> Any:
        """Return what must not be negative: distances to the limits that there are, (limits, …)."""
        angles = np.stack([x[0], x[1] - x[0], x[2] - x[1]])
        rows = []
        for values, limits in ((angles, self.joint_limits), (self.torques(x), self.torque_limits)):
            for value, (least, greatest) in zip(values, limits, strict=True):
                rows += [value - least] * bool(np.isfinite(least)) + [greatest - value] * bool(np.isfinite(greatest))
        return np.stack(rows) if rows else np.zeros((0, *np.shape(x)[1:]))

    def theta(self, x: FloatArray) -> FloatArray:
        """Return θ1, θ2 [deg] of x, both in [−180, 180)."""
        angles = np.degrees(np.array([x[0], x[1] - x[0]]))
        wrapped: FloatArray = angles - TURN * np.floor((angles + TURN / 2) / TURN)
        return wrapped

    def directions(self, theta: FloatArray, theta_3: float) -> FloatArray:
        """Return x of joint angles θ1, θ2 and θ3 [deg]."""
        return np.radians(np.cumsum([theta[0], theta[1], theta_3]))


def directions_of(model: Model, angle_limits: FloatArray) -> Directions:
    """Return the criteria of a planner's model.

    Args:
        model: See `placement_criteria`.
        angle_limits: (2, 2) of the planner's genes [deg]; they limit θ1 and θ2 where they leave out anything.
    """
    task, joints = model.task, model.limits[:3].copy()
    for k, (least, greatest) in enumerate(angle_limits):
        if greatest - least < TURN:
            joints[k] = max(least, joints[k, 0]), min(greatest, joints[k, 1])
    return Directions(
        task[:3], task[3:5], task[5:7], model.weights[:6], model.avoided, np.radians(joints), model.limits[3:]
    )


def gradient(function: Any, x: FloatArray) -> FloatArray:
    """Return the derivatives of a function of x at one place, (…, len(x)), by complex steps."""
    steps = x[:, None] + 1j * STEP * np.eye(len(x))
    return np.asarray(np.imag(function(steps)) / STEP)
