"""Angles and speeds of links during a motion (Curkovic et al. 2013, Fig. 9 and Eq. 2)."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.papers.curkovic import link_motions
from evoexp.report.kit import ConditionResults, groups, rounded, style

SAMPLES = 40  # per segment
HALF_TURN = 180.0  # [deg]
KINDS: tuple[Any, ...] = ("-", (0, (4, 1.5)))  # of first and second links


def joints_table(condition: ConditionResults) -> pd.DataFrame:
    """Return link angles and their speeds along the best replicate's motion.

    Returns:
        Columns robot, link, instant, at_configuration, angle_deg, turn_deg (per sampling step, to
        the right of the instant), limit_deg (of Eq. 2).
    """
    prepared = condition.prepared
    motion = link_motions.executed(prepared, condition.solutions[condition.best_replicate])
    found, limits = link_motions.sampled(motion, SAMPLES), link_motions.speed_limits(prepared)
    parts = [
        pd.DataFrame(
            {
                "robot": robot,
                "link": link,
                "instant": found.instants,
                "angle_deg": found.links[:, robot, link],
                "turn_deg": np.abs(found.speeds[:, robot, link]),
                "limit_deg": limit,
            }
        )
        for (robot, link), limit in np.ndenumerate(limits)
    ]
    table = rounded(pd.concat(parts, ignore_index=True))
    table.insert(3, "at_configuration", table["instant"] == table["instant"].round())
    return table


def draw_joints(table: pd.DataFrame) -> Figure:
    """Draw link angles in their range, and beside them turns per sampling step with limits."""
    robots = sorted(table["robot"].unique())
    figure = style.figure(1.9 * len(robots) + 1.0)
    panels = figure.subplots(len(robots), 2, sharex=True, squeeze=False)
    for (angles, turns), robot in zip(panels, robots, strict=True):
        _robot(angles, turns, table[table["robot"] == robot], style.arm_colour(int(robot)))
        angles.set_ylabel(f"robot {robot + 1}: link angle [deg]")
        turns.set_ylabel("turn per step [deg]")
    for axes, title in zip(
        panels.T, ("a  link angles from +x", "b  turns per sampling step"), strict=True
    ):
        axes[0].set_title(title)
        axes[-1].set(
            xlabel="sampling step (whole numbers: configurations)",
            xlim=(-0.05, table["instant"].max() + 0.05),
        )
    grey, red = style.NEUTRAL, style.FORBIDDEN
    keys = [
        *(style.key(f"link {k + 1}", color=grey, linestyle=kind) for k, kind in enumerate(KINDS)),
        style.key("configurations", color=grey, marker="o", mec="white", linestyle="none", ms=5),
        style.key("range [0, 180°]", color=red, linewidth=0.9),
        style.key("limit of a link, Eq. 2", color=red, linewidth=1.2, linestyle=":"),
    ]
    style.keys_below(figure, keys)
    return figure


def _robot(angles: Axes, turns: Axes, table: pd.DataFrame, colour: str) -> None:
    low, high = float(table["angle_deg"].min()), float(table["angle_deg"].max())
    for edge in (0.0, HALF_TURN):
        angles.axhline(edge, color=style.FORBIDDEN, linewidth=0.9, zorder=1)
    ends = min(0.0, low) - 10.0, max(HALF_TURN, high) + 10.0
    angles.set(ylim=ends, yticks=[0, 60, 120, 180])
    for link, rows in groups(table, "link"):
        kind = KINDS[int(link)]
        angles.plot(rows["instant"], rows["angle_deg"], color=colour, linestyle=kind)
        turns.plot(rows["instant"], rows["turn_deg"], color=colour, linestyle=kind)
        at = rows[rows["at_configuration"]]
        angles.plot(at["instant"], at["angle_deg"], "o", color=colour, **style.DOTS)
        limit = float(rows["limit_deg"].iloc[0])
        turns.axhline(limit, color=style.FORBIDDEN, linewidth=1.2, linestyle=":")
        turns.annotate(
            f"link {int(link) + 1}: {limit:.1f}°",
            (1.01, limit),
            xycoords=turns.get_yaxis_transform(),
            fontsize=6.5,
            va="bottom" if link else "top",  # the limits may be close
        )
    turns.set_ylim(bottom=0.0)
