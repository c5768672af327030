"""Conventional optimisers from many starts: where they end, and how often that is not the optimum.

"Calculus based methods are local in scope and easy to get stuck in local minima" (Chen & Zalzala 1995, section 1).
"""

from typing import Any, ClassVar

import numpy as np

from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.references.placement_model import Directions, directions_of, gradient
from evoexp.references.placement_polish import End, descend
from evoexp.references.placement_subgradient import slide
from evoexp.references.truth import Reference, Truth
from evoexp.validation import Count, Positive

R2 = np.array([0.7548776662466927, 0.5698402909980532])  # Roberts' sequence: fills a square evenly
DIGITS = 2  # decimals [deg] of the angles that are kept: beyond them libraries differ
MOST_TRIES = 1000  # places looked at per start


class PlacementConventional(Reference):
    """What local methods end at, each from the same starts: feasible postures spread evenly over all of them.

    Arrays, one row per start: `starts` (starts, 3): θ1, θ2, θ3 [deg]; `newton`, `subgradient` and, of minimax problems,
    `bounded`, each (starts, 3): θ1, θ2 [deg], E of where the method ended; inf where it broke a limit or left the
    target.

    - newton: sequential quadratic programming on E itself (scipy's SLSQP), which takes a kink for a smooth place.
    - subgradient: see `placement_subgradient`.
    - bounded: sequential quadratic programming again, the greatest torque as a variable above all torques.

    Terms: `<method>_evaluations`: of E per start; derivatives of `newton` and `bounded` are exact and not counted.

    Attributes:
        num_starts: Starts.
        num_steps: Steps of the subgradient method.
        first_step: Length of its first one; the k-th is shorter by √k [rad].
    """

    component: ClassVar[str] = "placement_conventional"

    num_starts: Count
    num_steps: Count
    first_step: Positive

    def truth(self, problem: Any) -> Truth:
        """Run all methods."""
        model = directions_of(problem.model, problem.angle_limits)
        starts, places = self._starts(problem, model)
        ends = {"newton": [_newton(model, x) for x in starts]}
        if model.weights[1]:
            ends["bounded"] = [descend(model, x) for x in starts]
        ends["subgradient"] = self._slide(model, starts)
        arrays = {name: np.array([_row(model, end) for end in found]) for name, found in ends.items()}
        every = np.concatenate(list(arrays.values()))
        best = every[int(np.argmin(every[:, 2]))]
        spent = {name: sum(end.evaluations for end in found) for name, found in ends.items()}
        terms = {f"{name}_evaluations": total / self.num_starts for name, total in spent.items()}
        solved = bool(np.isfinite(best[2]))
        solution = best[:2].copy()
        cost = float(problem.model.posture(*solution)[1][0])  # at the angles that are kept
        return Truth(solution, cost, solved, sum(spent.values()), terms, arrays | {"starts": places})

    def _starts(self, problem: Any, model: Directions) -> tuple[list[FloatArray], FloatArray]:
        """Return feasible postures as directions, and as θ1, θ2, θ3 [deg] (starts, 3)."""
        low, high = problem.angle_limits.T
        count = MOST_TRIES * self.num_starts
        tried = low[:, None] + (high - low)[:, None] * ((0.5 + np.arange(1, count + 1) * R2[:, None]) % 1.0)
        chunk = 64 * self.num_starts
        found: list[FloatArray] = []
        for first in range(0, count, chunk):
            pairs = tried[:, first : first + chunk]
            costs, theta_3 = problem.model.measure_branches(pairs)
            rows = np.stack([*np.repeat(pairs[:, :, None], 2, axis=2), theta_3.T], axis=2).reshape(-1, 3)
            found += list(rows[(problem.model.weights[6] > costs.T).ravel()])
            if len(found) >= self.num_starts:
                break
        else:
            raise SettingError("reference.num_starts", f"at most {len(found)}, the feasible postures", self.num_starts)
        places = np.array(found[: self.num_starts])
        return [model.directions(place[:2], float(place[2])) for place in places], places

    def _slide(self, model: Directions, starts: list[FloatArray]) -> list[End]:
        steps = self.first_step / np.sqrt(np.arange(1.0, self.num_steps + 1.0))
        x, ends, costs = np.column_stack(starts), np.empty((3, len(starts))), np.empty(len(starts))
        slide(x, steps, model.lengths, model.target, model.force, model.weights, model.avoided, ends, costs)
        evaluations = 7 * self.num_steps
        return [End(end, float(cost), evaluations) for end, cost in zip(ends.T, costs, strict=True)]


def _newton(model: Directions, x: FloatArray) -> End:
    """Minimise E itself from x, kinks included."""
    from scipy.optimize import minimize  # takes long to load

    if not model.weights[1]:
        return descend(model, x)

    def slope(x: FloatArray) -> FloatArray:
        torques = model.weighted_torques(x)
        largest = int(np.argmax(np.abs(torques)))
        kink = np.sign(torques[largest]) * gradient(model.weighted_torques, x)[largest]
        return np.asarray(gradient(model.smooth, x) + model.weights[1] * kink)

    constraints: list[Any] = [{"type": "eq", "fun": model.height, "jac": lambda x: gradient(model.height, x)}]
    if len(model.margins(x)):
        constraints.append({"type": "ineq", "fun": model.margins, "jac": lambda x: gradient(model.margins, x)})
    found = minimize(
        lambda x: float(model.cost(x)), x, jac=slope, constraints=constraints, method="SLSQP", options={"maxiter": 200}
    )
    return End(found.x, float(model.cost(found.x)), int(found.nfev))


def _row(model: Directions, end: End) -> FloatArray:
    """Return θ1, θ2 [deg] and E of an end; E is inf where the end is no posture that was asked for."""
    legal = abs(model.height(end.x)) < 1e-6 and np.all(model.margins(end.x) > -1e-6)
    return np.array([*np.round(model.theta(end.x), DIGITS), end.cost if legal else np.inf])
