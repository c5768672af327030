"""Settings of the criteria of a mobile arm's posture (Chen & Zalzala 1995, section 3.1)."""

from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from evoexp.errors import SettingError
from evoexp.objectives.placement_kernels import Weights
from evoexp.records import FloatArray
from evoexp.validation import Component, NonNegative, NonNegativeCount, Positive, Rate, Settings


class Avoidance(Settings):
    """One term of Eq. 12: a point of the robot shall be far from an obstacle."""

    weight: NonNegative  # γ of Eq. 14 [length unit²]
    # where the point is: 0: the platform's middle, 1 to 3: a link
    link: Annotated[int, Field(ge=0, le=3)]
    place: Rate  # on the link, from its joint to its end [-]
    obstacle: NonNegativeCount  # index of the obstacle, from 0


class PlacementCriteria(Component):
    """Weights of E of Eq. 14, which is at most `greatest`, the cost of an infeasible posture."""

    component: ClassVar[str] = "placement_criteria"

    torque_norm_weight: NonNegative  # ε, of ‖τ‖² (Eq. 10)
    torque_max_weight: NonNegative  # λ, of the greatest |α τ| (Eq. 11)
    manipulability_weight: NonNegative  # δ, of 1 / det(J Jᵀ) (Eq. 13)
    # α1, α2, α3 of Eq. 11: inverses of the torques' limits
    torque_weights: tuple[NonNegative, NonNegative, NonNegative]
    # E_m of Eq. 15: no criterion and no cost is above it, singular postures included
    greatest: Positive
    avoidances: tuple[Avoidance, ...] = ()  # terms of Eq. 12

    @model_validator(mode="after")
    def _something_is_asked_for(self) -> Self:
        weights = self.torque_norm_weight, self.torque_max_weight, self.manipulability_weight
        counts = any((*weights, *(one.weight for one in self.avoidances)))
        must = "above 0, or another weight: with all of them 0 every posture costs the same"
        self.demand("torque_norm_weight", counts, must)
        if self.torque_max_weight > 0.0 and not any(self.torque_weights):
            must = "above 0 for one torque at least"
            raise SettingError("torque_weights", must, list(self.torque_weights))
        return self

    @property
    def weights(self) -> Weights:
        """All weights, as the kernels take them."""
        plain = self.torque_norm_weight, self.torque_max_weight, self.manipulability_weight
        return Weights(*plain, *self.torque_weights, self.greatest)

    def avoided(self, obstacles: FloatArray) -> FloatArray:
        """Return the terms of Eq. 12 as a table for the kernels, (n, 5), by the obstacles' middles.

        SettingError: there is no such obstacle.
        """
        rows = []
        for k, one in enumerate(self.avoidances):
            if one.obstacle >= len(obstacles):
                must = f"an obstacle of the scenario, which has {len(obstacles)} (counted from 0)"
                raise SettingError(f"objective.avoidances[{k}].obstacle", must, one.obstacle)
            rows.append([one.weight, one.link, one.place, *obstacles[one.obstacle]])
        return np.array(rows, dtype=np.float64).reshape(len(rows), 5)
