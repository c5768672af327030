"""The probability of an error below x with a band and printed points (Lavoie & Boudreau 2001)."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from evoexp.papers import marks
from evoexp.report.kit import ConditionResults, Proportion, Results, Values, groups, records, style

FOUND, PRINTED = "found", "printed"
HALO = [withStroke(linewidth=2.5, foreground="white")]
NAMES = [
    *("series", "position", "condition", "error", "having", "total"),
    *("share", "lower", "upper"),
]
Point = tuple[float, Proportion]
"""(x, count of the paper's runs)."""


def distribution_table(
    results: Results,
    errors: Values,
    printed: Callable[[ConditionResults], Sequence[Point]],
    confidence: float,
) -> pd.DataFrame:
    """Return P(error < x) of every condition at each error that occurs, and the printed points.

    Returns:
        Columns series (found: holds for x from this row's error, exclusive, to the next one's;
        printed), position, condition, error, having, total, share, lower, upper, length_unit.
    """
    rows: list[tuple[object, ...]] = []
    for c in results.with_data:
        values = errors(c)
        steps, counts = np.unique(values[np.isfinite(values)], return_counts=True)
        totals = zip([0.0, *steps], [0, *np.cumsum(counts)], strict=True)
        points = [(FOUND, x, Proportion(int(count), len(values))) for x, count in totals]
        for series, x, share in [*points, *((PRINTED, *point) for point in printed(c))]:
            given = series, results.position(c.label), c.label, x
            rows.append((*given, *share, share.share, *share.interval(confidence)))
    unit = results.with_data[0].condition.length_unit
    return pd.DataFrame(rows, columns=NAMES).astype({"error": "float64"}).assign(length_unit=unit)


def draw_distribution(table: pd.DataFrame) -> Figure:
    """Draw steps with bands: over the whole range, and where the printed points are."""
    figure, (whole, close) = style.row_of_panels(3.9, 2)
    printed, found = (table[table["series"] == series] for series in (PRINTED, FOUND))
    greatest = max(2.1, 1.05 * float(table["error"].max()))
    for axes in (whole, close):
        for (position, condition), rows in groups(found, ["position", "condition"]):
            _curve(axes, rows, greatest, style.condition_colour(int(position)), str(condition))
        for position, rows in groups(printed, "position"):
            _points(axes, rows, style.condition_colour(int(position)))
        axes.set(
            xlim=(0.0, greatest),
            xlabel=f"x [{table['length_unit'].iloc[0]}]",
            ylabel="P(position error < x)",
        )
    whole.set(ylim=(-0.02, 1.03), title="a  whole range")
    low = min([0.93, *printed["lower"]])
    near = low - 0.1 * (1.0 - low), 1.0 + 0.1 * (1.0 - low)
    close.set(ylim=near, title="b  where the printed percentages are")
    for row in records(printed):
        _label(close, row, row.share == printed.loc[printed["error"] == row.error, "share"].max())
    style.legend_below(figure, whole, 2)
    return figure


def _curve(axes: Axes, rows: pd.DataFrame, greatest: float, colour: str, name: str) -> None:
    """Draw the steps of an arm's curve up to the right end, and their band."""
    rows = pd.concat([rows, rows.iloc[[-1]].assign(error=greatest)], ignore_index=True)
    x, label = rows["error"], f"{name} (n = {int(rows['total'].iloc[0])})"
    marks.band(axes, x, rows["lower"], rows["upper"], colour, alpha=0.22, step="post")
    axes.step(x, rows["share"], where="post", color=colour, label=label)


def _points(axes: Axes, rows: pd.DataFrame, colour: str) -> None:
    """Draw the printed points of one arm with the intervals of the paper's own sample."""
    name = f"printed, {rows['condition'].iloc[0]} (their n = {int(rows['total'].iloc[0])})"
    axes.vlines(rows["error"], rows["lower"], rows["upper"], color=colour, linewidth=1.0, zorder=4)
    look = {"label": name, "mew": 1.4, "zorder": 5}
    marks.hollow(axes, rows["error"], rows["share"], "D", colour, 5, **look)


def _label(axes: Axes, row: Any, greatest: bool) -> None:
    """Write a printed percentage above its point if it is the greatest at its x, else below."""
    left = row.error > 0.7 * axes.get_xlim()[1]
    look: dict[str, Any] = {"ha": "right" if left else "left", "fontsize": 7.5, "zorder": 6}
    look |= {"color": style.condition_colour(row.position), "path_effects": HALO}
    offset = -6 if left else 7, 4 if greatest else -10
    marks.write(axes, f"{100 * row.share:.1f} %", (row.error, row.share), offset, **look)
