"""Success and expected effort against one setting, one series per task (Corsépius 2001, section 5)."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from evoexp.report import style
from evoexp.report.pages import corsepius_measures as measures
from evoexp.report.pages.corsepius_measures import Task
from evoexp.report.pages.generic import Values
from evoexp.report.statistics import expected_effort, expected_interval
from evoexp.report.tables import groups

SUCCESS = "goal met"
APART = 0.035  # [-] of a value, by which neighbouring series are set apart on the logarithmic axis


def effort_table(
    found: tuple[Task, ...], effort: Mapping[str, Values], confidence: float, num_resamples: int
) -> pd.DataFrame:
    """Return success and expected running times.

    Args:
        found: Tasks with one condition per value of the setting.
        effort: Name with unit → what a run spent, (done,).
        confidence: Level of the intervals: Wilson's of shares, bootstrapped ones of efforts.
        num_resamples: Of the bootstrap.

    Returns:
        Columns quantity, position (of the task), task, value (of the setting), expected (a share, or the effort spent
        per success; inf without one), lower, upper, having, total.
    """
    rows: list[tuple[object, ...]] = []
    for position, task in enumerate(found):
        for value, c in zip(task.values, task.conditions, strict=True):
            one, given = measures.success(c), (position, task.name, value)
            rows.append((SUCCESS, *given, one.share, *one.interval(confidence), *one))
            for name, values in effort.items():
                spent, having = values(c), measures.solved(c)
                interval = expected_interval(spent, having, confidence, num_resamples)
                rows.append((name, *given, expected_effort(spent, having), *interval, *one))
    names = ["quantity", "position", "task", "value", "expected", "lower", "upper", "having", "total"]
    return pd.DataFrame(rows, columns=names)


def draw_effort(table: pd.DataFrame, setting: str, marked: float) -> Figure:
    """Draw one panel per quantity; a value without a success has no point.

    Args:
        table: As `effort_table` gives it.
        setting: Label of the horizontal axis.
        marked: The value that the paper recommends.
    """
    quantities = list(dict.fromkeys(table["quantity"]))
    tasks = sorted(set(zip(table["position"], table["task"], strict=True)))
    lines = -(-len(quantities) // 2)
    figure = style.figure(2.75 * lines + 0.7)
    for k, quantity in enumerate(quantities):
        axes = figure.add_subplot(lines, 2, k + 1)
        axes.axvline(marked, color=style.FAINT, linewidth=0.9, linestyle=(0, (4, 2)), zorder=1)
        for (position, _), rows in groups(table[table["quantity"] == quantity], ["position", "task"]):
            rows = rows.sort_values("value").replace(np.inf, np.nan)
            colour, scale = style.condition_colour(int(position)), 100.0 if quantity == SUCCESS else 1.0
            x = rows["value"] * (1.0 + APART * (position - 0.5 * (len(tasks) - 1)))
            kind = "-" if position % 2 == 0 else (0, (4, 1.5))
            axes.plot(x, scale * rows["expected"], "o", color=colour, markersize=3.2, linestyle=kind, linewidth=1.1)
            axes.vlines(x, scale * rows["lower"], scale * rows["upper"], color=colour, linewidth=1.0, alpha=0.7)
        axes.set_xscale("log")
        axes.xaxis.set_minor_locator(NullLocator())
        values = sorted(table["value"].unique())
        axes.set_xticks(values, [f"{value:g}" for value in values])
        if quantity == SUCCESS:
            axes.set_ylabel("share of runs [%]")
        else:
            axes.set_yscale("log")
            axes.set_ylabel(quantity)
        axes.set_title(f"{'abcdef'[k]}  {quantity if quantity == SUCCESS else quantity.split(' [')[0] + ' per success'}")
        axes.set_xlabel(setting)
    handles = [
        Line2D(
            [],
            [],
            color=style.condition_colour(position),
            linestyle="-" if position % 2 == 0 else (0, (4, 1.5)),
            marker="o",
            markersize=3.2,
            label=name,
        )
        for position, name in tasks
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
    return figure
