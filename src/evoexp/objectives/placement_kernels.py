"""Criteria of a mobile arm's posture, compiled (Chen & Zalzala 1995, Eqs. 8 and 10–14, 17–19).

The arm's kinematics know nothing of the platform's joints: the posture (θ1, θ2) leaves two values
of θ3 that bring the end-effector to its height, and the platform stands where the arm's reach then
ends at the target.
"""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import DEGREE, asin, sincos

COST, TORQUE_NORM, TORQUE_MAX, OBSTACLE, MANIPULABILITY = range(5)
CRITERIA = 5  # numbers that a population keeps of every individual: E, E1, E2, Σ E_obs, E_man
TORQUE, THETA_3, PLATFORM = 5, 8, 9  # of a whole posture
RESULTS = 10  # … and τ1, τ2, τ3, θ3 [deg], X_p


@kernel
def _directions(theta_1, theta_2, task):  # type: ignore[no-untyped-def]
    """Return θ1, θ2, s1, c1, s12, c12, s123, c123, θ1 + θ2 + θ3 [deg].

    The last two NaN where unreachable.
    """
    s1, c1 = sincos(DEGREE * theta_1)
    s12, c12 = sincos(DEGREE * (theta_1 + theta_2))
    s123 = (task[4] - task[0] * s1 - task[1] * s12) / task[2]
    c123, absolute = np.nan, np.nan
    if abs(s123) <= 1.0:
        c123 = np.sqrt((1.0 - s123) * (1.0 + s123))
        absolute = asin(s123) / DEGREE
    return theta_1, theta_2, s1, c1, s12, c12, s123, c123, absolute


@kernel
def measure_posture(directions, branch, task, weights, avoided, limits, out):  # type: ignore[no-untyped-def]
    """Measure one posture; return whether it is feasible: reachable, and within the limits.

    Args:
        directions: What `_directions` makes of θ1 and θ2, which is relative to the first link
            [deg].
        branch: Of θ3: 0: the third link points to +x, 1: to −x.
        task: (7,) l1, l2, l3, X_e, Y_e, F_x, F_y.
        weights: (7,) ε, λ, δ of Eq. 14, α1, α2, α3 of Eq. 11, and the greatest value of E and of
            every criterion, which is what singular and infeasible postures have.
        avoided: (n, 5) γ, link (0: the platform), place on it in [0, 1], X_o, Y_o of Eq. 12.
        limits: (6, 2) of θ1, θ2, θ3 [deg] and τ1, τ2, τ3.
        out: (RESULTS,) written; of what cannot be reached θ3, X_p and torques are NaN.
    """
    theta_1, theta_2, s1, c1, s12, c12, s123, c123, absolute = directions
    cap = weights[6]
    if not abs(s123) <= 1.0:
        for k in range(CRITERIA):
            out[k] = cap
        for k in range(CRITERIA, RESULTS):
            out[k] = np.nan
        return False
    if branch == 1:
        c123, absolute = -c123, 180.0 - absolute
    theta_3 = absolute - theta_1 - theta_2
    theta_3 -= 360.0 * np.floor((theta_3 + 180.0) / 360.0)
    x1, x2, x3 = task[0] * c1, task[1] * c12, task[2] * c123
    y1, y2, y3 = task[0] * s1, task[1] * s12, task[2] * s123
    platform = task[3] - (x1 + x2 + x3)  # Eq. 17
    # The Jacobian (Eq. 19), row by row.
    jx1, jx2, jx3 = -(y1 + y2 + y3), -(y2 + y3), -y3
    jy1, jy2, jy3 = x1 + x2 + x3, x2 + x3, x3
    out[TORQUE] = jx1 * task[5] + jy1 * task[6]  # Eq. 8
    out[TORQUE + 1] = jx2 * task[5] + jy2 * task[6]
    out[TORQUE + 2] = jx3 * task[5] + jy3 * task[6]
    out[THETA_3], out[PLATFORM] = theta_3, platform
    norm, largest, within = 0.0, 0.0, True
    for k in range(3):
        torque = out[TORQUE + k]
        norm += torque * torque  # Eq. 10
        largest = max(largest, abs(weights[3 + k] * torque))  # Eq. 11
        angle = theta_1 if k == 0 else (theta_2 if k == 1 else theta_3)
        within = within and limits[k, 0] <= angle <= limits[k, 1]
        within = within and limits[3 + k, 0] <= torque <= limits[3 + k, 1]
    xx = jx1 * jx1 + jx2 * jx2 + jx3 * jx3
    yy = jy1 * jy1 + jy2 * jy2 + jy3 * jy3
    xy = jx1 * jy1 + jx2 * jy2 + jx3 * jy3
    obstacles = _obstacle_costs(platform, (x1, x2, x3), (y1, y2, y3), avoided, cap)
    out[TORQUE_NORM], out[TORQUE_MAX] = min(norm, cap), min(largest, cap)
    out[OBSTACLE], out[MANIPULABILITY] = (
        min(obstacles, cap),
        _inverse(xx * yy - xy * xy, cap),
    )  # Eq. 13
    total = (
        obstacles + weights[0] * norm + weights[1] * largest + weights[2] * out[MANIPULABILITY]
    )  # Eq. 14
    out[COST] = min(total, cap) if within else cap
    return within


@kernel
def _obstacle_costs(platform, xs, ys, avoided, cap):  # type: ignore[no-untyped-def]
    """Return Σ γ E_obs (Eq. 12) of a platform's place and the links' extents.

    `avoided` as in `measure_posture`.
    """
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
def _inverse(value, cap):  # type: ignore[no-untyped-def]
    """Return 1 / value, at most `cap`.

    Also where rounding made the value of a singular posture negative.
    """
    return 1.0 / value if value * cap > 1.0 else cap


@kernel
def measure_both(theta_1, theta_2, task, weights, avoided, limits, out, other):  # type: ignore[no-untyped-def]
    """Measure both values of θ3; the better one into `out`, the other one into `other`, both.

    RESULTS,.

    Returns:
        Its branch, −1 where neither is feasible.
    """
    directions = _directions(theta_1, theta_2, task)
    one = measure_posture(directions, 0, task, weights, avoided, limits, out)
    two = measure_posture(directions, 1, task, weights, avoided, limits, other)
    branch = 0 if one else -1
    if two and not (one and out[COST] <= other[COST]):
        branch = 1
        for k in range(RESULTS):
            out[k], other[k] = other[k], out[k]
    return branch


@kernel
def measure_branches(angles, task, weights, avoided, limits, costs, theta_3):  # type: ignore[no-untyped-def]
    """Measure both values of θ3 of every posture.

    Costs and θ3 [deg], both (2, individuals), are written.
    """
    out = np.empty(RESULTS)
    for k in range(angles.shape[1]):
        directions = _directions(angles[0, k], angles[1, k], task)
        for branch in range(2):
            measure_posture(directions, branch, task, weights, avoided, limits, out)
            costs[branch, k], theta_3[branch, k] = out[COST], out[THETA_3]


@kernel
def measure_postures(angles, count, task, weights, avoided, limits, out):  # type: ignore[no-untyped-def]
    """Measure a population, the better θ3 of each.

    Args:
        angles: (2, ≥ count) θ1, θ2 [deg].
        count: Individuals.
        task: As of `measure_posture`, and so are `weights`, `avoided` and `limits`.
        out: (CRITERIA + 1, ≥ count) written: the criteria, and the branch (−1: infeasible).
    """
    links, branches = np.empty((7, count)), np.empty((2, CRITERIA, count))
    within = np.empty((2, count), dtype=np.bool_)
    for k in range(count):
        _, _, s1, c1, s12, c12, s123, c123, absolute = _directions(angles[0, k], angles[1, k], task)
        links[0, k], links[1, k], links[2, k], links[3, k] = s1, c1, s12, c12
        links[4, k], links[5, k], links[6, k] = s123, c123, absolute
    for branch in range(2):
        _measure_lanes(
            angles,
            count,
            links,
            branch,
            task,
            weights,
            avoided,
            limits,
            branches[branch],
            within[branch],
        )
    for k in range(count):
        one, two = within[0, k], within[1, k]
        other = two & ((not one) | (branches[0, COST, k] > branches[1, COST, k]))
        for row in range(CRITERIA):
            out[row, k] = branches[1, row, k] if other else branches[0, row, k]
        out[CRITERIA, k] = 1.0 if other else (0.0 if one else -1.0)


@kernel
def _measure_lanes(  # type: ignore[no-untyped-def]
    angles, count, links, branch, task, weights, avoided, limits, out, within
):
    """Measure one branch of a population as `measure_posture` does, bit for bit.

    Individuals innermost.
    """
    l1, l2, l3, x_e, f_x, f_y, cap = (
        task[0],
        task[1],
        task[2],
        task[3],
        task[5],
        task[6],
        weights[6],
    )
    a1, a2, a3, sign = weights[3], weights[4], weights[5], -1.0 if branch == 1 else 1.0
    s1, c1, s12, c12, s123, c123, absolute = (
        links[0],
        links[1],
        links[2],
        links[3],
        links[4],
        links[5],
        links[6],
    )
    obstacles = out[OBSTACLE]
    obstacles[:] = 0.0
    for n in range(len(avoided)):
        weight, link, place, x_o, y_o = (
            avoided[n, 0],
            avoided[n, 1],
            avoided[n, 2],
            avoided[n, 3],
            avoided[n, 4],
        )
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
        free = (
            reached
            & (low_1 <= theta_1)
            & (theta_1 <= high_1)
            & (low_2 <= theta_2)
            & (theta_2 <= high_2)
        )
        free = free & (low_3 <= theta_3) & (theta_3 <= high_3) & (least_1 <= t1) & (t1 <= most_1)
        free = free & (least_2 <= t2) & (t2 <= most_2) & (least_3 <= t3) & (t3 <= most_3)
        xx = jx1 * jx1 + jx2 * jx2 + jx3 * jx3
        yy = jy1 * jy1 + jy2 * jy2 + jy3 * jy3
        xy = jx1 * jy1 + jx2 * jy2 + jx3 * jy3
        singular = _inverse(xx * yy - xy * xy, cap)  # Eq. 13
        obstacle = obstacles[k]
        total = (
            obstacle + weights[0] * norm + weights[1] * largest + weights[2] * singular
        )  # Eq. 14
        out[TORQUE_NORM, k] = norm if reached & (norm < cap) else cap
        out[TORQUE_MAX, k] = largest if reached & (largest < cap) else cap
        out[MANIPULABILITY, k] = singular if reached else cap
        out[OBSTACLE, k] = obstacle if reached & (obstacle < cap) else cap
        out[COST, k] = total if free & (total < cap) else cap
        within[k] = free
