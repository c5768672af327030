"""Figures for a column: fewer panels side by side, nothing cut off, nothing on top of another."""

from collections.abc import Callable
from itertools import combinations
from typing import Any

import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from evoexp.report.figures import style
from evoexp.report.figures.style import Look, drawn

NAMES = ["the first of some conditions", "another one", "a third with a long name"]
LONG = "share of the runs that were begun and came to their end [%]"


def row(count: int) -> Figure:
    found, panels = style.panels(2.7, count, sharey=True)
    for k, axes in enumerate(panels):
        axes.barh(range(3), [1e4, 2e4, 3e4])
        axes.set(yticks=range(3), yticklabels=NAMES, xlabel=LONG, title=f"ended by the goal {k}")
    return found


def lines() -> Figure:
    found, panels = style.panels(2.1, 10, 3, 0.8)
    for k, axes in enumerate(panels):
        axes.plot([0.0, 12345.0], [0.0, 1.0], label=f"a curve with a long name, number {k}")
        axes.set_title(f"panel {k} of many, of which each has a name that is too long")
    style.legend_below(found, panels, 4)
    return found


def boxes() -> Figure:
    found, (axes,) = style.panels(3.0)
    axes.bar(range(8), range(8))
    axes.set_xticks(range(8), [f"{k}\nn = 50, 2 refuted" for k in range(8)])
    axes.set_title("b  at the end of each of the runs that were begun, those that failed included")
    return found


def stack() -> Figure:
    found = style.figure(6.4)
    parts: Any = found.subfigures(2, 1, height_ratios=(5, 6))
    for axes in parts[0].subplots(1, 4, sharex=True, sharey=True):
        axes.plot([0.0, 200.0], [7.0, 14.0])
    parts[0].suptitle(
        "a  best collision-free team so far: mean ± standard deviation", x=0.01, ha="left"
    )
    parts[1].subplots().plot([0.0, 1.0], label="the lower one")
    parts[1].legend(loc="outside lower center", ncols=4)
    return found


def coloured() -> Figure:
    found, panels = style.panels(3.4, 2)
    for axes in panels:
        image = axes.imshow([[0.0, 100.0], [200.0, 50.0]])
        found.colorbar(image, ax=axes, label="potential [-]")
        axes.set_title("(a) potential of all of the obstacles")
    return found


def at_width(draw: Callable[[], Figure], width: Any) -> Figure:
    seen: list[Figure] = []

    def look_at() -> Figure:
        seen.append(draw())
        return seen[0]

    drawn(look_at, ("png",), 100, Look(width))
    return seen[0]


def columns(figure: Figure) -> int:
    return len({round(axes.get_window_extent().x0) for axes in of_grid(figure)})


def of_grid(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.get_subplotspec() is not None]


def words(figure: Figure) -> list[Text]:
    parts: list[Any] = [figure, *figure.subfigs]
    found = [text for part in parts for text in part.texts]
    for axes in figure.axes:
        found += [axes.xaxis.label, axes.yaxis.label]
        found += [one for one in axes.get_children() if isinstance(one, Text)]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            ticks = [tick for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
            found += [label for tick in ticks for label in (tick.label1, tick.label2)]
    return [text for text in found if text.get_text().strip() and text.get_visible()]


@pytest.mark.examples(3)
@pytest.mark.parametrize(
    ("draw", "page", "column"),
    [
        (lambda: row(1), 1, 1),
        (lambda: row(2), 2, 1),
        (lambda: row(3), 3, 2),
        (lines, 3, 2),
        (boxes, 1, 1),
        (coloured, 2, 1),
    ],
)
def test_a_column_has_half_as_many_panels_side_by_side(
    draw: Callable[[], Figure], page: int, column: int
) -> None:
    assert (columns(at_width(draw, "page")), columns(at_width(draw, "column"))) == (page, column)


@pytest.mark.examples(3)
@pytest.mark.parametrize("draw", [lambda: row(1), lambda: row(3), lines, boxes, stack, coloured])
def test_no_text_of_a_column_is_cut_off_or_lies_upon_another(draw: Callable[[], Figure]) -> None:
    figure = at_width(draw, "column")
    found = words(figure)
    assert len(found) > 8
    for text in found:
        box = text.get_window_extent()
        assert box.x0 >= -1.0 and box.x1 <= figure.bbox.x1 + 1.0, text.get_text()
        assert box.y0 >= -1.0 and box.y1 <= figure.bbox.y1 + 1.0, text.get_text()
    for one, other in combinations(found, 2):
        if one.get_rotation() in (0.0, 90.0) and other.get_rotation() in (0.0, 90.0):
            pair = one.get_text(), other.get_text()
            assert not one.get_window_extent().padded(-1.0).overlaps(other.get_window_extent()), (
                pair
            )


def test_panels_that_begin_a_line_have_numbers_and_others_that_share_them_none() -> None:
    for axes in of_grid(at_width(lambda: row(3), "column")):
        begins = axes.get_subplotspec().is_first_col()  # type: ignore[union-attr]
        assert any(text.get_visible() for text in axes.get_yticklabels()) == begins


def test_titles_of_a_page_are_broken_where_they_would_reach_into_the_next_panel() -> None:
    def long_titles() -> Figure:
        found, panels = style.panels(3.0, 2)
        for axes in panels:
            axes.set_title(
                "a condition that has a name as long as those of a sweep: 4 exact bodies"
            )
        return found

    first, second = of_grid(at_width(long_titles, "page"))
    (title,) = (
        one for one in words(first.figure) if "bodies" in one.get_text() and one.axes is first
    )  # type: ignore[arg-type]
    assert "\n" in title.get_text()
    assert title.get_window_extent().x1 < second.get_window_extent().x0


def test_panels_stay_about_as_wide_as_they_were() -> None:
    page, column = (
        [axes.get_window_extent().width for axes in of_grid(at_width(lambda: row(2), width))]
        for width in ("page", "column")
    )
    assert 0.6 * max(page) <= min(column)
