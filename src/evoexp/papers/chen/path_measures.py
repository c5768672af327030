"""Measures of the grid paths of Chen & Zalzala 1995: weightings, gaps to the truth, routes."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.planners.grid_path_ga.planner import GridPathGa
from evoexp.records import FloatArray
from evoexp.report.kit import ConditionResults, Results, planned_by, run_measures

# name of a route (A, B, …; A is the most frequent) → keys of its paths
Routes = dict[str, tuple[Any, ...]]


class Group(NamedTuple):
    """Conditions of one weighting and one rule for loops."""

    name: str  # label of the first condition: (a), (b), …, as in the paper's Fig. 2
    weights: tuple[float, float]  # ε and λ
    revisits: bool  # whether nodes may be passed again
    # GA first, then with elitism, then the controls; without the reference
    conditions: tuple[ConditionResults, ...]
    truth: ConditionResults | None  # the reference; None if it has no data

    @property
    def main(self) -> ConditionResults:
        """The first condition."""
        return self.conditions[0]

    @property
    def all(self) -> tuple[ConditionResults, ...]:
        """The conditions, and the reference if it is there."""
        return self.conditions if self.truth is None else (*self.conditions, self.truth)

    @property
    def title(self) -> str:
        """Name and weights, over a panel."""
        return f"{self.name}  ε = {self.weights[0]:g}, λ = {self.weights[1]:g}"

    @property
    def optimum(self) -> float:
        """Cost of the best path that the reference knows; NaN without a reference."""
        return float(self.truth.column("best_cost")[0]) if self.truth is not None else np.nan

    @property
    def bound(self) -> float:
        """The greatest known lower bound of the cost of any path; NaN without a reference."""
        return float(self.truth.column("term_lower_bound")[0]) if self.truth is not None else np.nan

    @property
    def best_path(self) -> list[FloatArray]:
        """The best path that the reference knows, (nodes, 2); empty without a reference."""
        return [] if self.truth is None else [paths(self.truth)[0]]


def fits(results: Results) -> bool:
    """Whether there are planners' results, and all are of paths over a plane grid."""
    found = results.with_data
    evolved = planned_by(results, GridPathGa) and any(not c.is_reference for c in found)
    return evolved and all(
        len(c.condition.scenario.size) == 2  # type: ignore[attr-defined]
        for c in found
    )


def group_list(results: Results) -> tuple[Group, ...]:
    """Return the conditions by weighting and rule for loops, in the order of the experiment."""
    found = []
    for members in run_measures.grouped(
        results.with_data, lambda c: (c.planner.objective.weights, c.planner.revisits)
    ):
        evolved = tuple(c for c in members if not c.is_reference)
        truth = next((c for c in members if c.is_reference), None)
        weights, revisits = members[0].planner.objective.weights, members[0].planner.revisits
        found += [Group(c.label, weights, revisits, evolved, truth) for c in evolved[:1]]
    return tuple(found)


def shortest(groups: tuple[Group, ...]) -> float:
    """Return the length of the shortest path [cell]; NaN without a reference."""
    known = (g.truth.array("frontier")[:, 1].min() for g in groups if g.truth is not None)
    return float(min(known, default=np.nan))


def gaps(condition: ConditionResults, truth: float) -> FloatArray:
    """Return the gap of each run's cost above a known cost, (done,) [%]."""
    return np.asarray(np.round(100.0 * (condition.column("best_cost") / truth - 1.0), 9))


def cost_of(truth: ConditionResults, weights: tuple[float, float]) -> float:
    """Return the cost of a reference's best path by other weights ε and λ."""
    terms = (float(truth.column(f"term_{name}")[0]) for name in ("distance", "unsafeness"))
    return sum(weight * term for weight, term in zip(weights, terms, strict=True))


def paths(condition: ConditionResults) -> dict[int, FloatArray]:
    """Return replicate → nodes (nodes, 2) of its best path."""
    return {k: values.reshape(-1, 2) for k, values in condition.solutions.items()}


def boxes(condition: ConditionResults) -> list[tuple[int, ...]]:
    """Return the obstacles as blocks of nodes (x0, y0, x1, y1)."""
    return list(condition.condition.scenario.obstacles)  # type: ignore[attr-defined]


def route_list(groups: tuple[Group, ...]) -> Routes:
    """Return the routes of all first conditions together: members are (label, replicate)."""
    of = {(g.main.label, k): path for g in groups for k, path in paths(g.main).items()}
    return routes(of, inside_points(boxes(groups[0].main)))


def routes_of(condition: ConditionResults, found: Routes) -> dict[str, list[int]]:
    """Return name of a route → replicates of a condition that take it; none is empty."""
    label = condition.label
    own = {name: [m[1] for m in members if m[0] == label] for name, members in found.items()}
    return {name: members for name, members in own.items() if members}


def median_replicate(condition: ConditionResults, replicates: list[int] | None = None) -> int:
    """Return the replicate of median cost (the lower one of two) among some, or all."""
    among = None if replicates is None else condition.summaries.index.isin(replicates)
    return run_measures.median_replicate(condition, condition.column("best_cost"), among)


def median_path(condition: ConditionResults, replicates: list[int] | None = None) -> FloatArray:
    """Return the path of the `median_replicate`."""
    return paths(condition)[median_replicate(condition, replicates)]


def signature(path: FloatArray, centres: FloatArray) -> tuple[int, ...]:
    """Count the passes of a path above each obstacle, rightward minus leftward.

    Two paths with the same ends that pass the same sides of all obstacles have the same signature.

    Args:
        path: (nodes, 2).
        centres: (obstacles, 2) a point inside each obstacle, whose x is that of no node.
    """
    before, after = path[:-1, None, :], path[1:, None, :]
    crosses = (before[..., 0] < centres[:, 0]) != (after[..., 0] < centres[:, 0])
    run = np.where(crosses, after[..., 0] - before[..., 0], 1.0)
    share = (centres[:, 0] - before[..., 0]) / run
    above = crosses & (before[..., 1] + share * (after[..., 1] - before[..., 1]) > centres[:, 1])
    return tuple(int(value) for value in (above * np.sign(run)).sum(axis=0))


def inside_points(boxes: Sequence[Sequence[int]]) -> FloatArray:
    """Return a point inside each box (x0, y0, x1, y1) of nodes; no point has the x of a node."""
    return np.array(
        [[0.5 * (x0 + x1) + 0.26, 0.5 * (y0 + y1)] for x0, y0, x1, y1 in boxes]
    ).reshape(-1, 2)


def routes(paths: Mapping[Any, FloatArray], centres: FloatArray) -> Routes:
    """Return paths grouped by signature, the most frequent route first.

    Of equally frequent routes, that of the earlier path is first. As far as signatures tell, no
    path of a route passes over an obstacle if it is bent to another path of the route.

    Args:
        paths: Key → (nodes, 2).
        centres: See `signature`.
    """
    of = {key: signature(path, centres) for key, path in paths.items()}
    return {
        _name(k): tuple(key for key, own in of.items() if own == found)
        for k, (found, _) in enumerate(Counter(of.values()).most_common())
    }


def _name(number: int) -> str:
    """Return the name of a route, counted from 0: A to Z, then AA and so on."""
    before, last = divmod(number, 26)
    return (_name(before - 1) if before else "") + chr(ord("A") + last)
