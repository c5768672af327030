"""Conventional optimisers from many starts: their ends, and how often these miss the optimum.

"Calculus based methods are local in scope and easy to get stuck in local minima" (Chen & Zalzala
1995, section 1).
"""

from typing import Any, ClassVar

import numpy as np

from evoexp.errors import SettingError
from evoexp.records import FloatArray
from evoexp.references.placement_programme import (
    Directions,
    End,
    Programme,
    directions_of,
    dot,
)
from evoexp.references.reference import Reference, Truth
from evoexp.validation import Count, LayoutCount, Positive

R2 = np.array([0.7548776662466927, 0.5698402909980532])  # Roberts' sequence: fills a square evenly
DIGITS = 2  # decimals [deg] of the angles that are kept: beyond them libraries differ
MOST_TRIES = 1000  # places looked at per start
H = 1e-6  # [rad] of central differences; within it of a kink, the slope is between both sides
PROJECTIONS = 3  # Newton steps back to the surface


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

    component: ClassVar[str] = "placement_conventional"
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
