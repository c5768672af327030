"""Many conditions in panels of few: the best cost so far, and runs that have reached a cost."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.papers.curkovic import measures
from evoexp.records import FloatArray
from evoexp.report.figures import groups, style
from evoexp.report.results.run_measures import grouped
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.inference import quantile

MOST = len(style.CONDITION_COLOURS)  # conditions of a panel, each with a colour of its own
LEGEND: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (-0.02, -0.2), "ncols": 2}
LEGEND |= {"fontsize": 6.5}
DIRECTIONS = {"one_sided": "Eq. 9 one-sided", "symmetric": "Eq. 9 symmetric"}


def facets(results: Results) -> dict[str, dict[str, ConditionResults]]:
    """Divide conditions by collision substeps and reading of Eq. 9; by rates if they are many.

    Returns title of a panel (empty if there is one only) → its conditions by the parts of their
    labels that differ within the panel.
    """

    def direction(condition: ConditionResults) -> str:
        return DIRECTIONS[condition.planner.ga.mutation_direction]

    def rate(condition: ConditionResults) -> str:
        ga = condition.planner.ga
        return "Eq. 10" if ga.mutation_decay else f"constant rate {ga.mutation_rate:g}"

    def title(condition: ConditionResults) -> str:
        return ", ".join(trait(condition) for trait in traits)

    traits = [t for t in (_substeps, direction) if len(set(map(t, results.with_data))) > 1]
    found = grouped(results.with_data, title)
    if max(map(len, found)) > MOST:
        traits.append(rate)
        found = grouped(results.with_data, title)
    divided = {}
    for own in found:
        parts = [c.label.split(", ") for c in own]
        everywhere = set(parts[0]).intersection(*parts[1:]) if len(parts) > 1 else set[str]()
        names = [
            ", ".join(p for p in one if p not in everywhere) or ", ".join(one) for one in parts
        ]
        divided[title(own[0])] = dict(zip(names, own, strict=True))
    return divided


def facet_table(results: Results, threshold: float) -> pd.DataFrame:
    """Return medians of the best cost so far, and shares of runs that have reached a cost."""
    parts, names = [], dict[str, int]()
    for panel, (title, conditions) in enumerate(facets(results).items()):
        for name, c in conditions.items():
            first = measures.generations_to(c, threshold)
            rows = c.generations.groupby("index")
            index = np.unique(c.generations["index"].to_numpy(np.float64))
            parts.append(
                pd.DataFrame(
                    {
                        "panel": panel,
                        "title": title,
                        "position": names.setdefault(name, len(names)),
                        "name": name,
                        "generation": index,
                        "evaluations": _medians(rows, "evaluations"),
                        "median": _medians(rows, "best_cost"),
                        "reached": (first <= index[:, None]).mean(axis=1),
                        "reaching": int(np.isfinite(first).sum()),
                        "runs": c.done,
                    }
                )
            )
    return pd.concat(parts, ignore_index=True).assign(threshold=threshold)


def draw_convergence(table: pd.DataFrame) -> Figure:
    """Draw medians of the best cost so far, and the threshold."""
    finite = table["median"].replace([np.inf], np.nan)
    figure, panels = _panels(table)
    for axes, (_, rows) in zip(panels, groups(table.assign(median=finite), "panel"), strict=True):
        _lines(axes, rows, "median", "default", "{name}")
        threshold = float(rows["threshold"].iloc[0])
        axes.axhline(threshold, color=style.NEUTRAL, lw=1.0, ls=(0, (4, 2)), label="threshold")
        axes.set_ylabel("best cost so far (median)")
        axes.legend(**LEGEND)
    return figure


def draw_effort(table: pd.DataFrame) -> Figure:
    """Draw the share of all runs that have reached the cost, as steps."""
    figure, panels = _panels(table)
    for axes, (_, rows) in zip(panels, groups(table, "panel"), strict=True):
        _lines(axes, rows, "reached", "steps-post", "{name} ({reaching} of {runs})")
        axes.set(ylim=(-0.02, 1.02), ylabel="share of runs")
        axes.legend(**LEGEND)
    return figure


def _panels(table: pd.DataFrame) -> tuple[Figure, list[Axes]]:
    count = table["panel"].nunique()
    names = int(table.groupby("panel")["name"].nunique().max())
    figure, panels = style.panels(2.4 + 0.09 * names, count, 2)
    for axes in panels[1:]:
        axes.sharex(panels[0])
        axes.sharey(panels[0])
    return figure, panels


def _lines(axes: Axes, rows: pd.DataFrame, column: str, steps: Any, label: str) -> None:
    """Draw a line per condition; `label` is filled in by its columns."""
    several = rows.groupby("generation")["evaluations"].nunique().max() > 1
    across = "evaluations" if several else "generation"
    for position, own in groups(rows, "position"):
        colour = style.condition_colour(int(position))
        name = label.format_map(own.iloc[0])
        axes.plot(own[across], own[column], color=colour, drawstyle=steps, label=name)
    axes.set(xlabel=across, xlim=(0, float(rows[across].max())), title=rows["title"].iloc[0])


def _medians(rows: Any, column: str) -> FloatArray:
    return np.array([quantile(own.to_numpy(np.float64), 0.5) for _, own in rows[column]])


def _substeps(condition: ConditionResults) -> str:
    substeps = condition.planner.collision.collision_substeps
    return "configurations only" if substeps == 1 else f"{substeps} substeps"
