"""How much of the gain by a hall of fame elites explain, quantity by quantity."""

import itertools
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.papers.curkovic.hall_shares import Corner, Gain, Shares, short_label
from evoexp.report.figures import marks, records, style

COLUMNS = ["measure", "corner", "elites", "share", "lower", "upper"]
WRAPPED = 16  # characters of a quantity's name, per line
EDGES = (-0.6, 2.6)  # shares beyond stand at the edge, as arrows
ALL = 1.0  # elites gain as much as the hall does


def draw_shares(table: pd.DataFrame) -> Figure:
    """Draw one panel per quantity, one row per reading and rate, elites side by side."""
    corners, numbers, measures = (
        list(dict.fromkeys(table[name])) for name in ("corner", "elites", "measure")
    )
    figure, panels = style.panels(0.42 * len(corners) + 1.6, len(measures), sharey=True)
    for axes, measure in zip(panels, measures, strict=True):
        for edge, line in ((0.0, "-"), (ALL, (0, (4, 2)))):
            axes.axvline(edge, color=style.FAINT, linewidth=0.9, linestyle=line, zorder=1)
        for row in records(table[table["measure"] == measure]):
            k = numbers.index(row.elites)
            y = corners.index(row.corner) + 0.22 * (k - 0.5 * (len(numbers) - 1))
            colour, place = style.ARM_COLOURS[k], float(np.clip(row.share, *EDGES))
            if not np.isfinite(row.share):
                axes.annotate("no gain", (0.03, y), fontsize=6, va="center", color=colour)
                continue
            axes.hlines(y, *np.clip([row.lower, row.upper], *EDGES), color=colour, linewidth=1.4)
            mark = "o" if place == row.share else (">" if row.share > EDGES[1] else "<")
            fill = colour if np.isfinite(row.lower) else "white"
            axes.plot(place, y, mark, color=colour, mfc=fill, ms=5, clip_on=False)
        axes.set(xlim=EDGES, xticks=[0, 1, 2], title=textwrap.fill(measure, WRAPPED))
        axes.set_xticklabels(["0", "100", "200"])
        axes.set_xlabel("share of the gain [%]")
    panels[0].set_yticks(range(len(corners)), corners)
    panels[0].set_ylim(len(corners) - 0.5, -0.5)
    looks = zip(numbers, style.ARM_COLOURS, strict=False)
    keys = [style.key(name, color=colour, marker="o", ms=5, lw=1.4) for name, colour in looks]
    open_mark: dict[str, Any] = {"mfc": "white", "mec": style.NEUTRAL}
    keys.append(marks.point_key("gain of the hall not told from none", "o", 5, **open_mark))
    style.keys_below(figure, keys)
    return figure


def shares_table(
    corners: Sequence[Corner], gains: Sequence[Gain], hall_shares: Shares
) -> pd.DataFrame:
    """Return the table of the figure: shares in the gain by a hall of distinct genomes."""
    rows = []
    for corner, gain in itertools.product(corners, gains):
        for elites in corner.elites:
            share, name = hall_shares(corner, gain, elites, corner.hall), short_label(elites)
            rows.append((gain.short, corner.name, name, share.value, *share.interval))
    return pd.DataFrame(rows, columns=COLUMNS)
