"""The grid paths of Chen & Zalzala 1995: weightings, gaps to the truth, routes; their claims."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from evoexp.records import FloatArray
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import Claim
from evoexp.report.results import run_measures
from evoexp.report.results.run_measures import counted, planned
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import adjusted, by_column, compared
from evoexp.report.statistics.inference import Proportion
from evoexp.report.statistics.judging import Judge, Rules, evidence

# name of a route (A, B, …; A is the most frequent) → keys of its paths
Routes = dict[str, tuple[Any, ...]]
TERMS = DISTANCE, UNSAFENESS = "term_distance", "term_unsafeness"  # of a path's cost
COST = "best_cost"
CONTROLS = {"random_search": "random walks"}  # names in sentences; of others the component's


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
    def title(self) -> str:
        """Name and weights, over a panel."""
        return f"{self.name}  ε = {self.weights[0]:g}, λ = {self.weights[1]:g}"

    @property
    def best_path(self) -> list[FloatArray]:
        """The best path that the reference knows, (nodes, 2); empty without a reference."""
        return [] if self.truth is None else [paths(self.truth)[0]]


def fits_paths(results: Results) -> bool:
    """Whether there are planners' results, and all are of paths over a plane grid."""
    found = results.with_data
    evolved = planned(results)["grid_path_ga"] and any(not c.is_reference for c in found)
    return evolved and all(len(c.scenario.size) == 2 for c in found)


def groups(results: Results) -> Iterator[Group]:
    """Yield the conditions by weighting and rule for loops, in the order of the experiment."""
    for members in run_measures.grouped(
        results.with_data, lambda c: (c.planner.objective.weights, c.planner.revisits)
    ):
        evolved = tuple(c for c in members if not c.is_reference)
        truth = next((c for c in members if c.is_reference), None)
        weights, revisits = members[0].planner.objective.weights, members[0].planner.revisits
        yield from (Group(c.label, weights, revisits, evolved, truth) for c in evolved[:1])


def truth(results: Results, condition: ConditionResults) -> ConditionResults | None:
    """Return the reference of the same map, potentials and weights, if it is there."""
    return next((c for c in results.references if _problem(c) == _problem(condition)), None)


def _problem(condition: ConditionResults) -> tuple[object, ...]:
    planner, own = condition.planner, condition.condition
    return own.robot, own.scenario, planner.objective, planner.collision, planner.revisits


def cost_known(truth: ConditionResults | None) -> float:
    """Return the cost of the best path known; NaN without a reference."""
    return np.nan if truth is None else float(truth.column("best_cost")[0])


def bound_known(truth: ConditionResults | None) -> float:
    """Return the greatest known lower bound of the cost of any path; NaN without a reference."""
    return np.nan if truth is None else float(truth.column("term_lower_bound")[0])


def shortest_known(truth: ConditionResults) -> float:
    """Return the length of the shortest path [cell]."""
    return float(truth.array("frontier")[:, 1].min())


def above_known(condition: ConditionResults, cost_known: float) -> FloatArray:
    """Return the gap of each run's cost above that of the best path known, (done,) [%]."""
    return np.asarray(np.round(100.0 * (condition.column("best_cost") / cost_known - 1.0), 9))


def paths(condition: ConditionResults) -> dict[int, FloatArray]:
    """Return replicate → nodes (nodes, 2) of its best path."""
    return {k: values.reshape(-1, 2) for k, values in condition.solutions.items()}


def route_list(groups: tuple[Group, ...]) -> Routes:
    """Return the routes of all first conditions together: members are (label, replicate)."""
    of = {(g.main.label, k): path for g in groups for k, path in paths(g.main).items()}
    return routes(of, inside_points(groups[0].main.scenario.obstacles))


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
    """Count the passes of a path (nodes, 2) above each obstacle, rightward minus leftward.

    Two paths with the same ends that pass the same sides of all obstacles have the same signature.
    `centres` (obstacles, 2) are points inside the obstacles, whose x is that of no node.
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
    """Return paths, key → (nodes, 2), grouped by signature, the most frequent route first.

    Of equally frequent routes, that of the earlier path is first. As far as signatures tell, no
    path of a route passes over an obstacle if it is bent to another path of the route.
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


def tuned(results: Results) -> list[tuple[str, str]]:
    """Return labels of the first map: of the best setting on the other maps, and its control's.

    The best one has the least mean logarithm of the median cost.
    """
    first, *others = run_measures.grouped(results.with_data, lambda c: c.scenario)

    def elsewhere(condition: ConditionResults) -> float:
        planner = condition.condition.planner
        twins = [c for own in others for c in own if c.condition.planner == planner]
        return float(np.mean([np.log(np.median(c.column(COST))) for c in twins]))

    sides = ([c for c in first if c.is_control == control] for control in (False, True))
    best = [min(side, key=elsewhere).label for side in sides if side and others]
    return [(best[0], best[1])] if len(best) == 2 else []


def falls_steadily(condition: ConditionResults) -> np.ndarray:
    """Return whether each run's average cost falls from every fifth of it to the next, (done,)."""
    rows = condition.generations
    fifth = (5 * rows["index"]) // (rows.groupby("replicate")["index"].transform("max") + 1)
    means = rows.groupby(["replicate", fifth])["mean_cost"].mean().unstack()
    return np.asarray((means.diff(axis=1).iloc[:, 1:] < 0.0).all(axis=1))


def excess(condition: ConditionResults, shortest_known: float) -> FloatArray:
    """Return the excess of each run's length over the shortest one, (done,) [%]."""
    return np.asarray(100.0 * (condition.column(DISTANCE) / shortest_known - 1.0))


def compromise(judge: Judge, groups: tuple[Group, ...]) -> Iterator[Claim]:
    """Judge that the second weighting's paths are safer than the first's, shorter than the last's.

    Both comparisons are one family. No claim without the three weightings of Fig. 2.
    """
    if len(groups) == 3:
        a, b, c = (group.main for group in groups)
        safer = compared([(b, a)], by_column(UNSAFENESS), judge.settings)
        shorter = compared([(b, c)], by_column(DISTANCE), judge.settings)
        told = "; ".join(
            f"against {other.label}: {evidence(row, word)}"
            for other, word, rows in ((a, "safer", safer), (c, "shorter", shorter))
            for row in rows
        )
        hearing = judge.on("compromise", condition=b.label, first=a.label, last=c.label)
        yield hearing.better_than_all(told, adjusted([*safer, *shorter]))


def converging(condition: ConditionResults, rules: Rules) -> Proportion:
    """Count the runs whose best cost falls and whose average converges toward the best."""
    generations = condition.generations.sort_values("index").groupby("replicate")
    first, last = generations.first(), generations.last()
    most = 1.0 + rules["converges"].limits["spread_percent"] / 100.0
    lower = last["best_cost"] < first["best_cost"]
    return counted(lower & (last["mean_cost"] <= most * last["best_cost_in_generation"]))


def converges(condition: ConditionResults, converging: Proportion) -> bool | None:
    """Return whether all planned runs converge; None: not all of them are done."""
    complete = 0 < condition.planned <= condition.done
    return False if converging.having < condition.done else True if complete else None


def different_paths(judge: Judge, groups: tuple[Group, ...]) -> Iterator[Claim]:
    """Judge that weightings can lead to different paths, by the best ones known of them."""
    if len(groups) == 3 and all(group.truth is not None for group in groups):
        paths = len({tuple(map(tuple, group.best_path[0].tolist())) for group in groups})
        told = {"paths": paths, "weightings": len(groups)}
        yield judge.on("different_paths").own(told, len(groups), paths > 1)


def known_excess(truth: ConditionResults | None, shortest_known: float) -> str:
    """Return how long the best path known is, in words; empty without a reference."""
    if truth is None:
        return ""
    known = float(excess(truth, shortest_known)[0])
    return f"; the best path known of this weighting is {known:.0f} % longer, and costs less"


def evolutions(judge: Judge, groups: tuple[Group, ...]) -> Iterator[Claim]:
    """Judge that evolution helps, whatever the weighting."""
    for group in groups:
        controls = tuple(c for c in group.conditions if c.is_control)
        for own in group.conditions if controls else ():
            if not own.is_control:
                yield evolution(judge, own, controls)


def evolution(
    judge: Judge, condition: ConditionResults, controls: tuple[ConditionResults, ...]
) -> Claim:
    """Judge that evolution helps, and tell its gain over the best control."""
    rows = compared([(condition, c) for c in controls], by_column(COST), judge.settings)
    components = {c.label: str(c.condition.planner.component) for c in controls}
    names = {label: CONTROLS.get(own, own.replace("_", " ")) for label, own in components.items()}
    medians = {names[c.label]: float(np.median(c.column(COST))) for c in controls}
    best = min(medians, key=lambda name: medians[name])
    median = float(np.median(condition.column(COST)))
    gain = medians[best] - median
    told = "; ".join(
        f"against {names[row.quantity]} (median {markdown.number(medians[names[row.quantity]])}): "
        f"{evidence(row, 'lower cost')}"
        for row in rows
    )
    words: dict[str, object] = {"median": median, "best": best, "told": told, "gain": abs(gain)}
    words |= {"share": 100.0 * abs(gain) / medians[best]}
    words |= {"verb": "saves" if gain >= 0.0 else "loses"}
    hearing = judge.on("path_evolution", condition=condition.label, controls=" and ".join(medians))
    return hearing.better_than_all(words, rows)


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "near_shortest": lambda excess, rules: (
        excess <= rules["nearly_shortest"].limits["near_percent"]
    ),
    "is_longer": lambda excess, rules: excess > rules["much_longer"].limits["much_percent"],
    "near_best": lambda above_known, rules: (
        above_known <= rules["nearly_best"].limits["near_percent"]
    ),
    "median_excess": lambda excess: np.median(excess),
    "median_above": lambda above_known: np.median(above_known),
}
