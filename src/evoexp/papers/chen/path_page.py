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
from evoexp.report.kit import (
    Comparison,
    ConditionResults,
    Drawing,
    Page,
    PlayedRun,
    Quantity,
    ReportSettings,
    Results,
    Values,
    by_column,
    compared,
    counted,
    generic,
    markdown,
    run_measures,
)

INTRODUCTION = (
    "Individuals are paths from node to node, of any length, valid by construction. The cost is "
    "C = ε D + λ S (Eq. 1): D is the length in cells (Eq. 2), S the mean unsafeness of the "
    "path's nodes (Eq. 3); lower is better. Best path known: for λ = 0 the shortest path "
    "(Dijkstra), exact; for λ > 0 paths of the frontier of D + μ ΣS over μ, improved until no "
    "insertion, removal or exchange of up to three nodes helps. Below all paths without loops is "
    "a bound by Lagrangian relaxation (the best walk of every number of nodes, with multipliers "
    "that punish further visits of a node): the truth lies between the two. Controls at equal "
    "evaluations: random walks, drawn as the first generation; and path climbing, which "
    "regenerates pieces of five random walks as the mutation does and keeps what costs no more, "
    "without selection and crossover."
)
LINGERING = (
    "The unsafeness of a path is the mean over its nodes (Eq. 3): every further step in a safe "
    "place lowers it. Where nodes may be passed again, the best path waits there; the cost of "
    "its length alone ends it. The paper does not say whether nodes may be passed again; "
    "everywhere else loops are erased. For paths with revisits the best walk is exact (dynamic "
    "programming over the number of nodes); without them the truth lies between the best path "
    "known and a bound by Lagrangian relaxation."
)
CHECKS = (
    (
        "Lingering in safe nodes, which the mean of Eq. 3 rewards",
        "`evoexp run experiment=chen_lingering`",
    ),
    (
        "Places of the obstacles of Fig. 2",
        "are assumed: the text says of the map only that it is cluttered; the platform is a "
        "cylinder of an assumed radius, "
        "obstacles are boxes between the centres of their outermost nodes: every permitted "
        "move is free, past corners, too",
    ),
)


def page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of the grid paths, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    groups = measures.group_list(results)
    found = measures.route_list(groups)
    return Page(
        title=f"Chen & Zalzala 1995: {results.experiment or 'stored runs'}",
        introduction=INTRODUCTION,
        quantities=quantities(results, groups),
        claims=path_claims.judge_paths(results, settings, groups),
        checks=checks(groups, settings, found),
        comparisons=comparisons(groups, settings),
        drawings=drawings(groups, found),
    )


def quantities(results: Results, groups: tuple[Group, ...]) -> tuple[Quantity, ...]:
    """Return the rows of the table of results."""
    row, column = partial(generic.quantity, results), by_column
    group_of = {c.label: group for group in groups for c in group.all}
    above = "cost above the best path known (below 0: better than it)"

    def gap(truth: str) -> Values:
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
    groups: tuple[Group, ...], settings: ReportSettings, found: Routes
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
    return (*gaps, *_same_problem(groups), *routes, *CHECKS)


def _gap_text(condition: ConditionResults, group: Group, settings: ReportSettings) -> str:
    """Describe the gaps of a condition's runs above the best path known."""
    gaps, shares = measures.gaps(condition, group.optimum), []
    for bound in (0, 1, 5):  # [%]
        found = counted(gaps <= bound + 1e-9)
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
    groups: tuple[Group, ...], settings: ReportSettings
) -> tuple[tuple[str, tuple[Comparison, ...]], ...]:
    """Compare the costs of the first condition of each weighting with those of its others."""
    values = by_column("best_cost")
    return tuple(
        (f"cost: {group.main.label} against …", rows)
        for group in groups
        for rows in (compared([(group.main, c) for c in group.conditions[1:]], values, settings),)
        if rows
    )


def drawings(groups: tuple[Group, ...], found: Routes) -> tuple[Drawing, ...]:
    """Return the figures."""
    shown = tuple(c for group in groups for c in group.all)
    faint = {
        g.name: [Line(FAINT, path) for path in measures.paths(g.main).values()] for g in groups
    }
    panels = [(g.title, g.main, [*faint[g.name], *grid_paths.known_lines(g)]) for g in groups]
    of_routes = [(g.title, g.main, _route_lines(g, found)) for g in groups]
    gaps = Drawing(
        "gaps",
        "Gaps to the best path known",
        "Share of runs whose cost is at most so far above the best path known (dotted line at 0). "
        "Dash-dotted: the bound below all paths.",
        partial(grid_paths.gaps_table, groups),
        grid_paths.draw_gaps,
        shown,
    )
    return (
        Drawing(
            "fig_2_costs",
            "Fig. 2: path cost against generations",
            "Best so far: median and quartiles of the runs; dashed: average of a generation. "
            "Random search draws as many random walks; path climbing regenerates pieces of five of "
            "them and keeps what costs no more. Dotted and dash-dotted: cost of "
            "the best path known, and the bound below which no path is.",
            partial(grid_paths.costs_table, groups),
            grid_paths.draw_costs,
            shown,
        ),
        Drawing(
            "fig_2_paths",
            "Fig. 2: paths",
            "All runs of the genetic algorithm, the one of median cost, and the best path known. "
            "Grey: obstacles, from centre to centre of their outermost nodes.",
            partial(grid_paths.paths_table, panels),
            grid_paths.draw_paths,
            shown,
            tuple(PlayedRun(g.main, measures.median_replicate(g.main)) for g in groups),
        ),
        Drawing(
            "routes",
            "Routes",
            "Paths that pass the same sides of all obstacles are one route; of each the run of "
            "median cost, as wide as the route is frequent. A is the most frequent one over all "
            "panels.",
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


def lingering_page(results: Results, settings: ReportSettings) -> Page:
    """Build the page of lingering paths, or the generic page if another planner was run."""
    if not measures.fits(results):
        return generic.page(results, settings)
    groups = measures.group_list(results)
    return Page(
        title=f"Chen & Zalzala 1995: {results.experiment or 'stored runs'}",
        introduction=LINGERING,
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


def _lingering_drawings(groups: tuple[Group, ...]) -> tuple[Drawing, ...]:
    panels = [(group.name, group.main, grid_paths.known_lines(group)) for group in groups]
    return (
        Drawing(
            "paths",
            "Paths with and without revisits",
            "Run of median cost of the genetic algorithm, and the best path known. Lines that go "
            "back and forth lie on each other: the next figure counts nodes.",
            partial(grid_paths.paths_table, panels),
            grid_paths.draw_paths,
            tuple(c for group in groups for c in group.all),
            tuple(PlayedRun(g.main, measures.median_replicate(g.main)) for g in groups),
        ),
        Drawing(
            "lingering",
            "Nodes by their unsafeness",
            "Nodes of the best solution of every run: mean number per unsafeness of the node, "
            "counted as often as they are passed.",
            partial(grid_paths.places_table, groups),
            grid_paths.draw_places,
            tuple(group.main for group in groups),
        ),
    )
