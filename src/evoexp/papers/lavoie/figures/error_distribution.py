"""How probable an error below x is, with a band and the printed percentages.

Lavoie & Boudreau 2001, Fig. 3.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from evoexp.records import FloatArray
from evoexp.report import style
from evoexp.report.proportions import Proportion
from evoexp.report.results import ConditionResults, Results
from evoexp.report.rows import groups, records

FOUND, PRINTED = "found", "printed"
Point = tuple[float, Proportion]
"""(x, how many of the paper's runs)."""


def distribution_table(
    results: Results,
    errors: Callable[[ConditionResults], FloatArray],
    printed: Callable[[ConditionResults], Sequence[Point]],
    confidence: float,
) -> pd.DataFrame:
    """Return P(error < x) of every condition at each error that occurs, and the printed points.

    Args:
        results: With data.
        errors: Of a condition, (done,); inf: no solution.
        printed: The paper's points for a condition.
        confidence: Level of Wilson's intervals, each for itself.

    Returns:
        Columns series (found: holds for x from this row's error, exclusive, to the next one's;
        printed), position, condition, error, having, total, share, lower, upper, length_unit.
    """
    rows: list[tuple[object, ...]] = []
    for c in results.with_data:
        values = errors(c)
        points = [(0.0, 0), *zip(*_steps(values), strict=True)]
        given = results.position(c.label), c.label
        for error, count in points:
            share = Proportion(int(count), len(values))
            rows.append((FOUND, *given, error, *share, share.share, *share.interval(confidence)))
        for error, share in printed(c):
            rows.append((PRINTED, *given, error, *share, share.share, *share.interval(confidence)))
    names = [
        "series",
        "position",
        "condition",
        "error",
        "having",
        "total",
        "share",
        "lower",
        "upper",
    ]
    unit = results.with_data[0].condition.length_unit
    return pd.DataFrame(rows, columns=names).astype({"error": "float64"}).assign(length_unit=unit)


def draw_distribution(table: pd.DataFrame) -> Figure:
    """Draw steps with bands over the whole range, and where the printed points are."""
    figure = style.figure(3.9)
    whole, close = figure.subplots(1, 2)
    printed = table[table["series"] == PRINTED]
    greatest = max(2.1, 1.05 * float(table["error"].max()))
    for axes in (whole, close):
        for (position, condition), rows in groups(
            table[table["series"] == FOUND], ["position", "condition"]
        ):
            _curve(axes, rows, greatest, style.condition_colour(int(position)), str(condition))
        for position, rows in groups(printed, "position"):
            _points(axes, rows, style.condition_colour(int(position)))
        axes.set_xlim(0.0, greatest)
        axes.set_xlabel(f"x [{table['length_unit'].iloc[0]}]")
        axes.set_ylabel("P(position error < x)")
    whole.set_ylim(-0.02, 1.03)
    whole.set_title("a  whole range")
    close.set_title("b  where the printed percentages are")
    low = min([0.93, *printed["lower"]])
    close.set_ylim(low - 0.1 * (1.0 - low), 1.0 + 0.1 * (1.0 - low))
    for row in records(printed):
        _label(close, row, row.share == printed.loc[printed["error"] == row.error, "share"].max())
    style.legend_below(figure, whole, 2)
    return figure


def _steps(values: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Return the finite values in order, each once, and how many are at or below each."""
    found, counts = np.unique(values[np.isfinite(values)], return_counts=True)
    return found, np.cumsum(counts)


def _curve(axes: Axes, rows: pd.DataFrame, greatest: float, colour: str, name: str) -> None:
    """Draw one arm's steps on to the right end, and their band."""
    last = rows.iloc[[-1]].assign(error=greatest)
    rows = pd.concat([rows, last], ignore_index=True)
    label = f"{name} (n = {int(rows['total'].iloc[0])})"
    axes.fill_between(
        rows["error"],
        rows["lower"],
        rows["upper"],
        step="post",
        color=colour,
        alpha=0.22,
        linewidth=0,
    )
    axes.step(rows["error"], rows["share"], where="post", color=colour, label=label)


def _points(axes: Axes, rows: pd.DataFrame, colour: str) -> None:
    """Draw the printed points of one arm with the intervals of the paper's own sample."""
    name = f"printed, {rows['condition'].iloc[0]} (their n = {int(rows['total'].iloc[0])})"
    axes.vlines(rows["error"], rows["lower"], rows["upper"], color=colour, linewidth=1.0, zorder=4)
    axes.plot(
        rows["error"],
        rows["share"],
        "D",
        color="white",
        mec=colour,
        mew=1.4,
        ms=5,
        zorder=5,
        label=name,
    )


def _label(axes: Axes, row: Any, greatest: bool) -> None:
    """Write a printed percentage beside its point.

    Above the greatest one at an x, below the others.
    """
    left = row.error > 0.7 * axes.get_xlim()[1]
    place = (-6 if left else 7, 4 if greatest else -10)
    halo = [withStroke(linewidth=2.5, foreground="white")]
    look: dict[str, Any] = {
        "color": style.condition_colour(row.position),
        "fontsize": 7.5,
        "path_effects": halo,
    }
    side = "right" if left else "left"
    at = (row.error, row.share)
    axes.annotate(
        f"{100 * row.share:.1f} %",
        at,
        xytext=place,
        textcoords="offset points",
        ha=side,
        zorder=6,
        **look,
    )
