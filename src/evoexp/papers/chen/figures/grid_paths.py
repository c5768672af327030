"""Paths over a grid: costs, gaps, routes, unsafeness (Chen & Zalzala 1995, Fig. 2, Eq. 3)."""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from evoexp.papers.chen import path_claims
from evoexp.papers.chen.path_claims import Group, Routes, above_known, cost_known, paths
from evoexp.planners.grid_path_ga.planner import Problem
from evoexp.records import FloatArray
from evoexp.report.figures import Rows, groups, marks, style, table_of
from evoexp.report.pages import markdown
from evoexp.report.pages.page_parts import PlayedRun
from evoexp.report.results.run_measures import counted
from evoexp.report.results.stored_results import ConditionResults
from evoexp.report.statistics.comparisons import Family
from evoexp.report.statistics.inference import spread

OBSTACLE = "obstacle"
FAINT, MEDIAN, EXACT = "all runs", "run of median cost", "best path known (reference)"
LOOKS: dict[str, dict[str, Any]] = {
    FAINT: {"color": "#88aacc", "linewidth": 0.5, "alpha": 0.45},
    MEDIAN: {"color": style.CONDITION_COLOURS[0], "linewidth": 1.8},
    EXACT: {"color": style.CONDITION_COLOURS[1], "linewidth": 1.4, "linestyle": "--"},
}
AVERAGE = "average of a generation"
KNOWN, BOUND = "best path known", "no path costs less"


class Line(NamedTuple):
    """A path to draw."""

    kind: str  # lines of one kind look alike and share an entry in the legend
    path: FloatArray  # (nodes, 2)
    share: float = 1.0  # share of the runs that take it, in [0, 1]; tells its width
    text: str = ""  # entry in the legend; empty: the kind


# title, a condition of the workspace, lines in order
Panel = tuple[str, ConditionResults, list[Line]]


def known_lines(group: Group) -> list[Line]:
    """Return the run of median cost, and the best path that the reference knows."""
    best = (Line(EXACT, path) for path in group.best_path)
    return [Line(MEDIAN, path_claims.median_path(group.main)), *best]


@table_of("panel unit kind text number share x y")
def paths_table(panels: Sequence[Panel]) -> Rows:
    """Return obstacles and paths."""
    for title, c, lines in panels:
        head = title, c.length_unit
        for number, (x0, y0, x1, y1) in enumerate(c.scenario.obstacles):
            yield from ((*head, OBSTACLE, "", number, 1.0, x, y) for x, y in ((x0, y0), (x1, y1)))
        for number, line in enumerate(lines):
            same = (*head, line.kind, line.text, number, line.share)
            yield from ((*same, x, y) for x, y in line.path.tolist())


def draw_paths(table: pd.DataFrame) -> Figure:
    """Draw workspaces side by side: all runs faint, one run, the reference."""
    figure, panels = _panels(table, {1: 4.2, 2: 3.6, 3: 2.9}.get(table["panel"].nunique(), 2.4))
    for axes, kind, line in _lines(panels, table):
        axes.plot(line["x"], line["y"], **LOOKS[kind])
    kinds = [kind for kind in LOOKS if (table["kind"] == kind).any()]
    style.keys_below(figure, [style.key(kind, **LOOKS[kind]) for kind in kinds])
    return figure


def draw_routes(table: pd.DataFrame) -> Figure:
    """Draw one path per route, as wide as it is frequent, with a legend per workspace."""
    names = sorted({*table["kind"]} - {OBSTACLE}, key=lambda name: (len(name), name))
    figure, panels = _panels(table, 3.1)
    for axes, kind, line in _lines(panels, table):
        text, share = line[["text", "share"]].iloc[0]
        colour, width = style.condition_colour(names.index(kind)), 0.8 + 3.2 * share
        axes.plot(line["x"], line["y"], label=text, color=colour, linewidth=width)
    for axes in panels:
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.24), ncols=2, fontsize=6.5)
    return figure


def draw_obstacle(axes: Axes, x: pd.Series, y: pd.Series) -> None:
    """Draw an obstacle between two corners."""
    (x0, x1), (y0, y1) = x, y
    look: dict[str, Any] = {"facecolor": "#bbbbbb", "edgecolor": style.NEUTRAL}
    axes.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, **look))


def _lines(panels: list[Axes], table: pd.DataFrame) -> Iterator[tuple[Axes, str, pd.DataFrame]]:
    for axes, (_, rows) in zip(panels, groups(table, "panel"), strict=True):
        for (kind, _), line in groups(rows[rows["kind"] != OBSTACLE], ["kind", "number"]):
            yield axes, str(kind), line


def _panels(table: pd.DataFrame, height: float) -> tuple[Figure, list[Axes]]:
    """Return a figure with one workspace per panel, its obstacles and its ends drawn."""
    figure, panels = style.panels(height, table["panel"].nunique(), sharey=True)
    for axes, (name, rows) in zip(panels, groups(table, "panel"), strict=True):
        for _, corners in groups(rows[rows["kind"] == OBSTACLE], "number"):
            draw_obstacle(axes, corners["x"], corners["y"])
        ends = rows[rows["kind"] != OBSTACLE].iloc[[0, -1]]
        for (x, y), marker, size in zip(ends[["x", "y"]].to_numpy(), "o*", (4, 8), strict=True):
            axes.plot(x, y, marker, color=style.NEUTRAL, markersize=size, zorder=4)
        style.operational_axes(axes, str(rows["unit"].iloc[0]))
        limits = {f"{k}lim": (table[k].min() - 1.0, table[k].max() + 1.0) for k in "xy"}
        axes.set(title=str(name), **limits)
    for axes in panels[1:]:
        axes.set_ylabel("")
    return figure, panels


@table_of("position condition unsafeness nodes runs")
def places_table(shown: Sequence[Group]) -> Rows:
    """Count the nodes of every unsafeness on the paths of each first condition."""
    for position, group in enumerate(shown):
        fields, found = group.main.problem(Problem).fields, paths(group.main).values()
        unsafeness = np.asarray(fields.grid.inner(fields.unsafeness))  # (along x, along y)
        passed = np.concatenate([unsafeness[tuple(path.astype(int).T)] for path in found])
        for value in np.unique(unsafeness):
            nodes = (passed == value).sum() / len(found)
            yield position, group.name, float(value), nodes, len(found)


def draw_places(table: pd.DataFrame) -> Figure:
    """Draw one bar per unsafeness and condition."""
    figure, (axes,) = style.panels(2.7)
    values = sorted(set(table.loc[table["nodes"] > 0.0, "unsafeness"]))
    count = table["position"].nunique()
    width = 0.8 / count
    for k, (position, rows) in enumerate(groups(table, "position")):
        own = rows.set_index("unsafeness")["nodes"].reindex(values)
        x = np.arange(len(values)) + width * (k - 0.5 * (count - 1))
        label = f"{rows['condition'].iloc[0]} (n = {rows['runs'].iloc[0]})"
        axes.bar(x, own, width=width, color=style.condition_colour(int(position)), label=label)
    axes.set_xticks(np.arange(len(values)), [f"{value:g}" for value in values])
    axes.set_xlabel("unsafeness Sᵢ of a node (1: far from everything)")
    axes.set_ylabel("nodes per path, mean")
    axes.grid(visible=False, axis="x")
    style.legend_below(figure, [axes], min(count, 4))
    return figure


@table_of("panel position condition quantity generation median lower upper")
def costs_table(found: tuple[Group, ...]) -> Rows:
    """Return median and quartiles of costs over replicates by weighting, condition, generation."""
    for group in found:
        for position, c in enumerate(group.conditions):
            columns: dict[str, Any] = {"best so far": "best_cost"} | (
                {} if position else {AVERAGE: "mean_cost"}
            )
            for name, column in columns.items():
                for generation, own in c.generations.groupby("index"):
                    median, lower, upper, _ = spread(own[column].to_numpy(dtype=np.float64))
                    given = group.title, position, _name(c, group), name, generation
                    yield *given, median, lower, upper
        if group.truth is not None:
            known = (KNOWN, cost_known(group.truth)), (BOUND, path_claims.bound_known(group.truth))
            yield from ((group.title, -1, name, name, 0, *(value,) * 3) for name, value in known)


def draw_costs(table: pd.DataFrame) -> Figure:
    """Draw one panel per weighting."""
    figure, panels = style.panels(2.7, table["panel"].nunique())
    for axes, (name, rows) in zip(panels, groups(table, "panel"), strict=True):
        for (position, quantity), line in groups(rows, ["position", "quantity"]):
            label, x, median = str(line["condition"].iloc[0]), line["generation"], line["median"]
            colour = style.condition_colour(int(position))
            if position < 0:
                look: dict[str, Any] = {"color": style.NEUTRAL, "linewidth": 1.0, "label": label}
                axes.axhline(median.iloc[0], linestyle=":" if quantity == KNOWN else "-.", **look)
            elif quantity == AVERAGE:
                look = {"label": f"{label}, average", "linestyle": "--", "linewidth": 0.9}
                axes.plot(x, median, color=colour, **look)
            else:
                marks.band(axes, x, line["lower"], line["upper"], colour)
                axes.plot(x, median, color=colour, label=label)
        axes.set(title=str(name), xlabel="generation")
    panels[0].set_ylabel("cost C(P)")
    style.legend_below(figure, [panels[0]], 3)
    return figure


@table_of("panel position condition replicate gap_percent bound_percent")
def gaps_table(found: tuple[Group, ...]) -> Rows:
    """Return every run's gap to the best path known."""
    for group in found:
        known, bound = cost_known(group.truth), path_claims.bound_known(group.truth)
        for position, c in enumerate(group.conditions):
            for replicate, gap in zip(c.summaries.index, above_known(c, known), strict=True):
                given = group.title, position, _name(c, group), replicate
                yield *given, gap, 100.0 * (bound / known - 1.0)


def draw_gaps(table: pd.DataFrame) -> Figure:
    """Draw the share of runs whose gap is at most x, one panel per weighting."""
    figure, panels = style.panels(2.5, table["panel"].nunique(), sharey=True)
    most = 1.03 * float(table["gap_percent"].max())
    limits = min(float(table["bound_percent"].min()), -0.03 * most), most  # of all panels
    for axes, (name, rows) in zip(panels, groups(table, "panel"), strict=True):
        for (position, kind), own in groups(rows, ["position", "condition"]):
            axes.ecdf(own["gap_percent"], color=style.condition_colour(int(position)), label=kind)
        look: dict[str, Any] = {"color": style.NEUTRAL, "linewidth": 1.0}
        axes.axvline(0.0, linestyle=":", label=KNOWN, **look)
        axes.axvline(rows["bound_percent"].iloc[0], linestyle="-.", label=BOUND, **look)
        axes.set(title=str(name), xlabel="cost above best known [%]", xlim=limits)
    panels[0].set_ylabel("share of runs")
    style.legend_below(figure, [panels[0]], 3)
    return figure


def _name(condition: ConditionResults, group: Group) -> str:
    """Return the part of a label that the condition adds to its group's: "elitism"."""
    return condition.label.removeprefix(group.name).strip(" ,·") or "genetic algorithm"


def gaps_of_runs(condition: ConditionResults, group: Group, confidence: float) -> str:
    """Describe the gaps of a condition's runs above the best path known."""
    gaps, shares = above_known(condition, cost_known(group.truth)), []
    for bound in (0, 1, 5):  # [%]
        found = counted(gaps <= bound + 1e-9)
        interval = markdown.percent(found.interval(confidence))
        name = f"within {bound} %" if bound else "equal or better"
        shares.append(f"{name} {found} ({interval})")
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
            terms = (one.truth.column(name)[0] for name in path_claims.TERMS)
            cost = sum(weight * term for weight, term in zip(two.weights, terms, strict=True))
            exchanged = float(cost) / cost_known(two.truth) - 1.0
            nodes = len(own), len(other)
            yield one, two, ratios, len(own & other), nodes, 100.0 * exchanged


def route_panels(groups: tuple[Group, ...], route_list: Routes) -> Iterator[Panel]:
    """Yield one path per route of every weighting."""
    for group in groups:
        c, lines = group.main, list[Line]()
        for name, members in path_claims.routes_of(c, route_list).items():
            path, count = path_claims.median_path(c, members), len(members)
            lines.append(Line(name, path, count / c.done, f"{name}: {count} of {c.done}"))
        yield group.title, c, lines


def lingering(group: Group, groups: tuple[Group, ...]) -> str:
    """Count the repeated nodes of the runs of a weighting that permits them."""
    repeats = [_repeated(path) for path in paths(group.main).values()]
    simple = [g for g in groups if g.weights == group.weights and not g.revisits][:1]
    return (
        f"{counted(repeats)} runs pass nodes "
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
    cost, bound = cost_known(group.truth), path_claims.bound_known(group.truth)
    told, gap = f"no path is below {bound:.5g}", 100.0 * (cost / bound - 1.0)
    within = f"no path costs less than {bound:.5g}: the optimum is known to within {gap:.1f} %"
    words: dict[str, object] = {"cost": cost, "length": length, "unsafeness": unsafeness}
    words |= {"nodes": len(best), "repeated": _repeated(best), "told": told, "within": within}
    return words | ({"told": "exact", "within": "exact"} if exact else {})


def _median_run(condition: ConditionResults) -> PlayedRun:
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
        (g.title, g.main, [*faint, *known_lines(g)])
        for g in groups
        for faint in ([Line(FAINT, each) for each in paths(g.main).values()],)
    ],
    # the first condition of each weighting against its others
    "group_families": lambda groups: [Family.of(group.conditions) for group in groups],
    # of all weightings, references included
    "shown_conditions": lambda groups: tuple(
        c for g in groups for c in (*g.conditions, g.truth) if c is not None
    ),
    "main_conditions": lambda groups: tuple(group.main for group in groups),
    # the run of median cost of every weighting
    "median_runs": lambda main_conditions: [*map(_median_run, main_conditions)],
    "median_missions": lambda conditions: [*map(_median_run, conditions)],
    "truths_are_known": lambda groups: all(group.truth is not None for group in groups),
    # the paths of every weighting that stand out
    "known_panels": lambda groups: [(g.name, g.main, known_lines(g)) for g in groups],
    # gap of each run's cost above the bound of any path, (done,) [%]
    "above_bound": lambda condition, bound_known: above_known(condition, bound_known),
}
