"""Rows of the tables and checks, and lines of the figures, on the grid paths of Chen & Zalzala."""

from collections.abc import Iterator
from itertools import pairwise

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


def group_families(groups: tuple[Group, ...]) -> list[Family]:
    """Return the first condition of each weighting against its others."""
    return [Family.of(group.conditions) for group in groups]


def route_counts(group: Group, route_list: Routes) -> str:
    """Return how many runs of a weighting take each route, in words."""
    taken = path_claims.routes_of(group.main, route_list).items()
    return ", ".join(f"{name} {len(members)}" for name, members in taken)


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
            # the cost of the best path of one by the weights of two
            terms = (one.truth.column(name)[0] for name in (DISTANCE, UNSAFENESS))
            cost = sum(weight * term for weight, term in zip(two.weights, terms, strict=True))
            exchanged = float(cost) / two.optimum - 1.0
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


def _length(group: Group) -> float:
    return float(np.median(group.main.column("term_distance")))


def _repeated(path: np.ndarray) -> int:
    """Count the nodes of a path that were passed before."""
    return len(path) - len(np.unique(path, axis=0))
