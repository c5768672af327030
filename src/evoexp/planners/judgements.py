"""Judged populations: their costs, and whether the planner's own model accepts them."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from evoexp.records import BoolArray, FloatArray


class Judgement(Protocol):
    """A judged population."""

    @property
    def cost(self) -> FloatArray:
        """(individuals,) lower is better; inf: infeasible."""

    @property
    def feasible(self) -> np.ndarray:
        """(individuals,) whether the planner's own model accepts each."""

    @property
    def collision_queries(self) -> int:
        """Configurations that the algorithm asks for, also those that the kernels skip."""

    def named_terms(self, individual: int) -> dict[str, float]:
        """Return the paper's own terms of one individual."""


class JudgementArrays(NamedTuple):
    """A `Judgement` as plain arrays."""

    cost: FloatArray  # (individuals,) lower is better; inf: infeasible
    feasible: BoolArray  # (individuals,) whether the planner's own model accepts each
    collision_queries: int  # configurations that the algorithm asks for
    terms: Mapping[str, NDArray[Any]]  # name → (individuals,) of the planner's own terms

    def named_terms(self, individual: int) -> dict[str, float]:
        """Return the terms of one individual."""
        return {name: float(values[individual]) for name, values in self.terms.items()}
