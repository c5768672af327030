"""A reference for tests: the straight line between start and goal, which can be disturbed."""

import os
from typing import Any, ClassVar

import numpy as np

from evoexp.references.reference import Reference, Truth


class Counted(Reference):
    component: ClassVar[str] = "counted"

    rows: int = 3

    def truth(self, problem: Any) -> Truth:
        drawn = self.planner.sample(problem, np.random.Generator(np.random.PCG64(0)), 1)
        best = np.asarray(self.planner.solution(problem, drawn, 0))
        cost = float(self.planner.cost(problem, drawn).cost[0])
        cost += float(os.environ.get("DISTURBED", "0"))
        table = np.array([[0.1 * k, np.inf, np.nan] for k in range(self.rows)])
        arrays = {"table": table, "counts": np.arange(4)}
        return Truth(best, cost, np.isfinite(cost), 1, {"share": 0.25}, arrays)
