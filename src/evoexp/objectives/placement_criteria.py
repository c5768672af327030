"""Settings of the criteria of a mobile arm's posture (Chen & Zalzala 1995, section 3.1)."""

from typing import Annotated, ClassVar, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from evoexp.errors import SettingError
from evoexp.objectives.placement_kernels import (
    RESULTS,
    measure_both,
    measure_branches,
    measure_postures,
)
from evoexp.records import FloatArray
from evoexp.validation import Component, NonNegative, NonNegativeCount, Positive, Rate, Settings


class Avoidance(Settings):
    """One term of Eq. 12: a point of the robot shall be far from an obstacle.

    Attributes:
        weight: γ of Eq. 14 [length unit²].
        link: Where the point is: 0: the platform's middle, 1 to 3: a link.
        place: On the link, from its joint to its end [-].
        obstacle: Index of the obstacle, from 0.
    """

    weight: NonNegative
    link: Annotated[int, Field(ge=0, le=3)]
    place: Rate
    obstacle: NonNegativeCount


class PlacementCriteria(Component):
    """What a posture costs: E of Eq.

    14, at most `greatest`, which is also the cost of an infeasible posture.

    Attributes:
        torque_norm_weight: ε, of ‖τ‖² (Eq. 10).
        torque_max_weight: λ, of the greatest |α τ| (Eq. 11).
        manipulability_weight: δ, of 1 / det(J Jᵀ) (Eq. 13).
        torque_weights: α1, α2, α3 of Eq. 11: inverses of the torques' limits.
        greatest: E_m of Eq. 15: no criterion and no cost is above it, singular postures included.
        avoidances: Terms of Eq. 12.
    """

    component: ClassVar[str] = "placement_criteria"

    torque_norm_weight: NonNegative
    torque_max_weight: NonNegative
    manipulability_weight: NonNegative
    torque_weights: tuple[NonNegative, NonNegative, NonNegative]
    greatest: Positive
    avoidances: tuple[Avoidance, ...] = ()

    @model_validator(mode="after")
    def _something_is_asked_for(self) -> Self:
        weights = self.torque_norm_weight, self.torque_max_weight, self.manipulability_weight
        if not any((*weights, *(one.weight for one in self.avoidances))):
            must = "above 0, or another weight: with all of them 0 every posture costs the same"
            raise SettingError("torque_norm_weight", must, self.torque_norm_weight)
        if self.torque_max_weight > 0.0 and not any(self.torque_weights):
            raise SettingError(
                "torque_weights", "above 0 for one torque at least", list(self.torque_weights)
            )
        return self

    @property
    def weights(self) -> FloatArray:
        """ε, λ, δ, α1, α2, α3, E_m; see `placement_kernels.measure_posture`."""
        plain = self.torque_norm_weight, self.torque_max_weight, self.manipulability_weight
        return np.array([*plain, *self.torque_weights, self.greatest])

    def avoided(self, obstacles: FloatArray) -> FloatArray:
        """Return the terms of Eq. 12 as a table for the kernels, (n, 5).

        Args:
            obstacles: (obstacles, 2) their middles.

        Raises:
            SettingError: If there is no such obstacle.
        """
        rows = []
        for k, one in enumerate(self.avoidances):
            if one.obstacle >= len(obstacles):
                must = f"an obstacle of the scenario, which has {len(obstacles)} (counted from 0)"
                raise SettingError(f"objective.avoidances[{k}].obstacle", must, one.obstacle)
            rows.append([one.weight, one.link, one.place, *obstacles[one.obstacle]])
        return np.array(rows, dtype=np.float64).reshape(len(rows), 5)


class Model(NamedTuple):
    """What criteria are computed from; see `placement_kernels.measure_posture`.

    Attributes:
        task: (7,) l1, l2, l3, X_e, Y_e, F_x, F_y.
        weights: (7,) ε, λ, δ, α1, α2, α3, E_m.
        avoided: (n, 5) γ, link, place, X_o, Y_o.
        limits: (6, 2) of joint angles [deg] and torques.
    """

    task: FloatArray
    weights: FloatArray
    avoided: FloatArray
    limits: FloatArray

    def measure(self, angles: FloatArray) -> FloatArray:
        """Return criteria and branch of postures θ1, θ2 (2, individuals) [deg].

        (CRITERIA + 1, individuals).
        """
        angles = np.ascontiguousarray(angles, dtype=np.float64)
        if angles.ndim != 2 or len(angles) != 2:
            raise ValueError(f"angles must have shape (2, individuals), was {angles.shape}")
        out = np.empty((6, angles.shape[1]))
        measure_postures(angles, angles.shape[1], *self, out)
        return out

    def measure_branches(self, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return E and θ3 [deg] of postures θ1, θ2 (2, individuals) [deg], each (2, individuals).

        By branch.
        """
        angles = np.ascontiguousarray(angles, dtype=np.float64)
        costs, theta_3 = np.empty(angles.shape), np.empty(angles.shape)
        measure_branches(angles, *self, costs, theta_3)
        return costs, theta_3

    def posture(self, theta_1: float, theta_2: float) -> tuple[int, FloatArray, FloatArray]:
        """Return the better branch (−1.

        Neither is feasible), and all numbers of it and of the other one (RESULTS,).
        """
        own, other = np.empty(RESULTS), np.empty(RESULTS)
        branch = measure_both(float(theta_1), float(theta_2), *self, own, other)
        return int(branch), own, other
