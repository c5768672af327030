"""The best posture: a dense search over all angles, then every promising minimum polished."""

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from evoexp.objectives.placement_kernels import Model
from evoexp.records import FloatArray
from evoexp.references.placement_model import TURN, directions_of
from evoexp.references.placement_polish import descend, polish
from evoexp.references.placement_programme import Programme
from evoexp.references.placement_search import lowest
from evoexp.references.reference import Reference, Truth
from evoexp.validation import Count

SAME = 1e-3  # [deg] two minima so close are one

TERM_VALUES = 5  # numbers kept for one pair of angles


class PlacementOptimum(Reference):
    """The exact optimum of `placement_ga`'s cost, and all local minima that the search saw.

    Arrays: `minima` (minima, 3): θ1, θ2 [deg], E, the best one first. The optimum has 15 digits,
    more than any code of 16 bits per angle.
    """

    component: ClassVar[str] = "placement_optimum"

    # values of either angle that the dense search takes
    num_angles: Annotated[int, Field(ge=8, le=10_000)]
    num_polished: Count  # minima of the dense search that are polished, the lowest ones

    def memory(self, problem: Any) -> int:
        """Return the memory of the dense search, besides the planner's."""
        return 8 * TERM_VALUES * self.num_angles**2 + self.planner.memory(problem)

    def truth(self, problem: Any) -> Truth:
        """Search, polish, and judge the best by the planner's own kernels."""
        model, cap = (
            directions_of(problem.model, problem.angle_limits),
            problem.model.weights.greatest,
        )
        programme, ends, exact = Programme(model), list[FloatArray](), list[FloatArray]()
        evaluations = 2 * self.num_angles * self.num_angles
        for x in lowest(model, problem.angle_limits, self.num_angles, cap, self.num_polished):
            end = descend(programme, x)
            evaluations += end.evaluations
            theta = model.theta(end.x)
            if not _is_among(exact, theta):
                polished = polish(programme, end.x)
                ends.append(theta if polished is None else model.theta(polished.x))
                exact += [] if polished is None else ends[-1:]
        minima = _distinct(problem.model, ends)
        if not len(minima):
            return Truth(
                problem.angle_limits.mean(axis=1), cap, False, evaluations, {"num_minima": 0.0}
            )
        best, cost, count = (
            minima[0, :2].copy(),
            float(minima[0, 2]),
            {"num_minima": float(len(minima))},
        )
        return Truth(best, cost, True, evaluations, count, {"minima": minima})


def _is_among(known: list[FloatArray], theta: FloatArray) -> bool:
    """Return whether θ1 and θ2 are those of a known minimum."""
    return any(
        np.abs((theta - other[:2] + TURN / 2) % TURN - TURN / 2).max() <= SAME for other in known
    )


def _distinct(model: Model, found: list[FloatArray]) -> FloatArray:
    """Return distinct feasible minima, the lowest first: θ1, θ2, and E by the planner's kernels.

    Returns:
        (minima, 3).
    """
    rows: list[FloatArray] = []
    measured = [(theta, model.posture(*theta)) for theta in found]
    feasible = [np.array([*theta, own[0]]) for theta, (branch, own, _) in measured if branch >= 0]
    for row in sorted(feasible, key=lambda row: (round(float(row[2]), 9), *np.round(row[:2], 6))):
        if not _is_among(rows, row[:2]):
            rows.append(row)
    return np.array(rows).reshape(len(rows), 3)
