"""Chen & Zalzala 1995, Fig. 2: safe paths over a grid, beside the truth; paths that linger."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from evoexp.papers.chen import path_claims
from evoexp.papers.chen.figures import grid_paths
from evoexp.papers.chen.figures.grid_paths import FAINT, Line
from evoexp.papers.chen.path_claims import Group, Routes
from evoexp.papers.chen.rules import PAPER
from evoexp.report import kit
from evoexp.report.kit import generic, markdown

COST = kit.Measure("cost", kit.by_column("best_cost"))


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the grid paths, or the generic page if another planner was run."""
    if not path_claims.fits(results):
        return generic.page(results, settings)
    groups = path_claims.group_list(results)
    found = path_claims.route_list(groups)
    families = [kit.Family.of(group.conditions) for group in groups]
    return PAPER.page(
        results,
        "path",
        quantities=quantities(results, groups),
        claims=path_claims.judge_paths(results, settings, groups),
        checks=checks(groups, settings, found),
        comparisons=kit.headed(kit.compare_families(families, [COST], settings)),
        drawings=drawings(groups, found),
    )


def quantities(results: kit.Results, groups: tuple[Group, ...]) -> tuple[kit.Quantity, ...]:
    """Return the rows of the table of results."""
    group_of = {c.label: group for group in groups for c in group.all}
    return PAPER.quantities(
        results,
        "path",
        {
            "above_optimum": lambda c: path_claims.gaps(c, group_of[c.label].optimum),
            "above_bound": lambda c: path_claims.gaps(c, group_of[c.label].bound),
        },
    )


def checks(
    groups: tuple[Group, ...], settings: kit.ReportSettings, found: Routes
) -> tuple[tuple[str, str], ...]:
    """Return the rows on gaps, on weightings that are nearly the same, and on routes."""
    truths, routes = list[tuple[str, str]](), list[tuple[str, str]]()
    for g in groups:
        taken = path_claims.routes_of(g.main, found).items()
        counts = ", ".join(f"{name} {len(members)}" for name, members in taken)
        routes += PAPER.checks("routes", group=g, counts=counts)
        if g.truth is not None:
            told = "; ".join(_gap_text(c, g, settings) for c in g.conditions)
            truths.append((f"{g.name}: {_truth_text(g)}", told))
    return (*truths, *_same_problem(groups), *routes, *PAPER.checks("path"))


def _gap_text(condition: kit.ConditionResults, group: Group, settings: kit.ReportSettings) -> str:
    """Describe the gaps of a condition's runs above the best path known."""
    gaps, shares = path_claims.gaps(condition, group.optimum), []
    for bound in (0, 1, 5):  # [%]
        found = kit.counted(gaps <= bound + 1e-9)
        interval = markdown.percent(found.interval(settings.confidence))
        name = f"within {bound} %" if bound else "equal or better"
        shares.append(f"{name} {markdown.share(*found)} ({interval})")
    median = float(np.median(gaps))
    return f"{condition.label}: median {median:+.1f} %, {', '.join(shares)}".replace("-", "−")


def _truth_text(group: Group) -> str:
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


def _same_problem(groups: tuple[Group, ...]) -> Iterator[tuple[str, str]]:
    """Yield a row on each two neighbouring weightings with λ > 0: ratios λ/ε and best paths."""
    for one, two in pairwise(groups):
        if one.truth is not None and two.truth is not None and 0.0 not in one.weights + two.weights:
            ratios = [lam / epsilon for epsilon, lam in (one.weights, two.weights)]
            own, other = (
                {tuple(node) for node in group.best_path[0].tolist()} for group in (one, two)
            )
            exchanged = path_claims.cost_of(one.truth, two.weights) / two.optimum - 1.0
            yield from PAPER.checks(
                "same_problem",
                one=one,
                two=two,
                ratios=ratios,
                shared=len(own & other),
                nodes=(len(own), len(other)),
                more=100.0 * exchanged,
            )


def drawings(groups: tuple[Group, ...], found: Routes) -> tuple[kit.Drawing, ...]:
    """Return the figures."""
    shown, main = _shown(groups), tuple(group.main for group in groups)
    faint = {
        g.name: [Line(FAINT, path) for path in path_claims.paths(g.main).values()] for g in groups
    }
    panels = [(g.title, g.main, [*faint[g.name], *grid_paths.known_lines(g)]) for g in groups]
    of_routes = [(g.title, g.main, _route_lines(g, found)) for g in groups]
    gaps = PAPER.drawing("gaps", grid_paths.GAPS, shown, groups)
    return (
        PAPER.drawing("fig_2_costs", grid_paths.COSTS, shown, groups),
        PAPER.drawing("fig_2_paths", grid_paths.PATHS, shown, panels, plays=_played(groups)),
        PAPER.drawing("routes", grid_paths.ROUTES, main, of_routes),
        *([gaps] if all(group.truth is not None for group in groups) else []),
    )


def _shown(groups: tuple[Group, ...]) -> tuple[kit.ConditionResults, ...]:
    return tuple(c for group in groups for c in group.all)


def _played(groups: tuple[Group, ...]) -> tuple[kit.PlayedRun, ...]:
    return tuple(kit.PlayedRun(g.main, path_claims.median_replicate(g.main)) for g in groups)


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


def lingering_page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of lingering paths, or the generic page if another planner was run."""
    if not path_claims.fits(results):
        return generic.page(results, settings)
    groups = path_claims.group_list(results)
    panels = [(group.name, group.main, grid_paths.known_lines(group)) for group in groups]
    return PAPER.page(
        results,
        "lingering",
        quantities=quantities(results, groups),
        checks=(
            *((f"{g.name}: lingering", _lingering(g, groups)) for g in groups if g.revisits),
            *(row for g in groups for row in _best_known(g)),
        ),
        drawings=(
            PAPER.drawing("paths", grid_paths.PATHS, _shown(groups), panels, plays=_played(groups)),
            PAPER.drawing("lingering", grid_paths.PLACES, [g.main for g in groups], groups),
        ),
    )


def _lingering(group: Group, groups: tuple[Group, ...]) -> str:
    """Count the repeated nodes of the runs of a weighting that permits them."""
    repeats = [_repeated(path) for path in path_claims.paths(group.main).values()]
    simple = [g for g in groups if g.weights == group.weights and not g.revisits][:1]
    return (
        f"{markdown.share(int(np.count_nonzero(repeats)), len(repeats))} runs pass nodes "
        f"again, median {np.median(repeats):.0f} repeated nodes; median length "
        f"{_length(group):.0f} cells"
    ) + "".join(f", {_length(g):.0f} without revisits" for g in simple)


def _best_known(group: Group) -> tuple[tuple[str, str], ...]:
    """Describe the best path that the reference knows; nothing without a reference."""
    if group.truth is None:
        return ()
    (best,) = group.best_path
    length, unsafeness, exact = (
        float(group.truth.column(f"term_{name}")[0])
        for name in ("distance", "unsafeness", "bound_is_reached")
    )
    return PAPER.checks(
        "best_known",
        group=group,
        length=length,
        unsafeness=unsafeness,
        nodes=len(best),
        repeated=_repeated(best),
        told="exact" if exact else f"no path is below {group.bound:.5g}",
    )


def _length(group: Group) -> float:
    return float(np.median(group.main.column("term_distance")))


def _repeated(path: np.ndarray) -> int:
    """Count the nodes of a path that were passed before."""
    return len(path) - len(np.unique(path, axis=0))
