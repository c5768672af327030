"""Runs counted (Lavoie & Boudreau 2001): attempts, errors below x (Fig. 3), stopping values."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.papers.lavoie.measures import Percentage
from evoexp.report.figures import groups, marks, records, style
from evoexp.report.results.run_measures import counted
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.comparisons import Values
from evoexp.report.statistics.inference import Proportion, spread

ATTEMPT_COLUMNS = [
    *("position", "condition", "attempts", "having", "total"),
    *("share", "lower", "upper", "mean"),
]
FOUND, PRINTED = "found", "printed"
DISTRIBUTION_COLUMNS = [
    *("series", "position", "condition", "error", "having", "total"),
    *("share", "lower", "upper"),
]
ERROR, EFFORT = "position error", "evaluations"
BESIDE = 0.012  # [-] of the axis by which series are set apart
STOPPING_COLUMNS = [
    *("quantity", "num_generations", "stop_cost", "condition"),
    *("median", "lower", "upper", "solved", "done"),
]


def attempts_table(results: Results, confidence: float) -> pd.DataFrame:
    """Return how many runs take 1, 2, … attempts."""
    rows: list[tuple[object, ...]] = []
    for c in results.with_data:
        taken = c.column("term_attempts")
        for number in range(1, 1 + c.planner.num_attempts):
            found = counted(taken == number)
            share = *found, found.share, *found.interval(confidence)
            rows.append((results.position(c.label), c.label, number, *share, float(taken.mean())))
    return pd.DataFrame(rows, columns=ATTEMPT_COLUMNS)


def draw_attempts(table: pd.DataFrame) -> Figure:
    """Draw one bar per number of attempts and arm, with intervals and counts."""
    figure, (axes,) = style.panels(2.9)
    count = table["position"].nunique()
    width = 0.8 / count
    for k, (position, rows) in enumerate(groups(table, "position")):
        first = rows.iloc[0]
        x = rows["attempts"].to_numpy() + width * (k - 0.5 * (count - 1))
        colour = style.condition_colour(int(position))
        label = f"{first['condition']} (n = {first['total']}, mean {first['mean']:.2f})"
        axes.bar(x, 100.0 * rows["share"], width=width, color=colour, alpha=0.75, label=label)
        seen = rows.assign(x=x)[rows["share"] > 0.0]
        lower, upper = 100.0 * seen["lower"], 100.0 * seen["upper"]
        axes.vlines(seen["x"], lower, upper, color=style.NEUTRAL, linewidth=1.0)
        for row in records(seen):
            marks.write(axes, str(row.having), (row.x, 100.0 * row.upper), (0, 2), fontsize=6.5)
    axes.set_xticks(sorted(table["attempts"].unique()))
    axes.set(xlabel="attempts of SP1 → SP2", ylabel="share of runs [%]")
    axes.grid(visible=False, axis="x")
    style.legend_below(figure, [axes], 2)
    return figure


def distribution_table(
    results: Results,
    errors: Values,
    printed: Callable[[ConditionResults], Sequence[Percentage]],
    confidence: float,
) -> pd.DataFrame:
    """Return P(error < x) of every condition at each error that occurs, and the printed points."""
    rows: list[tuple[object, ...]] = []
    for c in results.with_data:
        values = errors(c)
        steps, counts = np.unique(values[np.isfinite(values)], return_counts=True)
        totals = zip([0.0, *steps], [0, *np.cumsum(counts)], strict=True)
        points = [(FOUND, x, Proportion(int(count), len(values))) for x, count in totals]
        points += [(PRINTED, one.bound, one.proportion) for one in printed(c)]
        for series, x, share in points:
            given = series, results.position(c.label), c.label, x
            rows.append((*given, *share, share.share, *share.interval(confidence)))
    unit = results.with_data[0].length_unit
    table = pd.DataFrame(rows, columns=DISTRIBUTION_COLUMNS)
    return table.astype({"error": "float64"}).assign(length_unit=unit)


def draw_distribution(table: pd.DataFrame) -> Figure:
    """Draw steps with bands: over the whole range, and where the printed points are."""
    figure, (whole, close) = style.panels(3.9, 2)
    printed, found = (table[table["series"] == series] for series in (PRINTED, FOUND))
    greatest = max(2.1, 1.05 * float(table["error"].max()))
    for axes in (whole, close):
        for (position, condition), rows in groups(found, ["position", "condition"]):
            colour = style.condition_colour(int(position))
            rows = pd.concat([rows, rows.iloc[[-1]].assign(error=greatest)], ignore_index=True)
            x, label = rows["error"], f"{condition} (n = {int(rows['total'].iloc[0])})"
            marks.band(axes, x, rows["lower"], rows["upper"], colour, alpha=0.22, step="post")
            axes.step(x, rows["share"], where="post", color=colour, label=label)
        # the printed points with the intervals of the paper's own sample
        for (position, condition), rows in groups(printed, ["position", "condition"]):
            colour, x = style.condition_colour(int(position)), rows["error"]
            name = f"printed, {condition} (their n = {int(rows['total'].iloc[0])})"
            axes.vlines(x, rows["lower"], rows["upper"], color=colour, linewidth=1.0, zorder=4)
            look = {"label": name, "mew": 1.4, "zorder": 5}
            marks.hollow(axes, x, rows["share"], "D", colour, 5, **look)
        axes.set(xlim=(0.0, greatest), ylabel="P(position error < x)")
        axes.set_xlabel(f"x [{table['length_unit'].iloc[0]}]")
    whole.set(ylim=(-0.02, 1.03), title="a  whole range")
    low = min([0.93, *printed["lower"]])
    near = low - 0.1 * (1.0 - low), 1.0 + 0.1 * (1.0 - low)
    close.set(ylim=near, title="b  where the printed percentages are")
    for row in records(printed):  # to the left of points on the right
        side, offset = ("right", -6) if row.error > 0.7 * greatest else ("left", 7)
        words: dict[str, Any] = {"color": style.condition_colour(row.position), "fontsize": 7.5}
        words |= {"ha": side, "path_effects": marks.HALO, "zorder": 6}
        marks.write(close, f"{100 * row.share:.1f} %", (row.error, row.share), (offset, 4), **words)
    style.legend_below(figure, [whole], 2)
    return figure


def stopping_table(results: Results, errors: Values, effort: Values) -> pd.DataFrame:
    """Return precision and effort of every condition by its stopping value and its generations."""
    rows = [
        (
            *(name, c.planner.ga.num_generations, c.planner.stop_cost_sp2, c.label),
            *(*spread(values(c))[:3], c.solved, c.done),
        )
        for name, values in ((ERROR, errors), (EFFORT, effort))
        for c in results.with_data
    ]
    unit = results.with_data[0].length_unit
    return pd.DataFrame(rows, columns=STOPPING_COLUMNS).assign(length_unit=unit)


def draw_stopping(table: pd.DataFrame) -> Figure:
    """Draw medians with quartiles of error and effort, one series per limit of generations."""
    figure, panels = style.panels(3.2, 2)
    count = table["num_generations"].nunique()
    apart = BESIDE * float(np.ptp(table["stop_cost"]) or 1.0)
    labels = {
        ERROR: ("a  precision", f"position error [{table['length_unit'].iloc[0]}]"),
        EFFORT: ("b  effort", "evaluations to a solution [-]"),
    }
    for axes, (quantity, (title, label)) in zip(panels, labels.items(), strict=True):
        own = table[table["quantity"] == quantity].replace(np.inf, np.nan)
        for k, (generations, rows) in enumerate(groups(own, "num_generations")):
            rows = rows.sort_values("stop_cost")
            x = rows["stop_cost"] + apart * (2 * k - count + 1)
            solved, done = rows[["solved", "done"]].sum()
            name = f"at most {generations} generations ({solved} of {done} runs with a solution)"
            colour, without_end = style.condition_colour(k), rows["upper"].isna()
            axes.vlines(x, rows["lower"], rows["upper"], color=colour, linewidth=1.2)
            axes.plot(x[without_end], rows["lower"][without_end], "^", color=colour, ms=6)
            axes.plot(x, rows["median"], "o-", label=name, color=colour, ms=4.5, lw=1.0)
        axes.set(ylim=(0.0, None), ylabel=label, title=title)
        axes.set_xlabel("stopping value of SP2 (objective) [-]")
        axes.set_xticks(sorted(table["stop_cost"].unique()))
        axes.invert_xaxis()
        style.shorten_thousands(axes.yaxis)
    style.legend_below(figure, [panels[0]], 2)
    return figure
