"""Headline quantities under other assumed numbers, with the verdict at each."""

import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from evoexp.report.figures import groups, records, style
from evoexp.report.statistics.inference import spread
from evoexp.report.statistics.judging import CONTRADICTED, REPRODUCED

WRAPPED = 30  # characters of a quantity's name, per line
OTHERWISE = "undecided or not judged"
MARKS: dict[str, dict[str, Any]] = {
    REPRODUCED: {"marker": "o", "mfc": style.ARM_COLOURS[0]},
    CONTRADICTED: {"marker": "X", "mfc": style.ARM_COLOURS[1], "mec": style.ARM_COLOURS[1]},
    OTHERWISE: {"marker": "o", "mfc": "white"},
}


def robustness_table(judged: Sequence[Any]) -> pd.DataFrame:
    """Return one row per claim and condition of `pages.assumptions.Judged`."""
    positions = {c: k for k, c in enumerate(dict.fromkeys(one.condition for one in judged))}
    rows = []
    for one in judged:
        median, lower, upper, _ = spread(one.headline.values(one.condition))
        shipped = spread(one.headline.values(one.family.shipped)).median
        given = one.headline.quantity, positions[one.condition], one.condition.label
        family = one.family.shipped.label
        rows.append((*given, median, lower, upper, one.claim.verdict, shipped, family))
    names = ["quantity", "position", "condition", "median", "lower", "upper", "verdict"]
    return pd.DataFrame(rows, columns=[*names, "shipped", "family"])


def draw_robustness(table: pd.DataFrame) -> Figure:
    """Draw one panel per quantity, one row per condition, families one below the other.

    Args:
        table: Of `robustness_table`; infinite values stand at the right edge, as "never".
    """
    quantities = list(dict.fromkeys(table["quantity"]))
    labels = dict(zip(table["position"], table["condition"], strict=True))
    figure, panels = style.panels(0.24 * len(labels) + 1.5, len(quantities), sharey=True)
    for axes, quantity in zip(panels, quantities, strict=True):
        rows = table[table["quantity"] == quantity]
        numbers = rows[["median", "lower", "upper"]].to_numpy(np.float64)
        finite = numbers[np.isfinite(numbers)]
        low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 1.0)
        room = 0.08 * (high - low) or 0.5
        edge = high + room
        for _, own in groups(rows, "family"):
            y, middle = own["position"].to_numpy(), float(own["shipped"].iloc[0])
            if np.isfinite(middle):
                axes.vlines(
                    middle, y.min() - 0.4, y.max() + 0.4, color=style.FAINT, ls=(0, (4, 2)), lw=0.9
                )
        for row in records(rows):
            ends = [min(end, edge) for end in (row.lower, row.upper)]
            axes.hlines(row.position, *ends, color=style.ARM_COLOURS[0], linewidth=1.4)
            mark = MARKS.get(row.verdict, MARKS[OTHERWISE])
            look = {"mec": style.ARM_COLOURS[0], "ms": 5, **mark}
            axes.plot(min(row.median, edge), row.position, zorder=3, **look)
            if not np.isfinite(row.median):
                beside: dict[str, Any] = {"xytext": (5, 0), "textcoords": "offset points"}
                axes.annotate("never", (edge, row.position), va="center", fontsize=6.5, **beside)
        axes.set_xlim(low - room, edge + (0.25 * (edge - low) if np.isinf(numbers).any() else 0))
        axes.xaxis.set_major_locator(style.few_ticks())
        style.shorten_thousands(axes.xaxis)
        axes.set_xlabel(textwrap.fill(quantity, WRAPPED))
    panels[0].set_yticks(list(labels), list(labels.values()))
    panels[0].set_ylim(max(labels) + 0.6, -0.6)
    entries = [
        style.key(label, ls="", **{"mec": style.ARM_COLOURS[0], "ms": 5, **look})
        for label, look in MARKS.items()
    ]
    style.keys_below(figure, entries)
    return figure
