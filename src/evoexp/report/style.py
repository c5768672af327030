"""The look of figures: sizes, fonts, colours and legends; it leaves no global state behind."""

import io
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import matplotlib as mpl
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import EngFormatter, LogLocator, MaxNLocator, NullFormatter

ARM_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")  # Okabe & Ito 2008
CONDITION_COLOURS = (
    "#332288",
    "#CC6677",
    "#117733",
    "#DDAA33",
    "#88CCEE",
    "#882255",
    "#44AA99",
    "#999933",
)  # Tol
NUM_CURVE_COLOURS = 6  # that curves which cross are still told apart by
CURVE_STYLES: tuple[Any, ...] = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))
NEUTRAL, FAINT, FORBIDDEN = "#333333", "#9a9a9a", "#882255"
ARM_SYMBOLS = ("θ", "α", "β", "γ", "δ", "ε")  # θ and α are the paper's
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
DOTS: dict[str, Any] = {"mec": "white", "ms": 5, "clip_on": False}  # configurations of a path
THOUSANDS = 10_000  # from here on numbers along an axis are written with k and M
FEW_DECADES = 30.0  # [-] last over first number of an axis, below which powers of ten are few
WIDTH = 7.2  # [inch] of a figure over the whole page

_RC: dict[str, Any] = {
    "svg.hashsalt": "evoexp",  # else ids in an SVG are random
    "svg.fonttype": "path",
    "pdf.fonttype": 42,
    "font.family": "DejaVu Sans",  # comes with matplotlib
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "lines.solid_capstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "legend.handlelength": 1.8,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "figure.constrained_layout.w_pad": 0.08,  # [inch]
    "figure.constrained_layout.h_pad": 0.06,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
}


# nothing that changes from one day, or one machine, to the next
_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": "evoexp"},
    "png": {"Software": "evoexp"},
    "pdf": {"CreationDate": None, "Creator": "evoexp", "Producer": None},
}


def drawn(draw: Callable[[], Figure], formats: Sequence[str], dpi: int) -> dict[str, bytes]:
    """Draw a figure in evoexp's style, whatever the user's own settings are.

    Args:
        draw: Gives the figure; called anew where a name is no formula, though it looks like one.
        formats: File formats.
        dpi: Resolution of raster formats [1/inch].

    Returns:
        One file per format; the same figure gives the same bytes.
    """
    try:
        return _drawn(draw, formats, dpi)
    except ValueError:  # a name with a $ that begins no formula
        return _drawn(draw, formats, dpi, formulas=False)


def _drawn(
    draw: Callable[[], Figure], formats: Sequence[str], dpi: int, *, formulas: bool = True
) -> dict[str, bytes]:
    with mpl.rc_context():
        mpl.rcdefaults()
        for name, value in _RC.items():
            mpl.rcParams[name] = value  # type: ignore[index]
        mpl.rcParams["text.parse_math"] = formulas
        mpl.rcParams["figure.dpi"] = dpi  # arranged with the widths that text has when it is saved
        figure, images = draw(), {}
        if engine := figure.get_layout_engine():  # arranged once, for all formats
            engine.execute(figure)
        figure.set_layout_engine(None)  # with "none" every file would be drawn twice
        for kind in formats:
            buffer = io.BytesIO()
            figure.savefig(buffer, format=kind, dpi=dpi, metadata=_METADATA[kind])
            images[kind] = buffer.getvalue()
    return images


def figure(height: float, width: float = WIDTH) -> Figure:
    """Return an empty figure that arranges itself [inch]."""
    return Figure(figsize=(width, height), layout="constrained")


def row_of_panels(height: float, count: int, *, sharey: bool = False) -> tuple[Figure, list[Axes]]:
    """Return a figure of some height [inch] over the whole page, and its panels side by side."""
    found = figure(height)
    return found, list(found.subplots(1, count, squeeze=False, sharey=sharey)[0])


def lines_of_panels(
    height: float, count: int, per_line: int, foot: float
) -> tuple[Figure, list[Axes]]:
    """Return a figure over the whole page with some panels, and the panels, line by line.

    Args:
        height: Of a line [inch].
        count: Number of panels.
        per_line: Panels side by side at most.
        foot: Height below the panels, for a legend [inch].
    """
    columns = min(count, per_line)
    lines = -(-count // columns)
    found = figure(height * lines + foot)
    return found, [found.add_subplot(lines, columns, k + 1) for k in range(count)]


def arm_colour(arm: int) -> str:
    """Return the colour of an arm, counted from 0."""
    return ARM_COLOURS[arm % len(ARM_COLOURS)]


def condition_colour(position: int) -> str:
    """Return the colour of a condition by its position in the experiment."""
    return CONDITION_COLOURS[position % len(CONDITION_COLOURS)]


def curve_look(position: int) -> dict[str, Any]:
    """Return the look of one of many curves: six colours, then the next line style.

    A later curve is thinner, so that one below it is seen where both are equal.
    """
    line, colour = divmod(position, NUM_CURVE_COLOURS)
    return {
        "color": CONDITION_COLOURS[colour],
        "linestyle": CURVE_STYLES[line % len(CURVE_STYLES)],
        "linewidth": 2.2 - 0.2 * colour,
    }


def shortened(text: str, most: int) -> str:
    """Return a text of so many signs at most; of a longer one the middle is left out."""
    if len(text) <= most:
        return text
    return f"{text[: (most - 1) // 2]}…{text[len(text) - most // 2 :]}"


def row_colour(position: int, count: int) -> str:
    """Return the colour of a condition that has a row with its name to itself.

    Where there are more conditions than colours none is repeated, which would join what does not
    belong together: the first condition has its colour, all others are grey.
    """
    if count <= len(CONDITION_COLOURS) or position == 0:
        return condition_colour(position)
    return NEUTRAL


def joint_symbol(arm: int, joint: int) -> str:
    """Return the name of a joint angle: θ₁, α₂, …, both counted from 0."""
    letter = ARM_SYMBOLS[arm] if arm < len(ARM_SYMBOLS) else f"q{arm + 1},"
    return letter + str(joint + 1).translate(SUBSCRIPTS)


def few_ticks() -> MaxNLocator:
    """Return ticks that leave room in a small panel."""
    return MaxNLocator(nbins=4)


def shorten_thousands(axis: Axis) -> None:
    """Write the numbers along an axis with k and M where they are large: 200 k."""
    if axis.get_view_interval()[1] >= THOUSANDS:
        axis.set_major_formatter(EngFormatter())


def log_axis(axes: Axes, first: float, last: float) -> None:
    """Make the horizontal axis logarithmic; a short one has numbers between powers of ten, too."""
    axes.set(xscale="log", xlim=(first, last))
    if last < FEW_DECADES * first:
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(EngFormatter())
    axes.xaxis.set_minor_formatter(NullFormatter())


def operational_axes(axes: Axes, unit: str) -> None:
    """Set up axes as a plane of the operational space."""
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")


def draw_arm(
    axes: Axes, arm: int, rows: pd.DataFrame, *, alpha: float = 1.0, dashed: bool = False
) -> None:
    """Draw an arm's links, given by rows with x, y, x_end, y_end in order."""
    x, y = ([*rows[name], rows[f"{name}_end"].iloc[-1]] for name in "xy")
    colour = arm_colour(arm)
    line: dict[str, Any] = (
        {"linestyle": (0, (2, 1)), "linewidth": 2} if dashed else {"linewidth": 3}
    )
    axes.plot(x, y, color=colour, alpha=alpha, zorder=3 + dashed, **line)
    joints: dict[str, Any] = {"color": "white", "markeredgecolor": colour, "ms": 5}
    axes.plot(x[:-1], y[:-1], "o", alpha=alpha, zorder=4, **joints)
    axes.plot(x[-1], y[-1], "o", color=colour, alpha=alpha, markersize=4, zorder=4)


def configuration_axes(axes: Axes, arm: int) -> None:
    """Set up axes as an arm's plane of joint angles [deg]."""
    x, y = (f"{joint_symbol(arm, joint)} [deg]" for joint in (0, 1))
    axes.set(xlabel=x, ylabel=y, title=f"arm {arm + 1}")
    axes.set_aspect("equal", adjustable="datalim")  # lengths of paths are Euclidean in degrees


def legend_below(figure: Figure, axes: Axes, columns: int) -> None:
    """Put the legend of some axes under the whole figure."""
    _put_below(figure, *axes.get_legend_handles_labels(), columns)


def _put_below(
    figure: Figure, handles: Sequence[Artist], labels: Sequence[str], columns: int
) -> None:
    """Put a legend under the whole figure, in as many columns as are wanted and as fit."""
    for count in range(max(columns, 1), 0, -1):
        legend = figure.legend(handles, labels, loc="outside lower center", ncols=count)
        if count == 1 or legend.get_window_extent().width <= figure.bbox.width:
            return
        legend.remove()


def key(label: str, **look: Any) -> Line2D:
    """Return an entry of a legend: a line or marker that is drawn nowhere else."""
    return Line2D([], [], label=label, **look)


def arm_keys(arms: Iterable[int], name: str = "arm", **look: Any) -> list[Line2D]:
    """Return entries of a legend for arms, counted from 0: "arm 1" in the arm's colour, …."""
    return [key(f"{name} {int(k) + 1}", color=arm_colour(int(k)), **look) for k in arms]


def keys_below(figure: Figure, keys: Sequence[Artist], columns: int | None = None) -> None:
    """Put a legend of given entries under the whole figure, in one line if no columns are given."""
    _put_below(figure, keys, [str(one.get_label()) for one in keys], columns or len(keys))


def legend_of_all(figure: Figure, panels: Iterable[Axes], columns: int) -> None:
    """Put one legend of the labels of all panels under the whole figure, each label once."""
    handles: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    _put_below(figure, list(handles.values()), list(handles), columns)
