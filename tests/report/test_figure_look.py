"""Figures for a page and for a column, with a style file over evoexp's own, text as text."""

import io
import re
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure
from PIL import Image

from evoexp.cli import main
from evoexp.errors import SettingError
from evoexp.report.figures import style
from evoexp.report.figures.style import Look, drawn
from report_samples import SMALL

LONG = "a name that is by far too long for the width of one of two columns of a printed page, " * 2


def draw(label: str = "a curve") -> Figure:
    found, panels = style.panels(3.0, 2)
    for axes in panels:
        axes.plot([0.0, 1.0], [0.0, 2.0], label=label)
        axes.set(xlabel="instant", ylabel="distance [m]", title="one")
    style.legend_below(found, panels[:1], 1)
    return found


def width_of(png: bytes) -> int:
    return Image.open(io.BytesIO(png)).width


def texts_of(svg: bytes) -> list[str]:
    return re.findall(r"<text[^>]*>([^<]*)</text>", svg.decode())


def test_a_column_is_half_as_wide_as_a_page() -> None:
    page, column = (
        drawn(draw, ("png",), 100, Look(width))
        for width in ("page", "column")  # type: ignore[arg-type]
    )
    assert width_of(page["png"]) == 720
    assert width_of(column["png"]) == 350


def test_text_is_text_in_a_font_that_is_anywhere() -> None:
    svg = drawn(draw, ("svg",), 100)["svg"]
    assert {"instant", "distance [m]", "a curve"} <= set(texts_of(svg))
    fonts = set(re.findall(rb"font-family: ([^;\"]*)", svg)) | set(
        re.findall(rb"font: ([^;]*)", svg)
    )
    assert fonts and all(font.endswith(b"sans-serif") for font in fonts)


def test_text_of_a_column_is_smaller_but_readable() -> None:
    svg = drawn(draw, ("svg",), 100, Look("column"))["svg"].decode()
    sizes = [float(size) for size in re.findall(r"font(?:-size)?: (?:bold )?([\d.]+)px", svg)]
    assert sizes and 5.5 <= min(sizes) < max(sizes) <= 8.5


@pytest.mark.parametrize("width", ["page", "column"])
def test_a_long_legend_stays_within_the_figure(width: str) -> None:
    seen = []

    def look_at() -> Figure:
        found = draw(LONG)
        seen.append(found)
        return found

    drawn(look_at, ("png",), 100, Look(width))  # type: ignore[arg-type]
    (legend,) = seen[0].legends
    assert legend.get_window_extent().width <= seen[0].bbox.width * 1.01


def test_a_style_file_changes_figures_and_nothing_that_comes_after(tmp_path: Path) -> None:
    path = tmp_path / "thesis.mplstyle"
    path.write_text("font.family: serif\naxes.facecolor: ffeeee\nsvg.hashsalt: mine\n")
    plain = drawn(draw, ("svg",), 100)["svg"]
    styled = drawn(draw, ("svg",), 100, Look("page", str(path)))["svg"]
    assert b"#ffeeee" in styled and b"#ffeeee" not in plain
    assert drawn(draw, ("svg",), 100, Look("page", str(path)))["svg"] == styled
    assert drawn(draw, ("svg",), 100)["svg"] == plain


@pytest.mark.parametrize(
    ("text", "wrong"),
    [("font.sizes: 9", "Bad key font.sizes"), ("font.size: big", "Could not convert 'big'")],
)
def test_a_style_file_that_is_none_is_refused(tmp_path: Path, text: str, wrong: str) -> None:
    path = tmp_path / "bad.mplstyle"
    path.write_text(text)
    must = rf"report\.style: must be a matplotlib style file \(.*{re.escape(wrong)}.*bad\.mplstyle'"
    with pytest.raises(SettingError, match=must):
        drawn(draw, ("svg",), 100, Look("page", str(path)))


@pytest.mark.parametrize(
    ("word", "refusal"),
    [
        ("report.width=colum", "report.width: must be one of 'page' or 'column', was 'colum'; did"),
        ("report.style=none.mplstyle", "report.style: must be the path of a matplotlib style file"),
    ],
)
def test_settings_are_refused_before_anything_is_drawn(
    word: str, refusal: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", "rana_planar", word]) == 2
    assert refusal in capsys.readouterr().err


def test_the_width_is_that_of_the_report(
    stored: Path, blank_figures: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(stored))
    widths, blank = list[str](), style.drawn

    def noted(draw: Any, formats: Any, dpi: int, look: Look) -> dict[str, bytes]:
        widths.append(look.width)
        return blank(draw, formats, dpi)

    monkeypatch.setattr(style, "drawn", noted)
    assert main(["report", "rana_planar", *SMALL, "report.width=column"]) == 0
    assert len(widths) > 3 and set(widths) == {"column"}
