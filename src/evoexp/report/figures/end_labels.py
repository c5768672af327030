"""Names of curves at their right ends: a legend of many is looked up again and again."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evoexp.records import FloatArray
from evoexp.report.figures import style

MANY = 5  # curves, from which on each is named at its end
LONGEST = 40  # signs of a name
LINE = 9.5  # [pt] from one name to the next
HIGH = 0.82  # [-] of a figure's height that its axes have, about
APART = 0.075  # [-] of the height of a panel, between names at the ends of curves
DOTTED = (0, (1, 1.5))  # so that no line to a name is taken for a curve
BESIDE = 1.06  # [-] of the width of a panel, where names begin


CurveEnd = tuple[float, float, str, str]  # its place in a panel, x and y; its name, its colour


def apart(wanted: FloatArray, gap: float) -> FloatArray:
    """Return places within 0 to 1 with a gap between neighbours, near the wanted ones (n,), sorted.

    Neighbours that are too close stand around the middle of what they want.
    """
    steps = min(gap, 1.0 / max(len(wanted) - 1, 1)) * np.arange(len(wanted))
    free = wanted - steps  # without gaps the places only have to be in order
    up, down = np.maximum.accumulate(free), np.minimum.accumulate(free[::-1])[::-1]
    return np.asarray(np.clip(0.5 * (up + down), 0.0, 1.0 - steps[-1:].sum()) + steps)


def name_ends(axes: Axes, ends: Sequence[CurveEnd], gap: float = APART) -> None:
    """Write names to the right of a panel, each joined with the end of its curve by a line.

    The panel's limits are set; curves that end at infinity get no name.
    """
    low, high = axes.get_ylim()
    known = sorted((end for end in ends if np.isfinite(end[1])), key=lambda end: end[1])
    heights = np.clip([(y - low) / (high - low) for _, y, *_ in known], 0.0, 1.0)
    for (x, y, name, colour), place in zip(known, apart(np.asarray(heights), gap), strict=True):
        line = {"arrowstyle": "-", "color": colour, "lw": 0.8, "shrinkA": 1.0, "shrinkB": 0.0}
        look: dict[str, Any] = {"va": "center", "fontsize": 7.0, "color": style.NEUTRAL}
        axes.annotate(
            style.shortened(name, LONGEST),
            (x, y),
            (BESIDE, place),
            "data",
            "axes fraction",
            {**line, "linestyle": DOTTED, "relpos": (0.0, 0.5)},
            annotation_clip=False,
            **look,
        )


def name_curves(figure: Figure, axes: Axes, columns: int) -> None:
    """Name the curves of some axes: many of them at their ends, few in a legend below."""
    curves: list[tuple[Any, str]] = list(zip(*axes.get_legend_handles_labels(), strict=True))
    if len(curves) < MANY or figure.get_figwidth() < style.WIDTH:
        style.legend_below(figure, [axes], columns)
        return
    ends: list[tuple[float, CurveEnd]] = []
    for curve, name in curves:
        x, y = (np.asarray(values, dtype=np.float64) for values in curve.get_data())
        x, y = x[np.isfinite(y)], y[np.isfinite(y)]
        if len(y):
            end = float(x[-1]), float(y[-1]), name, str(curve.get_color())
            ends.append((float(y.mean()), end))
    ends.sort(key=lambda each: each[0])  # curves of one end are told apart by their means
    gap = LINE / 72.0 / (HIGH * figure.get_figheight())
    name_ends(axes, [end for _, end in ends], gap)
