"""Curves along motions: link angles and speeds (Fig. 9, Eq. 2), least distances of bodies."""

from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from evoexp.numeric.elementary import DEGREE
from evoexp.papers.curkovic import link_motions, measures
from evoexp.planners.coevolution.planner import Problem
from evoexp.records import FloatArray
from evoexp.report.figures import groups, marks, rounded, style
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults

SAMPLES = 40  # per segment
HALF_TURN = 180.0  # [deg]
KINDS: tuple[Any, ...] = ("-", (0, (4, 1.5)))  # of first and second links
LOWEST, HIGHEST, BEST, STRAIGHT = "lowest", "highest", "best replicate", "straight line"


def joints_table(condition: ConditionResults) -> pd.DataFrame:
    """Return link angles and their speeds along the best replicate's motion."""
    prepared = condition.prepared
    motion = link_motions.executed(prepared, condition.solutions[measures.exemplar(condition)])
    found, limits = link_motions.sampled(motion, SAMPLES), link_motions.speed_limits(prepared)
    parts = []
    for (robot, link), limit in np.ndenumerate(limits):
        columns: dict[str, Any] = {"robot": robot, "link": link, "instant": found.instants}
        columns |= {"at_configuration": found.instants == found.instants.round()}
        columns |= {"angle_deg": found.links[:, robot, link]}
        columns |= {"turn_deg": np.abs(found.speeds[:, robot, link]), "limit_deg": limit}
        parts.append(pd.DataFrame(columns))
    return rounded(pd.concat(parts, ignore_index=True))


def draw_joints(table: pd.DataFrame) -> Figure:
    """Draw link angles in their range, and beside them turns per sampling step with limits."""
    red: dict[str, Any] = {"color": style.FORBIDDEN, "linewidth": 0.9, "zorder": 1}
    limit_look = red | {"linestyle": ":", "linewidth": 1.2}
    figure, panels = style.panels(1.9, 2 * table["robot"].nunique(), 2, 1.0)
    for (robot, own), angles, turns in zip(
        groups(table, "robot"), panels[::2], panels[1::2], strict=True
    ):
        colour = style.arm_colour(int(robot))
        for edge in (0.0, HALF_TURN):
            angles.axhline(edge, **red)
        for link, rows in groups(own, "link"):
            kind, x = KINDS[int(link)], rows["instant"]
            angles.plot(x, rows["angle_deg"], color=colour, linestyle=kind)
            turns.plot(x, rows["turn_deg"], color=colour, linestyle=kind)
            at = rows[rows["at_configuration"]]
            angles.plot(at["instant"], at["angle_deg"], "o", color=colour, **style.DOTS)
            limit = float(rows["limit_deg"].iloc[0])
            turns.axhline(limit, **limit_look)
            text = f"link {int(link) + 1}: {limit:.1f}°"
            marks.beside(turns, limit, text, va="bottom" if link else "top")  # they may be close
        turns.set_ylim(bottom=0.0)
        angles.set(yticks=[0, 60, 120, 180], ylabel=f"robot {robot + 1}: link angle [deg]")
        turns.set_ylabel("turn per step [deg]")
    panels[0].set_title("a  link angles from +x")
    panels[1].set_title("b  turns per sampling step")
    for axes in panels[-2:]:
        axes.set_xlabel("sampling step (whole numbers: configurations)")
    grey = style.NEUTRAL
    keys = [
        *(style.key(f"link {k + 1}", color=grey, linestyle=kind) for k, kind in enumerate(KINDS)),
        style.key("configurations", color=grey, marker="o", mec="white", linestyle="none", ms=5),
        style.key("range [0, 180°]", **red),
        style.key("limit of a link, Eq. 2", **limit_look),
    ]
    style.keys_below(figure, keys)
    return figure


def distances_table(conditions: tuple[ConditionResults, ...], samples: int) -> pd.DataFrame:
    """Return the bodies' least distance: range over all motions, best replicate, straight line."""
    parts = []
    for position, c in enumerate(conditions):
        scene = c.problem(Problem).scene
        distance = motion_geometry.BodyDistance(scene.model, scene.geometry)
        quick = motion_geometry.distance_measure(scene, distance)
        sampled = partial(_sampled, c, samples=samples)
        (extremes,) = motion_geometry.extremes(list(c.solutions), sampled, [quick])
        series = {LOWEST: extremes.at_lowest, HIGHEST: extremes.at_highest}
        series |= {BEST: sampled(measures.exemplar(c)), STRAIGHT: sampled(None)}
        for name, q in series.items():
            columns: dict[str, Any] = {"condition": c.label, "position": position, "series": name}
            columns |= {"instant": np.arange(q.shape[1]) / samples, "distance": distance(q)}
            columns |= {"replicates": c.done, "refuted": len(motion_geometry.refuted(c))}
            parts.append(pd.DataFrame(columns))
    table = rounded(pd.concat(parts, ignore_index=True))
    return table.assign(length_unit=conditions[0].length_unit)


def _sampled(condition: ConditionResults, replicate: int | None, samples: int) -> FloatArray:
    """Return a replicate's motion, or the straight one, (nq, instants) [rad]."""
    c = condition
    solution = link_motions.straight(c.prepared) if replicate is None else c.solutions[replicate]
    executed = link_motions.executed(c.prepared, solution)
    return DEGREE * link_motions.sampled(executed, samples).q


def draw_distances(table: pd.DataFrame) -> Figure:
    """Draw the distance at each instant: best replicate, range over all, straight line."""
    by_position = list(groups(table, "position"))
    figure, panels = style.panels(1.9, len(by_position), 2, 0.9, sharey=True)
    for axes, (position, rows) in zip(panels, by_position, strict=True):
        colour = style.condition_colour(int(position))
        own = dict(groups(rows, "series"))
        low, high, best, straight = (own[name] for name in (LOWEST, HIGHEST, BEST, STRAIGHT))
        marks.band(axes, low["instant"], low["distance"], high["distance"], colour)
        axes.plot(straight["instant"], straight["distance"], ":", color=style.FAINT)
        axes.plot(best["instant"], best["distance"], color=colour)
        at = best[best["instant"] == best["instant"].round()]
        axes.plot(at["instant"], at["distance"], "o", color=colour, **style.DOTS)
        condition, refuted, runs = rows[["condition", "refuted", "replicates"]].iloc[0]
        axes.set_title(f"{condition}: {refuted} of {runs} refuted", fontsize=7.5)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_xlim(0.0, table["instant"].max())
        if style.begins_line(axes):
            axes.set_ylabel(f"least distance [{table['length_unit'].iloc[0]}]")
        if style.ends_column(axes, panels):
            axes.set_xlabel("sampling step (whole: configurations)")
    panels[0].set_ylim(bottom=-0.02 * float(table["distance"].max()))
    grey = style.NEUTRAL
    keys = [
        style.key(f"{BEST}, dots: configurations", color=grey, marker="o", mec="white", ms=5),
        Patch(color=grey, alpha=0.18, linewidth=0, label="range over replicates"),
        style.key("straight line in link angles", linestyle=":", color=style.FAINT),
    ]
    style.keys_below(figure, keys)
    return figure
