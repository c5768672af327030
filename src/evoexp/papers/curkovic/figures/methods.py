"""Methods and settings side by side: curves, boxes of all runs (Curkovic et al. 2013, Fig. 6).

Beside them the Pareto fronts of populations in an early generation (Fig. 5).
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from evoexp.evolution.succession import pareto_front
from evoexp.papers.curkovic import measures
from evoexp.records import FloatArray, FrontRow
from evoexp.report.figures import Rows, groups, marks, style, table_of
from evoexp.report.figures.side_by_side import draw_box
from evoexp.report.pages.page_parts import Quantity
from evoexp.report.results.run_measures import counted, grouped
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.inference import quantile, quantiles, spread
from evoexp.store.log_reader import read_log

CURVE, FINAL, BOUND, THRESHOLD = "best so far", "final", "lower bound", "threshold"
COST = "best C₂ + C₃ + C₄ of a team"
ORDER = [
    *("series", "position", "method", "panel", "hall", "generation", "replicate", "value"),
    *("deviation", "replicates", "refuted"),
]
WITH, WITHOUT = style.ARM_COLOURS[0], style.ARM_COLOURS[1]
PRINTED_RUNS = 20  # of each method in Fig. 6
DASHED = (0, (4, 1.5))
LINES: dict[str, dict[str, Any]] = {
    name: {"color": style.NEUTRAL, "linewidth": 1.0, "linestyle": kind, "zorder": 1}
    for name, kind in ((BOUND, (0, (1, 2))), (THRESHOLD, (0, (4, 2))))
}
MOST = len(style.CONDITION_COLOURS)  # conditions of a panel, each with a colour of its own
DIRECTIONS = {"one_sided": "Eq. 9 one-sided", "symmetric": "Eq. 9 symmetric"}
CRITERIA = ("c1", "c2", "c3", "c4")
MARKERS = ("o", "^", "s", "D")  # of populations
DOMINATED, FRONT = style.ARM_COLOURS[:2]  # blue and red, as the paper draws them
Fronts = dict[int, list[FrontRow]]  # replicate → front of each population


@table_of("position condition replicate cost refuted threshold")
def costs_table(results: Results, threshold: float) -> Rows:
    """Return every run's best cost."""
    for position, c in enumerate(results.with_data):
        refuted = measures.refuted(c) == 1.0
        yield position, c.label, c.summaries.index, c.column("best_cost"), refuted, threshold


def draw_costs(table: pd.DataFrame) -> Figure:
    """Draw one box per condition, the first on top."""
    figure = style.figure(0.25 * table["position"].nunique() + 1.3)
    axes, threshold = figure.add_subplot(), float(table["threshold"].iloc[0])
    _draw_boxes(axes, table.assign(colour=WITH))
    axes.axvline(threshold, **LINES[THRESHOLD])
    style.keys_below(figure, [*run_keys(), style.key("threshold", **LINES[THRESHOLD])], 4)
    return figure


def _draw_boxes(axes: Axes, table: pd.DataFrame) -> None:
    """Draw boxes of all runs, refuted ones as crosses, and medians with these as worst.

    Infinite costs are of runs without a team.
    """
    names = []
    for row, (_, rows) in enumerate(groups(table, "position")):
        costs, refuted = rows["cost"].to_numpy(), rows["refuted"].to_numpy(dtype=bool)
        draw_box(axes, row, costs, rows["colour"].iloc[0])
        crosses: dict[str, Any] = {"color": style.FORBIDDEN, "ms": 4.0, "zorder": 4}
        axes.plot(costs[refuted], np.full(refuted.sum(), row), "x", **crosses)
        middle = quantile(np.where(refuted, np.inf, costs), 0.5)
        if np.isfinite(middle):
            marks.hollow(axes, middle, row, "D", style.NEUTRAL, 5, zorder=5)
        without = int(np.isinf(costs).sum())
        counts = f"n = {len(costs)}{f', {without} without' if without else ''}, {refuted.sum()} ×"
        names.append(f"{rows['condition'].iloc[0]}  ({counts})")
    axes.set_yticks(range(len(names)), names)
    axes.set(ylim=(len(names) - 0.4, -0.6), xlabel=COST)


def run_keys() -> list[Line2D]:
    """Return the entries of a legend for points and medians."""
    grey = style.NEUTRAL
    return [
        marks.point_key("a run", "o", 3, color=grey),
        marks.point_key("refuted (×)", "x", 5, color=style.FORBIDDEN),
        marks.point_key("median, refuted as worst", "D", 5, mec=grey, mfc="white"),
    ]


def methods_table(
    results: Results, pairs: Sequence[tuple[str, str]], bound: float, threshold: float
) -> pd.DataFrame:
    """Return best costs so far per generation, and at the end, and two costs to compare with.

    Of the first runs, as many as the paper draws.
    """
    panels = {label: k for k, pair in enumerate(pairs) for label in pair}
    parts = []
    for position, c in enumerate(results.with_data):
        drawn = c.summaries.index < PRINTED_RUNS
        rows = c.generations[c.generations["replicate"] < PRINTED_RUNS]
        costs = rows.pivot(index="index", columns="replicate", values="best_cost")
        finite = costs.replace([np.inf], np.nan)
        curve: dict[str, Any] = {"series": CURVE, "generation": finite.index.to_numpy()}
        curve |= {"value": finite.mean(axis=1).to_numpy()}
        curve |= {"deviation": finite.std(axis=1, ddof=1).to_numpy()}
        curve |= {"replicates": finite.notna().sum(axis=1).to_numpy()}
        final: dict[str, Any] = {"series": FINAL, "replicate": c.summaries.index[drawn]}
        final |= {"value": c.column("best_cost")[drawn]}
        final |= {"refuted": (measures.refuted(c) == 1.0)[drawn]}
        own: dict[str, Any] = {"position": position, "method": c.label}
        own |= {"panel": panels.get(c.label, len(pairs)), "hall": bool(c.planner.ga.hall_depth)}
        parts += [pd.DataFrame(part).assign(**own) for part in (curve, final)]
    lines = pd.DataFrame({"series": [BOUND, THRESHOLD], "value": [bound, threshold]})
    table = pd.concat([*parts, lines], ignore_index=True)
    return table[ORDER].astype({"value": "float64", "deviation": "float64"})


def draw_methods(table: pd.DataFrame) -> Figure:
    """Draw mean and standard deviation pair by pair, and the final values as boxes."""
    hall = table["hall"].eq(True)
    series = dict(list(groups(table.assign(colour=np.where(hall, WITH, WITHOUT)), "series")))
    lines = {name: float(series[name]["value"].iloc[0]) for name in LINES}
    pairs = list(groups(series[CURVE], "panel"))
    figure = style.figure(6.4)
    halves: Any = figure.subfigures(2, 1, height_ratios=(5, 6))
    row = halves[0].subplots(1, len(pairs), sharex=True, sharey=True, squeeze=False)[0]
    for axes, (_, pair) in zip(row, pairs, strict=True):
        for _, rows in groups(pair, "position"):
            x, mean, off = (rows[name] for name in ("generation", "value", "deviation"))
            colour, kind = rows["colour"].iloc[0], "-" if rows["hall"].iloc[0] else DASHED
            marks.band(axes, x, mean - off, mean + off, colour, alpha=0.2)
            axes.plot(x, mean, color=colour, linestyle=kind)
        for name, value in lines.items():
            axes.axhline(value, **LINES[name])
        names = dict.fromkeys(pair.sort_values("position", kind="stable")["method"])
        axes.set(xlabel="generation", title=" and ".join(names))
        axes.set_xlim(0, max(1.0, float(pair["generation"].max())))
        axes.xaxis.set_major_locator(style.few_ticks())
    row[0].set_ylabel(COST)
    look: dict[str, Any] = {"x": 0.01, "ha": "left", "fontsize": 9, "fontweight": "bold"}
    halves[0].suptitle("a  best collision-free team so far: mean ± standard deviation", **look)
    boxes = halves[1].subplots()
    _draw_boxes(boxes, series[FINAL].rename(columns={"value": "cost", "method": "condition"}))
    boxes.set_title("b  at the end of each run")
    for name, value in lines.items():
        boxes.axvline(value, **LINES[name])
    keys = [
        style.key("hall of fame, Eq. 10", color=WITH),
        style.key("no hall, constant rate", color=WITHOUT, linestyle=DASHED),
        *run_keys(),
        *(style.key(name, **look) for name, look in LINES.items()),
    ]
    style.keys_below(halves[1], keys, 4)
    return figure


def facets(results: Results) -> dict[str, dict[str, ConditionResults]]:
    """Divide conditions by collision substeps and reading of Eq. 9; by rates if they are many.

    Returns title of a panel (empty if there is one only) → its conditions by the parts of their
    labels that differ within the panel.
    """

    def title(condition: ConditionResults) -> str:
        return ", ".join(trait(condition) for trait in traits)

    traits = [t for t in (_substeps, _direction) if len(set(map(t, results.with_data))) > 1]
    found = grouped(results.with_data, title)
    if max(map(len, found)) > MOST:
        traits.append(_rate)
        found = grouped(results.with_data, title)
    divided = {}
    for own in found:
        parts = [c.label.split(", ") for c in own]
        common = set(parts[0]).intersection(*parts[1:]) if len(parts) > 1 else set[str]()
        names = [", ".join([p for p in one if p not in common] or one) for one in parts]
        divided[title(own[0])] = dict(zip(names, own, strict=True))
    return divided


def _substeps(condition: ConditionResults) -> str:
    substeps = condition.planner.collision.collision_substeps
    return "configurations only" if substeps == 1 else f"{substeps} substeps"


def _direction(condition: ConditionResults) -> str:
    return DIRECTIONS[condition.planner.ga.mutation_direction]


def _rate(condition: ConditionResults) -> str:
    ga = condition.planner.ga
    return "Eq. 10" if ga.mutation_decay else f"constant rate {ga.mutation_rate:g}"


@table_of("panel title position name generation evaluations median reached reaching runs threshold")
def facet_table(results: Results, threshold: float) -> Rows:
    """Return medians of the best cost so far, and shares of runs that have reached a cost."""
    names = dict[str, int]()
    for panel, (title, conditions) in enumerate(facets(results).items()):
        for name, c in conditions.items():
            first = measures.generations_to(c, threshold)
            averaged = ["evaluations", "best_cost"]
            wide = c.generations.pivot(index="index", columns="replicate", values=averaged)
            (spent,), (best,) = (
                quantiles(wide[each].to_numpy(np.float64), (0.5,)) for each in averaged
            )
            index = wide.index.to_numpy(np.float64)
            reached, reaching = (first <= index[:, None]).mean(axis=1), np.isfinite(first).sum()
            curve = panel, title, names.setdefault(name, len(names)), name, index, spent, best
            yield *curve, reached, int(reaching), c.done, threshold


def draw_facets(table: pd.DataFrame, column: str) -> Figure:
    """Draw a line per condition: medians of the best cost so far, or the share that got there."""
    names = int(table.groupby("panel")["name"].nunique().max())
    figure, panels = style.panels(2.4 + 0.09 * names, table["panel"].nunique(), 2)
    is_share = column == "reached"
    look: dict[str, Any] = {"drawstyle": "steps-post"} if is_share else {}
    for axes, (_, rows) in zip(panels, groups(table.replace(np.inf, np.nan), "panel"), strict=True):
        axes.sharex(panels[0])
        axes.sharey(panels[0])
        several = rows.groupby("generation")["evaluations"].nunique().max() > 1
        across = "evaluations" if several else "generation"
        for position, own in groups(rows, "position"):
            name, reaching, runs = own[["name", "reaching", "runs"]].iloc[0]
            name += f" ({reaching} of {runs})" * is_share
            colour = style.condition_colour(int(position))
            axes.plot(own[across], own[column], color=colour, label=name, **look)
        if is_share:
            axes.set(ylim=(-0.02, 1.02), ylabel="share of runs")
        else:
            axes.set_ylabel("best cost so far (median)")
            axes.axhline(rows["threshold"].iloc[0], label="threshold", **LINES[THRESHOLD])
        axes.set(xlabel=across, xlim=(0, rows[across].max()), title=rows["title"].iloc[0])
        axes.legend(loc="upper left", bbox_to_anchor=(-0.02, -0.2), ncols=2, fontsize=6.5)
    return figure


@table_of(
    f"generation population individual {' '.join(CRITERIA)} non_dominated replicate length_unit",
    is_rounded=True,
)
def fronts_table(fronts: Sequence[FrontRow], replicate: int, length_unit: str) -> Rows:
    """Return the criteria of every individual of every population."""
    for front in fronts:
        best = pareto_front(np.ascontiguousarray(front.criteria.T))
        individuals = np.arange(len(front.criteria)), *front.criteria.T, best
        yield front.generation, front.population, *individuals, replicate, length_unit


def draw_fronts(table: pd.DataFrame) -> Figure:
    """Draw all pairs of criteria; each population has its marker, each front its colour."""
    unit = table["length_unit"].iloc[0]
    words = "C₁ [collisions]", f"C₂ path [{unit}]", "C₃ rotation [rad]", f"C₄ unevenness [{unit}]"
    names = dict(zip(CRITERIA, words, strict=True))
    figure, panels = style.panels(2.3, 6, 3, 0.3)
    for axes, (x, y) in zip(panels, combinations(CRITERIA, 2), strict=True):
        for (front, population), rows in groups(table, ["non_dominated", "population"]):
            colour, word = (FRONT, "non-dominated") if front else (DOMINATED, "dominated")
            look: dict[str, Any] = {"alpha": 0.85 if front else 0.45, "ms": 3.4, "mec": "none"}
            label = f"robot {population + 1}: {len(rows)} {word}"
            marker = MARKERS[int(population) % len(MARKERS)]
            axes.plot(rows[x], rows[y], marker, color=colour, label=label, **look)
        axes.set(xlabel=names[x], ylabel=names[y])
        axes.yaxis.set_major_locator(style.few_ticks())
        if x == CRITERIA[0]:
            axes.set_xscale("symlog", linthresh=1.0)  # most have no collision, a few have many
            axes.set_xlim(left=-0.2)
        else:
            axes.xaxis.set_major_locator(style.few_ticks())
    style.legend_below(figure, panels[:1], 4)
    return figure


def fronts(condition: ConditionResults) -> Fronts:
    """Return the fronts that the logs of a condition hold."""
    return {
        int(k): read_log(condition.run.log_path(int(k))).fronts for k in condition.summaries.index
    }


def front_conditions(results: Results) -> list[tuple[ConditionResults, str]]:
    """Return the conditions whose fronts are drawn, each with the end of its figure's stem."""
    several = len(results.with_data) > 1
    return [
        (c, f"_{results.position(c.label) + 1}" if several else "")
        for c in results.with_data
        if fronts(c).get(c.best_replicate)
    ]


def front_sizes(results: Results) -> Iterator[Quantity]:
    """Yield the rows of the sizes of fronts, population by population."""
    found = {c.label: fronts(c) for c in results.with_data}
    most = max(len(rows) for own in found.values() for rows in own.values())
    for population in range(most):
        name = f"individuals on the front of robot {population + 1}'s population"
        sizes = {label: spread(_sizes(own, population)) for label, own in found.items()}
        yield Quantity(name, "–", sizes)


def _sizes(fronts: Fronts, population: int | None = None) -> FloatArray:
    """Return the numbers of individuals on the fronts of a population, or of all, (fronts,)."""
    sizes = [
        float(pareto_front(np.ascontiguousarray(front.criteria.T)).sum())
        for rows in fronts.values()
        for number, front in enumerate(rows)
        if population in (None, number)
    ]
    return np.array(sizes)


PAGE_VALUES: dict[str, Callable[..., Any]] = {
    "best_fronts": lambda condition, fronts: fronts[condition.best_replicate],
    # fronts that are larger than the hall of fame may be, and those of a single point
    "large_fronts": lambda condition, fronts: counted(
        _sizes(fronts) > condition.planner.ga.num_hall_teams
    ),
    "single_fronts": lambda fronts: counted(_sizes(fronts) == 1),
}
