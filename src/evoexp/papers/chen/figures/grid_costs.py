"""Costs of paths over a grid (Chen & Zalzala 1995, Fig. 2): by generation, and above the best."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.papers.chen.path_measures import Group, gaps
from evoexp.report.kit import ConditionResults, spread, style
from evoexp.report.kit import groups as grouped

AVERAGE = "average of a generation"
EXACT, BOUND = "best path known", "no path costs less"


def costs_table(found: tuple[Group, ...]) -> pd.DataFrame:
    """Return median and quartiles of costs over replicates by weighting, condition, generation.

    Returns:
        Columns panel, position (of the condition in its panel), condition, quantity (best so far,
        average, and of references two lines of one row), generation, median, lower, upper.
    """
    rows: list[tuple[object, ...]] = []
    for group in found:
        for position, c in enumerate(group.conditions):
            columns = {"best so far": "best_cost"} | ({} if position else {AVERAGE: "mean_cost"})
            for name, column in columns.items():
                for generation, own in c.generations.groupby("index"):
                    median, lower, upper, _ = spread(own[column].to_numpy(dtype=np.float64))
                    given = group.title, position, _name(c, group), name, generation
                    rows.append((*given, median, lower, upper))
        if group.truth is not None:
            known = (EXACT, group.optimum), (BOUND, group.bound)
            rows += [(group.title, -1, name, name, 0, *(value,) * 3) for name, value in known]
    return pd.DataFrame(
        rows,
        columns=[
            "panel",
            "position",
            "condition",
            "quantity",
            "generation",
            "median",
            "lower",
            "upper",
        ],
    )


def draw_costs(table: pd.DataFrame) -> Figure:
    """Draw one panel per weighting."""
    figure, panels = style.row_of_panels(2.7, table["panel"].nunique())
    for axes, (name, rows) in zip(panels, grouped(table, "panel"), strict=True):
        evolved, known = rows[rows["position"] >= 0], rows[rows["position"] < 0]
        for (position, quantity), line in grouped(evolved, ["position", "quantity"]):
            _curve(axes, line, style.condition_colour(int(position)), dashed=quantity == AVERAGE)
        for (kind, line), pattern in zip(grouped(known, "quantity"), (":", "-."), strict=False):
            at = float(line["median"].iloc[0])
            axes.axhline(at, color=style.NEUTRAL, linewidth=1.0, linestyle=pattern, label=str(kind))
        axes.set(title=str(name), xlabel="generation")
    panels[0].set_ylabel("cost C(P)")
    style.legend_below(figure, panels[0], 3)
    return figure


def _curve(axes: Axes, line: pd.DataFrame, colour: str, *, dashed: bool) -> None:
    """Draw a median, and its quartiles unless it is dashed."""
    label, x, median = str(line["condition"].iloc[0]), line["generation"], line["median"]
    if dashed:
        look: dict[str, Any] = {"linestyle": "--", "linewidth": 0.9}
        axes.plot(x, median, label=f"{label}, average", color=colour, **look)
    else:
        axes.plot(x, median, color=colour, label=label)
        axes.fill_between(x, line["lower"], line["upper"], color=colour, alpha=0.18, linewidth=0)


def gaps_table(found: tuple[Group, ...]) -> pd.DataFrame:
    """Return every run's gap to the best path known.

    Returns:
        Columns panel, position, condition, replicate, gap_percent.
    """
    parts = [
        pd.DataFrame(
            {
                "panel": group.title,
                "position": position,
                "condition": _name(c, group),
                "replicate": c.summaries.index,
                "gap_percent": gaps(c, group.optimum),
            }
        )
        for group in found
        for position, c in enumerate(group.conditions)
    ]
    return pd.concat(parts, ignore_index=True)


def draw_gaps(table: pd.DataFrame) -> Figure:
    """Draw the share of runs whose gap is at most x, one panel per weighting."""
    figure, panels = style.row_of_panels(2.5, table["panel"].nunique(), sharey=True)
    for axes, (name, rows) in zip(panels, grouped(table, "panel"), strict=True):
        for (position, kind), own in grouped(rows, ["position", "condition"]):
            values = np.sort(own["gap_percent"].to_numpy())
            x, steps = [min(values[0], 0.0), *values], np.arange(len(values) + 1) / len(values)
            colour = style.condition_colour(int(position))
            axes.step(x, 100.0 * steps, where="post", color=colour, label=str(kind))
        axes.axvline(0.0, color=style.NEUTRAL, linewidth=1.0, linestyle=":")
        axes.set(title=str(name), xlabel="cost above best known [%]")
    panels[0].set_ylabel("share of runs [%]")
    style.legend_below(figure, panels[0], len(set(table["condition"])))
    return figure


def _name(condition: ConditionResults, group: Group) -> str:
    """Return the part of a label that the condition adds to its group's: "elitism"."""
    return condition.label.removeprefix(group.name).strip(" ,·") or "genetic algorithm"
