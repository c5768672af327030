r"""Tables as LaTeX, for `\input` in a paper; they need `\usepackage{booktabs, adjustbox}`."""

import re
from importlib import resources

import pandas as pd
import yaml

from evoexp.report.pages.page_parts import Document, Table

LONG_TEXT = 30  # letters of a cell, from which on its column breaks lines
NUMBERS = "0123456789−–∞"  # signs that numbers begin with

SIGNS: dict[str, str] = yaml.safe_load(
    resources.files("evoexp").joinpath("assets/latex_signs.yaml").read_text(encoding="utf-8")
)


def escaped(text: str) -> str:
    """Return a text that LaTeX prints as it is."""
    return "".join(SIGNS.get(sign, sign) for sign in " ".join(text.split()))


def latex_tables(document: Document) -> dict[str, bytes]:
    """Return the tables of a page, by the names of their files."""
    tables = (*document.results, *document.appendix)
    return {table.file: _latex(table, document).encode() for table in tables}


def _latex(table: Table, document: Document) -> str:
    plain = [
        [str(getattr(value, "text", value)).replace("`", "") for value in row]
        for row in (table.headers, *table.rows)
    ]
    # numbers stand to the right, long texts as paragraphs
    kinds = []
    for k, (_, *cells) in enumerate(zip(*plain, strict=True)):
        is_number = k and all(cell[:1] in NUMBERS for cell in cells if cell)
        is_long = max(map(len, cells), default=0) > LONG_TEXT
        kinds.append(r"p{0.4\linewidth}" if is_long else "r" if is_number else "l")
    headers, *rows = ([escaped(text) for text in row] for row in plain)
    style = pd.DataFrame(rows, columns=headers).style.hide(axis="index")
    lines = style.to_latex(column_format="".join(kinds), hrules=True).splitlines()
    # heading, note, and whose runs these are
    note = f" {table.note}" if table.note else ""
    caption = f"{document.title}: {table.heading}.{note} {document.provenance}".replace("`", "")
    words = f"{document.experiment or document.runs[0].hash12} {table.heading}"
    framed = [
        f"% made by {' '.join(document.command.split())}",
        f"% runs: {', '.join(run.hash12 for run in document.runs)}",
        r"\begin{table}",
        r"\centering\footnotesize",
        rf"\caption{{{escaped(caption)}}}",
        rf"\label{{tab:{'-'.join(re.findall('[a-z0-9]+', words.lower()))}}}",
        r"\begin{adjustbox}{max width=\linewidth}",  # wider ones are made smaller
        *lines,
        r"\end{adjustbox}",
        r"\end{table}",
        "",
    ]
    return "\n".join(framed)
