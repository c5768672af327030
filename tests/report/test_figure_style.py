"""Figures for a page and for a column: text as text, nothing cut off, nothing upon another."""

import io
import re
from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from evoexp.cli import main
from evoexp.errors import SettingError
from evoexp.report.figures import marks, style
from evoexp.report.figures.marks import MANY, name_curves, name_ends
from evoexp.report.figures.style import drawn
from report_samples import SMALL

NAMES = ["the first of some conditions", "another one", "a third with a long name"]
LONG = "share of the runs that were begun and came to their end [%]"
Draw = Callable[[], Figure]


def plain(label: str = "a curve") -> Figure:
    found, panels = style.panels(3.0, 2)
    for axes in panels:
        axes.plot([0.0, 1.0], [0.0, 2.0], label=label)
        axes.set(xlabel="instant", ylabel="distance [m]", title="one")
    style.legend_below(found, panels[:1], 1)
    return found


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
    title = "a  best collision-free team so far: mean ± standard deviation"
    parts[0].suptitle(title, x=0.01, ha="left")
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


def long_titles() -> Figure:
    found, panels = style.panels(3.0, 2)
    for axes in panels:
        axes.set_title("a condition that has a name as long as those of a sweep: 4 exact bodies")
    return found


def at_width(draw: Draw, width: Any = "page") -> Figure:
    """Return a figure as it is laid out for a width."""
    seen: list[Figure] = []
    drawn(lambda: seen.append(draw()) or seen[0], ("png",), 100, width)
    return seen[0]


def of_grid(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.get_subplotspec() is not None]


def words(figure: Figure) -> list[Text]:
    found = [text for part in (figure, *figure.subfigs) for text in part.texts]
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
def test_a_column_has_half_as_many_panels_side_by_side(draw: Draw, page: int, column: int) -> None:
    for width, columns in (("page", page), ("column", column)):
        places = {round(a.get_window_extent().x0) for a in of_grid(at_width(draw, width))}
        assert len(places) == columns


@pytest.mark.examples(3)
@pytest.mark.parametrize("draw", [lambda: row(1), lambda: row(3), lines, boxes, stack, coloured])
def test_no_text_of_a_column_is_cut_off_or_lies_upon_another(draw: Draw) -> None:
    figure = at_width(draw, "column")
    found = words(figure)
    assert len(found) > 8
    for text in found:
        box = text.get_window_extent()
        assert box.x0 >= -1.0 and box.x1 <= figure.bbox.x1 + 1.0, text.get_text()
        assert box.y0 >= -1.0 and box.y1 <= figure.bbox.y1 + 1.0, text.get_text()
    upright = [text for text in found if text.get_rotation() in (0.0, 90.0)]
    for one, other in combinations(upright, 2):
        apart = not one.get_window_extent().padded(-1.0).overlaps(other.get_window_extent())
        assert apart, (one.get_text(), other.get_text())


def test_panels_of_a_column_stay_as_wide_and_those_that_begin_a_line_have_numbers() -> None:
    for axes in of_grid(at_width(lambda: row(3), "column")):
        begins = axes.get_subplotspec().is_first_col()
        assert any(text.get_visible() for text in axes.get_yticklabels()) == begins
    page, column = (
        [axes.get_window_extent().width for axes in of_grid(at_width(lambda: row(2), width))]
        for width in ("page", "column")
    )
    assert 0.6 * max(page) <= min(column)


def test_many_rows_with_long_names_fit_a_page_in_a_column() -> None:
    def many() -> Figure:
        found, panels = style.panels(16.0, 2, sharey=True)
        names = [
            f"{k} is a condition with a name that has no room here, number {k}" for k in range(50)
        ]
        panels[0].set_yticks(range(50), names)
        return found

    figure = at_width(many, "column")
    assert figure.get_figheight() <= 8.9 and min(w.get_fontsize() for w in words(figure)) >= 6.0
    assert len({label.get_text() for label in figure.axes[0].get_yticklabels()}) == 50


def test_titles_of_a_page_are_broken_where_they_would_reach_into_the_next_panel() -> None:
    first, second = of_grid(at_width(long_titles))
    (title,) = (w for w in words(first.figure) if "bodies" in w.get_text() and w.axes is first)
    assert "\n" in title.get_text()
    assert title.get_window_extent().x1 < second.get_window_extent().x0


def test_a_column_is_half_as_wide_and_its_text_is_text_that_can_be_read() -> None:
    for width, pixels in (("page", 720), ("column", 350)):
        png = drawn(plain, ("png",), 100, width)["png"]
        assert Image.open(io.BytesIO(png)).width == pixels
        svg = drawn(plain, ("svg",), 100, width)["svg"].decode()
        texts = set(re.findall(r"<text[^>]*>([^<]*)</text>", svg))
        assert {"instant", "distance [m]", "a curve"} <= texts
        fonts = re.findall(r"font(?:-family)?: ([^;\"]*)", svg)
        assert fonts and all(font.endswith("sans-serif") for font in fonts)
    sizes = [float(size) for size in re.findall(r"font(?:-size)?: (?:bold )?([\d.]+)px", svg)]
    assert sizes and 6.0 <= min(sizes) < max(sizes) <= 8.5


@pytest.mark.parametrize("width", ["page", "column"])
def test_a_long_legend_stays_within_the_figure(width: str) -> None:
    long = "a name that is by far too long for the width of one of two columns of a page, " * 2
    figure = at_width(lambda: plain(long), width)
    assert figure.legends[0].get_window_extent().width <= figure.bbox.width * 1.01


@pytest.mark.parametrize(("length", "columns"), [(4, 6), (38, 2), (90, 1)])
def test_a_legend_takes_as_many_columns_as_fit(length: int, columns: int) -> None:
    figure = style.figure(3.0)
    axes = figure.subplots()
    for k in range(6):
        axes.plot([0.0, 1.0], [0.0, k], label=f"{'w' * (length // 2)}{'i' * (length // 2 - 1)}{k}")
    style.legend_below(figure, [axes], 6)
    (legend,) = figure.legends
    figure.draw_without_rendering()
    places = [round(text.get_window_extent().x0) for text in legend.get_texts()]
    assert (len(places), len(set(places))) == (6, columns)
    assert legend.get_window_extent().width <= figure.bbox.width or columns == 1


def test_a_style_file_changes_figures_and_nothing_that_comes_after(tmp_path: Path) -> None:
    path = tmp_path / "thesis.mplstyle"
    path.write_text("font.family: serif\naxes.facecolor: ffeeee\nsvg.hashsalt: mine\n")
    before, styled, again, after = (
        drawn(plain, ("svg",), 100, "page", each)["svg"]
        for each in (None, str(path), str(path), None)
    )
    assert b"#ffeeee" in styled == again and b"#ffeeee" not in before == after


def test_a_figure_has_the_same_bytes_each_time_whatever_the_users_style() -> None:
    first = drawn(plain, ("svg", "png", "pdf"), 60)
    with mpl.rc_context({"font.size": 20.0, "lines.linewidth": 9.0}):
        assert drawn(plain, ("svg", "png", "pdf"), 60) == first
        assert mpl.rcParams["font.size"] == 20.0
    assert b"<dc:date>" not in first["svg"]


@pytest.mark.parametrize(
    ("text", "wrong"),
    [("font.sizes: 9", "Bad key font.sizes"), ("font.size: big", "Could not convert 'big'")],
)
def test_a_style_file_that_is_none_is_refused(tmp_path: Path, text: str, wrong: str) -> None:
    path = tmp_path / "bad.mplstyle"
    path.write_text(text)
    must = rf"report\.style: must be a matplotlib style file \(.*{re.escape(wrong)}.*bad\.mplstyle'"
    with pytest.raises(SettingError, match=must):
        drawn(plain, ("svg",), 100, "page", str(path))


def test_the_width_is_that_of_the_report(
    stored: Path, blank_figures: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(stored))
    widths, blank = list[str](), style.drawn

    def noted(draw: Any, formats: Any, dpi: int, *look: Any) -> dict[str, bytes]:
        widths.append(look[0])
        return blank(draw, formats, dpi)

    monkeypatch.setattr(style, "drawn", noted)
    assert main(["report", "rana_planar", *SMALL, "report.width=column"]) == 0
    assert len(widths) > 3 and set(widths) == {"column"}


@pytest.mark.parametrize(
    ("count", "width", "named"),
    [(MANY, "page", True), (MANY - 1, "page", False), (MANY, "column", False)],
)
def test_many_curves_are_named_at_their_ends_from_the_highest_to_the_lowest(
    count: int, width: str, named: bool
) -> None:
    def draw() -> Figure:
        figure, (axes,) = style.panels(3.0)
        for k in range(count):
            axes.plot([0.0, 1.0], [0.5, 0.1 * k], label=f"planner {k}", **style.curve_look(k))
        name_curves(figure, axes, 3)
        return figure

    figure = at_width(draw, width)
    texts = sorted(figure.axes[0].texts, key=lambda text: -text.get_position()[1])
    names = [f"planner {k}" for k in reversed(range(count))] if named else []
    assert [text.get_text() for text in texts] == names
    assert len(figure.legends) == (0 if named else 1)


def test_names_at_the_ends_of_curves_keep_apart() -> None:
    _, (axes,) = style.panels(3.0)
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    heights = [0.5] * 5 + [0.99, np.nan]
    name_ends(axes, [(0.5, y, str(k), "#000000") for k, y in enumerate(heights)])
    places = sorted(text.xyann[1] for text in axes.texts)
    assert len(places) == 6 and np.diff(places).min() >= marks.APART - 1e-9
    assert np.mean(places[:5]) == pytest.approx(0.5)  # around their curves
    assert {text.xy for text in axes.texts} == {(0.5, 0.5), (0.5, 0.99)}


@given(st.lists(st.floats(0.0, 1.0), max_size=40), st.floats(0.01, 0.2))
def test_places_of_names_are_apart_in_order_and_inside(wanted: list[float], gap: float) -> None:
    found = marks.apart(np.sort(np.array(wanted)), gap)
    least = min(gap, 1.0 / max(len(wanted) - 1, 1))
    assert len(found) == len(wanted)
    assert (np.diff(found) >= least - 1e-9).all()
    assert ((found >= -1e-9) & (found <= 1.0 + 1e-9)).all()


@pytest.mark.parametrize("label", ["$x_$", "$\\frac$", "a $ b", "costs $5 or $6_", "\\"])
def test_a_label_that_is_no_formula_is_drawn_as_it_is(label: str) -> None:
    assert drawn(lambda: plain(label), ("svg",), 100)["svg"].startswith(b"<?xml")
    assert mpl.rcParams["text.parse_math"]


def test_colours_and_lines_repeat_only_after_all_are_used() -> None:
    assert len({style.arm_colour(k) for k in range(6)}) == 6
    assert style.arm_colour(6) == style.arm_colour(0)
    assert len({style.condition_colour(k) for k in range(8)}) == 8
    assert [style.row_colour(k, 8) for k in range(8)] == list(style.CONDITION_COLOURS)
    assert style.row_colour(0, 9) == style.CONDITION_COLOURS[0]
    assert style.row_colour(1, 9) == style.row_colour(8, 9) == style.NEUTRAL
    looks = [style.curve_look(k) for k in range(24)]
    assert len({look["color"] for look in looks}) == 6
    assert len({str(look) for look in looks}) == 24
    assert all(look["linestyle"] == "-" for look in looks[:6])


def test_symbols_and_long_names() -> None:
    assert (style.joint_symbol(1, 11), style.joint_symbol(7, 0)) == ("α₁₂", "q8,₁")
    assert style.shortened("a" * 10, 10) == "a" * 10
    assert style.shortened("abcdefghij", 7) == "abc…hij"
    assert all(len(style.shortened("x" * 40, most)) == most for most in range(3, 12))
