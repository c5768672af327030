"""Criteria of a mobile arm's posture (Chen & Zalzala 1995, section 3.1, Eqs. 8 and 10–14, 17–19).

The arm's kinematics do not depend on the platform's joints: the posture (θ1, θ2) leaves two values
of θ3 that bring the end-effector to its height, and the platform stands where the arm then reaches
the target.
"""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field

from evoexp.errors import SettingError
from evoexp.numeric.compilation import borrowed, inlined, kernel
from evoexp.numeric.elementary import DEGREE, asin, sincos
from evoexp.records import BoolArray, FloatArray
from evoexp.validation import Component, NonNegative, NonNegativeCount, Positive, Rate, Settings

COST, TORQUE_NORM, TORQUE_MAX, OBSTACLE, MANIPULABILITY = range(5)
CRITERIA = 5  # rows of a population: E, E1, E2, Σ E_obs, E_man
TORQUE, THETA_3, PLATFORM = 5, 8, 9  # places among the numbers of one posture
RESULTS = 10  # numbers of one posture: the criteria, τ1, τ2, τ3, θ3 [deg], X_p


class Task(NamedTuple):
    """Links, target and force."""

    l1: float  # length of the first link [length unit]
    l2: float  # of the second one
    l3: float  # of the third one
    x_e: float  # X_e: where the end-effector shall be [length unit]
    y_e: float  # Y_e
    f_x: float  # F_x: force at the end-effector
    f_y: float  # F_y


class Weights(NamedTuple):
    """Weights of Eqs. 11 and 14."""

    epsilon: float  # ε, of ‖τ‖²
    lam: float  # λ, of the greatest |α τ|
    delta: float  # δ, of 1 / det(J Jᵀ)
    alpha_1: float  # α1, of the first torque
    alpha_2: float
    alpha_3: float
    greatest: float  # E_m: of E and of every criterion; that of singular and infeasible postures


class Model(NamedTuple):
    """Task, weights and limits of the criteria."""

    task: Task
    weights: Weights
    avoided: (
        FloatArray  # (n, 5) γ, link (0: the platform), place on it in [0, 1], X_o, Y_o (Eq. 12)
    )
    limits: FloatArray  # (6, 2) of θ1, θ2, θ3 [deg] and τ1, τ2, τ3

    def measure(self, angles: FloatArray) -> FloatArray:
        """Return criteria and branch (CRITERIA + 1, n) of θ1, θ2 (2, n) [deg]."""
        angles = np.ascontiguousarray(angles, dtype=np.float64)
        out = np.empty((CRITERIA + 1, angles.shape[1]))
        measure_postures(angles, angles.shape[1], self, out)
        return out

    def measure_branches(self, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return E and θ3 [deg] by branch, both (2, individuals), of θ1, θ2 (2, …) [deg]."""
        angles = np.ascontiguousarray(angles, dtype=np.float64)
        branches, _ = measure_branches(angles, angles.shape[1], self)
        return branches[:, COST], branches[:, THETA_3]

    def posture(self, theta_1: float, theta_2: float) -> tuple[int, FloatArray, FloatArray]:
        """Return the better branch, and all numbers of it and of the other one, (RESULTS,) each.

        The branch is −1 where neither is feasible.
        """
        angles = np.array([[float(theta_1)], [float(theta_2)]])
        (one, two), within = measure_branches(angles, 1, self)
        if within[1, 0] and not (within[0, 0] and one[COST, 0] <= two[COST, 0]):
            return 1, two[:, 0], one[:, 0]
        return (0 if within[0, 0] else -1), one[:, 0], two[:, 0]


@inlined
def _inverse(value: float, cap: float) -> float:
    """Return 1 / value, at most `cap`; rounding may make a singular posture's value negative."""
    return 1.0 / value if value * cap > 1.0 else cap


@kernel
def measure_branches(angles: FloatArray, count: int, model: Model) -> tuple[FloatArray, BoolArray]:
    """Measure both values of θ3 of every posture θ1, θ2 (2, ≥ count) [deg].

    Returns by branch (2, RESULTS, count): the criteria, torques, θ3 [deg] and X_p, which are NaN
    out of reach; and (2, count) whether each is feasible: reachable, and within the limits.
    """
    angles, model = borrowed((angles, model))
    branches, within = np.empty((2, RESULTS, count)), np.empty((2, count), dtype=np.bool_)
    numbers = np.empty(RESULTS)
    for branch in range(2):
        for k in range(count):
            within[branch, k] = _measure(angles[0, k], angles[1, k], branch, model, numbers)
            for row in range(RESULTS):
                branches[branch, row, k] = numbers[row]
    return branches, within


@kernel
def measure_postures(angles: FloatArray, count: int, model: Model, out: FloatArray) -> None:
    """Measure the first of a population (2, ≥ count) θ1, θ2 [deg], the better θ3 of each.

    `out` (CRITERIA + 1, ≥ count) is written: the criteria, and the branch (−1: infeasible).
    """
    branches, within = measure_branches(angles, count, model)
    # the better branch of each
    for k in range(count):
        one, two = within[0, k], within[1, k]
        other = two & ((not one) | (branches[0, COST, k] > branches[1, COST, k]))
        for row in range(CRITERIA):
            out[row, k] = branches[1, row, k] if other else branches[0, row, k]
        out[CRITERIA, k] = 1.0 if other else (0.0 if one else -1.0)


@inlined
def _measure(theta_1: float, theta_2: float, branch: int, model: Model, out: FloatArray) -> bool:
    """Write the numbers (RESULTS,) of a posture [deg]; return whether it is feasible.

    The third link points to +x in branch 0, to −x in branch 1.
    """
    task, weights, avoided, limits = model
    l1, l2, l3, x_e, y_e, f_x, f_y = task
    epsilon, lam, delta, a1, a2, a3, cap = weights
    # directions of the links; the third brings the end-effector to its height (Eq. 18)
    s1, c1 = sincos(DEGREE * theta_1)
    s12, c12 = sincos(DEGREE * (theta_1 + theta_2))
    s123 = (y_e - l1 * s1 - l2 * s12) / l3
    reached, c123, absolute = abs(s123) <= 1.0, np.nan, np.nan
    if reached:
        c123, absolute = np.sqrt((1.0 - s123) * (1.0 + s123)), asin(s123) / DEGREE
    if branch == 1:
        c123, absolute = -c123, 180.0 - absolute
    theta_3 = absolute - theta_1 - theta_2
    theta_3 -= 360.0 * np.floor((theta_3 + 180.0) / 360.0)
    x1, x2, x3 = l1 * c1, l2 * c12, l3 * c123
    y1, y2, y3 = l1 * s1, l2 * s12, l3 * s123
    platform = x_e - (x1 + x2 + x3)  # Eq. 17
    # columns of the Jacobian, torques (Eq. 8) and their criteria (Eqs. 10 and 11)
    jx1, jx2, jx3 = -(y1 + y2 + y3), -(y2 + y3), -y3
    jy1, jy2, jy3 = x1 + x2 + x3, x2 + x3, x3
    t1, t2, t3 = jx1 * f_x + jy1 * f_y, jx2 * f_x + jy2 * f_y, jx3 * f_x + jy3 * f_y
    norm = t1 * t1 + t2 * t2 + t3 * t3
    b1, b2, b3 = abs(a1 * t1), abs(a2 * t2), abs(a3 * t3)
    largest = b1 if b1 > b2 else b2
    largest = b3 if b3 > largest else largest
    # limits
    free, values = reached, (theta_1, theta_2, theta_3, t1, t2, t3)
    for k in range(6):
        free &= (limits[k, 0] <= values[k]) & (values[k] <= limits[k, 1])
    # manipulability (Eq. 13), obstacles (Eq. 12), cost (Eq. 14)
    xx = jx1 * jx1 + jx2 * jx2 + jx3 * jx3
    yy = jy1 * jy1 + jy2 * jy2 + jy3 * jy3
    xy = jx1 * jy1 + jx2 * jy2 + jx3 * jy3
    singular, obstacle = _inverse(xx * yy - xy * xy, cap), 0.0
    for n in range(len(avoided)):
        link, place = avoided[n, 1], avoided[n, 2]
        first = (place if link == 1.0 else 1.0) * (link >= 1.0)
        second, third = (place if link == 2.0 else 1.0) * (link >= 2.0), place * (link >= 3.0)
        dx = platform + first * x1 + (second * x2 + third * x3) - avoided[n, 3]
        dy = first * y1 + (second * y2 + third * y3) - avoided[n, 4]
        obstacle += avoided[n, 0] * _inverse(dx * dx + dy * dy, cap)
    total = obstacle + epsilon * norm + lam * largest + delta * singular
    out[TORQUE_NORM] = norm if reached & (norm < cap) else cap
    out[TORQUE_MAX] = largest if reached & (largest < cap) else cap
    out[MANIPULABILITY] = singular if reached else cap
    out[OBSTACLE] = obstacle if reached & (obstacle < cap) else cap
    out[COST] = total if free & (total < cap) else cap
    for k in range(3):
        out[TORQUE + k] = values[3 + k] if reached else np.nan
    out[THETA_3], out[PLATFORM] = theta_3, platform
    return bool(free)


class Avoidance(Settings):
    """One term of Eq. 12: a point of the robot shall be far from an obstacle."""

    weight: NonNegative  # γ of Eq. 14 [length unit²]
    # where the point is: 0: the platform's middle, 1 to 3: a link
    link: Annotated[int, Field(ge=0, le=3)]
    place: Rate  # on the link, from its joint to its end [-]
    obstacle: NonNegativeCount  # index of the obstacle, from 0


class PlacementCriteria(Component):
    """Weights of E of Eq. 14, which is at most `greatest`, the cost of an infeasible posture."""

    torque_norm_weight: NonNegative  # ε, of ‖τ‖² (Eq. 10)
    torque_max_weight: NonNegative  # λ, of the greatest |α τ| (Eq. 11)
    manipulability_weight: NonNegative  # δ, of 1 / det(J Jᵀ) (Eq. 13)
    # α1, α2, α3 of Eq. 11: inverses of the torques' limits
    torque_weights: tuple[NonNegative, NonNegative, NonNegative]
    # E_m of Eq. 15: no criterion and no cost is above it, singular postures included
    greatest: Positive
    avoidances: tuple[Avoidance, ...] = ()  # terms of Eq. 12

    def _check(self) -> None:
        weights = self.torque_norm_weight, self.torque_max_weight, self.manipulability_weight
        counts = any((*weights, *(one.weight for one in self.avoidances)))
        must = "above 0, or another weight: with all of them 0 every posture costs the same"
        self.demand("torque_norm_weight", counts, must)
        if self.torque_max_weight > 0.0 and not any(self.torque_weights):
            must = "above 0 for one torque at least"
            raise SettingError("torque_weights", must, list(self.torque_weights))

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
