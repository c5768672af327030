"""Marks that figures of several papers draw alike: texts, points, bands, axes in space."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from evoexp.records import FloatArray
from evoexp.report.kit import style

HALO = [withStroke(linewidth=2.0, foreground="white")]  # around a text on lines
NARROW = 0.6  # [-] of the longest side of a box, below which a side has few ticks


def write(axes: Axes, text: str, at: Any, offset: tuple[float, float], **look: Any) -> None:
    """Write a text beside a point, centred, at an offset [pt]."""
    axes.annotate(text, at, xytext=offset, textcoords="offset points", **{"ha": "center"} | look)


def hollow(axes: Axes, x: Any, y: Any, marker: str, colour: str, size: float, **look: Any) -> None:
    """Draw white points with a coloured edge."""
    axes.plot(x, y, marker, color="white", markeredgecolor=colour, markersize=size, **look)


def base(axes: Axes, x: Any, y: Any, size: float, **look: Any) -> None:
    """Draw the square of an arm's base."""
    axes.plot(x, y, "s", color=style.NEUTRAL, markersize=size, **look)


def contact(axes: Axes, x: Any, y: Any, size: float, **look: Any) -> None:
    """Draw crosses where bodies touch."""
    axes.plot(x, y, "X", color=style.FORBIDDEN, markeredgecolor="white", markersize=size, **look)


def band(axes: Axes, x: Any, low: Any, high: Any, colour: str, **look: Any) -> None:
    """Draw the range between two curves."""
    axes.fill_between(x, low, high, color=colour, linewidth=0, **{"alpha": 0.18} | look)


def point_key(label: str, marker: str, size: float, **look: Any) -> Line2D:
    """Return an entry of a legend for points without a line."""
    return style.key(label, marker=marker, ms=size, linestyle="none", **look)


def space(
    figure: Figure,
    place: tuple[Any, ...],
    low: FloatArray,
    high: FloatArray,
    pad: FloatArray,
    unit: str,
    *,
    view: tuple[float, float],
    zoom: float,
    label_pads: tuple[float, float, float],
    ticks: tuple[int, int],
) -> Any:
    """Return axes in space with equal scales.

    Args:
        figure: The figure that they are put into.
        place: As `add_subplot` takes it.
        low: (3,) the least coordinates that they hold.
        high: (3,) the greatest ones.
        pad: (3,) room beyond them.
        unit: Of lengths.
        view: Elevation and azimuth [deg].
        zoom: Of the box in its panel [-].
        label_pads: From the numbers along x, y and z to their labels [pt].
        ticks: At most, along a narrow side and along a wide one.
    """
    axes: Any = figure.add_subplot(*place, projection="3d")
    sides = high - low + 2.0 * pad
    for name, least, greatest, label_pad in zip(
        "xyz", low - pad, high + pad, label_pads, strict=True
    ):
        getattr(axes, f"set_{name}lim")(least, greatest)
        getattr(axes, f"set_{name}label")(f"{name} [{unit}]", labelpad=label_pad, fontsize=7)
    axes.set_box_aspect(sides, zoom=zoom)
    axes.patch.set_visible(False)  # else it hides the labels of the panel beside it
    axes.tick_params(labelsize=6, pad=-2)
    for axis, is_narrow in zip(
        (axes.xaxis, axes.yaxis, axes.zaxis), sides < NARROW * sides.max(), strict=True
    ):
        axis.set_major_locator(MaxNLocator(nbins=ticks[0] if is_narrow else ticks[1]))
    axes.view_init(elev=view[0], azim=view[1])
    return axes
