"""The look of figures: sizes, fonts, colours, legends, broken texts; no global state is left."""

import io
import logging
from collections.abc import Callable, Iterable, Sequence
from contextvars import ContextVar
from importlib import resources
from itertools import pairwise
from logging.handlers import BufferingHandler
from textwrap import fill
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import EngFormatter, FixedLocator, LogLocator, MaxNLocator, NullFormatter

from evoexp.errors import SettingError, brief
from evoexp.playback import colours

ARM_COLOURS, arm_colour = colours.ARM_COLOURS, colours.arm_colour
CONDITION_COLOURS = (  # Tol
    *("#332288", "#CC6677", "#117733", "#DDAA33"),
    *("#88CCEE", "#882255", "#44AA99", "#999933"),
)
NUM_CURVE_COLOURS = 6  # that curves which cross are still told apart by
CURVE_STYLES: tuple[Any, ...] = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))
NEUTRAL, FAINT, FORBIDDEN = "#333333", "#9a9a9a", "#882255"
ARM_SYMBOLS = ("θ", "α", "β", "γ", "δ", "ε")  # θ and α are the paper's
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
DOTS: dict[str, Any] = {"mec": "white", "ms": 5, "clip_on": False}  # configurations of a path
THOUSANDS = 10_000  # from here on numbers along an axis are written with k and M
FEW_DECADES = 30.0  # [-] last over first number of an axis, below which powers of ten are few
WIDTH = 7.2  # [inch] of a figure over the whole page
SMALLEST_TEXT = 6.0  # [pt] of legends and texts that are too wide
NAMES = 0.42  # [-] of the width of a figure that names of rows may take
LOWER = 1.3  # times as high as a page may panels be together, which then are made lower


class _Scale(NamedTuple):
    """Shares of the sizes of a figure over the whole page: its width, its height, its text."""

    width: float
    height: float
    text: float
    highest: float  # [inch] of a figure


_SCALES = {"page": _Scale(1.0, 1.0, 1.0, np.inf), "column": _Scale(3.5 / WIDTH, 0.62, 0.8, 8.8)}
_scale: ContextVar[_Scale] = ContextVar("_scale", default=_SCALES["page"])
_SCALED = ("size", "labelpad", "handlelength", ".major.pad", "_pad", "linewidth")
"""Endings of the names of parameters that are sizes of text, or distances between parts."""

# as matplotlib names it in an SVG, and with Verdana, whose letters are as wide
_FONT, _FONTS = b"'DejaVu Sans'", b"'DejaVu Sans', Verdana, sans-serif"

# nothing that changes from one day, or one machine, to the next
_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Date": None, "Creator": "evoexp"},
    "png": {"Software": "evoexp"},
    "pdf": {"CreationDate": None, "Creator": "evoexp", "Producer": None},
}


def drawn(
    draw: Callable[[], Figure],
    formats: Sequence[str],
    dpi: int,
    width: str = "page",
    style_file: str | None = None,
) -> dict[str, bytes]:
    """Draw a figure in evoexp's style, whatever the user's own settings are, as a file per format.

    The same figure gives the same bytes. It is drawn anew where a name with a $ begins no formula.

    Raises:
        SettingError: If the style file is none of matplotlib's.
    """
    scale = _SCALES[width]
    with mpl.rc_context():
        mpl.rcdefaults()
        with resources.as_file(resources.files("evoexp") / "assets/report.mplstyle") as path:
            own = dict(mpl.rc_params_from_file(path, use_default_template=False))
        for name, value in own.items():
            if isinstance(value, float) and name.endswith(_SCALED):
                own[name] = value * scale.text
        mpl.rcParams.update(own | (_style_file(style_file) if style_file else {}))
        mpl.rcParams["figure.dpi"] = dpi  # arranged with the widths that text has when it is saved
        token = _scale.set(scale)
        try:
            images = _images(draw(), formats, dpi)
        except ValueError:  # a name with a $ that begins no formula
            mpl.rcParams["text.parse_math"] = False
            images = _images(draw(), formats, dpi)
        finally:
            _scale.reset(token)
    if "svg" in images:
        images["svg"] = images["svg"].replace(_FONT, _FONTS)
    return images


def _style_file(path: str) -> dict[Any, Any]:
    """Return the parameters that a matplotlib style file sets, but for ids of files."""
    logger, handler = logging.getLogger("matplotlib"), BufferingHandler(10_000)
    handler.setLevel(logging.WARNING)  # matplotlib logs what a style file has wrong
    logger.addHandler(handler)
    style, reasons = dict[Any, Any](), list[str]()
    try:
        theirs = mpl.rc_params_from_file(path, use_default_template=False)
        style = {name: value for name, value in theirs.items() if name != "svg.hashsalt"}
    except (OSError, ValueError) as error:
        reasons.append(str(error))
    finally:
        logger.removeHandler(handler)
    if lines := [*(record.getMessage() for record in handler.buffer), *reasons]:
        wrong = brief(lines[0].strip().partition("\n")[0])
        raise SettingError("report.style", f"a matplotlib style file ({wrong})", path)
    return style


def _images(figure: Figure, formats: Sequence[str], dpi: int) -> dict[str, bytes]:
    """Arrange a figure once, and return one file per format."""
    FigureCanvasAgg(figure)  # what it has measured of texts is known when a PNG is drawn
    if engine := figure.get_layout_engine():
        engine.execute(figure)
        for fit in (fit_names, fit_texts, fit_names):
            if fit(figure):  # what is broken into lines takes room from the others
                engine.execute(figure)
    figure.set_layout_engine(None)  # with "none" every file would be drawn twice
    images = {}
    for kind in formats:
        buffer = io.BytesIO()
        figure.savefig(buffer, format=kind, dpi=dpi, metadata=_METADATA[kind])
        images[kind] = buffer.getvalue()
    return images


def figure(height: float, width: float = WIDTH) -> Figure:
    """Return an empty figure that arranges itself [inch]; one for a column is as wide as this."""
    scale = _scale.get()
    size = min(width, WIDTH * scale.width), min(height * scale.height, scale.highest)
    return Figure(figsize=size, layout="constrained")


def grid(
    height: float, count: int = 1, per_line: int = 0, foot: float = 0.0
) -> tuple[Figure, int, int]:
    """Return a figure with room for some panels [inch], their lines, and panels on a line.

    Side by side are `per_line` of them at most, 0: all; in a figure for a column half as many, or
    as many as let it fit a page.
    """
    scale, most = _scale.get(), min(count, per_line or count)
    columns = most if scale is _SCALES["page"] else -(-most // 2)
    room = LOWER * scale.highest / scale.height - foot
    while columns < most and height * -(-count // columns) > room:
        columns += 1
    lines = -(-count // columns)
    return figure(height * lines + foot), lines, columns


def panels(
    height: float, count: int = 1, per_line: int = 0, foot: float = 0.0, *, sharey: bool = False
) -> tuple[Figure, list[Axes]]:
    """Return a figure with some panels, and the panels, line by line, see `grid`."""
    found, lines, columns = grid(height, count, per_line, foot)
    places = list(found.subplots(lines, columns, squeeze=False, sharey=sharey).flat)
    for unused in places[count:]:
        unused.remove()
    return found, places[:count]


def begins_line(axes: Axes) -> bool:
    """Whether a panel of a grid is the first one of its line."""
    place = axes.get_subplotspec()
    return place is not None and place.is_first_col()


def ends_column(axes: Axes, panels: Sequence[Axes]) -> bool:
    """Whether no other panel of a grid, filled line by line, stands below a panel."""
    places = [place for panel in panels if (place := panel.get_subplotspec()) is not None]
    own = axes.get_subplotspec()
    return own is not None and not any(
        place.colspan == own.colspan and place.rowspan.start > own.rowspan.start for place in places
    )


def condition_colour(position: int) -> str:
    """Return the colour of a condition by its position in the experiment."""
    return CONDITION_COLOURS[position % len(CONDITION_COLOURS)]


def curve_look(position: int) -> dict[str, Any]:
    """Return the look of one of many curves: six colours, then the next line style."""
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
    """Return the colour of a row; of more conditions than colours only the first has one."""
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


def key(label: str, **look: Any) -> Line2D:
    """Return an entry of a legend: a line or marker that is drawn nowhere else."""
    return Line2D([], [], label=label, **look)


def keys_below(
    figure: Figure | SubFigure, keys: Sequence[Artist], columns: int | None = None
) -> None:
    """Put a legend under the whole figure, in as many columns as are wanted (None: all) and fit."""
    for count in range(max(columns or len(keys), 1), 0, -1):
        legend = figure.legend(handles=keys, ncols=count, loc="outside lower center")
        surplus = max(legend.get_window_extent().width - figure.bbox.width, 0.0)
        if not surplus or count == 1:
            break
        legend.remove()
    widest = max((_length(text, False) for text in legend.get_texts()), default=0.0)
    for text in legend.get_texts():
        _break(text, widest - surplus)


def legend_below(figure: Figure, panels: Iterable[Axes], columns: int) -> None:
    """Put one legend of the labels of some panels under the whole figure, each label once."""
    handles: dict[str, Artist] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    keys_below(figure, list(handles.values()), columns)


LEAST_LINE = 8  # [characters] of a line of a broken text
LINE_HEIGHT = 1.25  # [-] in sizes of its letters
GAP = 6.0  # [pixel] between texts side by side
MOST_STEPS = 4  # between the numbers along an axis whose numbers would touch
TURNED = 60.0  # [deg] of names along an axis that would touch


def _is_named(axis: Axis) -> bool:
    return isinstance(axis.get_major_locator(), FixedLocator)


def fit_names(figure: Figure) -> bool:
    """Break names of rows that are too wide, let a figure grow for its rows; say if it changed.

    Names that would make a figure too high for a page are shortened instead.
    """
    height, highest = figure.get_figheight(), _scale.get().highest
    heights, is_broken = [height], False
    for axes in figure.axes:
        labels = axes.get_yticklabels()
        if not labels or axes.get_subplotspec() is None or not _is_named(axes.yaxis):
            continue
        names = [label.get_text() for label in labels]
        share = max(_length(label, False) for label in labels) / figure.bbox.width
        if share > NAMES:
            most = int(max(map(len, names)) * NAMES / share)
            broken, short = ([cut(name, most) for name in names] for cut in (fill, shortened))
            fits = height + _lacking(axes, broken) <= highest or len({*short}) < len({*names})
            names, is_broken = broken if fits else short, True
            axes.set_yticks(axes.get_yticks(), names)
        heights.append(height + _lacking(axes, names))
    figure.set_figheight(min(max(heights), max(highest, height)))
    return is_broken or figure.get_figheight() > height


def _lacking(axes: Axes, names: Sequence[str]) -> float:
    """Return by how much a figure is too low for the names of a panel's rows [inch]."""
    place, size = axes.get_subplotspec(), float(axes.yaxis.get_ticklabels()[0].get_fontsize())
    rows = len(names) * (place.get_gridspec().nrows if place else 1)
    low = axes.transData.transform([(0.0, row) for row in axes.get_yticks()])[:, 1]
    apart = float(np.abs(np.diff(low)).min(initial=np.inf)) / axes.figure.dpi
    lines = 1 + max(name.count("\n") for name in names)
    return max(lines * LINE_HEIGHT * size / 72.0 - apart, 0.0) * rows


def fit_texts(figure: Figure) -> bool:
    """Break titles and names of axes of an arranged figure that are too wide; say if any was."""
    parts: list[Figure | SubFigure] = [figure, *figure.subfigs]
    rooms = [  # texts, and the room that they have [pixel]
        (text, part.bbox.x1 - text.get_window_extent().x0) for part in parts for text in part.texts
    ]
    for axes in figure.axes:
        axes.apply_aspect()  # which moves what has equal scales
    for axes in figure.axes:
        # a title may go up to the next panel beside its own, or to the edge of the figure
        box, ends = axes.get_window_extent(), [figure.bbox.x1]
        for other in figure.axes:
            near = other.get_window_extent()
            if near.x0 >= box.x1 - 1.0 and near.y1 > box.y0 and near.y0 < box.y1:
                ends.append(near.x0 if other.get_subplotspec() else box.x1)  # bar: numbers above
        titles = {axes.get_title(where) for where in ("left", "center", "right")} - {""}
        for title in axes.get_children():
            if isinstance(title, Text) and title.get_text() in titles:
                at_left = title.get_horizontalalignment() == "left"
                wide = min(ends) - GAP - title.get_window_extent().x0
                rooms.append((title, wide if at_left else box.width))
    fitted = [_break(*each) for each in rooms]
    for axes in figure.axes:
        if axes.name != "3d":
            box = axes.get_window_extent()
            fitted.append(_break(axes.xaxis.label, box.width))
            fitted.append(_break(axes.yaxis.label, box.height, is_upright=True))
            fitted.append(_part_labels(axes.xaxis))
    return any(fitted)


def _part_labels(axis: Axis) -> bool:
    """Let fewer numbers stand along a horizontal axis where they would touch; names are turned."""
    if not _touch(axis):
        return False
    if _is_named(axis):
        axis.set_tick_params(labelrotation=TURNED)
        for label in axis.get_ticklabels():
            label.set(horizontalalignment="right", rotation_mode="anchor")
    elif axis.get_scale() == "linear":
        for steps in range(MOST_STEPS, 0, -1):
            axis.set_major_locator(MaxNLocator(steps))
            if not _touch(axis):
                break
    return True


def _touch(axis: Axis) -> bool:
    labels = [label for label in axis.get_ticklabels() if label.get_text() and label.get_visible()]
    boxes = sorted((label.get_window_extent() for label in labels), key=lambda box: box.x0)
    return any(one.x1 + GAP > other.x0 for one, other in pairwise(boxes))


def _break(text: Text, room: float, *, is_upright: bool = False) -> bool:
    """Break a text that is longer than some room [pixel], or write it smaller; say if it was."""
    size = _length(text, is_upright)
    if not text.get_text() or size <= room or room <= 0.0:
        return False
    lines = text.get_text().split("\n")
    width = max(LEAST_LINE, int(max(map(len, lines)) * room / size))
    wrapped = (fill(line, width, break_long_words=False, break_on_hyphens=False) for line in lines)
    text.set_text("\n".join(wrapped))
    points = float(text.get_fontsize())
    while _length(text, is_upright) > room and points > SMALLEST_TEXT:
        points = max(0.95 * points, SMALLEST_TEXT)
        text.set_fontsize(points)
    return True


def _length(text: Text, is_upright: bool) -> float:
    box = text.get_window_extent()
    return float(box.height if is_upright else box.width)
