"""Names of curves at their right ends: a legend of many is looked up again and again."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.records import FloatArray
from evoexp.report import style

MANY = 5  # curves, from which on each is named at its end
LONGEST = 40  # signs of a name
SIZE = 7.5  # [pt]
LINE = 1.3  # [-] of the size, from one name to the next
HIGH = 0.82  # [-] of a figure's height that its axes have, about
BEGIN, END = 1.005, 1.035  # [-] of the axes' width, of the line from a curve to its name


def name_curves(figure: Figure, axes: Axes, columns: int) -> None:
    """Name the curves of some axes: many of them at their ends, few in a legend below.

    In a figure for a column there is no room beside the axes: there is a legend, too.
    """
    curves: list[tuple[Any, str]] = list(zip(*axes.get_legend_handles_labels(), strict=True))
    if len(curves) < MANY or figure.get_figwidth() < style.WIDTH:
        style.legend_below(figure, axes, columns)
        return
    curves.sort(key=lambda each: _height(each[0]), reverse=True)
    low, high = axes.get_ylim()
    ends = np.array([_height(curve)[0] for curve, _ in curves])
    ends = np.clip((ends - low) / (high - low), 0.0, 1.0)
    gap = SIZE * LINE / 72.0 / (HIGH * figure.get_figheight())
    for (curve, name), end, place in zip(curves, ends, spread_out(ends, gap), strict=True):
        look = {"color": curve.get_color(), "transform": axes.transAxes, "clip_on": False}
        dashes, width = curve.get_linestyle(), curve.get_linewidth()
        axes.plot([BEGIN, END], [end, place], linestyle=dashes, linewidth=width, **look)
        axes.text(
            END + 0.005, place, style.shortened(name, LONGEST), va="center", fontsize=SIZE, **look
        )


def _height(curve: Any) -> tuple[float, float]:
    """Return the end of a curve, and its mean, by which curves of one end are told apart."""
    found = np.asarray(curve.get_ydata(), dtype=np.float64)
    found = found[np.isfinite(found)]
    return (float(found[-1]), float(found.mean())) if len(found) else (0.0, 0.0)


def spread_out(heights: FloatArray, gap: float) -> FloatArray:
    """Return places near to heights, in their order, and no two nearer than a gap.

    Where there is room, all places are between 0 and 1.

    Args:
        heights: (names,) from the highest to the lowest, between 0 and 1.
        gap: Least distance of two places.
    """
    places, ceiling = np.empty(len(heights)), 1.0
    for k, height in enumerate(heights):
        places[k] = min(float(height), ceiling)
        ceiling = places[k] - gap
    floor = 0.0
    for k in range(len(places) - 1, -1, -1):
        places[k] = max(places[k], floor)
        floor = places[k] + gap
    return places
