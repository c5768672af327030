"""The best posture: a dense search over all angles, then every promising minimum polished."""

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field
from scipy import ndimage

from evoexp.objectives.placement_kernels import Model
from evoexp.records import BoolArray, FloatArray
from evoexp.references.placement_programme import (
    HEIGHT,
    MARGINS,
    OBJECTIVE,
    TURN,
    End,
    Programme,
    directions_of,
)
from evoexp.references.reference import Reference, Truth
from evoexp.validation import Count

SAME = 1e-3  # [deg] two minima so close are one
ACTIVE = 1e-6  # a margin below it is taken to be 0
CIRCLE, RADIUS = 24, 0.01  # postures around a minimum, and how far they are [deg]
MOST_STEPS = 12  # of Newton's method; it takes three or four
DIFFERENCE = 1e-5  # of Newton's central differences, precise enough for its steps

TERM_VALUES = 5  # numbers kept for one pair of angles


class PlacementOptimum(Reference):
    """The exact optimum of `placement_ga`'s cost, and all local minima that the search saw.

    Arrays: `minima` (minima, 3): θ1, θ2 [deg], E, the best one first.
    """

    component: ClassVar[str] = "placement_optimum"
    revision: ClassVar[int] = 2  # 2: saddles on kinks of E are no minima

    # values of either angle that the dense search takes
    num_angles: Annotated[int, Field(ge=8, le=10_000)]
    num_polished: Count  # minima of the dense search that are polished, the lowest ones

    def memory(self, problem: Any) -> int:
        """Return the memory of the dense search, besides the planner's."""
        return 8 * TERM_VALUES * self.num_angles**2 + int(self.planner.memory(problem))

    def truth(self, problem: Any) -> Truth:
        """Search, polish, and judge the best by the planner's own kernels."""
        model = directions_of(problem.model, problem.angle_limits)
        programme, ends, exact = Programme(model), list[FloatArray](), list[FloatArray]()
        evaluations = 2 * self.num_angles * self.num_angles
        own, limits = problem.model, problem.angle_limits
        for one, two, branch in lowest(own, limits, self.num_angles, self.num_polished):
            end = programme.descend(model.reaching(np.radians([one, two]), branch == 1.0))
            evaluations += end.evaluations
            theta = model.theta(end.x)
            if not _is_among(exact, theta):
                polished = polish(programme, end.x)
                ends.append(theta if polished is None else model.theta(polished.x))
                exact += [] if polished is None else ends[-1:]
        # distinct feasible minima, the lowest first, by the planner's kernels
        measured = [(theta, own.posture(*theta)) for theta in ends]
        rows = [
            np.array([*theta, best[0]])
            for theta, (branch, best, _) in measured
            if branch >= 0 and _is_lowest(own, theta, branch, best[0])
        ]
        distinct = list[FloatArray]()
        for row in sorted(rows, key=lambda row: (round(float(row[2]), 9), *np.round(row[:2], 6))):
            distinct += [] if _is_among(distinct, row[:2]) else [row]
        minima = np.array(distinct).reshape(len(distinct), 3)
        num_minima = {"num_minima": float(len(minima))}
        if not len(minima):
            middle, cap = problem.angle_limits.mean(axis=1), problem.model.weights.greatest
            return Truth(middle, cap, False, evaluations, num_minima)
        best, cost = minima[0, :2].copy(), float(minima[0, 2])
        return Truth(best, cost, True, evaluations, num_minima, {"minima": minima})


def lowest(model: Model, angle_limits: FloatArray, num_angles: int, count: int) -> FloatArray:
    """Return the lowest feasible local minima of a dense search, the lowest first, at most `count`.

    They are (≤ count, 3): θ1, θ2 [deg], and the branch: 0, or 1 where the third link points to −x.
    """
    low, high = angle_limits.T[:, :, None]
    angles = low + (high - low) * (np.arange(num_angles) / num_angles)  # (2, n)
    rows = [
        model.measure_branches(np.vstack([np.full(num_angles, one), angles[1]]))
        for one in angles[0]
    ]
    costs, theta_3 = (np.stack(values, axis=1) for values in zip(*rows, strict=True))  # (2, n, n)
    turns = (high - low).ravel() >= TURN
    least = minima_of(costs, np.isfinite(theta_3[0]), turns) & (costs < model.weights.greatest)
    found = np.flatnonzero(least)
    found = found[np.argsort(costs.ravel()[found], kind="stable")][:count]
    branch, i, j = np.unravel_index(found, costs.shape)
    return np.column_stack([angles[0, i], angles[1, j], branch])


def minima_of(costs: FloatArray, in_reach: BoolArray, turns: BoolArray) -> BoolArray:
    """Return which places of costs (2, n, n), by branch, θ1, θ2, are not above any around them.

    Both values of θ3 are sheets of one surface, joined where the third link is upright: a place at
    that edge of what is `in_reach` (n, n) is a minimum only if nothing around it on the other sheet
    is lower. `turns` (2,): whether the first value of θ1 and of θ2 follows the last one.
    """
    modes: Any = ["wrap" if whole else "constant" for whole in turns]
    around = ndimage.minimum_filter(costs, (1, 3, 3), mode=["nearest", *modes], cval=np.inf)
    at_edge = ndimage.minimum_filter(in_reach.astype(np.int8), (3, 3), mode=modes, cval=1) == 0
    return np.asarray((costs <= around) & (~at_edge | (costs <= around[::-1])))


def polish(programme: Programme, x: FloatArray) -> End | None:
    """Return the local minimum near the end of `Programme.descend`, to rounding, or None.

    Newton's method solves the Karush–Kuhn–Tucker conditions; the margins that are 0 at x stay 0.
    """
    z = programme.start(x)
    values, slopes = programme.measured(z)
    binding = np.array([HEIGHT, *(MARGINS + np.flatnonzero(values[MARGINS:] < ACTIVE))])

    def conditions(y: FloatArray) -> FloatArray:
        values, slopes = programme.measured(y[: len(z)])
        return np.concatenate([slopes[OBJECTIVE] - y[len(z) :] @ slopes[binding], values[binding]])

    multipliers = np.linalg.lstsq(slopes[binding].T, slopes[OBJECTIVE], rcond=None)[0]
    y, steps = np.concatenate([z, multipliers]), 0
    while steps < MOST_STEPS:
        off = conditions(y)
        if np.abs(off).max() < 1e-13:
            break
        units = DIFFERENCE * np.eye(len(y))
        changes = [conditions(y + unit) - conditions(y - unit) for unit in units]
        jacobian = np.column_stack([change / (2.0 * DIFFERENCE) for change in changes])
        y, steps = y - np.linalg.lstsq(jacobian, off, rcond=None)[0], steps + 1
    moved = float(np.abs(y[:3] - x).max())
    if not np.isfinite(y).all() or moved > 1e-3 or np.abs(conditions(y)).max() > 1e-9:
        return None
    return End(y[:3], programme.cost(y[:3]), steps)


def _is_lowest(model: Model, theta: FloatArray, branch: int, cost: float) -> bool:
    """Return whether no posture on a small circle around one costs less: a saddle is no minimum."""
    turns = np.linspace(0.0, 2.0 * np.pi, CIRCLE, endpoint=False)
    circle = theta[:, None] + RADIUS * np.stack([np.cos(turns), np.sin(turns)])
    return bool((model.measure_branches(circle)[0][branch] >= cost).all())


def _is_among(known: list[FloatArray], theta: FloatArray) -> bool:
    """Return whether θ1 and θ2 are those of a known minimum."""
    apart = [(theta - other[:2] + TURN / 2) % TURN - TURN / 2 for other in known]
    return any(np.abs(each).max() <= SAME for each in apart)
