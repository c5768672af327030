"""The table of a comparison as CSV for spreadsheets, and as LaTeX for papers."""

import csv
import io
import math
from collections.abc import Sequence

from evoexp.report import markdown
from evoexp.report.latex_tables import escaped
from evoexp.report.pages.comparison import Rated, effort_text

COLUMNS = (
    "planner",
    "problem",
    "n",
    "proven",
    "effort",
    "effort_low",
    "effort_high",
    "length",
    "length_lower",
    "length_upper",
    "body_queries",
    "evaluations",
    "cpu_s",
)


def as_csv(rows: Sequence[Rated]) -> bytes:
    """Return the table as CSV, numbers with all digits, `inf` where there is no proven answer.

    Columns: planner, problem, n (runs), proven (runs with a proven answer), effort (expected
    running time [collision queries]) with its interval, length (median [rad, m]) with quartiles;
    body_queries (the effort in pairs of shapes), evaluations and cpu_s (expected to a proven
    answer, as the effort is), empty where they are not known.
    """
    file = io.StringIO(newline="")
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows:
        others = row.queries * row.body_tests, row.evaluations, row.cpu_s
        numbers = (row.queries, *row.interval, *row.lengths[:3], *others)
        cells = ("" if math.isnan(value) else repr(float(value)) for value in numbers)
        writer.writerow((row.planner, row.problem, row.runs, row.proven, *cells))
    return file.getvalue().encode()


def as_latex(rows: Sequence[Rated], command: str, confidence: float) -> bytes:
    r"""Return the table as LaTeX; it needs `\usepackage{booktabs}`.

    Args:
        rows: Of the table.
        command: That makes it, for a comment above it.
        confidence: Level of the interval.
    """
    level = f"{100.0 * confidence:g}"
    head = (
        "planner",
        "problem",
        "$n$",
        "proven",
        rf"queries per proven answer ({level}\,\%)",
        "length [quartiles]",
    )
    lines = [
        f"% made by {command.replace(chr(10), ' ')}",
        "% queries: expected running time, failed runs included; length: best proven one [rad, m]",
        r"\begin{tabular}{llrrrr}",
        r"\toprule",
        " & ".join(head) + r" \\",
        r"\midrule",
        *(" & ".join(_cells(row)) + r" \\" for row in rows),
        r"\bottomrule",
        r"\end{tabular}",
        "",
    ]
    return "\n".join(lines).encode()


def _cells(row: Rated) -> tuple[str, ...]:
    effort, low, high = (_latex(effort_text(each)) for each in (row.queries, *row.interval))
    median, lower, upper = (_latex(markdown.number(value)) for value in row.lengths[:3])
    length = median if row.lengths.num_values == 1 else f"{median} [{lower}, {upper}]"
    effort = f"{effort} ({low}--{high})"
    names = escaped(row.planner), escaped(row.problem)
    return (*names, str(row.runs), str(row.proven), effort, length)


def _latex(number: str) -> str:
    return number.replace("∞", r"$\infty$").replace("–", "--")
