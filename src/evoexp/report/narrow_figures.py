"""Figures for one of two columns: fewer panels side by side, and no text wider than its place.

Two panels that stand side by side on a page stand below each other in a column, three or four in
two lines, and so on: each stays about as wide as it was. Titles of a page are fitted, too.
"""

import textwrap
from collections import defaultdict
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.text import Text
from matplotlib.ticker import FixedLocator, MaxNLocator

HIGHER = 1.2  # panels that are arranged anew beside a figure of one panel
MOST_STEPS = 4  # between the numbers along an axis whose numbers would touch
LEAST_LINE = 8  # [characters]
SMALLEST_TEXT = 3.0  # [pt]
GAP = 6.0  # [pixel] between texts side by side
TURNED = 60.0  # [deg] of names along an axis that would touch

_Part = Any  # a figure, or one in a figure: both have what matplotlib's types give only one of them
_Span = tuple[int, int, int]  # line, first and last column


def narrow(figure: Figure) -> None:
    """Rearrange a figure of the width of a column that was drawn as one of the whole page."""
    parts = _parts(figure)
    grown = [_regrid(part) for part in parts]
    if len(parts) > 1:
        grid = parts[0]._subplotspec.get_gridspec()
        shares = [float(share) for share in grid.get_height_ratios()]
        heights = [a * max(b, HIGHER) for a, b in zip(shares, grown, strict=True)]
        grid.set_height_ratios(heights)
        grown = [sum(heights) / sum(shares)]
    figure.set_figheight(figure.get_figheight() * grown[0])
    for part in (figure, *figure.subfigs):
        _fit_legends(part)
    engine = figure.get_layout_engine()
    for _ in range(2):  # what is broken into lines takes room from the others
        if engine is not None:
            engine.execute(figure)
        _fit_texts(figure)


def _parts(figure: Figure) -> Sequence[_Part]:
    """Return the figures that stand below each other in a figure, or that alone."""
    found: list[_Part] = figure.subfigs
    is_stack = all(part._subplotspec.get_gridspec().ncols == 1 for part in found)
    return found if found and is_stack else [figure]


def _regrid(part: _Part) -> float:
    """Put the panels of a figure into half as many columns; return how much higher it becomes."""
    panels = defaultdict[_Span, list[Axes]](list)  # those of one place lie upon each other
    grids, is_plain = set[Any](), True
    for axes in part.axes:
        spec = axes.get_subplotspec()
        if spec is not None:
            grids.add(spec.get_gridspec())
            is_plain &= len(spec.rowspan) == 1
            panels[spec.rowspan.start, spec.colspan.start, spec.colspan.stop].append(axes)
    if len(grids) != 1 or not is_plain:
        return 1.0
    (grid,) = grids
    if grid.ncols == 1:
        return 1.0
    columns, shares = -(-grid.ncols // 2), [float(share) for share in grid.get_height_ratios()]
    flows = len(set(shares)) == 1 and all(last - first == 1 for _, first, last in panels)
    places, heights = dict[_Span, tuple[int, slice]](), list[float]()
    end = columns
    for line in sorted({line for line, _, _ in panels}):
        end = end if flows else columns
        for span in sorted(each for each in panels if each[0] == line):
            wide = min(columns, -(-(span[2] - span[1]) // 2))
            if end + wide > columns:
                heights.append(shares[line])
                end = 0
            places[span] = len(heights) - 1, slice(end, end + wide)
            end += wide
    new = GridSpec(len(heights), columns, figure=part, height_ratios=heights)
    for span, place in places.items():
        for axes in panels[span]:
            axes.set_subplotspec(new[place])
        first = next(one for one, (line, _) in places.items() if line == place[0])
        named = min(each for each in panels if each[0] == span[0])
        _label(panels[span][0], panels[named][0], None if first == span else panels[first][0])
    return HIGHER * sum(heights) / sum(shares)


def _label(axes: Axes, named: Axes, first: Axes | None) -> None:
    """Let axes have numbers and a name on the left where they begin a line, or are on their own.

    Args:
        axes: Of a panel.
        named: Axes that began its line on a page.
        first: Axes that begin its line now; None: these axes.
    """
    shared = axes.get_shared_y_axes()
    if first is None and axes is not named and shared.joined(axes, named):
        axes.tick_params(axis="y", labelleft=True)
        axes.set_ylabel(axes.get_ylabel() or named.get_ylabel())
    elif first is not None and axes is named and shared.joined(axes, first):
        axes.tick_params(axis="y", labelleft=False)
        axes.set_ylabel("")


def _fit_legends(part: _Part) -> None:
    """Write legends in fewer columns, and smaller, until they are no wider than the figure."""
    for legend in list(part.legends):
        handles: list[Any] = legend.legend_handles
        names = [text.get_text() for text in legend.get_texts()]
        count, size = len(names), float(legend.get_texts()[0].get_fontsize()) if names else 0.0
        while legend.get_window_extent().width > part.bbox.width and size > SMALLEST_TEXT:
            size *= 1.0 if count > 1 else 0.95
            count = max(count - 1, 1)
            legend.remove()
            look: dict[str, Any] = {"loc": "outside lower center", "ncols": count, "fontsize": size}
            legend = part.legend(handles, names, **look)


def _fit_texts(figure: Figure) -> None:
    part: _Part
    for part in (figure, *figure.subfigs):
        for text in part.texts:
            _break(text, part.bbox.x1 - text.get_window_extent().x0)
    fit_titles(figure)
    for axes in figure.axes:
        box = axes.get_window_extent()
        if axes.name != "3d":
            _break(axes.xaxis.label, box.width)
            _break(axes.yaxis.label, box.height, is_upright=True)
            _thin(axes.xaxis)


def fit_titles(figure: Figure) -> bool:
    """Break titles that would reach into the next panel, or out of the figure; say if any would."""
    found = False
    for axes in figure.axes:
        titles = {axes.get_title(where) for where in ("left", "center", "right")} - {""}
        if not titles:
            continue
        box, end = axes.get_window_extent(), _end(axes, figure)
        for title in axes.get_children():
            if isinstance(title, Text) and title.get_text() in titles:
                left = title.get_horizontalalignment() == "left"
                room = end - title.get_window_extent().x0 if left else box.width
                found |= _break(title, room)
    return found


def _end(axes: Axes, figure: Figure) -> float:
    """Return how far a title may go to the right: up to the next panel beside it [pixel]."""
    own, ends = axes.get_window_extent(), [figure.bbox.x1]
    for other in figure.axes:
        box = other.get_window_extent()
        if box.x0 >= own.x1 - 1.0 and box.y1 > own.y0 and box.y0 < own.y1:
            ends.append(box.x0 if other.get_subplotspec() else own.x1)  # a bar has numbers above
    return min(ends) - GAP


def _break(text: Text, room: float, *, is_upright: bool = False) -> bool:
    """Break a text into lines that are no longer than some room [pixel]; else write it smaller.

    Returns:
        Whether it was longer.
    """
    size = _length(text, is_upright)
    if not text.get_text() or size <= room or room <= 0.0:
        return False
    longest = max(len(line) for line in text.get_text().split("\n"))
    width = max(LEAST_LINE, int(longest * room / size))
    lines = (
        textwrap.fill(line, width, break_long_words=False, break_on_hyphens=False)
        for line in text.get_text().split("\n")
    )
    text.set_text("\n".join(lines))
    points = float(text.get_fontsize())
    while _length(text, is_upright) > room and points > SMALLEST_TEXT:
        points *= 0.95
        text.set_fontsize(points)
    return True


def _length(text: Text, is_upright: bool) -> float:
    box = text.get_window_extent()
    return float(box.height if is_upright else box.width)


def _thin(axis: Axis) -> None:
    """Let fewer numbers stand along a horizontal axis where they would touch; names are turned."""
    if not _touch(axis.get_ticklabels()):
        return
    if isinstance(axis.get_major_locator(), FixedLocator):
        axis.set_tick_params(labelrotation=TURNED)
        for label in axis.get_ticklabels():
            label.set(horizontalalignment="right", rotation_mode="anchor")
        return
    if axis.get_scale() == "linear":
        for steps in range(MOST_STEPS, 0, -1):
            axis.set_major_locator(MaxNLocator(steps))
            if not _touch(axis.get_ticklabels()):
                return


def _touch(labels: Iterable[Text]) -> bool:
    boxes = [one.get_window_extent() for one in labels if one.get_text() and one.get_visible()]
    boxes.sort(key=lambda box: box.x0)
    return any(a.x1 + GAP > b.x0 for a, b in pairwise(boxes))
