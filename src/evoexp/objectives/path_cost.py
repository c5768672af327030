"""The cost of a path over a grid: its length and mean unsafeness (Chen & Zalzala 1995, Eq. 1)."""

from typing import ClassVar, Self

from pydantic import model_validator

from evoexp.validation import Component, NonNegative


class PathCost(Component):
    """Weights of Eq. 1, C = ε D + λ S."""

    component: ClassVar[str] = "path_cost"

    distance_weight: NonNegative  # ε, of the length D (Eq. 2) [1/cell]
    unsafeness_weight: NonNegative  # λ, of the mean unsafeness S of the path's nodes (Eq. 3) [-]

    @model_validator(mode="after")
    def _something_costs(self) -> Self:
        must = "above 0, or unsafeness_weight is: else all paths cost 0"
        self.demand("distance_weight", any(self.weights), must)
        return self

    @property
    def weights(self) -> tuple[float, float]:
        """(ε, λ), as kernels take them."""
        return self.distance_weight, self.unsafeness_weight
