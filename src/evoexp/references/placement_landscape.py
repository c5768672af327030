"""The landscape of a posture's cost over θ1 and θ2 (Chen & Zalzala 1995, Fig. 9)."""

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from evoexp.objectives.placement_kernels import CRITERIA
from evoexp.references.reference import Reference, Truth

TERM_VALUES = 20  # numbers measured for one pair of angles


class PlacementLandscape(Reference):
    """E over all θ1 and θ2, the better θ3 of each.

    Arrays: `theta_1` and `theta_2` (angles,) [deg]; `cost` (angles of θ1, angles of θ2): E, NaN
    where infeasible.
    """

    component: ClassVar[str] = "placement_landscape"

    # values of either angle, both ends of their range included
    num_angles: Annotated[int, Field(ge=2, le=10_000)]

    def memory(self, problem: Any) -> int:
        """Return the memory of the terms of every pair of angles, besides the planner's."""
        return 8 * TERM_VALUES * self.num_angles**2 + int(self.planner.memory(problem))

    def truth(self, problem: Any) -> Truth:
        """Measure the grid; the best of it is the solution."""
        share = np.arange(self.num_angles) / (self.num_angles - 1)
        one, two = problem.angle_limits[:, :1] + np.diff(problem.angle_limits) * share
        pairs = np.stack(np.meshgrid(one, two, indexing="ij")).reshape(2, -1)
        found = problem.model.measure(pairs)
        feasible = found[CRITERIA] >= 0.0
        best = int(np.argmin(found[0]))
        cost = np.where(feasible, found[0], np.nan).reshape(self.num_angles, self.num_angles)
        arrays = {"theta_1": one, "theta_2": two, "cost": cost}
        terms = {"share_feasible": float(np.count_nonzero(feasible)) / pairs.shape[1]}
        solution, lowest = pairs[:, best].copy(), float(found[0, best])
        return Truth(solution, lowest, bool(feasible[best]), pairs.shape[1], terms, arrays)
