"""Proven answers over collision queries: shares of targets reached, and the best lengths."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report import style
from evoexp.report.proven_answers import first_reached, straight_line
from evoexp.report.results import ConditionResults
from evoexp.report.statistics import quantile

TARGETS = (np.inf, 4.0, 3.0, 2.0, 1.5, 1.2, 1.1, 1.05)  # [-] of the straight line
POINTS = 200  # along the axis of effort


def share_table(
    planners: Mapping[str, Sequence[ConditionResults]], found: Mapping[str, pd.DataFrame]
) -> pd.DataFrame:
    """Return the share of (problem, target, run) that each planner has reached, over effort.

    Args:
        planners: Name → its conditions, one per problem.
        found: Label of a condition → its answers.

    Returns:
        Columns planner, collision_queries, share, targets.
    """
    reached: dict[str, list[float]] = {}
    for planner, own in planners.items():
        reached[planner] = []
        for condition in own:
            table, runs = found[condition.label], condition.summaries.index
            spent, line = condition.column("collision_queries"), straight_line(table)
            for target in TARGETS if line > 0.0 else TARGETS[:1]:
                longest = np.inf if np.isinf(target) else target * line
                effort, done = first_reached(table, runs, longest, spent)
                reached[planner] += np.where(done, effort, np.inf).tolist()
    finite = [value for own in reached.values() for value in own if 0.0 < value < np.inf]
    most = max(c.column("collision_queries").max() for own in planners.values() for c in own)
    axis = np.geomspace(min(finite, default=1.0), max(most, 1.0), POINTS)
    return pd.DataFrame(
        {
            "planner": planner,
            "collision_queries": axis,
            "share": [float(np.mean(np.array(own) <= x)) for x in axis],
            "targets": len(own),
        }
        for planner, own in reached.items()
    ).explode(["collision_queries", "share"], ignore_index=True)


def length_table(
    planners: Mapping[str, Sequence[ConditionResults]], found: Mapping[str, pd.DataFrame]
) -> pd.DataFrame:
    """Return median and quartiles over runs of the best proven length so far, of one problem.

    Returns:
        Columns planner, collision_queries, median, lower, upper.
    """
    parts = []
    for planner, (condition,) in planners.items():
        table, runs = found[condition.label], condition.summaries.index
        most = float(condition.column("collision_queries").max())
        least = float(table["collision_queries"].min()) if len(table) else 1.0
        axis = np.geomspace(max(least, 1.0), max(most, 2.0), POINTS // 2)
        good = table[table["certified"]]
        best = np.array(
            [
                good[good["collision_queries"] <= x]
                .groupby("replicate")["length"]
                .min()
                .reindex(runs)
                .fillna(np.inf)
                .to_numpy()
                for x in axis
            ]
        )
        spread = {
            name: [quantile(row, share) for row in best]
            for name, share in (("median", 0.5), ("lower", 0.25), ("upper", 0.75))
        }
        columns: dict[str, Any] = {"planner": planner}
        parts.append(pd.DataFrame(columns | {"collision_queries": axis} | spread))
    return pd.concat(parts, ignore_index=True)


def draw_shares(table: pd.DataFrame) -> Figure:
    """Draw the shares of targets reached."""
    figure, (axes,) = style.row_of_panels(3.6, 1)
    for k, planner in enumerate(table["planner"].unique()):
        curve = table[table["planner"] == planner]
        x, y = (curve[name].astype(float) for name in ("collision_queries", "share"))
        label = f"{planner} ({int(curve['targets'].iloc[0])} targets)"
        axes.step(x, y, where="post", color=style.condition_colour(k), label=label)
    axes.set(xscale="log", xlim=_ends(table), ylim=(0.0, 1.02), xlabel="collision queries")
    axes.set_ylabel("share of targets reached")
    style.legend_below(figure, axes, 2)
    return figure


def draw_lengths(table: pd.DataFrame) -> Figure:
    """Draw the best proven length so far of one problem."""
    figure, (axes,) = style.row_of_panels(3.6, 1)
    for k, planner in enumerate(table["planner"].unique()):
        curve = table[table["planner"] == planner]
        shown = curve.replace([np.inf], np.nan)
        x, colour = shown["collision_queries"], style.condition_colour(k)
        axes.fill_between(
            x, shown["lower"], shown["upper"], step="post", color=colour, alpha=0.18, linewidth=0
        )
        axes.step(x, shown["median"], where="post", color=colour, label=planner)
    axes.set(xscale="log", xlim=_ends(table), xlabel="collision queries")
    axes.set_ylabel("best proven length so far [rad, m]")
    style.legend_below(figure, axes, 2)
    return figure


def _ends(table: pd.DataFrame) -> tuple[float, float]:
    """Return the ends of the axis of effort, also where no run has a proven answer."""
    return float(table["collision_queries"].min()), float(table["collision_queries"].max())
