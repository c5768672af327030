"""The table of a comparison as CSV for spreadsheets, and as LaTeX for papers."""

from collections.abc import Sequence

import pandas as pd

from evoexp.report.pages import markdown
from evoexp.report.pages.comparison import Rated, effort_text
from evoexp.report.pages.latex_tables import escaped, tabular

HEADERS = (
    "planner",
    "problem",
    "$n$",
    "proven",
    r"queries per proven answer ({level}\,\%)",
    "length [quartiles]",
)


def as_csv(rows: Sequence[Rated]) -> bytes:
    """Return the table as CSV, numbers with all digits, `inf` where there is no proven answer.

    Columns: planner, problem, n (runs), proven (runs with a proven answer), effort (expected
    running time [collision queries]) with its interval, length (median [rad, m]) with quartiles;
    body_queries (the effort in pairs of shapes), evaluations and cpu_s (expected to a proven
    answer, as the effort is), empty where they are not known.
    """
    table = pd.DataFrame(
        {
            "planner": row.planner,
            "problem": row.problem,
            "n": row.runs,
            "proven": row.proven,
            "effort": row.queries,
            "effort_low": row.interval.low,
            "effort_high": row.interval.high,
            "length": row.lengths.median,
            "length_lower": row.lengths.lower,
            "length_upper": row.lengths.upper,
            "body_queries": row.queries * row.body_tests,
            "evaluations": row.evaluations,
            "cpu_s": row.cpu_s,
        }
        for row in rows
    )
    return table.to_csv(index=False, lineterminator="\n").encode()


def as_latex(rows: Sequence[Rated], command: str, confidence: float) -> bytes:
    r"""Return the table as LaTeX; it needs `\usepackage{booktabs}`."""
    lines = [
        f"% made by {command.replace(chr(10), ' ')}",
        "% queries: expected running time, failed runs included; length: best proven one [rad, m]",
        *tabular(
            (head.format(level=f"{100.0 * confidence:g}") for head in HEADERS),
            map(_cells, rows),
            "llrrrr",
        ),
    ]
    return "\n".join([*lines, ""]).encode()


def _cells(row: Rated) -> tuple[str, ...]:
    effort, low, high = (_latex(effort_text(each)) for each in (row.queries, *row.interval))
    median, lower, upper = (_latex(markdown.number(value)) for value in row.lengths[:3])
    length = median if row.lengths.num_values == 1 else f"{median} [{lower}, {upper}]"
    effort = f"{effort} ({low}--{high})"
    names = escaped(row.planner), escaped(row.problem)
    return (*names, str(row.runs), str(row.proven), effort, length)


def _latex(number: str) -> str:
    return number.replace("∞", r"$\infty$").replace("–", "--")
