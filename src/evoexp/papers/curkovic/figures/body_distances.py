"""Least distances of bodies along motions: of robots from each other and from obstacles."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from evoexp.numeric.elementary import DEGREE
from evoexp.papers import marks
from evoexp.papers.curkovic import link_motions
from evoexp.planners.coevolution.link_problem import Problem
from evoexp.records import FloatArray
from evoexp.report import kit
from evoexp.report.kit import motion_geometry, style

COLUMNS = 2  # of panels
LOWEST, HIGHEST, BEST, STRAIGHT = "lowest", "highest", "best replicate", "straight line"


def distances_table(conditions: tuple[kit.ConditionResults, ...], samples: int) -> pd.DataFrame:
    """Return the bodies' least distance: range over all motions, best replicate, straight line.

    Returns:
        Columns condition, position, series (lowest and highest of all replicates, best replicate,
        straight line in link angles), instant, distance [length unit], replicates, refuted (of
        them, by the exact verdict), length_unit.
    """
    parts = []
    for position, c in enumerate(conditions):
        columns = {"condition": c.label, "position": position}
        counts = {"replicates": c.done, "refuted": len(motion_geometry.refuted(c))}
        for name, distances in _series(c, samples).items():
            columns["series"] = name
            instants = np.arange(len(distances)) / samples
            parts.append(
                pd.DataFrame(columns | {"instant": instants, "distance": distances} | counts)
            )
    return kit.rounded(pd.concat(parts, ignore_index=True)).assign(
        length_unit=conditions[0].condition.length_unit
    )


def _series(condition: kit.ConditionResults, samples: int) -> dict[str, FloatArray]:
    """Return the distances of each series, (instants,) [length unit]."""
    prepared, solutions = condition.prepared, condition.solutions
    scene = condition.problem(Problem).scene
    distance = motion_geometry.BodyDistance(scene.model, scene.geometry)
    quick = motion_geometry.distance_measure(scene, distance)

    def sampled(solution: FloatArray) -> FloatArray:
        executed = link_motions.executed(prepared, solution)
        return DEGREE * link_motions.sampled(executed, samples).q

    (found,) = motion_geometry.extremes(list(solutions), lambda k: sampled(solutions[k]), [quick])
    series = {
        LOWEST: found.at_lowest,
        HIGHEST: found.at_highest,
        BEST: sampled(solutions[condition.best_replicate]),
        STRAIGHT: sampled(link_motions.straight(prepared)),
    }
    return {name: distance(q) for name, q in series.items()}


def draw_distances(table: pd.DataFrame) -> Figure:
    """Draw the distance at each instant: best replicate, range over all, straight line."""
    positions = sorted(table["position"].unique())
    columns = min(COLUMNS, len(positions))
    lines = -(-len(positions) // columns)
    figure = style.figure(1.9 * lines + 0.9)
    panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes in panels[len(positions) :]:
        axes.set_axis_off()
    for axes, (position, rows) in zip(panels, kit.groups(table, "position"), strict=False):
        colour = style.condition_colour(int(position))
        own = dict(kit.groups(rows, "series"))
        low, high, best, straight = (own[name] for name in (LOWEST, HIGHEST, BEST, STRAIGHT))
        marks.band(axes, low["instant"], low["distance"], high["distance"], colour)
        axes.plot(straight["instant"], straight["distance"], ":", color=style.FAINT)
        axes.plot(best["instant"], best["distance"], color=colour)
        at = best[best["instant"] == best["instant"].round()]
        axes.plot(at["instant"], at["distance"], "o", color=colour, **style.DOTS)
        refuted, replicates = (int(rows[name].iloc[0]) for name in ("refuted", "replicates"))
        title = f"{rows['condition'].iloc[0]}: {refuted} of {replicates} refuted"
        axes.set_title(title, fontsize=7.5)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    below = -0.02 * float(table["distance"].max())
    panels[0].set(xlim=(0.0, table["instant"].max()), ylim=(below, None))
    for k, axes in enumerate(panels):
        if k % columns == 0:
            axes.set_ylabel(f"least distance [{table['length_unit'].iloc[0]}]")
        if k >= len(panels) - columns:
            axes.set_xlabel("sampling step (whole: configurations)")
    grey = style.NEUTRAL
    keys = [
        style.key(f"{BEST}, dots: configurations", color=grey, marker="o", mec="white", ms=5),
        Patch(color=grey, alpha=0.18, linewidth=0, label="range over replicates"),
        style.key("straight line in link angles", linestyle=":", color=style.FAINT),
    ]
    style.keys_below(figure, keys)
    return figure
