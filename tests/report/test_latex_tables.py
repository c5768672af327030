"""Tables as LaTeX: every cell is there, nothing in it is a command, columns and braces balance."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.report.pages.latex_tables import SIZES, escaped, latex_tables
from evoexp.report.pages.page_parts import Document, RunText, Table, Verdict, provenance

LONG = "A claim that is too long for one line of a table, and so has a column that breaks lines"
TABLE = Table(
    "Claims",
    ("claim", "λ = 10 & more", "verdict"),
    ((LONG, "−1.5 [−2, ∞]", Verdict("reproduced")), ("50 %_x", "–", Verdict("not judged"))),
    "Median `a_b`.",
    "table_1_claims.tex",
)
RUNS = tuple(RunText(f"condition {k}", f"{k}" * 64, 20, 0, False) for k in range(6))


def document(*tables: Table, runs: tuple[RunText, ...] = RUNS[:1]) -> Document:
    words = "A & B", "evoexp report x", "exp_1", "paper", (), ""
    return Document(*words, tables, runs, "n = 20, seeds 0, 7; run `000000000000`.")


def lines_of(table: Table = TABLE) -> list[str]:
    return latex_tables(document(table))[table.file].decode().splitlines()


def balance(text: str) -> int:
    bare = re.sub(r"\\[{}]", "", text)
    return bare.count("{") - bare.count("}")


def test_rows_columns_and_rules() -> None:
    lines = lines_of()
    assert [line for line in lines if "rule" in line] == [r"\toprule", r"\midrule", r"\bottomrule"]
    rows = lines[lines.index(r"\midrule") + 1 : lines.index(r"\bottomrule")]
    assert rows[0] == rf"{LONG} & $-$1.5 {{[}}$-$2, $\infty$] & reproduced \\"
    assert rows[1] == r"50 \%\_x & -- & not judged \\"
    assert r"claim & $\lambda$ = 10 \& more & verdict \\" in lines
    assert all(len(re.findall(r"(?<!\\)&", row)) == 2 for row in rows)
    (begin,) = (line for line in lines if line.startswith(r"\begin{tabular}"))
    assert re.fullmatch(r"\\begin\{tabular\}\{p\{0\.\d\d\\linewidth\}rl\}", begin)
    assert all(balance(line) == 0 for line in lines if not line.startswith("%"))


def test_a_table_fits_on_a_line_or_is_made_to() -> None:
    number = "162.8 [160.7, 168.1]"
    for count, size, fits in ((1, "small", True), (3, "footnotesize", True), (7, "small", False)):
        headers, row = ("quantity", *"abcdefg"[:count]), (LONG, *[number] * count)
        lines = lines_of(Table("Claims", headers, (row,), "", "t.tex"))
        assert rf"\centering\{size}" in lines
        assert (r"\resizebox{\linewidth}{!}{%" in lines) is not fits
        assert (r"\end{tabular}}" in lines) is not fits
        share = float(re.findall(r"p\{(0\.\d+)", "".join(lines))[0])
        letters = share * SIZES[size] + count * (len(number) + 3) + 3
        assert letters <= SIZES[size] + 1 or not fits
        assert balance("".join(line for line in lines if not line.startswith("%"))) == 0


def test_the_caption_tells_title_note_and_whose_runs() -> None:
    lines = lines_of()
    assert lines[0] == "% made by evoexp report x"
    assert r"\caption{A \& B: Claims. Median a\_b. n = 20, seeds 0, 7; run 000000000000.}" in lines
    assert r"\label{tab:exp-1-claims}" in lines


def test_only_tables_that_have_a_file() -> None:
    assert latex_tables(document(TABLE._replace(file=""))) == {}


@pytest.mark.parametrize(
    ("runs", "seeds", "expected"),
    [
        ([], (0,), ""),
        ([("a", 1)], (3,), "n = 1, seed 3; run `a`."),
        ([("a", 5), ("b", 7)], (0,), "n = 5–7 of each condition, seed 0; runs `a`, `b`."),
        ([("a", 5), ("a", 5)], (0,), "n = 5 of each condition, seed 0; run `a`."),
        (
            [(str(k), 2) for k in range(9)],
            (0, 1),
            "n = 2 of each condition, seeds 0, 1; runs `0`, `1`, `2`, `3` and 5 more.",
        ),
    ],
)
def test_provenance(runs: list[tuple[str, int]], seeds: tuple[int, ...], expected: str) -> None:
    assert provenance(runs, seeds) == expected


@given(st.text(alphabet=st.sampled_from(r"""ab \{}$&#_%~^<>|"[]*'(ü""")))
def test_escaped_names_hold_no_commands_but_ours(text: str) -> None:
    found = escaped(text)
    words = "textbackslash|textasciitilde|textasciicircum|textless|textgreater|textbar"
    bare = re.sub(rf"\\(?:{words})\{{\}}|\\[{{}}$&#_%]|\{{[\[*]\}}", "", found)
    assert not set(bare) & set("\\{}$&#_%~^<>|[*"), (text, found)
    assert bare.count("a") == text.count("a") and bare.count("ü") == text.count("ü")


@pytest.mark.parametrize("name", ["A", "via-point GA", "x = 10", "rana (given)"])
def test_plain_names_stay_as_they_are(name: str) -> None:
    assert escaped(name) == name
