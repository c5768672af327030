"""What the pages on the grid paths of Chen & Zalzala 1995 measure alike.

Groups, gaps to the truth, routes.
"""

from typing import NamedTuple

import numpy as np

from evoexp.papers.chen.routes import Route, inside_points, routes
from evoexp.records import FloatArray
from evoexp.report.proportions import Proportion
from evoexp.report.results import ConditionResults, Results

Weights = tuple[float, float]
NEAR = 0.05  # [-] "nearly shortest": a length within 5 % of the shortest one
MUCH = 0.25  # [-] "much longer": a length more than 25 % above the shortest one
PANELS = "abcdefgh"


class Group(NamedTuple):
    """Conditions of one weighting and one rule for loops.

    Attributes:
        name: (a), (b), … in the order of the experiment; those of the paper's Fig. 2 where
            weightings are its.
        weights: ε and λ.
        conditions: GA first, then with elitism, then random search; without the reference.
        truth: The reference; None where it is not there.
    """

    name: str
    weights: Weights
    revisits: bool
    conditions: tuple[ConditionResults, ...]
    truth: ConditionResults | None

    @property
    def main(self) -> ConditionResults:
        """The first condition."""
        return self.conditions[0]

    @property
    def optimum(self) -> float:
        """Cost of the best path that the reference knows; NaN without one."""
        return float(self.truth.column("best_cost")[0]) if self.truth is not None else np.nan

    @property
    def bound(self) -> float:
        """A cost below which no path is; NaN without a reference."""
        return float(self.truth.column("term_lower_bound")[0]) if self.truth is not None else np.nan


def fits(results: Results) -> bool:
    """Whether there are results, and all of paths over a plane grid."""
    found = [
        hasattr(c.planner, "crossover_reach") and len(_size(c)) == 2 for c in results.with_data
    ]
    return (
        bool(results.evolved) and any(not c.is_reference for c in results.with_data) and all(found)
    )


def group_list(results: Results) -> tuple[Group, ...]:
    """Return the conditions by weighting (and by whether nodes may be passed again).

    In the order of the experiment.
    """
    keys: dict[tuple[Weights, bool], list[ConditionResults]] = {}
    for c in results.with_data:
        keys.setdefault((c.planner.objective.weights, c.planner.revisits), []).append(c)
    found = []
    for (weights, revisits), members in keys.items():
        evolved = tuple(c for c in members if not c.is_reference)
        truth = next((c for c in members if c.is_reference), None)
        if evolved:
            found.append(Group(evolved[0].label, weights, revisits, evolved, truth))
    return tuple(found)


def shortest(groups: tuple[Group, ...]) -> float:
    """Return the length of the shortest path [cell]; NaN where no reference tells it."""
    known = [
        group.truth.array("frontier")[:, 1].min() for group in groups if group.truth is not None
    ]
    return float(min(known)) if known else np.nan


def gaps(condition: ConditionResults, truth: float) -> FloatArray:
    """Return by how much each run's cost is above a known one, (done,) [%]."""
    return np.asarray(np.round(100.0 * (condition.column("best_cost") / truth - 1.0), 9))


def within(condition: ConditionResults, truth: float, share: float) -> Proportion:
    """Return how many runs end with a cost at most so much above a known one."""
    return Proportion(
        int(np.count_nonzero(gaps(condition, truth) <= 100.0 * share + 1e-9)), condition.done
    )


def paths(condition: ConditionResults) -> dict[int, FloatArray]:
    """Return replicate → nodes (nodes, 2) of its best path."""
    return {k: values.reshape(-1, 2) for k, values in condition.solutions.items()}


def boxes(condition: ConditionResults) -> list[tuple[int, ...]]:
    """Return the obstacles as blocks of nodes (x0, y0, x1, y1)."""
    return list(condition.condition.scenario.obstacles)  # type: ignore[attr-defined]


def route_list(groups: tuple[Group, ...]) -> list[Route]:
    """Return the routes of all first conditions together: members are (label, replicate)."""
    of = {(g.main.label, k): path for g in groups for k, path in paths(g.main).items()}
    return routes(of, inside_points(boxes(groups[0].main)))


def routes_of(condition: ConditionResults, found: list[Route]) -> dict[str, list[int]]:
    """Return name of a route → replicates of a condition that take it, of routes that any takes."""
    own = {route.name: [m[1] for m in route.members if m[0] == condition.label] for route in found}
    return {name: members for name, members in own.items() if members}


def median_replicate(condition: ConditionResults, replicates: list[int] | None = None) -> int:
    """Return the replicate of median cost (the lower one of two) among some, or all."""
    costs = condition.summaries["best_cost"]
    chosen = costs.loc[replicates] if replicates is not None else costs
    return int(chosen.sort_values(kind="stable").index[(len(chosen) - 1) // 2])


def search_seconds(condition: ConditionResults) -> FloatArray:
    """Return the CPU time of each run without that of the exact verdict, (done,) [s]."""
    return np.asarray(condition.column("cpu_s") - condition.column("certificate_s"))


def evaluations_per_second(condition: ConditionResults) -> FloatArray:
    """Return the evaluations per second of CPU time of each search, (done,) [1/s]."""
    return np.asarray(condition.column("evaluations") / search_seconds(condition))


def _size(condition: ConditionResults) -> tuple[int, ...]:
    size: tuple[int, ...] = condition.condition.scenario.size  # type: ignore[attr-defined]
    return size
