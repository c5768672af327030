"""Planners over many problems: performance profiles, and mean ranks with a critical difference."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report.figures import style
from evoexp.report.figures.effort_curves import draw_steps
from evoexp.report.figures.end_labels import name_curves
from evoexp.report.statistics.problem_ranks import (
    Standing,
    alike,
    critical_difference,
    effort_ratios,
    friedman,
)

END = 1.15  # times the largest finite ratio is where a performance profile ends
LINE = 0.24  # [inch] between names of planners
BAR = 0.09  # [inch] between bars that join planners
ABOVE = 0.62  # [inch] of the bar of the critical difference and the axis' numbers


def profiles_table(found: Standing) -> pd.DataFrame:
    """Return the performance profile of each planner, at every ratio at which one rises."""
    ratios = effort_ratios(found.efforts)
    steps = np.unique(np.append(ratios[np.isfinite(ratios)], 1.0))
    axis = np.append(steps, max(END * steps[-1], 2.0))
    rows = [
        (planner, x, np.count_nonzero(own <= x) / len(own), len(own))
        for planner, own in zip(found.planners, ratios.T, strict=True)
        for x in axis
    ]
    return pd.DataFrame(rows, columns=["planner", "ratio", "share", "problems"])


def draw_profiles(table: pd.DataFrame) -> Figure:
    """Draw performance profiles."""
    figure, (axes,) = style.panels(3.4)
    draw_steps(axes, table, "ratio", "share", list(table["planner"].unique()))
    count = int(table["problems"].iloc[0])
    axes.set(ylim=(0.0, 1.02), ylabel=f"share of {count} problems")
    axes.set_xlabel("expected running time to a proven answer, times that of the best planner [–]")
    name_curves(figure, axes, 3)
    return figure


def critical_difference_table(found: Standing, significance: float) -> pd.DataFrame:
    """Return mean ranks, best first, with the critical difference."""
    table = pd.DataFrame({"planner": found.planners, "mean_rank": found.mean_ranks})
    table["problems"] = len(found.problems)
    table["friedman_p"] = friedman(found.lengths).p_value
    table["critical_difference"] = critical_difference(
        len(found.planners), len(found.problems), significance
    )
    return table.sort_values("mean_rank", kind="stable", ignore_index=True)


def draw_critical_difference(table: pd.DataFrame) -> Figure:
    """Draw mean ranks on a line; a bar joins planners that do not differ significantly."""
    ranks, difference = table["mean_rank"].tolist(), float(table["critical_difference"].iloc[0])
    groups, count = alike(ranks, difference), len(ranks)
    left = (count + 1) // 2  # planners named on the left
    foot = BAR * (len(groups) + 1) + LINE * left  # [inch] below the axis
    figure = style.figure(ABOVE + foot)
    axes = figure.add_subplot()
    axes.set(xlim=(1.0 - 0.45 * (count - 1), count + 0.45 * (count - 1)), ylim=(-foot, ABOVE))
    axes.axis("off")
    # the axis of mean ranks, and the critical difference above it
    is_narrow = figure.get_figwidth() < style.WIDTH
    words: dict[str, Any] = {"fontsize": 6.0 if is_narrow else 7.5}  # [pt]
    line: dict[str, Any] = {"color": style.NEUTRAL, "linewidth": 1.0}
    axes.plot([1.0, count], [0.0, 0.0], **line)
    for tick in range(1, count + 1):
        axes.plot([tick, tick], [0.0, 0.06], **line)
        if tick % 2 or not is_narrow:
            axes.text(tick, 0.09, str(tick), ha="center", va="bottom", **words)
    axes.text(count + 0.06 * (count - 1), 0.0, "mean rank\n(1 is best)", va="center", **words)
    axes.plot([1.0, 1.0 + difference], [0.4, 0.4], **line)
    for end in (1.0, 1.0 + difference):
        axes.plot([end, end], [0.36, 0.44], **line)
    text = f"critical difference {difference:.2f}"
    axes.text(1.0 + 0.5 * difference, 0.45, text, ha="center", va="bottom", **words)
    # bars that join planners, and their names
    for k, (first, last) in enumerate(groups):
        ends = ranks[first] - 0.008 * count, ranks[last] + 0.008 * count
        y = -BAR * (k + 1)
        axes.plot(ends, [y, y], color=style.NEUTRAL, linewidth=3.5, solid_capstyle="butt")
    for k, row in enumerate(table.itertuples()):
        on_left = k < left
        y = -BAR * (len(groups) + 1) - LINE * ((k if on_left else count - 1 - k) + 0.5)
        end = 1.0 - 0.06 * (count - 1) if on_left else count + 0.06 * (count - 1)
        rank = float(ranks[k])
        axes.plot([rank, rank, end], [0.0, y, y], color=style.NEUTRAL, linewidth=0.8)
        name = style.shortened(str(row.planner), 26)
        text = f"{name}  {rank:.2f} " if on_left else f" {rank:.2f}  {name}"
        axes.text(end, y, text, ha="right" if on_left else "left", va="center")
    return figure
