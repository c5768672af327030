"""Proven answers over collision queries: shares of targets reached, and the best lengths."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.records import FloatArray
from evoexp.report.figures import style
from evoexp.report.figures.end_labels import name_curves
from evoexp.report.results.planner_runs import PlannerRuns
from evoexp.report.statistics.inference import quantiles

POINTS = 200  # along the axis of effort
MAX_PANELS = 24  # problems that have a panel of their own
BEFORE = 0.8  # times the effort of the first proven answer is where curves begin
PER_LINE = 3  # panels side by side

NOTE: dict[str, Any] = {"ha": "center", "va": "center", "color": style.NEUTRAL, "fontsize": 7.5}


def share_table(runs: Sequence[PlannerRuns], axis: FloatArray | None = None) -> pd.DataFrame:
    """Return the share of (problem, target, run) that each planner has reached, over effort.

    The axis of efforts (points,) begins before the first answer of these runs unless it is given.
    """
    reached: dict[str, list[float]] = {}
    for own in runs:
        for longest in own.problem.targets:
            effort, done = own.first_reached(longest)
            values = np.where(done, effort, np.inf).tolist()
            reached.setdefault(own.planner, []).extend(values)
    axis = _axis(runs) if axis is None else axis
    return pd.DataFrame(
        {
            "planner": planner,
            "collision_queries": axis,
            "share": [float(np.mean(np.array(own) <= x)) for x in axis],
            "targets": len(own),
        }
        for planner, own in reached.items()
    ).explode(["collision_queries", "share"], ignore_index=True)


def _axis(runs: Sequence[PlannerRuns]) -> FloatArray:
    """Return efforts from a little before the first proven answer of all to the longest run."""
    firsts = [own.first_reached() for own in runs]
    first = [np.where(done, effort, np.inf).min() for effort, done in firsts]
    most = max(1.0, *(float(own.spent.max()) for own in runs))
    least = min([value for value in first if 0.0 < value < np.inf], default=most / 10.0)
    return np.geomspace(BEFORE * least, most, POINTS)


def problem_share_table(runs: Sequence[PlannerRuns]) -> pd.DataFrame:
    """Return the share of (target, run) that each planner has reached, problem by problem."""
    parts, axis = [], _axis(runs)
    for name in problem_order(runs):
        table = share_table([own for own in runs if own.problem.name == name], axis)
        table.insert(0, "problem", name)
        parts.append(table)
    return pd.concat(parts, ignore_index=True)


def length_table(runs: Sequence[PlannerRuns]) -> pd.DataFrame:
    """Return median and quartiles over runs of the best proven length so far, of one problem."""
    parts = []
    for own in runs:
        table, most = own.table, max(float(own.spent.max()), 2.0)
        least = float(table["collision_queries"].min()) if len(table) else 0.5 * most
        axis = np.geomspace(max(least, 1.0), most, POINTS // 2)
        early = (table[table["collision_queries"] <= x] for x in axis)
        best = np.array([own._replace(table=part).best_lengths for part in early])  # (points, runs)
        spread = dict(
            zip(("median", "lower", "upper"), quantiles(best, (0.5, 0.25, 0.75)), strict=True)
        )
        columns: dict[str, Any] = {"planner": own.planner}
        parts.append(pd.DataFrame(columns | {"collision_queries": axis} | spread))
    return pd.concat(parts, ignore_index=True)


def problem_order(runs: Iterable[PlannerRuns]) -> list[str]:
    """Return the names of the problems, each once, in order."""
    return list(dict.fromkeys(own.problem.name for own in runs))


def draw_shares(table: pd.DataFrame) -> Figure:
    """Draw the shares of targets reached."""
    figure, (axes,) = style.panels(3.6)
    _draw_share_curves(axes, table, list(table["planner"].unique()))
    axes.set(xlabel="collision queries", ylabel="share of targets")
    name_curves(figure, axes, 4)
    return figure


def draw_shares_by_problem(table: pd.DataFrame) -> Figure:
    """Draw the shares of targets reached in one panel per problem."""
    planners, problems = (list(table[name].unique()) for name in ("planner", "problem"))
    shown = problems[:MAX_PANELS]
    figure, panels = style.panels(1.75, len(shown), PER_LINE, 0.5)
    for axes, problem in zip(panels, shown, strict=True):
        own = table[table["problem"] == problem]
        _draw_share_curves(axes, own, planners)
        axes.set_title(style.shortened(problem, 34), fontweight="normal")
        if not (own["share"].astype(float) > 0.0).any():
            axes.text(0.5, 0.5, "no proven answer", transform=axes.transAxes, **NOTE)
        axes.tick_params(labelleft=style.begins_line(axes))
        axes.set_ylabel("share reached" if style.begins_line(axes) else "")
        axes.set_xlabel("collision queries" if style.ends_column(axes, panels) else "")
    style.legend_below(figure, panels, 4)
    return figure


def _draw_share_curves(axes: Axes, table: pd.DataFrame, planners: Sequence[str]) -> None:
    """Draw the curves; the name of one that was run on fewer problems tells on how many targets."""
    most = int(table["targets"].max())
    counts = table.groupby("planner")["targets"].first()
    names = {name: f"{name} ({n} of {most})" for name, n in counts.items() if n < most}
    draw_steps(axes, table, "collision_queries", "share", planners, names)
    axes.set(ylim=(0.0, 1.02))


def draw_lengths(table: pd.DataFrame) -> Figure:
    """Draw the best proven length so far of one problem."""
    figure, (axes,) = style.panels(3.6)
    planners = list(table["planner"].unique())
    for k, planner in enumerate(planners):
        band = table[table["planner"] == planner].replace([np.inf], np.nan)
        look: dict[str, Any] = {"color": style.curve_look(k)["color"], "alpha": 0.18}
        x, low, high = (band[name] for name in ("collision_queries", "lower", "upper"))
        axes.fill_between(x, low, high, step="post", linewidth=0, **look)
    draw_steps(axes, table.replace([np.inf], np.nan), "collision_queries", "median", planners)
    axes.set(xlabel="collision queries", ylabel="best proven length so far [rad, m]")
    name_curves(figure, axes, 4)
    return figure


def draw_steps(
    axes: Axes,
    table: pd.DataFrame,
    across: str,
    up: str,
    planners: Sequence[str],
    names: Mapping[Any, str] | None = None,
) -> None:
    """Draw a curve over a logarithmic axis for each planner that a table has.

    It has the look of the planner's place among all, and its name unless it is given another one.
    """
    for k, planner in enumerate(planners):
        curve = table[table["planner"] == planner]
        if len(curve):
            x, y = curve[across].astype(float), curve[up].astype(float)
            label = (names or {}).get(planner, planner)
            axes.step(x, y, where="post", label=label, **style.curve_look(k))
    first, last = float(table[across].min()), float(table[across].max())
    style.log_axis(axes, first, max(last, 1.01 * first))
