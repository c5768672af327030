"""Ticks of a finished figure, worked out once where matplotlib works them out five times.

While a figure is arranged and drawn, every axis is asked for its ticks and for the boxes of their
labels again and again: by the layout, by titles, by labels that keep clear of them. All of these
follow from the axis' limits, its place and the resolution.
"""

from typing import Any, NamedTuple

from matplotlib.axis import Axis
from matplotlib.figure import Figure

PLAIN = "rectilinear"  # the kind of axes whose ticks follow from nothing else
_ASKED = ("_update_ticks", "_get_ticklabel_bboxes")  # what matplotlib's axes ask of themselves


def keep_ticks(figure: Figure) -> None:
    """Have all plain axes of a figure keep their ticks; nothing but its place may change then.

    A matplotlib that goes about it in another way is left to it.
    """
    if not all(hasattr(Axis, name) for name in _ASKED):
        return
    for axes in figure.axes:
        if axes.name == PLAIN:
            for axis in (axes.xaxis, axes.yaxis):
                _TickMemory(axis).join()


class _Place(NamedTuple):
    """All that the ticks of an axis follow from, once its figure is finished.

    Attributes:
        interval: Limits of the axis.
        box: Of the axes on the page.
        leading: Of the axes that choose the ticks, where several share them.
        dpi: Resolution [1/inch].
    """

    interval: tuple[float, ...]
    box: tuple[float, ...]
    leading: tuple[float, ...]
    dpi: float


class _TickMemory:
    """The ticks of one axis and their boxes, as long as it stays in its place."""

    def __init__(self, axis: Axis) -> None:
        """Begin without any."""
        self._axis: Any = axis
        self._find, self._measure = (getattr(axis, name) for name in _ASKED)
        self._place: _Place | None = None
        self._ticks: list[Any] = []
        self._renderer: Any = None
        self._measured: list[Any] = []
        self._boxes: tuple[list[Any], list[Any]] = [], []

    def join(self) -> None:
        """Answer for the axis from now on."""
        self._axis._update_ticks, self._axis._get_ticklabel_bboxes = self._update, self._boxes_of

    def _update(self) -> list[Any]:
        """Return the ticks that are drawn."""
        if (place := self._here()) != self._place:
            self._ticks, self._place = self._find(), place
            self._renderer = None
        return list(self._ticks)

    def _boxes_of(self, ticks: list[Any], renderer: Any = None) -> tuple[list[Any], list[Any]]:
        """Return the boxes of the labels on both sides of some ticks."""
        if renderer is not self._renderer or ticks != self._measured or self._here() != self._place:
            self._boxes = self._measure(ticks, renderer)
            self._renderer, self._measured = renderer, list(ticks)
        one, other = self._boxes
        return list(one), list(other)

    def _here(self) -> _Place:
        axis = self._axis
        leading = axis.get_major_locator().axis or axis
        bounds = axis.axes.bbox.bounds, leading.axes.bbox.bounds
        return _Place((*axis.get_view_interval(),), *bounds, axis.axes.figure.dpi)
