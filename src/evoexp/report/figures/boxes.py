"""Tukey's boxes with the points behind them."""

from typing import Literal

import numpy as np
from matplotlib.axes import Axes

from evoexp.records import FloatArray

JITTER = 0.16  # [rows] half the width over which points are spread
POINTS = 50  # up to so many replicates every one is shown


def draw_box(
    axes: Axes,
    position: float,
    values: FloatArray,
    colour: str,
    orientation: Literal["horizontal", "vertical"] = "horizontal",
) -> None:
    """Draw median, quartiles and whiskers of those values that are finite.

    Args:
        axes: To draw on.
        position: Of the box along the axis of conditions.
        values: (n,); whiskers reach to the last one within 1.5 interquartile ranges.
        colour: Of the box.
        orientation: Direction in which values grow.
    """
    values = values[np.isfinite(values)]
    if not len(values):
        return
    axes.boxplot(
        values,
        positions=[position],
        orientation=orientation,
        widths=0.55,
        manage_ticks=False,
        showfliers=len(values) > POINTS,
        boxprops={"color": colour},
        whiskerprops={"color": colour},
        capprops={"color": colour},
        medianprops={"color": colour, "linewidth": 2.0},
        flierprops={
            "marker": "o",
            "markersize": 2.6,
            "markerfacecolor": colour,
            "markeredgecolor": "none",
            "alpha": 0.5,
        },
    )
    if len(values) <= POINTS:
        beside = position + JITTER * (2.0 * ((np.arange(len(values)) * 0.618034) % 1.0) - 1.0)
        x, y = (values, beside) if orientation == "horizontal" else (beside, values)
        axes.plot(x, y, "o", color=colour, markersize=2.6, alpha=0.5, mec="none")
