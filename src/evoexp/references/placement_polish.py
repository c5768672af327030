"""Local optimisation of a mobile arm's posture: quadratic programming, then Newton's method."""

from typing import Any, NamedTuple

import numpy as np
from scipy import optimize

from evoexp.records import FloatArray
from evoexp.references.placement_programme import HEIGHT, MARGINS, OBJECTIVE, Programme

ACTIVE = 1e-6  # a margin below it is taken to be 0
MOST_STEPS = 12  # of Newton's method; it takes three or four


class End(NamedTuple):
    """The end of an optimiser's way."""

    x: FloatArray  # (3,) directions of the links [rad]
    cost: float  # E there, without any cap
    evaluations: int  # evaluations of the cost


def descend(programme: Programme, x: FloatArray, most_steps: int = 200) -> End:
    """Minimise E from x by sequential quadratic programming (SLSQP), a minimax term by t."""
    minimize: Any = optimize.minimize  # whose overloads no callable of ours fits
    found = minimize(
        lambda z: float(programme.measured(z)[0][OBJECTIVE]),
        programme.start(x),
        jac=lambda z: programme.measured(z)[1][OBJECTIVE].copy(),  # scipy keeps it
        constraints=programme.constraints(),
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": most_steps},
    )
    return End(found.x[:3], programme.cost(found.x[:3]), int(found.nfev))


def polish(programme: Programme, x: FloatArray) -> End | None:
    """Return the local minimum near the end of `descend`, to rounding.

    Newton's method solves the Karush–Kuhn–Tucker conditions; the margins that are 0 at x stay 0.
    The result is None where the method does not converge.
    """
    z = programme.start(x)
    values, slopes = programme.measured(z)
    binding = np.array([HEIGHT, *(MARGINS + np.flatnonzero(values[MARGINS:] < ACTIVE))])

    def conditions(y: FloatArray) -> FloatArray:
        values, slopes = programme.measured(y[: len(z)])
        return np.concatenate([slopes[OBJECTIVE] - y[len(z) :] @ slopes[binding], values[binding]])

    multipliers = np.linalg.lstsq(slopes[binding].T, slopes[OBJECTIVE], rcond=None)[0]
    y, steps = np.concatenate([z, multipliers]), 0
    while steps < MOST_STEPS:
        off = conditions(y)
        if np.abs(off).max() < 1e-13:
            break
        step, *_ = np.linalg.lstsq(_jacobian(conditions, y), off, rcond=None)
        y, steps = y - step, steps + 1
    moved = float(np.abs(y[:3] - x).max())
    if not np.isfinite(y).all() or moved > 1e-3 or np.abs(conditions(y)).max() > 1e-9:
        return None
    return End(y[:3], programme.cost(y[:3]), steps)


def _jacobian(function: Any, y: FloatArray) -> FloatArray:
    """Return derivatives by central differences, precise enough for Newton's steps."""
    h = 1e-5
    columns = [
        (function(y + h * unit) - function(y - h * unit)) / (2.0 * h) for unit in np.eye(len(y))
    ]
    return np.column_stack(columns)
