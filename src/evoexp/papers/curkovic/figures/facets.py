"""Many conditions in panels of few: the best cost so far, and runs that have reached a cost."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.papers.curkovic import measures
from evoexp.records import FloatArray
from evoexp.report.figures import groups, style
from evoexp.report.results.run_measures import grouped
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.inference import quantile

MOST = len(style.CONDITION_COLOURS)  # conditions of a panel, each with a colour of its own
DIRECTIONS = {"one_sided": "Eq. 9 one-sided", "symmetric": "Eq. 9 symmetric"}


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


def facet_table(results: Results, threshold: float) -> pd.DataFrame:
    """Return medians of the best cost so far, and shares of runs that have reached a cost."""
    parts, names = [], dict[str, int]()
    for panel, (title, conditions) in enumerate(facets(results).items()):
        for name, c in conditions.items():
            first = measures.generations_to(c, threshold)
            rows = c.generations.groupby("index")
            index = np.unique(c.generations["index"].to_numpy(np.float64))
            columns: dict[str, Any] = {"panel": panel, "title": title}
            columns |= {"position": names.setdefault(name, len(names)), "name": name}
            columns |= {"generation": index, "evaluations": _medians(rows, "evaluations")}
            columns |= {"median": _medians(rows, "best_cost")}
            columns |= {"reached": (first <= index[:, None]).mean(axis=1)}
            columns |= {"reaching": int(np.isfinite(first).sum()), "runs": c.done}
            parts.append(pd.DataFrame(columns))
    return pd.concat(parts, ignore_index=True).assign(threshold=threshold)


def draw_convergence(table: pd.DataFrame) -> Figure:
    """Draw medians of the best cost so far, and the threshold."""
    finite = table.assign(median=table["median"].replace([np.inf], np.nan))
    return _draw(finite, "median", {}, "{name}", "best cost so far (median)")


def draw_effort(table: pd.DataFrame) -> Figure:
    """Draw the share of all runs that have reached the cost, as steps."""
    steps = {"drawstyle": "steps-post"}
    return _draw(table, "reached", steps, "{name} ({reaching} of {runs})", "share of runs")


def _draw(
    table: pd.DataFrame, column: str, look: dict[str, Any], label: str, quantity: str
) -> Figure:
    """Draw a line per condition, named by a label that its columns fill in, panel by panel."""
    names = int(table.groupby("panel")["name"].nunique().max())
    figure, panels = style.panels(2.4 + 0.09 * names, table["panel"].nunique(), 2)
    for axes, (_, rows) in zip(panels, groups(table, "panel"), strict=True):
        axes.sharex(panels[0])
        axes.sharey(panels[0])
        several = rows.groupby("generation")["evaluations"].nunique().max() > 1
        across = "evaluations" if several else "generation"
        for position, own in groups(rows, "position"):
            colour, name = style.condition_colour(int(position)), label.format_map(own.iloc[0])
            axes.plot(own[across], own[column], color=colour, label=name, **look)
        if column == "median":
            line: dict[str, Any] = {"color": style.NEUTRAL, "lw": 1.0, "ls": (0, (4, 2))}
            axes.axhline(float(rows["threshold"].iloc[0]), label="threshold", **line)
        else:
            axes.set_ylim(-0.02, 1.02)
        limits = (0, float(rows[across].max()))
        axes.set(xlabel=across, xlim=limits, ylabel=quantity, title=rows["title"].iloc[0])
        axes.legend(loc="upper left", bbox_to_anchor=(-0.02, -0.2), ncols=2, fontsize=6.5)
    return figure


def _medians(rows: Any, column: str) -> FloatArray:
    return np.array([quantile(own.to_numpy(np.float64), 0.5) for _, own in rows[column]])
