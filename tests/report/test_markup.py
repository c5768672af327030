"""Numbers, tables, names and notes as text: inert on every page, in terminals and in LaTeX."""

import itertools
import re
import shutil
import subprocess
from math import inf, nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.commands.console import coloured, new_table, plain_console
from evoexp.configuration import compose
from evoexp.errors import SettingError, printable
from evoexp.report.pages import markdown, page_values
from evoexp.report.pages.build import PACKAGES, escaped, latex_tables
from evoexp.report.pages.index import in_few_words, provenance
from evoexp.report.pages.page_parts import Document, Table, Verdict
from report_samples import shown_run, smoke_report


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (-3.0, "−3"),
        (123456.0, "123456"),
        (123456.7, "1.235e+05"),
        (-1e-9, "−1e−09"),
        (nan, "–"),
        (inf, "∞"),
        (-inf, "−∞"),
    ],
)
def test_numbers_have_four_digits_or_are_whole(value: float, text: str) -> None:
    assert markdown.number(value) == text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("<script>alert(1)</script>", "&lt;script>alert(1)&lt;/script>"),
        ("<!-- x", "&lt;!-- x"),
        ("<javascript:alert(1)>", "&lt;javascript:alert(1)>"),
        ("[x](javascript:alert(1))", "[x]\\(javascript:alert(1))"),
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


def test_a_terminal_is_not_steered(capsys: pytest.CaptureFixture[str]) -> None:
    table = new_table("\x1b]0;title\x07[red]t[/red]")
    table.add_column("[bold]c[/bold]")
    table.add_row("[red]a[/red] :warning: \x1b[31mb\x1b[0m \u202e")
    table.add_row(coloured("\x1b[2J", "red"))
    plain_console().print(table)
    out = capsys.readouterr().out
    cell = "[red]a[/red] :warning: \\x1b[31mb\\x1b[0m \\u202e"
    assert all(text in out for text in (cell, "[red]t[/red]", "[bold]c[/bold]", "\\x1b[2J"))
    assert not {"\x1b", "\x07", "\u202e"} & set(out)
    assert printable("λ = 10 · µm ≤ 3\nnext\udcff") == "λ = 10 · µm ≤ 3\nnext\\udcff"


@pytest.mark.parametrize(
    ("name", "must"), [("mine.yaml", "labels of printable"), ("...yaml", "a plain name")]
)
def test_labels_and_names_of_experiments_are_plain(tmp_path: Any, name: str, must: str) -> None:
    base = (compose.shipped.config_directory() / "experiment/rana_obstacles.yaml").read_text()
    (tmp_path / name).write_text(base + 'conditions:\n  "a\\nb": []\n')
    with pytest.raises(SettingError, match=must):
        compose.expand([f"experiment={tmp_path / name}", "budget=smoke"])


def shown(label: str, *notes: str) -> Any:
    condition = SimpleNamespace(notes=lambda: [f"robot: {note}" for note in notes])
    return SimpleNamespace(condition=SimpleNamespace(label=label, condition=condition))


def test_equal_notes_on_conditions_stand_in_one_row() -> None:
    first = shown("I", "covers", "pairs"), shown("I", "covers")
    found = page_values.notes([*first, shown("II", "covers"), shown("III")])
    assert found == (("I, II", "robot: covers"), ("I", "robot: pairs"))


EVERY = [f"{problem} · {planner}" for problem in "abcd" for planner in ("GA", "RRT", "ES")]


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        ([f"{p} · RRT" for p in "abcd"], "RRT"),
        (["b · GA", "b · RRT", "b · ES"], "b"),
        (["a · RRT", "b · RRT"], "a · RRT, b · RRT"),
        (["a · RRT"], "a · RRT"),
        (["b · ES", "b · GA", "b · RRT", "a · GA"], "b, a · GA"),
    ],
)
def test_a_part_stands_for_all_labels_that_have_it(labels: list[str], words: str) -> None:
    assert in_few_words(labels, EVERY) == words


def meant(words: str) -> set[str]:
    """Return the labels that a list stands for."""
    parts = words.split(", ")
    return {label for label in EVERY if {label, *label.split(" · ")} & set(parts)}


def test_every_list_means_what_it_lists() -> None:
    for count in range(1, len(EVERY) + 1):
        for labels in itertools.islice(itertools.combinations(EVERY, count), 0, None, 5):
            words = in_few_words(labels, EVERY)
            assert meant(words) == set(labels), words
            assert len(words) <= len(", ".join(labels))


def test_other_labels_stay_as_they_are() -> None:
    every = ["I", "II · x", "III"]
    assert in_few_words(every[:2], every) == "I, II · x"


LONG = "A claim that is too long for one line of a table, and so has a column that breaks lines"
TABLE = Table(
    "Claims",
    ("claim", "λ = 10 & more", "verdict"),
    ((LONG, "−1.5 [−2, ∞]", Verdict("reproduced")), ("50 %_x", "–", Verdict("not judged"))),
    "Median `a_b`.",
    "table_1_claims.tex",
)


def latex(table: Table) -> list[str]:
    """Return the lines of a table in LaTeX; braces balance."""
    words = "A & B", "evoexp report x", "exp_1", "paper", (), ""
    runs = (shown_run("condition", "0" * 12, [1.0] * 20),)
    said = "n = 20, seeds 0, 7; run `000000000000`."
    document = Document(*words, (table,), (), (), runs, said)
    lines = latex_tables(document)[table.file].decode().splitlines()
    bare = re.sub(r"\\[{}]", "", "".join(line for line in lines if not line.startswith("%")))
    assert bare.count("{") == bare.count("}")
    return lines


def test_a_latex_table_has_caption_rows_columns_and_rules() -> None:
    lines = latex(TABLE)
    assert lines[0] == "% made by evoexp report x"
    assert rf"% needs {PACKAGES}" in lines
    assert r"\caption{A \& B: Claims. Median a\_b. n = 20, seeds 0, 7; run 000000000000.}" in lines
    assert r"\label{tab:exp-1-claims}" in lines
    assert [line for line in lines if "rule" in line] == [r"\toprule", r"\midrule", r"\bottomrule"]
    assert lines[lines.index(r"\midrule") + 1 : lines.index(r"\bottomrule")] == [
        rf"{LONG} & $-$1.5 {{[}}$-$2, $\infty$] & reproduced \\",
        r"50~\%\_x & -- & not judged \\",
    ]
    assert r"claim & $\lambda$ = 10 \& more & verdict \\" in lines
    assert r"\begin{table*}" in lines  # too wide for one of two columns
    sides, shares = layout(lines)
    assert sides == ["right", "left", "right"]  # ragged: numbers stand to the right
    assert 0.99 < sum(shares) <= 1.0 and shares[0] == max(shares)


def layout(lines: list[str]) -> tuple[list[str], list[float]]:
    """Return the ragged side and the share of the line of each column of a table."""
    (begin,) = (line for line in lines if line.startswith(r"\begin{tabular}"))
    column = r"\\ragged(\w+)\\arraybackslash\\hspace\{0pt\}\}p\{\\dimexpr (0\.\d{4})\\linewidth"
    sides, shares = zip(*re.findall(column, begin), strict=True)
    return list(sides), list(map(float, shares))


def test_a_narrow_latex_table_stands_in_one_column() -> None:
    lines = latex(Table("Costs", ("a", "b"), (("x", 1), ("y", 2)), file="a.tex"))
    assert r"\begin{table}" in lines and sum(layout(lines)[1]) < 0.3


@pytest.mark.parametrize(
    ("headers", "rows"),
    [
        (("name", "text"), [(f"row {k}", LONG * 2) for k in range(60)]),
        (("name", *"abcdefghijklmnop"), [("row 0", *["0.002837 [0.001000,"] * 16)]),
    ],
)
def test_a_latex_table_with_too_many_rows_or_columns_comes_in_parts(
    headers: tuple[str, ...], rows: list[tuple[object, ...]]
) -> None:
    lines = latex(Table("Long", headers, tuple(rows), file="a.tex"))
    count = lines.count(r"\toprule")
    assert count > 1
    labels = [line for line in lines if line.startswith(r"\label")]
    assert labels == [
        rf"\label{{tab:exp-1-long{'' if k == 1 else f'-{k}'}}}" for k in range(1, count + 1)
    ]
    assert sum(f"Part {k + 1} of {count}." in "".join(lines) for k in range(count)) == count
    body = [line for line in lines if line.startswith("row ")]
    assert list(dict.fromkeys(line.split(" & ")[0] for line in body)) == [row[0] for row in rows]
    assert sum(line.count(" & ") for line in body) == sum(len(row) - 1 for row in rows)


def test_later_parts_repeat_the_units() -> None:
    headers, cells = ("quantity", "unit", *"abcdefghijklmnop"), ["0.002837 [0.001000,"] * 16
    lines = latex(Table("Long", headers, (("cost", "m", *cells),), file="a.tex"))
    rows = [line for line in lines if line.startswith("cost")]
    assert len(rows) > 1 and all(row.startswith("cost & m & ") for row in rows)


NINE = [(str(k), 2, k % 2) for k in range(9)]


@pytest.mark.parametrize(
    ("runs", "expected"),
    [
        ([], ""),
        ([("a", 1, 3)], "n = 1, seed 3; run `a`."),
        ([("a", 5, 0), ("b", 7, 0)], "n = 5–7 of each condition, seed 0; runs `a`, `b`."),
        ([("a", 5, 0), ("a", 5, 0)], "n = 5 of each condition, seed 0; run `a`."),
        (NINE, "n = 2 of each condition, seeds 0, 1; runs `0`, `1`, `2`, `3` and 5 more."),
    ],
)
def test_provenance(runs: list[tuple[str, int, int]], expected: str) -> None:
    found: Any = [
        SimpleNamespace(hash12=name, done=done, condition=SimpleNamespace(seed=seed))
        for name, done, seed in runs
    ]
    assert provenance(found) == expected


@given(st.text(alphabet=st.sampled_from(r"""ab \{}$&#_%~^<>|"[]*'(ü""")))
def test_escaped_names_hold_no_commands_but_ours(text: str) -> None:
    found = escaped(text)
    found = found.replace(r"\allowbreak{}", "").replace(r"~\%", r"\%")
    words = "textbackslash|textasciitilde|textasciicircum|textless|textgreater|textbar"
    bare = re.sub(rf"\\(?:{words})\{{\}}|\\[{{}}$&#_%]|\{{[\[*]\}}", "", found)
    assert not set(bare) & set("\\{}$&#_%~^<>|[*"), (text, found)
    assert bare.count("a") == text.count("a") and bare.count("ü") == text.count("ü")
    assert escaped('"typical size 5", 3 % of Fig. 6') == r"``typical size 5'', 3~\% of Fig.~6"
    long_word = "scenario.obstacles.0.radius"
    assert escaped(long_word) == r"scenario.\allowbreak{}obstacles.0.\allowbreak{}radius"
    assert escaped("via-point GA, x = 10 (given)") == "via-point GA, x = 10 (given)"


NEEDS_LATEX = pytest.mark.skipif(shutil.which("pdflatex") is None, reason="needs pdflatex")
WIDEST = 1.0  # [pt] that a line may be too wide


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Return the lines that show every table and every figure of a report of each paper."""
    outputs = tmp_path_factory.mktemp("outputs")
    lines = []
    for name in ("rana_planar", "chen_options", "curkovic_methods", "corsepius", "lavoie_controls"):
        report = smoke_report(outputs, name, formats=("pdf",), width="column")
        tables, figures = sorted(report.glob("table_*.tex")), sorted(report.glob("*.pdf"))
        assert len(tables) > 4 and len(figures) > 1
        # LaTeX keeps a limited number of floats for later pages
        lines += [rf"\input{{{path}}}\clearpage" for path in tables]
        for path in figures:
            picture = rf"\includegraphics[width=\linewidth]{{{path}}}"
            lines += [r"\begin{figure}", picture, r"\end{figure}", r"\clearpage"]
    return lines


def log_of(paper: str, parts: list[str], folder: Path) -> str:
    """Return the log of an article of two columns; it has a page for each of its parts."""
    head = [rf"\documentclass[twocolumn,{paper}]{{article}}", r"\usepackage{graphicx}", PACKAGES]
    text = [*head, r"\begin{document}", *parts, r"\end{document}", ""]
    (folder / "article.tex").write_text("\n".join(text))
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "article.tex"]
    done = subprocess.run(command, cwd=folder, capture_output=True, timeout=200)
    log = (folder / "article.log").read_text(errors="replace")
    assert done.returncode == 0, log[-2000:]
    return log


@NEEDS_LATEX
@pytest.mark.matrix
@pytest.mark.parametrize("paper", ["letterpaper", "a4paper"])
def test_every_table_and_figure_fits(paper: str, parts: list[str], tmp_path: Path) -> None:
    log = log_of(paper, parts, tmp_path)
    wide = re.findall(r"Overfull \\hbox \(([\d.]+)pt too wide\)", log)
    assert all(float(width) <= WIDEST for width in wide), wide
    assert "Float too large" not in log and r"Overfull \vbox" not in log


@NEEDS_LATEX
@pytest.mark.matrix
def test_a_line_that_is_too_wide_is_noticed(tmp_path: Path) -> None:
    log = log_of("a4paper", [r"\noindent\rule{300pt}{1pt}"], tmp_path)
    assert r"Overfull \hbox" in log
