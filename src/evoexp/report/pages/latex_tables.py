r"""Tables as LaTeX, for `\input` in a paper; they need `\usepackage{booktabs}`."""

import re
from importlib import resources

import pandas as pd
import yaml

from evoexp.report.pages.page_parts import Document, Table

LONG_TEXT = 30  # letters of a cell, from which on its column breaks lines
NARROWEST = 14  # letters of a line in such a column
BETWEEN = 3  # letters that the space between two columns takes
NUMBERS = "0123456789−–∞"  # signs that numbers begin with
SIZES = {"small": 84, "footnotesize": 94, "scriptsize": 108}
"""Size of the type → its letters in a line of 345 pt, the width of LaTeX's own classes."""

SIGNS: dict[str, str] = yaml.safe_load(
    resources.files("evoexp").joinpath("assets/latex_signs.yaml").read_text(encoding="utf-8")
)


def escaped(text: str) -> str:
    """Return a text that LaTeX prints as it is."""
    return "".join(SIGNS.get(sign, sign) for sign in " ".join(text.split()))


def latex_tables(document: Document) -> dict[str, bytes]:
    """Return the tables of a page, by the names of their files."""
    return {t.file: _latex(t, document).encode() for t in document.tables if t.file}


def _latex(table: Table, document: Document) -> str:
    size, columns, fits = _layout(table)
    headers, *rows = (
        [escaped(_plain(each)) for each in row] for row in (table.headers, *table.rows)
    )
    style = pd.DataFrame(rows, columns=headers).style.hide(axis="index")
    lines = style.to_latex(column_format=columns, hrules=True).splitlines()
    # heading, note, and whose runs these are
    note = f" {table.note}" if table.note else ""
    caption = f"{document.title}: {table.heading}.{note} {document.provenance}".replace("`", "")
    words = f"{document.experiment or document.runs[0].hash12} {table.heading}"
    framed = [
        f"% made by {' '.join(document.command.split())}",
        f"% runs: {', '.join(run.hash12 for run in document.runs)}",
        *([] if fits else [r"% wider than a line, so made smaller: needs \usepackage{graphicx}"]),
        r"\begin{table}",
        rf"\centering\{size}",
        rf"\caption{{{escaped(caption)}}}",
        rf"\label{{tab:{'-'.join(re.findall('[a-z0-9]+', words.lower()))}}}",
        *([] if fits else [r"\resizebox{\linewidth}{!}{%"]),
        *lines[:-1],
        lines[-1] + "}" * (not fits),
        r"\end{table}",
        "",
    ]
    return "\n".join(framed)


def _layout(table: Table) -> tuple[str, str, bool]:
    """Return the size of the type, how columns stand, and whether all of it fits on a line.

    Numbers stand to the right, long texts as paragraphs in the room that the others leave.
    """
    cells = [[_plain(row[k]) for row in table.rows] for k in range(len(table.headers))]
    longest = [max(map(len, column), default=0) for column in cells]
    wide = [k for k, letters in enumerate(longest) if letters > LONG_TEXT]
    heads = [len(_plain(header)) for header in table.headers]
    taken = BETWEEN * len(cells) + sum(
        max(letters, heads[k]) for k, letters in enumerate(longest) if k not in wide
    )
    room = {size: letters - taken for size, letters in SIZES.items()}
    fitting = [size for size, letters in room.items() if letters >= NARROWEST * len(wide)]
    size = fitting[0] if fitting else next(iter(SIZES))
    letters = max(room[size] // max(len(wide), 1), NARROWEST)
    share = letters / SIZES[size]
    numbers = [all(cell[:1] in NUMBERS for cell in column if cell) for column in cells]
    kinds = [
        rf"p{{{share:.2f}\linewidth}}" if k in wide else "r" if k and numbers[k] else "l"
        for k in range(len(cells))
    ]
    return size, "".join(kinds), bool(fitting)


def _plain(value: object) -> str:
    return str(getattr(value, "text", value)).replace("`", "")
