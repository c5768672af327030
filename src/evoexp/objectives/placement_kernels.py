"""Criteria of a mobile arm's posture, compiled (Chen & Zalzala 1995, Eqs. 8 and 10–14, 17–19).

The arm's kinematics do not depend on the platform's joints: the posture (θ1, θ2) leaves two values
of θ3 that bring the end-effector to its height, and the platform stands where the arm then reaches
the target.
"""

from typing import NamedTuple

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import DEGREE, asin, sincos
from evoexp.records import BoolArray, FloatArray

COST, TORQUE_NORM, TORQUE_MAX, OBSTACLE, MANIPULABILITY = range(5)
CRITERIA = 5  # rows of a population: E, E1, E2, Σ E_obs, E_man
TORQUE, THETA_3, PLATFORM = 5, 8, 9  # places among the numbers of one posture
RESULTS = 10  # numbers of one posture: the criteria, τ1, τ2, τ3, θ3 [deg], X_p


class Task(NamedTuple):
    """Links, target and force.

    Attributes:
        l1: Length of the first link [length unit].
        l2: Of the second one.
        l3: Of the third one.
        x_e: X_e: where the end-effector shall be [length unit].
        y_e: Y_e.
        f_x: F_x: force at the end-effector.
        f_y: F_y.
    """

    l1: float
    l2: float
    l3: float
    x_e: float
    y_e: float
    f_x: float
    f_y: float


class Weights(NamedTuple):
    """Weights of Eqs. 11 and 14.

    Attributes:
        epsilon: ε, of ‖τ‖².
        lam: λ, of the greatest |α τ|.
        delta: δ, of 1 / det(J Jᵀ).
        alpha_1: α1, of the first torque.
        alpha_2: α2.
        alpha_3: α3.
        greatest: E_m: greatest value of E and of every criterion, and the value of singular and of
            infeasible postures.
    """

    epsilon: float
    lam: float
    delta: float
    alpha_1: float
    alpha_2: float
    alpha_3: float
    greatest: float


class Model(NamedTuple):
    """Task, weights and limits of the criteria.

    Attributes:
        task: Links, target and force.
        weights: Weights of the criteria.
        avoided: (n, 5) γ, link (0: the platform), place on it in [0, 1], X_o, Y_o of Eq. 12.
        limits: (6, 2) of θ1, θ2, θ3 [deg] and τ1, τ2, τ3.
    """

    task: Task
    weights: Weights
    avoided: FloatArray
    limits: FloatArray

    def measure(self, angles: FloatArray) -> FloatArray:
        """Return criteria and branch of postures θ1, θ2 (2, individuals) [deg].

        Returns:
            (CRITERIA + 1, individuals).

        Raises:
            ValueError: If the angles have another shape.
        """
        angles = np.ascontiguousarray(angles, dtype=np.float64)
        if angles.ndim != 2 or len(angles) != 2:
            raise ValueError(f"angles must have shape (2, individuals), was {angles.shape}")
        out = np.empty((CRITERIA + 1, angles.shape[1]))
        measure_postures(angles, angles.shape[1], self, out)
        return out

    def measure_branches(self, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return E and θ3 [deg] of both branches of postures θ1, θ2 (2, individuals) [deg].

        Returns:
            Two arrays (2, individuals), by branch.
        """
        angles = np.ascontiguousarray(angles, dtype=np.float64)
        costs, theta_3 = np.empty(angles.shape), np.empty(angles.shape)
        measure_branches(angles, self, costs, theta_3)
        return costs, theta_3

    def posture(self, theta_1: float, theta_2: float) -> tuple[int, FloatArray, FloatArray]:
        """Return the better branch, and all numbers of it and of the other one, (RESULTS,) each.

        The branch is −1 where neither is feasible.
        """
        own, other = np.empty(RESULTS), np.empty(RESULTS)
        return int(measure_both(float(theta_1), float(theta_2), self, own, other)), own, other


class LinkDirections(NamedTuple):
    """Directions of the links at θ1 and θ2.

    Attributes:
        theta_1: θ1 [deg].
        theta_2: θ2, relative to the first link [deg].
        s1: Sine of θ1.
        c1: Cosine of θ1.
        s12: Sine of θ1 + θ2.
        c12: Cosine of θ1 + θ2.
        s123: Sine of θ1 + θ2 + θ3; beyond ±1 where the target is out of reach.
        c123: Cosine of it, ≥ 0; NaN where the target is out of reach.
        absolute: θ1 + θ2 + θ3 [deg]; NaN where the target is out of reach.
    """

    theta_1: float
    theta_2: float
    s1: float
    c1: float
    s12: float
    c12: float
    s123: float
    c123: float
    absolute: float


@kernel
def _directions(theta_1: float, theta_2: float, task: Task) -> LinkDirections:
    """Return the directions of the links at θ1 and θ2 [deg], the third one to +x."""
    s1, c1 = sincos(DEGREE * theta_1)
    s12, c12 = sincos(DEGREE * (theta_1 + theta_2))
    s123 = (task.y_e - task.l1 * s1 - task.l2 * s12) / task.l3
    c123, absolute = np.nan, np.nan
    if abs(s123) <= 1.0:
        c123 = np.sqrt((1.0 - s123) * (1.0 + s123))
        absolute = asin(s123) / DEGREE
    return LinkDirections(theta_1, theta_2, s1, c1, s12, c12, s123, c123, absolute)


@kernel
def measure_posture(directions: LinkDirections, branch: int, model: Model, out: FloatArray) -> bool:
    """Measure one posture; return whether it is feasible: reachable, and within the limits.

    Args:
        directions: Of its links.
        branch: Of θ3: 0: the third link points to +x, 1: to −x.
        model: Task, weights and limits.
        out: (RESULTS,) written; θ3, X_p and torques out of reach are NaN.
    """
    task, weights, limits = model.task, model.weights, model.limits
    theta_1, theta_2, s1, c1, s12, c12, s123, c123, absolute = directions
    cap = weights.greatest
    if not abs(s123) <= 1.0:
        for k in range(CRITERIA):
            out[k] = cap
        for k in range(CRITERIA, RESULTS):
            out[k] = np.nan
        return False
    # θ3, links, platform
    if branch == 1:
        c123, absolute = -c123, 180.0 - absolute
    theta_3 = absolute - theta_1 - theta_2
    theta_3 -= 360.0 * np.floor((theta_3 + 180.0) / 360.0)
    x1, x2, x3 = task.l1 * c1, task.l2 * c12, task.l3 * c123
    y1, y2, y3 = task.l1 * s1, task.l2 * s12, task.l3 * s123
    platform = task.x_e - (x1 + x2 + x3)  # Eq. 17
    # the Jacobian (Eq. 19), row by row, and the torques
    jx1, jx2, jx3 = -(y1 + y2 + y3), -(y2 + y3), -y3
    jy1, jy2, jy3 = x1 + x2 + x3, x2 + x3, x3
    out[TORQUE] = jx1 * task.f_x + jy1 * task.f_y  # Eq. 8
    out[TORQUE + 1] = jx2 * task.f_x + jy2 * task.f_y
    out[TORQUE + 2] = jx3 * task.f_x + jy3 * task.f_y
    out[THETA_3], out[PLATFORM] = theta_3, platform
    # torques and limits
    norm, largest, within = 0.0, 0.0, True
    alphas = (weights.alpha_1, weights.alpha_2, weights.alpha_3)
    for k in range(3):
        torque = out[TORQUE + k]
        norm += torque * torque  # Eq. 10
        largest = max(largest, abs(alphas[k] * torque))  # Eq. 11
        angle = theta_1 if k == 0 else (theta_2 if k == 1 else theta_3)
        within = within and limits[k, 0] <= angle <= limits[k, 1]
        within = within and limits[3 + k, 0] <= torque <= limits[3 + k, 1]
    # obstacles, manipulability, cost
    xx = jx1 * jx1 + jx2 * jx2 + jx3 * jx3
    yy = jy1 * jy1 + jy2 * jy2 + jy3 * jy3
    xy = jx1 * jy1 + jx2 * jy2 + jx3 * jy3
    obstacles = _obstacle_costs(platform, (x1, x2, x3), (y1, y2, y3), model.avoided, cap)
    out[TORQUE_NORM], out[TORQUE_MAX] = min(norm, cap), min(largest, cap)
    singular = _inverse(xx * yy - xy * xy, cap)  # Eq. 13
    out[OBSTACLE], out[MANIPULABILITY] = min(obstacles, cap), singular
    total = obstacles + weights.epsilon * norm + weights.lam * largest  # Eq. 14
    total += weights.delta * singular
    out[COST] = min(total, cap) if within else cap
    return within


@kernel
def _obstacle_costs(
    platform: float,
    xs: tuple[float, float, float],
    ys: tuple[float, float, float],
    avoided: FloatArray,
    cap: float,
) -> float:
    """Return Σ γ E_obs (Eq. 12) of a platform's place and the links' extents along x and y."""
    total = 0.0
    for n in range(len(avoided)):
        link, place = avoided[n, 1], avoided[n, 2]
        x = platform + (place if link == 1.0 else 1.0) * xs[0] * (link >= 1.0)
        y = (place if link == 1.0 else 1.0) * ys[0] * (link >= 1.0)
        x += (place if link == 2.0 else 1.0) * xs[1] * (link >= 2.0) + place * xs[2] * (link >= 3.0)
        y += (place if link == 2.0 else 1.0) * ys[1] * (link >= 2.0) + place * ys[2] * (link >= 3.0)
        dx, dy = x - avoided[n, 3], y - avoided[n, 4]
        total += avoided[n, 0] * _inverse(dx * dx + dy * dy, cap)
    return total


@kernel
def _inverse(value: float, cap: float) -> float:
    """Return 1 / value, at most `cap`; rounding may make a singular posture's value negative."""
    return 1.0 / value if value * cap > 1.0 else cap


@kernel
def measure_both(
    theta_1: float, theta_2: float, model: Model, out: FloatArray, other: FloatArray
) -> int:
    """Measure both values of θ3: the better one into `out`, the other one into `other`.

    Returns:
        The better branch, −1 where neither is feasible.
    """
    directions = _directions(theta_1, theta_2, model.task)
    one = measure_posture(directions, 0, model, out)
    two = measure_posture(directions, 1, model, other)
    branch = 0 if one else -1
    if two and not (one and out[COST] <= other[COST]):
        branch = 1
        for k in range(RESULTS):
            out[k], other[k] = other[k], out[k]
    return branch


@kernel
def measure_branches(
    angles: FloatArray, model: Model, costs: FloatArray, theta_3: FloatArray
) -> None:
    """Measure both values of θ3 of every posture: `costs` and `theta_3` (2, individuals) [deg]."""
    out = np.empty(RESULTS)
    for k in range(angles.shape[1]):
        directions = _directions(angles[0, k], angles[1, k], model.task)
        for branch in range(2):
            measure_posture(directions, branch, model, out)
            costs[branch, k], theta_3[branch, k] = out[COST], out[THETA_3]


@kernel
def measure_postures(angles: FloatArray, count: int, model: Model, out: FloatArray) -> None:
    """Measure a population, the better θ3 of each.

    Args:
        angles: (2, ≥ count) θ1, θ2 [deg].
        count: Individuals.
        model: Task, weights and limits.
        out: (CRITERIA + 1, ≥ count) written: the criteria, and the branch (−1: infeasible).
    """
    links, branches = np.empty((7, count)), np.empty((2, CRITERIA, count))
    within = np.empty((2, count), dtype=np.bool_)
    for k in range(count):
        of = _directions(angles[0, k], angles[1, k], model.task)
        links[0, k], links[1, k], links[2, k], links[3, k] = of.s1, of.c1, of.s12, of.c12
        links[4, k], links[5, k], links[6, k] = of.s123, of.c123, of.absolute
    for branch in range(2):
        _measure_lanes(angles, count, links, branch, model, branches[branch], within[branch])
    # the better branch of each
    for k in range(count):
        one, two = within[0, k], within[1, k]
        other = two & ((not one) | (branches[0, COST, k] > branches[1, COST, k]))
        for row in range(CRITERIA):
            out[row, k] = branches[1, row, k] if other else branches[0, row, k]
        out[CRITERIA, k] = 1.0 if other else (0.0 if one else -1.0)


@kernel
def _measure_lanes(
    angles: FloatArray,
    count: int,
    links: FloatArray,
    branch: int,
    model: Model,
    out: FloatArray,
    within: BoolArray,
) -> None:
    """Measure one branch of a population as `measure_posture` does, bit for bit, lane by lane."""
    task, weights, _, limits = model
    l1, l2, l3, _, _, f_x, f_y = task
    epsilon, lam, delta, a1, a2, a3, cap = weights
    sign = -1.0 if branch == 1 else 1.0
    s1, c1, s12, c12, s123 = links[0], links[1], links[2], links[3], links[4]
    c123, absolute = links[5], links[6]
    obstacles = out[OBSTACLE]
    _obstacle_lanes(count, links, sign, model, obstacles)
    # all other criteria, limits, cost
    low_1, high_1, low_2, high_2 = limits[0, 0], limits[0, 1], limits[1, 0], limits[1, 1]
    low_3, high_3, least_1, most_1 = limits[2, 0], limits[2, 1], limits[3, 0], limits[3, 1]
    least_2, most_2, least_3, most_3 = limits[4, 0], limits[4, 1], limits[5, 0], limits[5, 1]
    for k in range(count):
        theta_1, theta_2 = angles[0, k], angles[1, k]
        theta_3 = (180.0 - absolute[k] if branch == 1 else absolute[k]) - theta_1 - theta_2
        theta_3 -= 360.0 * np.floor((theta_3 + 180.0) / 360.0)
        x1, x2, x3 = l1 * c1[k], l2 * c12[k], l3 * (sign * c123[k])
        y1, y2, y3 = l1 * s1[k], l2 * s12[k], l3 * s123[k]
        jx1, jx2, jx3 = -(y1 + y2 + y3), -(y2 + y3), -y3
        jy1, jy2, jy3 = x1 + x2 + x3, x2 + x3, x3
        t1, t2, t3 = jx1 * f_x + jy1 * f_y, jx2 * f_x + jy2 * f_y, jx3 * f_x + jy3 * f_y  # Eq. 8
        norm = 0.0 + t1 * t1 + t2 * t2 + t3 * t3  # Eq. 10
        b1, b2, b3 = abs(a1 * t1), abs(a2 * t2), abs(a3 * t3)
        largest = b1 if b1 > b2 else b2
        largest = b3 if b3 > largest else largest  # Eq. 11
        reached = abs(s123[k]) <= 1.0
        free = reached & (low_1 <= theta_1) & (theta_1 <= high_1)
        free = free & (low_2 <= theta_2) & (theta_2 <= high_2)
        free = free & (low_3 <= theta_3) & (theta_3 <= high_3) & (least_1 <= t1) & (t1 <= most_1)
        free = free & (least_2 <= t2) & (t2 <= most_2) & (least_3 <= t3) & (t3 <= most_3)
        xx = jx1 * jx1 + jx2 * jx2 + jx3 * jx3
        yy = jy1 * jy1 + jy2 * jy2 + jy3 * jy3
        xy = jx1 * jy1 + jx2 * jy2 + jx3 * jy3
        singular = _inverse(xx * yy - xy * xy, cap)  # Eq. 13
        obstacle = obstacles[k]
        total = obstacle + epsilon * norm + lam * largest + delta * singular  # Eq. 14
        out[TORQUE_NORM, k] = norm if reached & (norm < cap) else cap
        out[TORQUE_MAX, k] = largest if reached & (largest < cap) else cap
        out[MANIPULABILITY, k] = singular if reached else cap
        out[OBSTACLE, k] = obstacle if reached & (obstacle < cap) else cap
        out[COST, k] = total if free & (total < cap) else cap
        within[k] = free


@kernel
def _obstacle_lanes(
    count: int, links: FloatArray, sign: float, model: Model, obstacles: FloatArray
) -> None:
    """Write Σ γ E_obs (Eq. 12) of a population; `sign` of the third link's extent along x."""
    s1, c1, s12, c12, s123, c123 = links[0], links[1], links[2], links[3], links[4], links[5]
    avoided, cap = model.avoided, model.weights.greatest
    l1, l2, l3, x_e, _, _, _ = model.task
    obstacles[:] = 0.0
    for n in range(len(avoided)):
        weight, link, place = avoided[n, 0], avoided[n, 1], avoided[n, 2]
        x_o, y_o = avoided[n, 3], avoided[n, 4]
        first = (place if link == 1.0 else 1.0) * (link >= 1.0)
        second, third = (place if link == 2.0 else 1.0) * (link >= 2.0), place * (link >= 3.0)
        for k in range(count):
            x1, x2, x3 = l1 * c1[k], l2 * c12[k], l3 * (sign * c123[k])
            y1, y2, y3 = l1 * s1[k], l2 * s12[k], l3 * s123[k]
            platform = x_e - (x1 + x2 + x3)
            x, y = platform + first * x1, first * y1
            x += second * x2 + third * x3
            y += second * y2 + third * y3
            dx, dy = x - x_o, y - y_o
            obstacles[k] += weight * _inverse(dx * dx + dy * dy, cap)
