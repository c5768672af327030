"""Truths about docking postures: the landscape, its optimum, and the ends of conventional methods.

"Calculus based methods are local in scope and easy to get stuck in local minima" (Chen & Zalzala
1995, section 1).
"""

from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field
from scipy import ndimage

from evoexp.errors import SettingError
from evoexp.objectives.placement_criteria import CRITERIA, Model
from evoexp.records import BoolArray, FloatArray
from evoexp.references.placement_programme import (
    HEIGHT,
    MARGINS,
    OBJECTIVE,
    TURN,
    Directions,
    End,
    Programme,
    directions_of,
    dot,
)
from evoexp.references.reference import Reference, Truth
from evoexp.validation import Count, LayoutCount, Positive

SAME = 1e-3  # [deg] two minima so close are one
ACTIVE = 1e-6  # a margin below it is taken to be 0
CIRCLE, RADIUS = 24, 0.01  # postures around a minimum, and how far they are [deg]
MOST_STEPS = 12  # of Newton's method; it takes three or four
DIFFERENCE = 1e-5  # of Newton's central differences, precise enough for its steps
TERM_VALUES = 5  # numbers that the dense search keeps for one pair of angles
LANDSCAPE_VALUES = 20  # numbers that the landscape measures for one pair of angles
R2 = np.array([0.7548776662466927, 0.5698402909980532])  # Roberts' sequence: fills a square evenly
DIGITS = 2  # decimals [deg] of the angles that are kept: beyond them libraries differ
MOST_TRIES = 1000  # places looked at per start
H = 1e-6  # [rad] of central differences; within it of a kink, the slope is between both sides
PROJECTIONS = 3  # Newton steps back to the surface


class PlacementOptimum(Reference):
    """The exact optimum of `placement_ga`'s cost, and all local minima that a dense search saw.

    Arrays: `minima` (minima, 3): θ1, θ2 [deg], E, the best one first.
    """

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
    apart = [(theta - other[:2] + TURN / 2) % TURN - TURN / 2 for other in known]
    return any(np.abs(each).max() <= SAME for each in apart)


class PlacementLandscape(Reference):
    """E over all θ1 and θ2, the better θ3 of each.

    Arrays: `theta_1` and `theta_2` (angles,) [deg]; `cost` (angles of θ1, angles of θ2): E, NaN
    where infeasible.
    """

    # values of either angle, both ends of their range included
    num_angles: Annotated[int, Field(ge=2, le=10_000)]

    def memory(self, problem: Any) -> int:
        """Return the memory of the terms of every pair of angles, besides the planner's."""
        return 8 * LANDSCAPE_VALUES * self.num_angles**2 + int(self.planner.memory(problem))

    def truth(self, problem: Any) -> Truth:
        """Measure the grid; the best of it is the solution."""
        share = np.arange(self.num_angles) / (self.num_angles - 1)
        one, two = problem.angle_limits[:, :1] + np.diff(problem.angle_limits) * share
        pairs = np.stack(np.meshgrid(one, two, indexing="ij")).reshape(2, -1)
        found = problem.model.measure(pairs)
        feasible = found[CRITERIA] >= 0.0
        best = int(np.argmin(found[0]))
        cost = np.where(feasible, found[0], np.nan).reshape(self.num_angles, self.num_angles)
        arrays = {"theta_1": one, "theta_2": two, "cost": cost}
        terms = {"share_feasible": float(np.count_nonzero(feasible)) / pairs.shape[1]}
        solution, lowest = pairs[:, best].copy(), float(found[0, best])
        return Truth(solution, lowest, bool(feasible[best]), pairs.shape[1], terms, arrays)


class PlacementConventional(Reference):
    """Ends of local methods, all from the same starts: feasible postures, evenly spread.

    Arrays, one row per start: `starts` (starts, 3): θ1, θ2, θ3 [deg]; `newton` (of minimax problems
    `bounded`) and `subgradient`, each (starts, 3): θ1, θ2 [deg] and E at the end; E is inf where
    the method broke a limit or left the target.

    - newton: sequential quadratic programming (scipy's SLSQP).
    - subgradient: see `slide`.
    - bounded: the same, with the greatest torque as a variable above all torques; on E itself,
      which has kinks, rounding would decide the end.

    Terms: `<method>_evaluations`, of E per start; the exact derivatives of `newton` and `bounded`
    are not counted.
    """

    revision: ClassVar[int] = 2  # 2: exact slopes, so fewer evaluations

    num_starts: LayoutCount  # number of starts
    num_steps: Count  # steps of the subgradient method
    first_step: Positive  # length of its first one; the k-th is shorter by √k [rad]

    def truth(self, problem: Any) -> Truth:
        """Run all methods."""
        model = directions_of(problem.model, problem.angle_limits)
        starts, places = self._starts(problem, model)
        programme = Programme(model)
        method = "bounded" if programme.minimax else "newton"
        steps = self.first_step / np.sqrt(np.arange(1.0, self.num_steps + 1.0))
        columns, costs = slide(np.column_stack(starts), steps, model)
        slid = zip(columns.T.copy(), costs.tolist(), strict=True)
        ends = {
            method: [programme.descend(x) for x in starts],
            "subgradient": [End(x, cost, 7 * self.num_steps) for x, cost in slid],
        }

        def row(end: End) -> FloatArray:
            cost = end.cost if programme.is_legal(end.x, 1e-6) else np.inf
            return np.array([*np.round(model.theta(end.x), DIGITS), cost])

        arrays = {name: np.array([row(end) for end in found]) for name, found in ends.items()}
        every = np.concatenate(list(arrays.values()))
        # of mirror images always the same
        best = min(every, key=lambda row: (round(float(row[2]), 6), *row[:2]))
        spent = {name: sum(end.evaluations for end in found) for name, found in ends.items()}
        terms = {f"{name}_evaluations": total / self.num_starts for name, total in spent.items()}
        solved = bool(np.isfinite(best[2]))
        solution = best[:2].copy()
        cost = float(problem.model.posture(*solution)[1][0])  # at the angles that are kept
        arrays["starts"] = places
        return Truth(solution, cost, solved, sum(spent.values()), terms, arrays)

    def _starts(self, problem: Any, model: Directions) -> tuple[list[FloatArray], FloatArray]:
        """Return feasible postures as directions, and as θ1, θ2, θ3 [deg] (starts, 3)."""
        low, high = problem.angle_limits.T
        count = MOST_TRIES * self.num_starts
        chunk = 64 * self.num_starts
        found: list[FloatArray] = []
        for first in range(0, count, chunk):
            numbers = np.arange(first + 1, min(first + chunk, count) + 1)
            pairs = low[:, None] + (high - low)[:, None] * ((0.5 + numbers * R2[:, None]) % 1.0)
            costs, theta_3 = problem.model.measure_branches(pairs)
            rows = np.stack([*np.repeat(pairs[:, :, None], 2, axis=2), theta_3.T], axis=2)
            found += list(rows[problem.model.weights.greatest > costs.T])
            if len(found) >= self.num_starts:
                break
        else:
            must = f"at most {len(found)}, the feasible postures"
            raise SettingError("reference.num_starts", must, self.num_starts)
        places = np.array(found[: self.num_starts])
        return [model.directions(place[:2], float(place[2])) for place in places], places


def slide(x: FloatArray, steps: FloatArray, model: Directions) -> tuple[FloatArray, FloatArray]:
    """Follow a projected subgradient method from every start; return the best places and E there.

    Pin & Culioli (1992), whom Chen & Zalzala (1995) compare with, solved the minimax problem by a
    subgradient method; its details are not printed. Here, every step (steps,) [rad] goes against
    the slope of E along the surface of postures that reach the target, from directions x (3,
    starts) [rad] on it, and is followed by a projection onto that surface.
    """
    x, ends, moves = x.copy(), x.copy(), np.ones(x.shape[1])
    costs, units = model.costs(*model.links(x)), np.eye(3)[:, :, None]
    for step in steps:
        # slopes of E by differences (3, starts), normals of the surface
        above, below = (
            model.costs(*model.links((x + sign * units).swapaxes(0, 1))) for sign in (H, -H)
        )
        slope, (normal, _) = (above - below) / (2.0 * H), model.links(x)
        # slopes along the surface
        square = dot(normal, normal)
        share = np.divide(dot(slope, normal), square, np.zeros_like(square), where=square > 0.0)
        slope -= share * normal
        along = dot(slope, slope)
        moves[along <= 0.0] = 0.0  # a way ends where there is no slope
        # a step, and back to the surface by the shortest way to first order
        x -= moves * step * slope / np.sqrt(np.where(along > 0.0, along, 1.0))
        for _ in range(PROJECTIONS):
            normal, up = model.links(x)
            square = dot(normal, normal)
            heights = moves * _height(model, up)
            x -= np.divide(heights, square, np.zeros_like(square), where=square > 0.0) * normal
        # the best place so far
        across, up = model.links(x)
        lower = model.costs(across, up)
        better = (lower < costs) & (np.abs(_height(model, up)) < 1e-9)
        costs[better], ends[:, better] = lower[better], x[:, better]
    return ends, costs


def _height(model: Directions, up: FloatArray) -> FloatArray:
    """Return by how much end-effectors are above their target, by the links' extents (3, n)."""
    return np.asarray(-model.target[1] + up[0] + up[1] + up[2])
