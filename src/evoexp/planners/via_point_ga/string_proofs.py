"""Acceptance by proof: strings that the collision model accepts, judged by the exact certifier."""

from typing import Any

import numpy as np

from evoexp.planners.proofs import Proofs
from evoexp.records import FloatArray


class Prover:
    """Judges the whole motions of strings, and tells a search which ones are refuted."""

    def __init__(self, planner: Any, problem: Any) -> None:
        """Begin with no verdict.

        Args:
            planner: A `ViaPointGa` whose `acceptance` is not `model`.
            problem: Its problem.
        """
        self._planner, self._problem = planner, problem
        self._weight = planner.objective.collision_weight
        self._proofs = Proofs(planner, problem)

    @property
    def num_certificates(self) -> int:
        """Motions judged so far."""
        return self._proofs.num_certificates

    def settle(
        self, strings: FloatArray, costs: FloatArray, hits: FloatArray, below: float = np.inf
    ) -> int | None:
        """Judge free strings, the cheapest first, until one is proven.

        Each one that is refuted counts as colliding at one instant more, and costs as much.

        Args:
            strings: (nq, N + 1, ≥ individuals).
            costs: (individuals,), changed.
            hits: (individuals,) colliding instants, changed.
            below: Costs from which on nothing is judged: as low a one is proven already.

        Returns:
            The proven string; None if none is.
        """
        while True:
            open_costs = np.where((hits == 0.0) & (costs < below), costs, np.inf)
            k = int(np.argmin(open_costs))
            if not open_costs[k] < np.inf:
                return None
            if self.is_proven(strings[:, :, k]):
                return k
            hits[k] += 1.0
            costs[k] += self._weight

    def is_proven(self, string: FloatArray) -> bool:
        """Whether the certifier proves the whole motion of a string (nq, N + 1)."""
        solution = self._planner.solution(self._problem, string[:, :, None], 0)
        return self._proofs.is_proven(solution)
