"""The table of a comparison as files: read back, every number and name is there."""

import csv
import io

import numpy as np

from evoexp.report.pages.comparison import Rated, as_csv, as_latex
from evoexp.report.statistics.inference import Interval, Spread

ROWS = [
    Rated(
        "p_1: A&B",
        "[A] & B_1 50%",
        "p_1",
        4,
        3,
        10.0,
        1234.5,
        Interval(900.25, 2000.125),
        Spread(4.0 / 3.0, 1.0, 2.0, 4),
        1.0,
        np.nan,
        1.0,
        0,
        4,
        20.0,
        51.5,
        0.25,
    ),
    Rated(
        "q: C",
        "C (given)",
        "q, {a}",
        2,
        0,
        np.nan,
        np.inf,
        Interval(1e6, np.inf),
        Spread(np.inf, np.inf, np.inf, 2),
        np.nan,
        np.nan,
        np.nan,
        0,
        0,
    ),
]


def test_csv_has_all_digits() -> None:
    head, first, second = csv.reader(io.StringIO(as_csv(ROWS).decode()))
    assert head[:4] == ["planner", "problem", "n", "proven"] and len(set(head)) == 13
    assert first[:4] == ["[A] & B_1 50%", "p_1", "4", "3"]
    numbers = [1234.5, 900.25, 2000.125, 4 / 3, 1.0, 2.0, 24690.0, 51.5, 0.25]
    assert [float(cell) for cell in first[4:]] == numbers
    unknown = ["", "", ""]  # of runs that were given
    assert second == ["C (given)", "q, {a}", "2", "0", "inf", "1000000.0", *["inf"] * 4, *unknown]


def test_latex_has_a_row_per_planner_and_problem() -> None:
    text = as_latex(ROWS, "evoexp compare x\ny", 0.95).decode()
    lines = text.splitlines()
    assert lines[0] == "% made by evoexp compare x y"
    assert [line for line in lines if "rule" in line] == [r"\toprule", r"\midrule", r"\bottomrule"]
    rows = lines[lines.index(r"\midrule") + 1 : lines.index(r"\bottomrule")]
    assert rows == [
        r"{[}A] \& B\_1 50\% & p\_1 & 4 & 3 & 1234 (900--2000) & 1.333 [1, 2] \\",
        r"C (given) & q, \{a\} & 2 & 0 & $\infty$ (1000000--$\infty$) "
        r"& $\infty$ [$\infty$, $\infty$] \\",
    ]
    assert lines[2] == r"\begin{tabular}{llrrrr}" and lines[-1] == r"\end{tabular}"
