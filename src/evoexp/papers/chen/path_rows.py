"""Rows of the tables and checks, and lines of the figures, on the grid paths of Chen & Zalzala."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from evoexp.papers.chen import path_claims
from evoexp.papers.chen.figures import grid_paths
from evoexp.papers.chen.figures.grid_paths import FAINT, Line
from evoexp.papers.chen.path_claims import Group, Routes
from evoexp.records import FloatArray
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import PlayedRun
from evoexp.report.results.run_measures import counted
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Family

Conditions = tuple[ConditionResults, ...]
Panels = list[tuple[str, ConditionResults, list[Line]]]


def group_families(groups: tuple[Group, ...]) -> list[Family]:
    """Return the first condition of each weighting against its others."""
    return [Family.of(group.conditions) for group in groups]


def _group_of(condition: ConditionResults, groups: tuple[Group, ...]) -> Group:
    return next(group for group in groups if condition in group.all)


def above_optimum(condition: ConditionResults, groups: tuple[Group, ...]) -> FloatArray:
    """Return the gap of each run's cost above the best path known, (done,) [%]."""
    return path_claims.gaps(condition, _group_of(condition, groups).optimum)


def above_bound(condition: ConditionResults, groups: tuple[Group, ...]) -> FloatArray:
    """Return the gap of each run's cost above the bound of any path, (done,) [%]."""
    return path_claims.gaps(condition, _group_of(condition, groups).bound)


def route_counts(group: Group, route_list: Routes) -> str:
    """Return how many runs of a weighting take each route, in words."""
    taken = path_claims.routes_of(group.main, route_list).items()
    return ", ".join(f"{name} {len(members)}" for name, members in taken)


def gaps_of_runs(condition: ConditionResults, group: Group, confidence: float) -> str:
    """Describe the gaps of a condition's runs above the best path known."""
    gaps, shares = path_claims.gaps(condition, group.optimum), []
    for bound in (0, 1, 5):  # [%]
        found = counted(gaps <= bound + 1e-9)
        interval = markdown.percent(found.interval(confidence))
        name = f"within {bound} %" if bound else "equal or better"
        shares.append(f"{name} {markdown.share(*found)} ({interval})")
    return f"median {np.median(gaps):+.1f} %, {', '.join(shares)}".replace("-", "−")


def best_path(group: Group) -> str:
    """Describe the best path that the reference knows."""
    assert group.truth is not None
    length, unsafeness, nodes, exact = (
        group.truth.column(f"term_{name}")[0]
        for name in ("distance", "unsafeness", "num_nodes", "bound_is_reached")
    )
    gap = 100.0 * (group.optimum / group.bound - 1.0)
    told = f"no path costs less than {group.bound:.5g}: the truth is known within {gap:.1f} %"
    return (
        f"best path known costs {group.optimum:.5g} (D {length:.4g}, S {unsafeness:.3g}, "
        f"{nodes:.0f} nodes), {'exact' if exact else told}; gaps of runs to it"
    )


def same_problems(groups: tuple[Group, ...]) -> Iterator[tuple[object, ...]]:
    """Yield each two neighbouring weightings with λ > 0: what they share.

    Returns:
        (one, two, ratios λ/ε, nodes that the best paths share, nodes of each, how much more the
        best path of one costs than that of two where two weighs [%]).
    """
    for one, two in pairwise(groups):
        if one.truth is not None and two.truth is not None and 0.0 not in one.weights + two.weights:
            ratios = [lam / epsilon for epsilon, lam in (one.weights, two.weights)]
            own, other = (
                {tuple(node) for node in group.best_path[0].tolist()} for group in (one, two)
            )
            exchanged = path_claims.cost_of(one.truth, two.weights) / two.optimum - 1.0
            nodes = len(own), len(other)
            yield one, two, ratios, len(own & other), nodes, 100.0 * exchanged


def shown_conditions(groups: tuple[Group, ...]) -> Conditions:
    """Return the conditions of all weightings, references included."""
    return tuple(c for group in groups for c in group.all)


def main_conditions(groups: tuple[Group, ...]) -> Conditions:
    """Return the first condition of every weighting."""
    return tuple(group.main for group in groups)


def median_runs(main_conditions: Conditions) -> list[PlayedRun]:
    """Return the run of median cost of every weighting."""
    return [PlayedRun(c, path_claims.median_replicate(c)) for c in main_conditions]


def truths_are_known(groups: tuple[Group, ...]) -> bool:
    """Return whether every weighting has a reference."""
    return all(group.truth is not None for group in groups)


def path_panels(groups: tuple[Group, ...]) -> Panels:
    """Return the paths of all runs of every weighting, faint, and those that stand out."""
    faint = {
        g.name: [Line(FAINT, path) for path in path_claims.paths(g.main).values()] for g in groups
    }
    return [(g.title, g.main, [*faint[g.name], *grid_paths.known_lines(g)]) for g in groups]


def known_panels(groups: tuple[Group, ...]) -> Panels:
    """Return the paths of every weighting that stand out."""
    return [(group.name, group.main, grid_paths.known_lines(group)) for group in groups]


def route_panels(groups: tuple[Group, ...], route_list: Routes) -> Panels:
    """Return one path per route of every weighting."""
    return [(g.title, g.main, _route_lines(g, route_list)) for g in groups]


def _route_lines(group: Group, found: Routes) -> list[Line]:
    """Return one path per route of a weighting."""
    c = group.main
    return [
        Line(
            name,
            path_claims.median_path(c, members),
            len(members) / c.done,
            f"{name}: {len(members)} of {c.done}",
        )
        for name, members in path_claims.routes_of(c, found).items()
    ]


def revisiting(groups: tuple[Group, ...]) -> list[Group]:
    """Return the weightings that permit loops."""
    return [group for group in groups if group.revisits]


def lingering(group: Group, groups: tuple[Group, ...]) -> str:
    """Count the repeated nodes of the runs of a weighting that permits them."""
    repeats = [_repeated(path) for path in path_claims.paths(group.main).values()]
    simple = [g for g in groups if g.weights == group.weights and not g.revisits][:1]
    return (
        f"{markdown.share(int(np.count_nonzero(repeats)), len(repeats))} runs pass nodes "
        f"again, median {np.median(repeats):.0f} repeated nodes; median length "
        f"{_length(group):.0f} cells"
    ) + "".join(f", {_length(g):.0f} without revisits" for g in simple)


def known_groups(groups: tuple[Group, ...]) -> list[Group]:
    """Return the weightings whose best path is known."""
    return [group for group in groups if group.truth is not None]


def best_known(group: Group) -> dict[str, object]:
    """Return the numbers of the best path that the reference knows, by name."""
    assert group.truth is not None
    (best,) = group.best_path
    length, unsafeness, exact = (
        float(group.truth.column(f"term_{name}")[0])
        for name in ("distance", "unsafeness", "bound_is_reached")
    )
    told = "exact" if exact else f"no path is below {group.bound:.5g}"
    nodes = {"nodes": len(best), "repeated": _repeated(best)}
    return {"length": length, "unsafeness": unsafeness, "told": told} | nodes


def _length(group: Group) -> float:
    return float(np.median(group.main.column("term_distance")))


def _repeated(path: np.ndarray) -> int:
    """Count the nodes of a path that were passed before."""
    return len(path) - len(np.unique(path, axis=0))


def truth(results: Results, condition: ConditionResults) -> ConditionResults:
    """Return the reference of the same map, potentials and weights, of any algorithm."""
    return next(c for c in results.references if _problem(c) == _problem(condition))


def shortest_known(truth: ConditionResults) -> float:
    """Return the length of the shortest path [cell]."""
    return float(truth.array("frontier")[:, 1].min())


def cost_known(truth: ConditionResults) -> float:
    """Return the cost of the best path known."""
    return float(truth.column("best_cost")[0])


def bound_known(truth: ConditionResults) -> float:
    """Return the greatest known lower bound of the cost of any path."""
    return float(truth.column("term_lower_bound")[0])


def excess(condition: ConditionResults, shortest_known: float) -> FloatArray:
    """Return the excess of each run's length over the shortest one, (done,) [%]."""
    return path_claims.excess_of(condition, shortest_known)


def above_known(condition: ConditionResults, cost_known: float) -> FloatArray:
    """Return the gap of each run's cost above the best one known, (done,) [%]."""
    return path_claims.gaps(condition, cost_known)


def _problem(condition: ConditionResults) -> tuple[object, ...]:
    planner, own = condition.planner, condition.condition
    return own.robot, own.scenario, planner.objective, planner.collision, planner.revisits
