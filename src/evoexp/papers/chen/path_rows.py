"""Rows of the tables and checks, and lines of the figures, on the grid paths of Chen & Zalzala."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from evoexp.papers.chen import path_claims
from evoexp.papers.chen.figures import grid_paths
from evoexp.papers.chen.figures.grid_paths import FAINT, Line
from evoexp.papers.chen.path_claims import DISTANCE, UNSAFENESS, Group, Routes
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import PlayedRun
from evoexp.report.results.run_measures import counted
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.comparisons import Family

Conditions = tuple[ConditionResults, ...]
Panels = list[tuple[str, ConditionResults, list[Line]]]


def gaps_of_runs(condition: ConditionResults, group: Group, confidence: float) -> str:
    """Describe the gaps of a condition's runs above the best path known."""
    gaps, shares = path_claims.above_known(condition, group.optimum), []
    for bound in (0, 1, 5):  # [%]
        found = counted(gaps <= bound + 1e-9)
        interval = markdown.percent(found.interval(confidence))
        name = f"within {bound} %" if bound else "equal or better"
        shares.append(f"{name} {markdown.share(*found)} ({interval})")
    return f"median {np.median(gaps):+.1f} %, {', '.join(shares)}".replace("-", "−")


def same_problems(groups: tuple[Group, ...]) -> Iterator[tuple[object, ...]]:
    """Yield each two neighbouring weightings with λ > 0 with what they share.

    That is ratios λ/ε, common nodes of the best paths, nodes of each, and how much more the best
    path of one costs than that of two where two weighs [%].
    """
    for one, two in pairwise(groups):
        if one.truth is not None and two.truth is not None and 0.0 not in one.weights + two.weights:
            ratios = [lam / epsilon for epsilon, lam in (one.weights, two.weights)]
            own, other = (
                {tuple(node) for node in group.best_path[0].tolist()} for group in (one, two)
            )
            # the cost of the best path of one by the weights of two
            terms = (one.truth.column(name)[0] for name in (DISTANCE, UNSAFENESS))
            cost = sum(weight * term for weight, term in zip(two.weights, terms, strict=True))
            exchanged = float(cost) / two.optimum - 1.0
            nodes = len(own), len(other)
            yield one, two, ratios, len(own & other), nodes, 100.0 * exchanged


def route_panels(groups: tuple[Group, ...], route_list: Routes) -> Panels:
    """Return one path per route of every weighting."""
    panels: Panels = []
    for group in groups:
        c, lines = group.main, []
        for name, members in path_claims.routes_of(c, route_list).items():
            path, count = path_claims.median_path(c, members), len(members)
            lines.append(Line(name, path, count / c.done, f"{name}: {count} of {c.done}"))
        panels.append((group.title, c, lines))
    return panels


def lingering(group: Group, groups: tuple[Group, ...]) -> str:
    """Count the repeated nodes of the runs of a weighting that permits them."""
    repeats = [_repeated(path) for path in path_claims.paths(group.main).values()]
    simple = [g for g in groups if g.weights == group.weights and not g.revisits][:1]
    return (
        f"{markdown.share(int(np.count_nonzero(repeats)), len(repeats))} runs pass nodes "
        f"again, median {np.median(repeats):.0f} repeated nodes; median length "
        f"{_length(group):.0f} cells"
    ) + "".join(f", {_length(g):.0f} without revisits" for g in simple)


def best_known(group: Group) -> dict[str, object]:
    """Return the numbers of the best path that the reference knows, by name."""
    assert group.truth is not None
    (best,) = group.best_path
    length, unsafeness, exact = (
        float(group.truth.column(f"term_{name}")[0])
        for name in ("distance", "unsafeness", "bound_is_reached")
    )
    told, gap = f"no path is below {group.bound:.5g}", 100.0 * (group.optimum / group.bound - 1.0)
    within = f"no path costs less than {group.bound:.5g}: the truth is known within {gap:.1f} %"
    words: dict[str, object] = {"length": length, "unsafeness": unsafeness}
    words |= {"nodes": len(best), "repeated": _repeated(best), "told": told, "within": within}
    return words | ({"told": "exact", "within": "exact"} if exact else {})


def _median_run(condition: ConditionResults) -> PlayedRun:
    """Return the run of median cost."""
    return PlayedRun(condition, path_claims.median_replicate(condition))


def _length(group: Group) -> float:
    return float(np.median(group.main.column("term_distance")))


def _repeated(path: np.ndarray) -> int:
    """Count the nodes of a path that were passed before."""
    return len(path) - len(np.unique(path, axis=0))


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    # how many runs of a weighting take each route, in words
    "route_counts": lambda group, route_list: ", ".join(
        f"{name} {len(members)}"
        for name, members in path_claims.routes_of(group.main, route_list).items()
    ),
    # the paths of all runs of every weighting, faint, and those that stand out
    "path_panels": lambda groups: [
        (
            g.title,
            g.main,
            [
                *(Line(FAINT, path) for path in path_claims.paths(g.main).values()),
                *grid_paths.known_lines(g),
            ],
        )
        for g in groups
    ],
    # the first condition of each weighting against its others
    "group_families": lambda groups: [Family.of(group.conditions) for group in groups],
    # of all weightings, references included
    "shown_conditions": lambda groups: tuple(c for group in groups for c in group.all),
    "main_conditions": lambda groups: tuple(group.main for group in groups),
    # the run of median cost of every weighting
    "median_runs": lambda main_conditions: [*map(_median_run, main_conditions)],
    "median_missions": lambda conditions: [*map(_median_run, conditions)],
    "truths_are_known": lambda groups: all(group.truth is not None for group in groups),
    # the paths of every weighting that stand out
    "known_panels": lambda groups: [(g.name, g.main, grid_paths.known_lines(g)) for g in groups],
    # gap of each run's cost above the bound of any path, (done,) [%]
    "above_bound": lambda condition, bound_known: path_claims.above_known(condition, bound_known),
}
