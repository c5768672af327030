"""Chen & Zalzala 1995, Fig. 2: safe paths over a grid, beside the truth; paths that linger."""

from collections.abc import Iterator
from functools import partial
from itertools import pairwise

import numpy as np

from evoexp.papers.chen import path_claims
from evoexp.papers.chen import path_measures as measures
from evoexp.papers.chen.figures import grid_paths
from evoexp.papers.chen.figures.grid_paths import FAINT, Line
from evoexp.papers.chen.path_measures import Group, Routes
from evoexp.papers.chen.rules import PAPER
from evoexp.report import kit
from evoexp.report.kit import generic, markdown, run_measures


def page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of the grid paths, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    groups = measures.group_list(results)
    found = measures.route_list(groups)
    return PAPER.page(
        results,
        "path",
        quantities=quantities(results, groups),
        claims=path_claims.judge_paths(results, settings, groups),
        checks=checks(groups, settings, found),
        comparisons=comparisons(groups, settings),
        drawings=drawings(groups, found),
    )


def quantities(results: kit.Results, groups: tuple[Group, ...]) -> tuple[kit.Quantity, ...]:
    """Return the rows of the table of results."""
    row, column = partial(generic.quantity, results), kit.by_column
    group_of = {c.label: group for group in groups for c in group.all}
    above = "cost above the best path known (below 0: better than it)"

    def gap(truth: str) -> kit.Values:
        return lambda c: measures.gaps(c, getattr(group_of[c.label], truth))

    return (
        row("cost C", "–", column("best_cost")),
        row("length D", "cell", column("term_distance")),
        row("mean unsafeness S", "–", column("term_unsafeness")),
        row("nodes N", "–", column("term_num_nodes")),
        row(above, "%", gap("optimum")),
        row("cost above the lower bound of any path", "%", gap("bound")),
        row("clearance of the platform over the whole motion (exact)", "unit", column("clearance")),
        row("evaluations", "–", column("evaluations")),
        row("CPU time of a run, exact verdict included", "s", column("cpu_s")),
        row("CPU time of its search", "s", run_measures.search_seconds),
        row("evaluations per second of search", "1/s", run_measures.evaluations_per_second),
    )


def checks(
    groups: tuple[Group, ...], settings: kit.ReportSettings, found: Routes
) -> tuple[tuple[str, str], ...]:
    """Return the rows on gaps, on weightings that are nearly the same, and on routes."""
    gaps = [
        (
            f"{group.name}: {_truth_text(group)}",
            "; ".join(_gap_text(c, group, settings) for c in group.conditions),
        )
        for group in groups
        if group.truth is not None
    ]
    routes = [
        (
            f"{group.name}: routes taken (sides of the obstacles passed), runs each",
            ", ".join(
                f"{name} {len(members)}"
                for name, members in measures.routes_of(group.main, found).items()
            ),
        )
        for group in groups
    ]
    return (*gaps, *_same_problem(groups), *routes, *PAPER.checks("path"))


def _gap_text(condition: kit.ConditionResults, group: Group, settings: kit.ReportSettings) -> str:
    """Describe the gaps of a condition's runs above the best path known."""
    gaps, shares = measures.gaps(condition, group.optimum), []
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
            exchanged = measures.cost_of(one.truth, two.weights) / two.optimum - 1.0
            text = (
                f"only λ/ε matters: {ratios[0]:.0f} and {ratios[1]:.0f} cells; the best paths "
                f"known share {len(own & other)} of {len(own)} and {len(other)} nodes, and that of "
                f"{one.name} costs {100.0 * exchanged:.2g} % more than that of {two.name} where "
                f"{two.name} weighs"
            )
            yield (f"{one.name} and {two.name} are nearly the same problem", text)


def comparisons(
    groups: tuple[Group, ...], settings: kit.ReportSettings
) -> tuple[tuple[str, tuple[kit.Comparison, ...]], ...]:
    """Compare the costs of the first condition of each weighting with those of its others."""
    values = kit.by_column("best_cost")
    return tuple(
        (f"cost: {group.main.label} against …", rows)
        for group in groups
        for rows in (
            kit.compared([(group.main, c) for c in group.conditions[1:]], values, settings),
        )
        if rows
    )


def drawings(groups: tuple[Group, ...], found: Routes) -> tuple[kit.Drawing, ...]:
    """Return the figures."""
    shown = tuple(c for group in groups for c in group.all)
    faint = {
        g.name: [Line(FAINT, path) for path in measures.paths(g.main).values()] for g in groups
    }
    panels = [(g.title, g.main, [*faint[g.name], *grid_paths.known_lines(g)]) for g in groups]
    of_routes = [(g.title, g.main, _route_lines(g, found)) for g in groups]
    gaps = PAPER.drawing(
        "gaps", partial(grid_paths.gaps_table, groups), grid_paths.draw_gaps, shown
    )
    return (
        PAPER.drawing(
            "fig_2_costs", partial(grid_paths.costs_table, groups), grid_paths.draw_costs, shown
        ),
        PAPER.drawing(
            "fig_2_paths",
            partial(grid_paths.paths_table, panels),
            grid_paths.draw_paths,
            shown,
            tuple(kit.PlayedRun(g.main, measures.median_replicate(g.main)) for g in groups),
        ),
        PAPER.drawing(
            "routes",
            partial(grid_paths.paths_table, of_routes),
            grid_paths.draw_routes,
            tuple(group.main for group in groups),
        ),
        *([gaps] if all(group.truth is not None for group in groups) else []),
    )


def _route_lines(group: Group, found: Routes) -> list[Line]:
    """Return one path per route of a weighting."""
    c = group.main
    return [
        Line(
            name,
            measures.median_path(c, members),
            len(members) / c.done,
            f"{name}: {len(members)} of {c.done}",
        )
        for name, members in measures.routes_of(c, found).items()
    ]


def lingering_page(results: kit.Results, settings: kit.ReportSettings) -> kit.Page:
    """Build the page of lingering paths, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    groups = measures.group_list(results)
    return PAPER.page(
        results,
        "lingering",
        quantities=quantities(results, groups),
        checks=(
            *((f"{g.name}: lingering", _lingering(g, groups)) for g in groups if g.revisits),
            *(
                (f"{g.name}: best path known", _best_known(g))
                for g in groups
                if g.truth is not None
            ),
        ),
        drawings=_lingering_drawings(groups),
    )


def _lingering(group: Group, groups: tuple[Group, ...]) -> str:
    """Count the repeated nodes of the runs of a weighting that permits them."""
    repeats = [_repeated(path) for path in measures.paths(group.main).values()]
    simple = [g for g in groups if g.weights == group.weights and not g.revisits][:1]
    return (
        f"{markdown.share(int(np.count_nonzero(repeats)), len(repeats))} runs pass nodes "
        f"again, median {np.median(repeats):.0f} repeated nodes; median length "
        f"{_length(group):.0f} cells"
    ) + "".join(f", {_length(g):.0f} without revisits" for g in simple)


def _best_known(group: Group) -> str:
    """Describe the best path that the reference knows."""
    assert group.truth is not None
    (best,) = group.best_path
    length, unsafeness, exact = (
        float(group.truth.column(f"term_{name}")[0])
        for name in ("distance", "unsafeness", "bound_is_reached")
    )
    return (
        f"cost {group.optimum:.4g}: length {length:.4g}, mean unsafeness {unsafeness:.3g}, "
        f"{len(best)} nodes, {_repeated(best)} of them passed before; "
        f"{'exact' if exact else f'no path is below {group.bound:.5g}'}"
    )


def _length(group: Group) -> float:
    return float(np.median(group.main.column("term_distance")))


def _repeated(path: np.ndarray) -> int:
    """Count the nodes of a path that were passed before."""
    return len(path) - len(np.unique(path, axis=0))


def _lingering_drawings(groups: tuple[Group, ...]) -> tuple[kit.Drawing, ...]:
    panels = [(group.name, group.main, grid_paths.known_lines(group)) for group in groups]
    return (
        PAPER.drawing(
            "paths",
            partial(grid_paths.paths_table, panels),
            grid_paths.draw_paths,
            tuple(c for group in groups for c in group.all),
            tuple(kit.PlayedRun(g.main, measures.median_replicate(g.main)) for g in groups),
        ),
        PAPER.drawing(
            "lingering",
            partial(grid_paths.places_table, groups),
            grid_paths.draw_places,
            tuple(group.main for group in groups),
        ),
    )
