"""How much of the gain by a hall of fame elites explain, quantity by quantity."""

import itertools
import textwrap
from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.papers.curkovic.hall_shares import Corner, Gain, Shares, short_label
from evoexp.report.figures import groups, marks, style

COLUMNS = ["measure", "corner", "elites", "share", "lower", "upper"]
WRAPPED = 16  # characters of a quantity's name, per line
EDGES = (-0.6, 2.6)  # shares beyond stand at the edge, as arrows
ALL = 1.0  # elites gain as much as the hall does


def draw_shares(table: pd.DataFrame) -> Figure:
    """Draw one panel per quantity, one row per reading and rate, elites side by side."""
    corners = list(dict.fromkeys(table["corner"]))
    numbers = list(dict.fromkeys(table["elites"]))
    measures = list(dict.fromkeys(table["measure"]))
    figure, panels = style.panels(0.42 * len(corners) + 1.6, len(measures), sharey=True)
    for axes, measure in zip(panels, measures, strict=True):
        for edge, line in ((0.0, "-"), (ALL, (0, (4, 2)))):
            axes.axvline(edge, color=style.FAINT, linewidth=0.9, linestyle=line, zorder=1)
        for (elites, corner), rows in groups(
            table[table["measure"] == measure], ["elites", "corner"]
        ):
            k = numbers.index(elites)
            y = corners.index(corner) + 0.22 * (k - 0.5 * (len(numbers) - 1))
            row, colour = rows.iloc[0], style.ARM_COLOURS[k]
            ends = np.clip([row["lower"], row["upper"]], *EDGES)
            if np.isfinite(ends).all():
                axes.hlines(y, *ends, color=colour, linewidth=1.4)
            if not np.isfinite(row["share"]):
                axes.annotate("no gain", (0.03, y), fontsize=6, va="center", color=colour)
                continue
            inside = EDGES[0] <= row["share"] <= EDGES[1]
            mark = "o" if inside else (">" if row["share"] > EDGES[1] else "<")
            fill = colour if np.isfinite(row["lower"]) else "white"
            place = float(np.clip(row["share"], *EDGES))
            axes.plot(place, y, mark, color=colour, mfc=fill, ms=5, clip_on=False)
        axes.set(xlim=EDGES, xticks=[0, 1, 2], title=textwrap.fill(measure, WRAPPED))
        axes.set_xticklabels(["0", "100", "200"])
        axes.set_xlabel("share of the gain [%]")
    panels[0].set_yticks(range(len(corners)), corners)
    panels[0].set_ylim(len(corners) - 0.5, -0.5)
    keys = [
        style.key(name, color=style.ARM_COLOURS[k], marker="o", ms=5, linewidth=1.4)
        for k, name in enumerate(numbers)
    ]
    told = "gain of the hall not told from none"
    open_mark = marks.point_key(told, "o", 5, mfc="white", mec=style.NEUTRAL)
    style.keys_below(figure, [*keys, open_mark])
    return figure


def shares_table(
    corners: Sequence[Corner], gains: Sequence[Gain], hall_shares: Shares
) -> pd.DataFrame:
    """Return the table of the figure: shares in the gain by a hall of distinct genomes."""
    rows = []
    for corner, gain in itertools.product(corners, gains):
        for elites in corner.elites:
            share = hall_shares(corner, gain, elites, corner.hall)
            rows.append(
                (gain.short, corner.name, short_label(elites), share.value, *share.interval)
            )
    return pd.DataFrame(rows, columns=COLUMNS)
