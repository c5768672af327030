"""Least distance of bodies along motions: robots from each other and from what stands around."""

import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from evoexp.papers.curkovic import link_motions
from evoexp.report import body_contacts, style
from evoexp.report.results import ConditionResults
from evoexp.report.rows import groups, rounded

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
        for replicate, solution in {
            STRAIGHT: link_motions.straight(prepared),
            **c.solutions,
        }.items():
            found = link_motions.sampled(link_motions.executed(prepared, solution), samples)
            columns = {"condition": c.label, "position": position, "replicate": replicate}
            columns |= {"best": replicate == c.best_replicate, "refuted": replicate in refuted}
            columns |= {"instant": found.instants}
            parts.append(
                pd.DataFrame(
                    columns | {"distance": body_contacts.distances(prepared.problem.scene, found.q)}
                )
            )
    return rounded(pd.concat(parts, ignore_index=True)).assign(
        length_unit=conditions[0].condition.length_unit
    )


def draw_distances(table: pd.DataFrame) -> Figure:
    """Draw the distance against the instant, a panel per condition.

    Best replicate, range over all, straight line.
    """
    positions = sorted(table["position"].unique())
    columns = min(COLUMNS, len(positions))
    lines = -(-len(positions) // columns)
    figure = style.figure(1.9 * lines + 0.9)
    panels = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes in panels[len(positions) :]:
        axes.set_axis_off()
    for axes, (position, rows) in zip(panels, groups(table, "position"), strict=False):
        colour = style.condition_colour(int(position))
        found = rows[rows["replicate"] != STRAIGHT].groupby("instant")["distance"]
        low, high = found.min(), found.max()
        axes.fill_between(low.index, low, high, color=colour, alpha=0.18, linewidth=0)
        for (replicate, best), own in groups(rows, ["replicate", "best"]):
            if replicate == STRAIGHT:
                axes.plot(own["instant"], own["distance"], ":", color=style.FAINT)
            elif best:
                axes.plot(own["instant"], own["distance"], color=colour)
                at = own[own["instant"] == own["instant"].round()]
                axes.plot(
                    at["instant"],
                    at["distance"],
                    "o",
                    color=colour,
                    mec="white",
                    markersize=5,
                    clip_on=False,
                )
        refuted = rows[rows["replicate"] != STRAIGHT].groupby("replicate")["refuted"].first()
        axes.set_title(
            f"{rows['condition'].iloc[0]}: {int(refuted.sum())} of {len(refuted)} refuted",
            fontsize=7.5,
        )
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    panels[0].set_xlim(0.0, table["instant"].max())
    panels[0].set_ylim(bottom=-0.02 * float(table["distance"].max()))
    for k, axes in enumerate(panels):
        if k % columns == 0:
            axes.set_ylabel(f"least distance [{table['length_unit'].iloc[0]}]")
        if k >= len(panels) - columns:
            axes.set_xlabel("sampling step (whole: configurations)")
    axes, grey = panels[0], style.NEUTRAL
    axes.plot(
        [],
        [],
        color=grey,
        marker="o",
        mec="white",
        ms=5,
        label="best replicate, dots: configurations",
    )
    axes.fill_between([], [], color=grey, alpha=0.18, linewidth=0, label="range over replicates")
    axes.plot([], [], ":", color=style.FAINT, label="straight line in link angles")
    style.legend_below(figure, axes, 3)
    return figure
