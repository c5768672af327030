"""Best costs of runs as boxes, motions that the exact verdict refutes marked among them."""

from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from evoexp.papers import marks
from evoexp.papers.curkovic import measures
from evoexp.records import FloatArray
from evoexp.report.kit import Results, groups, quantile, style

SPREAD = 0.2  # [rows] over which points are spread to either side


def costs_table(results: Results, threshold: float) -> pd.DataFrame:
    """Return every run's best cost.

    Returns:
        Columns position, condition, replicate, cost, refuted, threshold.
    """
    parts = [
        pd.DataFrame(
            {
                "position": position,
                "condition": c.label,
                "replicate": c.summaries.index,
                "cost": c.column("best_cost"),
                "refuted": measures.refuted(c) == 1.0,
            }
        )
        for position, c in enumerate(results.with_data)
    ]
    return pd.concat(parts, ignore_index=True).assign(threshold=threshold)


def draw_costs(table: pd.DataFrame) -> Figure:
    """Draw one box per condition, the first on top."""
    labels = table.groupby("position")["condition"].first()
    figure = style.figure(0.25 * len(labels) + 1.3)
    axes = figure.add_subplot()
    names = []
    for position, rows in groups(table, "position"):
        costs, refuted = rows["cost"].to_numpy(), rows["refuted"].to_numpy(dtype=bool)
        draw_cost_box(axes, position, costs, refuted, style.ARM_COLOURS[0], "horizontal")
        names.append(f"{labels[position]}  ({counted(costs, refuted)})")
    threshold = float(table["threshold"].iloc[0])
    axes.axvline(threshold, color=style.NEUTRAL, linewidth=1.0, linestyle=(0, (4, 2)), zorder=1)
    axes.set_yticks(range(len(names)), names)
    axes.set(ylim=(len(names) - 0.4, -0.6), xlabel="best C₂ + C₃ + C₄ of a team")
    style.keys_below(figure, [*keys(), threshold_key()], 4)
    return figure


def draw_cost_box(
    axes: Axes,
    position: float,
    costs: FloatArray,
    refuted: np.ndarray,
    colour: str,
    orientation: Literal["horizontal", "vertical"],
) -> None:
    """Draw the box of all runs, their points, and the median with refuted runs as worst.

    Args:
        axes: To draw on.
        position: Of the box along the axis of conditions.
        costs: (runs,); infinite ones are runs without a team.
        refuted: (runs,) whether the exact verdict refutes a run's motion.
        colour: Of the box.
        orientation: Direction in which costs grow.
    """
    finite = np.isfinite(costs)
    if not finite.any():
        return
    line = {"color": colour}
    axes.boxplot(
        costs[finite],
        positions=[position],
        orientation=orientation,
        widths=0.6,
        manage_ticks=False,
        showfliers=False,
        boxprops=line,
        whiskerprops=line,
        capprops=line,
        medianprops={"color": colour, "linewidth": 2.0},
    )
    beside = position + SPREAD * (2.0 * ((np.arange(len(costs)) * 0.618034) % 1.0) - 1.0)
    looks: tuple[tuple[np.ndarray, dict[str, Any]], ...] = (
        (finite & ~refuted, {"marker": "o", "ms": 2.4, "color": colour, "mec": "none"}),
        (finite & refuted, {"marker": "x", "ms": 4.0, "color": style.FORBIDDEN, "mew": 1.0}),
    )
    for shown, look in looks:
        x, y = costs[shown], beside[shown]
        where = (x, y) if orientation == "horizontal" else (y, x)
        axes.plot(*where, linestyle="none", alpha=0.7, zorder=3, **look)
    middle = quantile(np.where(refuted, np.inf, costs), 0.5)
    if np.isfinite(middle):
        place = (middle, position) if orientation == "horizontal" else (position, middle)
        axes.plot(*place, "D", ms=5, color="white", mec=style.NEUTRAL, mew=1.0, zorder=5)


def counted(costs: FloatArray, refuted: np.ndarray) -> str:
    """Return the number of runs, of those without a team, and of the refuted: "n = 20, 3 ×"."""
    without = int(np.count_nonzero(~np.isfinite(costs)))
    parts = [f"n = {len(costs)}"] + [f"{without} without"] * (without > 0)
    return ", ".join([*parts, f"{int(refuted.sum())} ×"])


def keys() -> list[Line2D]:
    """Return the entries of a legend for points and medians."""
    grey = style.NEUTRAL
    return [
        marks.point_key("a run", "o", 3, color=grey),
        marks.point_key("refuted (×)", "x", 5, color=style.FORBIDDEN),
        marks.point_key("median, refuted as worst", "D", 5, mec=grey, mfc="white"),
    ]


def threshold_key() -> Line2D:
    """Return the entry of a legend for the line of the threshold."""
    return style.key("threshold", color=style.NEUTRAL, linewidth=1.0, linestyle=(0, (4, 2)))
