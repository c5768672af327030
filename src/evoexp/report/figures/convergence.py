"""Convergence: a quantity against generations and evaluations, over replicates."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.report.figures import groups, marks, records, style
from evoexp.report.figures.end_labels import name_curves
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.inference import quantiles

COLUMNS = ("best_cost", "mean_cost")
NAMES = {"best_cost": "best so far", "mean_cost": "average"}
REFERENCE = "reference"
LINE = 0.14  # [inch] of the height of a figure for each of many curves
DASH_DOTTED = (0, (5, 1.5, 1, 1.5))


def cost_table(results: Results) -> pd.DataFrame:
    """Return median and quartiles of best and average costs, per condition and generation."""
    # references have no generations, and one row each
    beside: dict[str, Any] = {"quantity": REFERENCE, "generation": 0, "evaluations": 0.0}
    references = (
        _condition(results, c, None).iloc[:1].assign(**beside)
        for c in results.references
        if c not in results.evolved and np.isfinite(c.column("best_cost")).all()
    )
    parts = [_condition(results, condition, None) for condition in results.evolved]
    return pd.concat([*parts, *references], ignore_index=True)


def fitness_table(results: Results) -> pd.DataFrame:
    """Return the same columns as `cost_table`, with the fitness of the planner's objective."""
    parts = [_condition(results, c, c.planner.objective) for c in results.evolved]
    return pd.concat(parts, ignore_index=True)


def draw_cost(table: pd.DataFrame) -> Figure:
    """Draw best and average cost against generations."""
    figure, (axes,) = style.panels(3.4)
    beside = table["quantity"] == REFERENCE
    _curves(axes, table[~beside])
    for row in records(table[beside]):
        look: dict[str, Any] = {"color": style.condition_colour(row.position), "linewidth": 1.0}
        axes.axhline(row.median, linestyle=DASH_DOTTED, label=row.condition, **look)
    axes.set_ylabel("cost")
    style.legend_below(figure, [axes], 2)
    return figure


def draw_best(table: pd.DataFrame) -> Figure:
    """Draw medians of the best cost only, for many conditions at once, named at their ends."""
    best = table[table["quantity"] == NAMES["best_cost"]].replace([np.inf, -np.inf], np.nan)
    across, curves = _across(best), list(groups(best, ["position", "condition"]))
    figure, (axes,) = style.panels(max(4.4, LINE * len(curves)))
    for k, ((_, condition), curve) in enumerate(curves):
        look = style.curve_look(k) | {"linewidth": 1.2}
        axes.plot(curve[across], curve["median"], label=f"{condition} ({_counts(curve)})", **look)
    limits = (0, max(1, int(best[across].max())))
    axes.set(xlim=limits, xlabel=across, ylabel="best cost so far (median)")
    style.shorten_thousands(axes.xaxis)
    name_curves(figure, axes, 3)
    return figure


def draw_fitness(table: pd.DataFrame) -> Figure:
    """Draw best and average fitness over the whole range, and the best fitness enlarged."""
    figure, (whole, close) = style.panels(4.1, 2)
    best = table[table["quantity"] == NAMES["best_cost"]]
    for axes, shown, title in (
        (whole, table, "a  whole range"),
        (close, best, "b  best fitness"),
    ):
        _curves(axes, shown)
        axes.set(ylabel="fitness F [-]", title=title)
    finite = best[np.isfinite(best[["median", "lower", "upper"]]).all(axis=1)]
    if len(finite):
        last = finite.groupby("position")["median"].max()
        near = float(last.min()) - 2.0 * (float(last.max() - last.min()) + 5.0)
        low, high = max(float(finite["lower"].min()), near), float(finite["upper"].max())
        close.set_ylim(low - 0.05 * (high - low) - 0.5, high + 0.05 * (high - low) + 0.5)
    style.legend_below(figure, [whole], 2)
    return figure


def _condition(results: Results, condition: ConditionResults, objective: Any) -> pd.DataFrame:
    parts = []
    for column in COLUMNS:
        rows = condition.generations[["replicate", "index", "evaluations", column]]
        if objective is not None:
            rows = rows.assign(**{column: objective.fitness(rows[column].to_numpy())})
        wide = rows.pivot(index="index", columns="replicate", values=column)
        replicates = rows.groupby("index").size().to_numpy()
        if column == "best_cost":  # a run that has ended keeps its best
            wide, replicates = wide.ffill(), np.full(len(wide), wide.shape[1])
        median, lower, upper = quantiles(wide.to_numpy(np.float64), (0.5, 0.25, 0.75))
        spent = rows.pivot(index="index", columns="replicate", values="evaluations")
        parts.append(
            pd.DataFrame(
                {
                    "condition": condition.label,
                    "position": results.position(condition.label),
                    "quantity": NAMES[column],
                    "generation": wide.index,
                    "evaluations": quantiles(spent.to_numpy(np.float64), (0.5,))[0],
                    "median": median,
                    "lower": lower,
                    "upper": upper,
                    "replicates": replicates,
                }
            )
        )
    return pd.concat(parts, ignore_index=True)


def _curves(axes: Axes, table: pd.DataFrame) -> None:
    """Draw medians as lines (the average dashed) and quartiles as bands."""
    across = _across(table)
    for (position, condition), rows in groups(table, ["position", "condition"]):
        colour = style.condition_colour(position)
        for column in COLUMNS:
            curve = rows[rows["quantity"] == NAMES[column]].replace([np.inf, -np.inf], np.nan)
            if curve.empty:
                continue
            kind = "-" if column == "best_cost" else (0, (3, 1.5))
            label = f"{condition}, {NAMES[column]} ({_counts(curve)})"
            marks.band(axes, curve[across], curve["lower"], curve["upper"], colour)
            axes.plot(curve[across], curve["median"], linestyle=kind, color=colour, label=label)
    axes.set(xlim=(0, max(1, int(table[across].max()))), xlabel=across)
    # evaluations as a second scale above
    steps = table.groupby("generation")["evaluations"].first()
    if across != "generation" or len(steps) < 2:
        return
    slope = float(steps.iloc[-1] - steps.iloc[0]) / float(steps.index[-1] - steps.index[0])
    offset = float(steps.iloc[0])

    above = axes.secondary_xaxis(
        "top",
        functions=(
            lambda generation: offset + slope * np.asarray(generation, dtype=np.float64),
            lambda evaluations: (np.asarray(evaluations, dtype=np.float64) - offset) / slope,
        ),
    )
    above.set_xlabel("evaluations")
    above.xaxis.set_major_locator(style.few_ticks())


def _across(table: pd.DataFrame) -> str:
    """Return the common axis: generations if they cost all conditions the same, or evaluations."""
    spent = table.groupby("generation")["evaluations"].nunique()
    return "generation" if spent.max() == 1 else "evaluations"


def _counts(curve: pd.DataFrame) -> str:
    low, high = int(curve["replicates"].min()), int(curve["replicates"].max())
    return f"n = {low}" if low == high else f"n = {low}…{high}"
