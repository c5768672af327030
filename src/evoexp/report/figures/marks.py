"""Marks that several figures draw alike: texts, points, bands."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

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
