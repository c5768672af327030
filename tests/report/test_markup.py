"""Names with markup are text on every page: labels, experiments, options, reasons of failures."""

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

from evoexp.commands.console import coloured, new_table, plain_console
from evoexp.configuration import compose
from evoexp.errors import SettingError, printable
from evoexp.report.figures.style import drawn
from evoexp.report.pages import markdown

SCRIPT, LINK = "<script>alert(1)</script>", "[x](javascript:alert(1))"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (SCRIPT, "&lt;script>alert(1)&lt;/script>"),
        ("<!-- x", "&lt;!-- x"),
        ("<javascript:alert(1)>", "&lt;javascript:alert(1)>"),
        (LINK, "[x]\\(javascript:alert(1))"),
        ("![x](http://elsewhere/x.png)", "![x]\\(http://elsewhere/x.png)"),
        ("[x](../../../secret.png)", "[x]\\(../../../secret.png)"),
        ("[x](//elsewhere", "[x]\\(//elsewhere)"),
        ("[png](convergence.png) a < 1, p <0.1", "[png](convergence.png) a < 1, p <0.1"),
    ],
)
def test_markdown_is_inert(text: str, expected: str) -> None:
    assert markdown.inert(text) == expected


def test_a_cell_stays_in_its_cell() -> None:
    assert markdown.table(["a"], [["x | y\n# z"]]).splitlines()[-1] == "| x \\| y # z |"


@pytest.mark.parametrize("label", ["$x_$", "$\\frac$", "a $ b", "costs $5 or $6_", "\\"])
def test_a_label_that_is_no_formula_is_drawn_as_it_is(label: str) -> None:
    def draw() -> Figure:
        figure = Figure()
        axes = figure.subplots()
        axes.plot([1.0, 2.0], label=label)
        axes.set_title(label)
        axes.legend()
        return figure

    assert drawn(draw, ("svg",), 100)["svg"].startswith(b"<?xml")
    assert mpl.rcParams["text.parse_math"]


def test_a_terminal_is_not_steered(capsys: pytest.CaptureFixture[str]) -> None:
    table = new_table("\x1b]0;title\x07[red]t[/red]")
    table.add_column("[bold]c[/bold]")
    table.add_row("[red]a[/red] :warning: \x1b[31mb\x1b[0m \u202e")
    table.add_row(coloured("\x1b[2J", "red"))
    plain_console().print(table)
    out = capsys.readouterr().out
    assert "[red]a[/red] :warning: \\x1b[31mb\\x1b[0m \\u202e" in out
    assert "[red]t[/red]" in out
    assert "[bold]c[/bold]" in out
    assert "\\x1b[2J" in out
    assert not {"\x1b", "\x07", "\u202e"} & set(out)


def test_printable_keeps_what_can_be_read() -> None:
    assert printable("λ = 10 · µm ≤ 3\nnext") == "λ = 10 · µm ≤ 3\nnext"
    assert printable("\x1b[31m\x00\udcff") == "\\x1b[31m\\x00\\udcff"


def test_labels_and_names_of_experiments_are_plain(tmp_path) -> None:  # type: ignore[no-untyped-def]
    text = '# @package _global_\ndefaults: []\nconditions:\n  "a\\nb": []\n'
    for name, must in (("mine.yaml", "labels of printable"), ("...yaml", "a plain name")):
        path = tmp_path / name
        base = (compose.shipped.config_directory() / "experiment/rana_obstacles.yaml").read_text()
        path.write_text(base + text[text.index("conditions") :])
        with pytest.raises(SettingError, match=must):
            compose.expand([f"experiment={path}", "budget=smoke"])
