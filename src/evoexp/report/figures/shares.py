"""Shares of runs of all conditions with their intervals, one panel per property."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from evoexp.report.figures import groups, marks, style
from evoexp.report.statistics.inference import Proportion

MARGIN = 0.08  # [-] of the panels' span, beyond the intervals
NEARLY_ALL = 60.0  # [%] a span from which on the axis has a number at every quarter


def shares_table(
    rows: Sequence[tuple[str, int, str, Proportion]],
    printed: Mapping[str, float],
    confidence: float,
) -> pd.DataFrame:
    """Return shares of runs with Wilson's intervals, and those that a paper prints, by quantity.

    The rows are (quantity, position, condition, how many).
    """
    names = ["quantity", "position", "condition", "having", "total", "share", "lower", "upper"]
    table = pd.DataFrame(
        [(*given, *p, p.share, *p.interval(confidence)) for *given, p in rows], columns=names
    )
    return table.assign(printed=table["quantity"].map(dict(printed)).astype("float64"))


def draw_shares(table: pd.DataFrame) -> Figure:
    """Draw one panel per quantity, one row per condition, in one scale [%]."""
    quantities = list(dict.fromkeys(table["quantity"]))
    labels = dict(zip(table["position"], table["condition"], strict=True))
    rows_of = {position: row for row, position in enumerate(sorted(labels))}
    figure, panels = style.panels(0.26 * len(labels) + 1.1, len(quantities), sharey=True)
    known = 100 * table.loc[table["total"] > 0, ["lower", "upper", "printed"]].to_numpy(np.float64)
    low, high = (np.nanmin(known), np.nanmax(known)) if known.size else (0.0, 100.0)
    beyond = MARGIN * max(high - low, 1.0)
    for axes, quantity in zip(panels, quantities, strict=True):
        every = table[table["quantity"] == quantity]
        own = every[every["total"] > 0]
        for position, rows in groups(every, "position"):
            colour, y = style.row_colour(int(position), len(labels)), rows_of[position]
            if rows["total"].iloc[0]:
                axes.hlines(
                    y, 100 * rows["lower"], 100 * rows["upper"], color=colour, linewidth=1.6
                )
                axes.plot(100 * rows["share"], [y], "o", color=colour, markersize=4.5)
            counts = f" {rows['having'].iloc[0]}/{rows['total'].iloc[0]}"
            marks.beside(axes, y, counts, 1.0)
        if len(own):
            for printed in own["printed"].dropna().unique():
                marks.dashed(axes, 100 * printed)
        axes.set_xlim(low - beyond, high + beyond)
        is_wide = high - low >= NEARLY_ALL
        axes.xaxis.set_major_locator(MultipleLocator(25.0) if is_wide else style.few_ticks())
        axes.set_xlabel("share of runs [%]")
        axes.set_title(quantity, fontsize=7.5)
    panels[0].set_yticks(list(rows_of.values()), [labels[position] for position in rows_of])
    panels[0].set_ylim(len(labels) - 0.5, -0.5)
    return figure
