"""The criteria of a mobile arm's posture over the links' directions, by numpy, slow and obvious.

All functions take x (3, …) = (φ1, φ2, φ3) [rad], complex numbers, too: a complex step gives
derivatives without any cancellation.
"""

from typing import Any

import numpy as np

from evoexp.references.placement_programme import Directions

STEP = 1e-30  # of the complex step: its square vanishes beside anything


def links(model: Directions, x: Any) -> tuple[Any, Any]:
    """Return the links as vectors, X and Y of each, both (3, …)."""
    lengths = model.lengths.reshape((3,) + (1,) * (np.ndim(x) - 1))
    return lengths * np.cos(x), lengths * np.sin(x)


def torques(model: Directions, x: Any) -> Any:
    """Return τ (3, …) of Eq. 8."""
    across, up = links(model, x)
    moments = up * -model.force[0] + across * model.force[1]
    return np.stack([moments[0] + moments[1] + moments[2], moments[1] + moments[2], moments[2]])


def height(model: Directions, x: Any) -> Any:
    """Return by how much the end-effector is above its target."""
    return links(model, x)[1].sum(axis=0) - model.target[1]


def smooth(model: Directions, x: Any) -> Any:
    """Return the differentiable part of E: ε E1 + δ E_man + Σ γ E_obs."""
    across, up = links(model, x)
    epsilon, _, delta = model.weights[:3]
    total = epsilon * (torques(model, x) ** 2).sum(axis=0)
    if delta:
        jx = -np.cumsum(up[::-1], axis=0)[::-1]
        jy = np.cumsum(across[::-1], axis=0)[::-1]
        determinant = (jx**2).sum(axis=0) * (jy**2).sum(axis=0) - (jx * jy).sum(axis=0) ** 2
        total = total + delta / determinant
    platform = model.target[0] - across.sum(axis=0)
    for gamma, link, place, x_o, y_o in model.avoided:
        parts = np.clip(int(link) - np.arange(3), 0, 1) * 1.0
        if link:
            parts[int(link) - 1] = place
        parts = parts.reshape((3,) + (1,) * (np.ndim(x) - 1))
        px, py = platform + (parts * across).sum(axis=0), (parts * up).sum(axis=0)
        total = total + gamma / ((px - x_o) ** 2 + (py - y_o) ** 2)
    return total


def weighted_torques(model: Directions, x: Any) -> Any:
    """Return α τ (3, …) of Eq. 11."""
    return torques(model, x) * model.weights[3:6].reshape((3,) + (1,) * (np.ndim(x) - 1))


def cost(model: Directions, x: Any) -> Any:
    """Return E of Eq. 14, without any cap; real x only."""
    return smooth(model, x) + model.weights[1] * np.abs(weighted_torques(model, x)).max(axis=0)


def margins(model: Directions, x: Any) -> Any:
    """Return what must not be negative: distances to the limits that there are, (limits, …)."""
    angles = np.stack([x[0], x[1] - x[0], x[2] - x[1]])
    values = np.concatenate([angles, torques(model, x)])
    limits = np.concatenate([model.joint_limits, model.torque_limits])
    rows = [(value - low, high - value) for value, (low, high) in zip(values, limits, strict=True)]
    there = np.isfinite(limits).ravel()
    return np.reshape(rows, (len(there), *np.shape(x)[1:]))[there]


def programme(model: Directions, z: Any) -> Any:
    """Return what `placement_programme.measure` measures, (2 + margins, …)."""
    x, objective, bounds = z[:3], smooth(model, z[:3]), margins(model, z[:3])
    if len(z) == 4:
        objective = objective + model.weights[1] * z[3]
        own = weighted_torques(model, x)
        bounds = np.concatenate([z[3] - own, z[3] + own, bounds])
    return np.concatenate([objective[None], height(model, x)[None], bounds])


def gradient(function: Any, x: np.ndarray) -> np.ndarray:
    """Return the derivatives of a function of x at one place, (…, len(x)), by complex steps."""
    steps = x[:, None] + 1j * STEP * np.eye(len(x))
    return np.asarray(np.imag(function(steps)) / STEP)


def slide(model: Directions, x: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the best place of the projected subgradient method from one start, and E there."""

    def normal(x: np.ndarray) -> np.ndarray:
        return model.lengths * np.cos(x)

    h, least, end = 1e-6, float(cost(model, x)), x
    for step in steps:
        around = [cost(model, x + h * unit) - cost(model, x - h * unit) for unit in np.eye(3)]
        slope = np.array(around) / (2 * h)
        slope = slope - (slope @ normal(x)) / (normal(x) @ normal(x)) * normal(x)
        x = x - step * slope / np.linalg.norm(slope)
        for _ in range(3):
            x = x - height(model, x) / (normal(x) @ normal(x)) * normal(x)
        if cost(model, x) < least and abs(height(model, x)) < 1e-9:
            least, end = float(cost(model, x)), x
    return end, least
