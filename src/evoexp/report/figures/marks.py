"""Marks that several figures draw alike: texts, points, bands, names at the ends of curves."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from evoexp.records import FloatArray
from evoexp.report.figures import style

HALO = [withStroke(linewidth=2.0, foreground="white")]  # around a text on lines


def write(axes: Axes, text: str, at: Any, offset: tuple[float, float], **look: Any) -> None:
    """Write a text beside a point, centred, at an offset [pt]."""
    axes.annotate(text, at, xytext=offset, textcoords="offset points", **{"ha": "center"} | look)


def hollow(axes: Axes, x: Any, y: Any, marker: str, colour: str, size: float, **look: Any) -> None:
    """Draw white points with a coloured edge."""
    axes.plot(x, y, marker, color="white", markeredgecolor=colour, markersize=size, **look)


def contact(axes: Axes, x: Any, y: Any, size: float, **look: Any) -> None:
    """Draw crosses where bodies touch."""
    axes.plot(x, y, "X", color=style.FORBIDDEN, markeredgecolor="white", markersize=size, **look)


def band(axes: Axes, x: Any, low: Any, high: Any, colour: str, **look: Any) -> None:
    """Draw the range between two curves."""
    axes.fill_between(x, low, high, color=colour, linewidth=0, **{"alpha": 0.18} | look)


def beside(axes: Axes, y: Any, text: str, at: float = 1.01, **look: Any) -> None:
    """Write a text to the right of a row, `at` a share of the width of the panel."""
    place: dict[str, Any] = {"xycoords": axes.get_yaxis_transform(), "fontsize": 6.5}
    axes.annotate(text, (at, y), **place | {"va": "center"} | look)


def dashed(axes: Axes, x: float) -> None:
    """Draw a faint vertical line below everything, of a value to compare with."""
    axes.axvline(x, color=style.FAINT, linewidth=0.9, linestyle=(0, (4, 2)), zorder=1)


def point_key(label: str, marker: str, size: float, **look: Any) -> Line2D:
    """Return an entry of a legend for points without a line."""
    return style.key(label, marker=marker, ms=size, linestyle="none", **look)


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
