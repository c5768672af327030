"""Tukey's boxes with the points behind them; infinite values can have a place of their own."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from evoexp.records import FloatArray
from evoexp.report.statistics.inference import quantile

JITTER = 0.16  # [rows] half the width over which points are spread
POINTS = 50  # up to so many finite values every one is shown
FENCE = 1.5  # [interquartile ranges] how far whiskers may reach
DOT: dict[str, Any] = {"ms": 2.6, "mec": "none", "alpha": 0.5}


def draw_box(
    axes: Axes, position: float, values: FloatArray, colour: str, never: float | None = None
) -> None:
    """Draw median, quartiles and whiskers of values (n,), and points, along the horizontal axis.

    Infinite values, of runs that never got there, are drawn at `never`; None: they are left out.
    """
    ordered = np.sort(values[np.isfinite(values) if never is None else values > -np.inf])
    if not len(ordered):
        return
    lower, median, upper = (quantile(ordered, share) for share in (0.25, 0.5, 0.75))
    within = ordered
    if upper < np.inf:
        reach = FENCE * (upper - lower)
        within = ordered[(ordered >= lower - reach) & (ordered <= upper + reach)]
    drawn = np.where(np.isfinite(ordered), ordered, never or 0.0)
    many = np.isfinite(ordered).sum() > POINTS
    low, high = float(within[0]), float(within[-1])
    beyond = (ordered < low) | (ordered > high)
    ends = {"q1": lower, "med": median, "q3": upper, "whislo": low, "whishi": high}
    box = {name: value if value < np.inf else never for name, value in ends.items()}
    axes.bxp(
        [box | {"fliers": drawn[beyond] if many else []}],
        positions=[position],
        orientation="horizontal",
        widths=0.55,
        manage_ticks=False,
        boxprops={"color": colour},
        whiskerprops={"color": colour},
        capprops={"color": colour},
        medianprops={"color": colour, "linewidth": 2.0},
        flierprops={"marker": "o", "mfc": colour, **DOT},
    )
    if not many:
        beside = position + JITTER * (2.0 * ((np.arange(len(drawn)) * 0.618034) % 1.0) - 1.0)
        axes.plot(drawn, beside, "o", color=colour, **DOT)
