"""Local optimisation of a mobile arm's posture: sequential quadratic programming, then Newton on its conditions."""

from typing import Any, NamedTuple

import numpy as np

from evoexp.records import FloatArray
from evoexp.references.placement_model import Directions, gradient

ACTIVE = 1e-6  # a margin below it is taken to be 0
MOST_STEPS = 12  # of Newton's method; it takes three or four


class End(NamedTuple):
    """Where an optimiser ended.

    Attributes:
        x: (3,) directions of the links [rad].
        cost: E there, without any cap.
        evaluations: Of the cost.
    """

    x: FloatArray
    cost: float
    evaluations: int


class Programme:
    """The task as a smooth programme over z = (x, t): least smooth(x) + λ t, t above every |α τ|, margins above 0."""

    def __init__(self, model: Directions) -> None:
        """Take the criteria; t is left out where λ is 0."""
        self.model, self.minimax = model, bool(model.weights[1])

    def objective(self, z: Any) -> Any:
        """Return what is minimised."""
        return self.model.smooth(z[:3]) + (self.model.weights[1] * z[3] if self.minimax else 0.0)

    def height(self, z: Any) -> Any:
        """Return what must be 0."""
        return self.model.height(z[:3])

    def margins(self, z: Any) -> Any:
        """Return what must not be negative."""
        margins = self.model.margins(z[:3])
        if not self.minimax:
            return margins
        torques = self.model.weighted_torques(z[:3])
        return np.concatenate([z[3] - torques, z[3] + torques, margins])

    def start(self, x: FloatArray) -> FloatArray:
        """Return z at x."""
        if not self.minimax:
            return x
        return np.append(x, np.abs(self.model.weighted_torques(x)).max())


def descend(model: Directions, x: FloatArray, most_steps: int = 200) -> End:
    """Minimise E from x by sequential quadratic programming (scipy's SLSQP), the minimax term as a bound t."""
    from scipy.optimize import minimize  # takes long to load

    programme = Programme(model)
    constraints: list[Any] = [
        {"type": "eq", "fun": programme.height, "jac": lambda z: gradient(programme.height, z)},
    ]
    z = programme.start(x)
    if len(programme.margins(z)):
        constraints.append(
            {"type": "ineq", "fun": programme.margins, "jac": lambda z: gradient(programme.margins, z)},
        )
    found = minimize(
        lambda z: float(programme.objective(z)),
        z,
        jac=lambda z: gradient(programme.objective, z),
        constraints=constraints,
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": most_steps},
    )
    return End(found.x[:3], float(model.cost(found.x[:3])), int(found.nfev))


def polish(model: Directions, x: FloatArray) -> End:
    """Return the local minimum near the end of `descend`, to rounding: Newton on the Karush–Kuhn–Tucker conditions.

    The conditions that hold with equality are taken from x; where Newton does not converge x itself is returned.
    """
    programme = Programme(model)
    z = programme.start(x)
    active = np.flatnonzero(np.asarray(programme.margins(z)) < ACTIVE)

    def binding(z: Any) -> Any:
        return np.concatenate([programme.height(z)[None], programme.margins(z)[active]])

    def conditions(y: FloatArray) -> FloatArray:
        z, multipliers = y[: len(x) + programme.minimax], y[len(x) + programme.minimax :]
        slope = gradient(programme.objective, z) - multipliers @ gradient(binding, z)
        return np.concatenate([slope, np.real(binding(z))])

    slopes = gradient(binding, z)
    multipliers = np.linalg.lstsq(slopes.T, gradient(programme.objective, z), rcond=None)[0]
    y, steps = np.concatenate([z, multipliers]), 0
    for steps in range(1, MOST_STEPS + 1):
        values = conditions(y)
        if np.abs(values).max() < 1e-13:
            break
        step, *_ = np.linalg.lstsq(_jacobian(conditions, y), values, rcond=None)
        y = y - step
    moved = float(np.abs(y[:3] - x).max())
    if not np.isfinite(y).all() or moved > 1e-3 or np.abs(conditions(y)).max() > 1e-9:
        return End(x, float(model.cost(x)), 0)
    return End(y[:3], float(model.cost(y[:3])), steps)


def _jacobian(function: Any, y: FloatArray) -> FloatArray:
    """Return derivatives by central differences: Newton's steps need no more digits."""
    h = 1e-5
    columns = [(function(y + h * unit) - function(y - h * unit)) / (2.0 * h) for unit in np.eye(len(y))]
    return np.column_stack(columns)
