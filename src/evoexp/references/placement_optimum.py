"""The best posture there is: a dense search over all angles, then every promising local minimum polished."""

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from evoexp.objectives.placement_criteria import Model
from evoexp.records import FloatArray
from evoexp.references.placement_model import directions_of
from evoexp.references.placement_polish import End, descend, polish
from evoexp.references.truth import Reference, Truth
from evoexp.validation import Count

SAME = 1e-3  # [deg] two minima so close are one


class PlacementOptimum(Reference):
    """The exact optimum of `placement_ga`'s cost, and all local minima that the search saw.

    Arrays: `minima` (minima, 3): θ1, θ2 [deg], E, the best one first. The optimum has 15 digits, more than any code of
    16 bits per angle.

    Attributes:
        num_angles: Values of either angle that the dense search takes.
        num_polished: Minima of the dense search that are polished, the lowest ones.
    """

    component: ClassVar[str] = "placement_optimum"

    num_angles: Annotated[int, Field(ge=8)]
    num_polished: Count

    def truth(self, problem: Any) -> Truth:
        """Search, polish, and judge the best by the planner's own kernels."""
        starts = lowest(problem.model, problem.angle_limits, self.num_angles, self.num_polished)
        model, ends = directions_of(problem.model, problem.angle_limits), []
        evaluations = 2 * self.num_angles * self.num_angles
        for theta, theta_3 in starts:
            end = descend(model, model.directions(theta, theta_3))
            evaluations += end.evaluations
            ends.append(polish(model, end.x))
        minima = _distinct(problem.model, [(model.theta(end.x), end) for end in ends])
        if not len(minima):
            anywhere = problem.angle_limits.mean(axis=1)
            return Truth(anywhere, float(problem.model.weights[6]), False, evaluations, {"num_minima": 0.0})
        best, cost = minima[0, :2].copy(), float(minima[0, 2])
        return Truth(best, cost, True, evaluations, {"num_minima": float(len(minima))}, {"minima": minima})


def branch_costs(model: Model, angle_limits: FloatArray, num_angles: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return E and θ3 [deg] over a grid of angles, branch by branch.

    Returns:
        The angles (2, num_angles) [deg]; E and θ3, both (2, num_angles, num_angles): branch, θ1, θ2.
    """
    share = np.arange(num_angles) / num_angles
    angles = angle_limits[:, :1] + (angle_limits[:, 1:] - angle_limits[:, :1]) * share
    pairs = np.stack(np.meshgrid(*angles, indexing="ij")).reshape(2, -1)
    costs, theta_3 = model.measure_branches(pairs)
    shape = (2, num_angles, num_angles)
    return angles, costs.reshape(shape), theta_3.reshape(shape)


def lowest(model: Model, angle_limits: FloatArray, num_angles: int, count: int) -> list[tuple[FloatArray, float]]:
    """Return θ1, θ2 and θ3 [deg] of the lowest local minima of a dense search.

    Both branches are sheets of one surface, joined where the third link is upright: a place at that edge is a minimum
    only if nothing around it on the other sheet is lower.
    """
    angles, costs, theta_3 = branch_costs(model, angle_limits, num_angles)
    shifts = [(one, two) for one in (-1, 0, 1) for two in (-1, 0, 1)]
    around = np.stack([np.roll(costs, shift, axis=(1, 2)) for shift in shifts])
    lowest_around, at_edge = around.min(axis=0), (around >= model.weights[6]).any(axis=0)
    least = (costs <= lowest_around) & (~at_edge | (costs <= lowest_around[::-1]))
    found = np.flatnonzero((least & (costs < model.weights[6])).ravel())
    found = found[np.argsort(costs.ravel()[found], kind="stable")][:count]
    places = zip(*np.unravel_index(found, costs.shape), strict=True)
    return [(np.array([angles[0, i], angles[1, j]]), float(theta_3[b, i, j])) for b, i, j in places]


def _distinct(model: Model, found: list[tuple[FloatArray, End]]) -> FloatArray:
    """Return distinct feasible minima θ1, θ2, E (minima, 3), the lowest first, by the planner's own kernels."""
    rows: list[FloatArray] = []
    measured = [(theta, model.posture(*theta)) for theta, _ in found]
    feasible = [np.array([*theta, own[0]]) for theta, (branch, own, _) in measured if branch >= 0]
    for row in sorted(feasible, key=lambda row: (round(float(row[2]), 9), *np.round(row[:2], 6))):
        apart = [np.abs((row[:2] - other[:2] + 180.0) % 360.0 - 180.0).max() for other in rows]
        if not apart or min(apart) > SAME:
            rows.append(row)
    return np.array(rows).reshape(len(rows), 3)
