"""Costs of paths over a grid: against generations (Chen & Zalzala 1995, Fig.

2), and above the best known.
"""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.papers.chen.path_measures import Group, gaps
from evoexp.report import style
from evoexp.report.rows import groups as grouped
from evoexp.report.statistics import spread

AVERAGE = "average of a generation"
EXACT, BOUND = "best path known", "no path costs less"


def costs_table(found: tuple[Group, ...]) -> pd.DataFrame:
    """Return median and quartiles of costs over replicates, per weighting.

    Condition and generation.

    Returns:
        Columns panel, position (of the condition in its panel), condition, quantity (best so far,
        average, and of references two lines of one row), generation, median, lower, upper.
    """
    rows: list[tuple[object, ...]] = []
    for group in found:
        for position, c in enumerate(group.conditions):
            quantities = {"best so far": "best_cost"} | (
                {AVERAGE: "mean_cost"} if position == 0 else {}
            )
            for name, column in quantities.items():
                for generation, own in c.generations.groupby("index"):
                    values = spread(own[column].to_numpy(dtype=np.float64))
                    kind = _kind(c.label, group.name)
                    rows.append((_title(group), position, kind, name, generation, *values[:3]))
        if group.truth is not None:
            for name, value in ((EXACT, group.optimum), (BOUND, group.bound)):
                rows.append((_title(group), -1, name, name, 0, value, value, value))
    names = ["panel", "position", "condition", "quantity", "generation", "median", "lower", "upper"]
    return pd.DataFrame(rows, columns=names)


def draw_costs(table: pd.DataFrame) -> Figure:
    """Draw one panel per weighting."""
    names = list(dict.fromkeys(table["panel"]))
    figure = style.figure(2.7)
    panels = figure.subplots(1, len(names), squeeze=False)[0]
    for axes, (name, rows) in zip(panels, grouped(table, "panel"), strict=True):
        for (position, quantity), line in grouped(
            rows[rows["position"] >= 0], ["position", "quantity"]
        ):
            _curve(axes, line, style.condition_colour(int(position)), dashed=quantity == AVERAGE)
        for (kind, line), pattern in zip(
            grouped(rows[rows["position"] < 0], "quantity"), (":", "-."), strict=False
        ):
            at = float(line["median"].iloc[0])
            axes.axhline(at, color=style.NEUTRAL, linewidth=1.0, linestyle=pattern, label=str(kind))
        axes.set_title(str(name))
        axes.set_xlabel("generation")
        if axes is panels[0]:
            axes.set_ylabel("cost C(P)")
    style.legend_below(figure, panels[0], 3)
    return figure


def _curve(axes: Axes, line: pd.DataFrame, colour: str, *, dashed: bool) -> None:
    """Draw a median, and its quartiles unless it is dashed."""
    label, x = str(line["condition"].iloc[0]), line["generation"]
    if dashed:
        axes.plot(
            x,
            line["median"],
            color=colour,
            linestyle="--",
            linewidth=0.9,
            label=f"{label}, average",
        )
        return
    axes.plot(x, line["median"], color=colour, label=label)
    axes.fill_between(x, line["lower"], line["upper"], color=colour, alpha=0.18, linewidth=0)


def gaps_table(found: tuple[Group, ...]) -> pd.DataFrame:
    """Return every run's gap to the best path known.

    Columns panel, position, condition, replicate, gap_percent.
    """
    parts = []
    for group in found:
        for position, c in enumerate(group.conditions):
            kind = _kind(c.label, group.name)
            given = {
                "panel": _title(group),
                "position": position,
                "condition": kind,
                "replicate": c.summaries.index,
            }
            parts.append(pd.DataFrame(given | {"gap_percent": gaps(c, group.optimum)}))
    return pd.concat(parts, ignore_index=True)


def draw_gaps(table: pd.DataFrame) -> Figure:
    """Draw the share of runs whose gap is at most x, one panel per weighting."""
    names = list(dict.fromkeys(table["panel"]))
    figure = style.figure(2.5)
    panels = figure.subplots(1, len(names), squeeze=False, sharey=True)[0]
    for axes, (name, rows) in zip(panels, grouped(table, "panel"), strict=True):
        for position, own in grouped(rows, "position"):
            values = np.sort(own["gap_percent"].to_numpy())
            steps = np.concatenate([[0.0], np.arange(1, len(values) + 1) / len(values)])
            x = np.concatenate([[min(values[0], 0.0)], values])
            colour = style.condition_colour(int(position))
            axes.step(
                x, 100.0 * steps, where="post", color=colour, label=str(own["condition"].iloc[0])
            )
        axes.axvline(0.0, color=style.NEUTRAL, linewidth=1.0, linestyle=":")
        axes.set_title(str(name))
        axes.set_xlabel("cost above best known [%]")
    panels[0].set_ylabel("share of runs [%]")
    style.legend_below(figure, panels[0], len(set(table["condition"])))
    return figure


def _kind(label: str, group: str) -> str:
    """Return what a condition adds to its group: "elitism"."""
    return label.removeprefix(group).strip(" ,·") or "genetic algorithm"


def _title(group: Group) -> str:
    epsilon, lam = group.weights
    return f"{group.name}  ε = {epsilon:g}, λ = {lam:g}"
