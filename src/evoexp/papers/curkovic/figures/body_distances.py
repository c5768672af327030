"""Least distances of bodies along motions: of robots from each other and from obstacles."""

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from evoexp.numeric.elementary import DEGREE
from evoexp.papers.curkovic import link_motions
from evoexp.planners.coevolution.link_problem import Problem
from evoexp.report.kit import (
    ConditionResults,
    body_contacts,
    groups,
    motion_geometry,
    rounded,
    style,
)

COLUMNS = 2  # of panels
STRAIGHT = -1  # instead of a replicate


def distances_table(conditions: tuple[ConditionResults, ...], samples: int) -> pd.DataFrame:
    """Return the bodies' least distance along every replicate's motion and the straight line.

    Args:
        conditions: With data.
        samples: Configurations per segment.

    Returns:
        Columns condition, position, replicate (−1: straight line in link angles), best (whether it
        is the best one), refuted (by the exact verdict), instant, distance [length unit],
        length_unit.
    """
    parts = []
    for position, c in enumerate(conditions):
        prepared, refuted = c.prepared, body_contacts.refuted(c)
        scene = c.problem(Problem).scene
        distance = motion_geometry.BodyDistance(scene.model, scene.geometry)
        solutions = {STRAIGHT: link_motions.straight(prepared), **c.solutions}
        for replicate, solution in solutions.items():
            found = link_motions.sampled(link_motions.executed(prepared, solution), samples)
            columns = {
                "condition": c.label,
                "position": position,
                "replicate": replicate,
                "best": replicate == c.best_replicate,
                "refuted": replicate in refuted,
                "instant": found.instants,
                "distance": distance(DEGREE * found.q),
            }
            parts.append(pd.DataFrame(columns))
    return rounded(pd.concat(parts, ignore_index=True)).assign(
        length_unit=conditions[0].condition.length_unit
    )


def draw_distances(table: pd.DataFrame) -> Figure:
    """Draw the distance at each instant: best replicate, range over all, straight line."""
    positions = sorted(table["position"].unique())
    columns = min(COLUMNS, len(positions))
    lines = -(-len(positions) // columns)
    figure = style.figure(1.9 * lines + 0.9)
    panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes in panels[len(positions) :]:
        axes.set_axis_off()
    for axes, (position, rows) in zip(panels, groups(table, "position"), strict=False):
        colour = style.condition_colour(int(position))
        of_runs = rows[rows["replicate"] != STRAIGHT]
        found = of_runs.groupby("instant")["distance"]
        low, high = found.min(), found.max()
        axes.fill_between(low.index, low, high, color=colour, alpha=0.18, linewidth=0)
        for (replicate, best), own in groups(rows, ["replicate", "best"]):
            if replicate == STRAIGHT:
                axes.plot(own["instant"], own["distance"], ":", color=style.FAINT)
            elif best:
                axes.plot(own["instant"], own["distance"], color=colour)
                at = own[own["instant"] == own["instant"].round()]
                axes.plot(at["instant"], at["distance"], "o", color=colour, **style.DOTS)
        refuted = of_runs.groupby("replicate")["refuted"].first()
        title = f"{rows['condition'].iloc[0]}: {int(refuted.sum())} of {len(refuted)} refuted"
        axes.set_title(title, fontsize=7.5)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    below = -0.02 * float(table["distance"].max())
    panels[0].set(xlim=(0.0, table["instant"].max()), ylim=(below, None))
    for k, axes in enumerate(panels):
        if k % columns == 0:
            axes.set_ylabel(f"least distance [{table['length_unit'].iloc[0]}]")
        if k >= len(panels) - columns:
            axes.set_xlabel("sampling step (whole: configurations)")
    grey, best = style.NEUTRAL, "best replicate, dots: configurations"
    keys = [
        style.key(best, color=grey, marker="o", mec="white", ms=5),
        Patch(color=grey, alpha=0.18, linewidth=0, label="range over replicates"),
        style.key("straight line in link angles", linestyle=":", color=style.FAINT),
    ]
    style.keys_below(figure, keys)
    return figure
