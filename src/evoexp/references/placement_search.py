"""A dense search for postures, compiled: E over all θ1 and θ2, and its local minima.

It is written over directions, as all references are: nothing is shared with the planner's own
kernels.
"""

import numpy as np

from evoexp.numeric.compilation import kernel
from evoexp.numeric.elementary import asin, sin
from evoexp.records import BoolArray, FloatArray
from evoexp.references.placement_model import TURN, Directions
from evoexp.references.placement_programme import MARGINS, measure
from evoexp.references.placement_subgradient import costs_of

PI, WHOLE = 3.141592653589793, 6.283185307179586  # [rad]
ON_LIMIT = 1e-9  # [rad], of torques [-]: a posture that breaks a limit by less is on it


def lowest(
    model: Directions, angle_limits: FloatArray, num_angles: int, cap: float, count: int
) -> list[FloatArray]:
    """Return directions (3,) [rad] of the lowest local minima of a dense search, the lowest first.

    Both values of θ3 are sheets of one surface, joined where the third link is upright: a place at
    that edge is a minimum only if nothing around it on the other sheet is lower.

    Args:
        model: The criteria.
        angle_limits: (2, 2) of θ1 and θ2 [deg].
        num_angles: Values of either angle.
        cap: A minimum costs less.
        count: Number of minima, at most.
    """
    share = np.arange(num_angles) / num_angles
    angles = np.radians(angle_limits[:, :1] + (angle_limits[:, 1:] - angle_limits[:, :1]) * share)
    costs, sines = search(model, angles)
    least = np.zeros(costs.shape, dtype=np.bool_)
    mark_minima(
        costs, np.abs(sines) <= 1.0, angle_limits[:, 1] - angle_limits[:, 0] >= TURN, cap, least
    )
    found = np.flatnonzero(least)
    found = found[np.argsort(costs.ravel()[found], kind="stable")][:count]
    places = zip(*np.unravel_index(found, costs.shape), strict=True)
    return [_directions(angles[0, i], angles[1, j], sines[i, j], branch) for branch, i, j in places]


def search(model: Directions, angles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return E, without any cap, over a grid of angles, and the sine of the third link's direction.

    Args:
        model: The criteria.
        angles: (2, n) θ1 and θ2 [rad].

    Returns:
        E (2, n, n): branch (0: the third link points to +x), θ1, θ2; inf where the target is out of
        reach or a limit is broken. Sines (n, n): beyond ±1 where the target is out of reach.
    """
    num = angles.shape[1]
    costs, sines = np.full((2, num, num), np.inf), np.empty((num, num))
    _search(np.ascontiguousarray(angles), model, model.bounds(), costs, sines)
    return costs, sines


@kernel
def _search(
    angles: FloatArray, model: Directions, bounds: FloatArray, costs: FloatArray, sines: FloatArray
) -> None:
    """Search row by row, see `search`; postures out of reach are not measured.

    Args:
        angles: (2, n) [rad].
        model: The criteria.
        bounds: See `placement_programme.measure`.
        costs: (2, n, n) written where the target is in reach.
        sines: (n, n) written.
    """
    num, lengths, target = angles.shape[1], model.lengths, model.target
    kept, upward = np.empty(num, dtype=np.int64), np.empty(num)
    x, across, up, found = np.empty((3, num)), np.empty((3, num)), np.empty((3, num)), np.empty(num)
    z = np.empty(3)
    values, slopes = np.empty(MARGINS + len(bounds)), np.empty((MARGINS + len(bounds), 3))
    for i in range(num):
        one, left, count = angles[0, i], target[1] - lengths[0] * sin(angles[0, i]), 0
        # which angles θ2 are in reach
        for j in range(num):
            sines[i, j] = (left - lengths[1] * sin(one + angles[1, j])) / lengths[2]
        for j in range(num):
            kept[count] = j
            count += 1 if abs(sines[i, j]) <= 1.0 else 0
        for n in range(count):
            x[0, n], x[1, n], upward[n] = one, one + angles[1, kept[n]], sines[i, kept[n]]
        for n in range(count):
            upward[n] = asin(upward[n])
        # both branches, E and limits
        for branch in range(2):
            for n in range(count):
                x[2, n] = PI - upward[n] if branch else upward[n]
            costs_of(x, model, across, up, found[:count])
            for n in range(count * (len(bounds) > 0)):
                z[0], z[1], z[2] = x[0, n], x[1, n], _wrapped(x[1, n], x[2, n])
                measure(z, model, bounds, values, slopes)
                for row in range(MARGINS, len(values)):
                    found[n] = np.inf if values[row] < -ON_LIMIT else found[n]
            for n in range(count):
                costs[branch, i, kept[n]] = found[n]


@kernel
def _wrapped(before: float, after: float) -> float:
    """Return a link's direction, its angle to the link before turned into [−π, π) [rad]."""
    turned: float = after - WHOLE * np.floor((after - before + PI) / WHOLE)
    return turned


def _directions(one: float, two: float, sine: float, branch: int) -> FloatArray:
    """Return directions (3,) of θ1, θ2 [rad] and a branch."""
    upward = float(np.arcsin(sine))
    return np.array([one, one + two, _wrapped(one + two, PI - upward if branch else upward)])


@kernel
def mark_minima(
    costs: FloatArray, in_reach: BoolArray, turns: BoolArray, cap: float, least: BoolArray
) -> None:
    """Mark the places that are not above any place around them.

    Args:
        costs: (2, n, n) branch, θ1, θ2.
        in_reach: (n, n).
        turns: (2,) whether the first value of θ1 and of θ2 follows the last one.
        cap: A minimum costs less.
        least: (2, n, n) written where it is true.
    """
    num = costs.shape[1]
    for branch in range(2):
        for i in range(num):
            for j in range(num):
                cost = costs[branch, i, j]
                if not cost < cap or (
                    0 < j < num - 1 and min(costs[branch, i, j - 1], costs[branch, i, j + 1]) < cost
                ):
                    continue  # as almost all are
                on_own, on_other, at_edge = True, True, False
                for k in range(9):
                    a, b = i + k // 3 - 1, j + k % 3 - 1
                    if (turns[0] or 0 <= a < num) and (turns[1] or 0 <= b < num):
                        a, b = (a + num) % num, (b + num) % num
                        at_edge = at_edge or not in_reach[a, b]
                        on_own = on_own and cost <= costs[branch, a, b]
                        on_other = on_other and cost <= costs[1 - branch, a, b]
                least[branch, i, j] = on_own and (on_other or not at_edge)
