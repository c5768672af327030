"""Texts of a figure broken into lines where they would reach into the next panel."""

import textwrap
from itertools import pairwise

from matplotlib.axis import Axis
from matplotlib.figure import Figure, SubFigure
from matplotlib.text import Text
from matplotlib.ticker import FixedLocator, MaxNLocator

LEAST_LINE = 8  # [characters]
SMALLEST_TEXT = 3.0  # [pt]
GAP = 6.0  # [pixel] between texts side by side
MOST_STEPS = 4  # between the numbers along an axis whose numbers would touch
TURNED = 60.0  # [deg] of names along an axis that would touch


def fit_texts(figure: Figure) -> bool:
    """Break titles and names of axes of an arranged figure that are too wide; say if any was."""
    parts: list[Figure | SubFigure] = [figure, *figure.subfigs]
    rooms = [  # texts, and the room that they have [pixel]
        (text, part.bbox.x1 - text.get_window_extent().x0) for part in parts for text in part.texts
    ]
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
    if isinstance(axis.get_major_locator(), FixedLocator):
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
    wrapped = (
        textwrap.fill(line, width, break_long_words=False, break_on_hyphens=False) for line in lines
    )
    text.set_text("\n".join(wrapped))
    points = float(text.get_fontsize())
    while _length(text, is_upright) > room and points > SMALLEST_TEXT:
        points *= 0.95
        text.set_fontsize(points)
    return True


def _length(text: Text, is_upright: bool) -> float:
    box = text.get_window_extent()
    return float(box.height if is_upright else box.width)
