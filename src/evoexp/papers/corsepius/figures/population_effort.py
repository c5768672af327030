"""Success and expected effort against one setting, one series per task.

Corsépius 2001, section 5.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullFormatter, NullLocator

from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.measures import Task
from evoexp.report import style
from evoexp.report.pages.generic import Values
from evoexp.report.proportions import Proportion
from evoexp.report.results import ConditionResults
from evoexp.report.rows import groups
from evoexp.report.statistics import expected_effort, expected_interval

SHARE, EFFORT, RATIO = "share", "effort", "ratio"
NUMBERS = "abcdef"
APART = 0.035  # [-] of a value, by which neighbouring series are set apart on the logarithmic axis


def effort_table(
    found: tuple[Task, ...],
    shares: Mapping[str, Callable[[ConditionResults], Proportion]],
    effort: Mapping[str, Values],
    confidence: float,
    num_resamples: int,
) -> pd.DataFrame:
    """Return shares of runs and expected running times.

    Args:
        found: Tasks with one condition per value of the setting.
        shares: Name → how many runs of a condition.
        effort: Name with unit → what a run spent, (done,).
        confidence: Level of the intervals: Wilson's of shares, bootstrapped ones of efforts.
        num_resamples: Of the bootstrap.

    Returns:
        Columns quantity, kind (share, effort), position (of the task), task, value (of the
        setting), expected (a share, or the effort spent per success; inf without one, NaN of no
        runs), lower, upper, having, total.
    """
    rows: list[tuple[object, ...]] = []
    for position, task in enumerate(found):
        for value, c in zip(task.values, task.conditions, strict=True):
            given = position, task.name, value
            for name, count in shares.items():
                one = count(c)
                rows.append((name, SHARE, *given, one.share, *one.interval(confidence), *one))
            for name, values in effort.items():
                spent, having = values(c), measures.solved(c)
                interval = expected_interval(spent, having, confidence, num_resamples)
                expected = expected_effort(spent, having)
                rows.append((name, EFFORT, *given, expected, *interval, c.solved, c.done))
    names = [
        "quantity",
        "kind",
        "position",
        "task",
        "value",
        "expected",
        "lower",
        "upper",
        "having",
        "total",
    ]
    table = pd.DataFrame(rows, columns=names)
    order = {name: k for k, name in enumerate([*shares, *effort])}
    return table.sort_values(
        "quantity", key=lambda column: column.map(order), kind="stable", ignore_index=True
    )


def draw_effort(table: pd.DataFrame, setting: str, marked: float) -> Figure:
    """Draw one panel per quantity; a value without a success has no point.

    Args:
        table: As `effort_table` gives it.
        setting: Label of the horizontal axis.
        marked: The value that the paper recommends.
    """
    quantities = list(dict.fromkeys(table["quantity"]))
    tasks = sorted(set(zip(table["position"], table["task"], strict=True)))
    lines = -(-(len(quantities) + 1) // 2) if len(quantities) % 2 else len(quantities) // 2
    figure = style.figure(2.6 * lines + (0.0 if len(quantities) % 2 else 0.7))
    grid = figure.add_gridspec(lines, 2)
    for k, quantity in enumerate(quantities):
        axes = figure.add_subplot(grid[divmod(k, 2)])
        own = table[table["quantity"] == quantity]
        _series(axes, own, len(tasks), marked)
        axes.set_xlabel(setting)
        axes.set_ylabel("share of runs [%]" if own["kind"].iloc[0] == SHARE else quantity)
        per = "" if own["kind"].iloc[0] == SHARE else " per success"
        axes.set_title(f"{NUMBERS[k]}  {quantity.split(' [')[0]}{per}")
    _legend(figure, grid[lines - 1, 1] if len(quantities) % 2 else None, tasks)
    return figure


def ratios_table(
    rows: Mapping[str, Sequence[Any]], names: Sequence[str], reference: float
) -> pd.DataFrame:
    """Return the effort of every value over that of the recommended one.

    Args:
        rows: Metric → objects with task, value, ratio, interval, bound.
        names: Tasks, in the order that gives them their colours.
        reference: The recommended value.

    Returns:
        Columns quantity, kind (ratio), position, task, value, expected (the ratio), lower, upper,
        bound, reference.
    """
    found = [
        (
            metric,
            RATIO,
            names.index(row.task),
            row.task,
            row.value,
            row.ratio,
            *row.interval,
            row.bound,
            reference,
        )
        for metric, own in rows.items()
        for row in own
    ]
    columns = [
        "quantity",
        "kind",
        "position",
        "task",
        "value",
        "expected",
        "lower",
        "upper",
        "bound",
        "reference",
    ]
    return pd.DataFrame(found, columns=columns)


def draw_ratios(table: pd.DataFrame, setting: str) -> Figure:
    """Draw one panel per metric; a ratio of 0 or ∞ (one of the two never succeeds) has no point."""
    quantities = list(dict.fromkeys(table["quantity"]))
    tasks = sorted(set(zip(table["position"], table["task"], strict=True)))
    figure = style.figure(3.3)
    grid = figure.add_gridspec(1, len(quantities))
    for k, quantity in enumerate(quantities):
        own = table[table["quantity"] == quantity]
        axes = figure.add_subplot(grid[0, k])
        _series(axes, own[own["expected"] > 0.0], len(tasks), float(own["reference"].iloc[0]))
        axes.axhline(1.0, color=style.NEUTRAL, linewidth=0.9)
        bounds = own[own["bound"] != 1.0].drop_duplicates("value").sort_values("value")
        if len(bounds):
            x = [*bounds["value"], own["reference"].iloc[0]]
            axes.plot(
                x,
                [*bounds["bound"], 1.0],
                color=style.NEUTRAL,
                linewidth=1.2,
                linestyle=(0, (1, 1.5)),
            )
        axes.set_xlabel(setting)
        axes.set_title(f"{NUMBERS[k]}  {quantity}")
        axes.tick_params(axis="x", labelsize=6.5)
    figure.axes[0].set_ylabel(f"effort over that of {table['reference'].iloc[0]:g} [-]")
    _legend(figure, None, tasks)
    return figure


def _series(axes: Axes, table: pd.DataFrame, count: int, marked: float) -> None:
    """Draw one line with intervals per task, side by side."""
    axes.axvline(marked, color=style.FAINT, linewidth=0.9, linestyle=(0, (4, 2)), zorder=1)
    kind = table["kind"].iloc[0]
    scale = 100.0 if kind == SHARE else 1.0
    for position, rows in groups(table, "position"):
        rows = rows.sort_values("value").replace(np.inf, np.nan)
        rows = rows[rows["expected"].notna()]
        x = rows["value"] * (1.0 + APART * (position - 0.5 * (count - 1)))
        look = {"color": style.condition_colour(int(position)), "linestyle": _dashes(int(position))}
        axes.plot(x, scale * rows["expected"], marker="o", markersize=3.2, linewidth=1.1, **look)
        least, most = rows["lower"], rows["upper"].fillna(rows["expected"])
        axes.vlines(x, scale * least, scale * most, color=look["color"], linewidth=1.0, alpha=0.7)
    axes.set_xscale("log")
    axes.xaxis.set_minor_locator(NullLocator())
    values = sorted({*table["value"], marked})
    axes.set_xticks(values, [f"{value:g}" for value in values])
    if kind == SHARE:
        axes.set_ylim(-4, 104)
    else:
        axes.set_yscale("log")
        axes.yaxis.set_minor_formatter(NullFormatter())


def _dashes(position: int) -> Any:
    return "-" if position % 2 == 0 else (0, (4, 1.5))


def _legend(figure: Figure, place: Any, tasks: list[tuple[int, str]]) -> None:
    """Put the legend into a free place, else below everything."""
    handles = [
        Line2D(
            [],
            [],
            color=style.condition_colour(position),
            linestyle=_dashes(position),
            marker="o",
            markersize=3.2,
            label=name,
        )
        for position, name in tasks
    ]
    if place is None:
        figure.legend(handles=handles, loc="outside lower center", ncols=4)
        return
    axes = figure.add_subplot(place)
    axes.set_axis_off()
    axes.legend(handles=handles, loc="center", ncols=2)
