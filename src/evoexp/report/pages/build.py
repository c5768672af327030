r"""Builds a report, with its tables as LaTeX; no other module of it writes its files.

Tables are for `\input` in a paper of one column or two; they need `PACKAGES`. A table whose lines
fit into one of two columns is a `table`. Any other one is a `table*` with broken lines, in parts if
it has more columns or rows than a page has room for.
"""

import hashlib
import json
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml

from evoexp.condition import Condition
from evoexp.records import FloatArray
from evoexp.report.pages import markdown
from evoexp.report.pages.html_page import HTML, html_page
from evoexp.report.pages.index import document
from evoexp.report.pages.page_builder import page_of
from evoexp.report.pages.page_parts import Document, Drawing, Page, Table
from evoexp.report.pages.page_values import players_of
from evoexp.report.pages.sweeps import Searched
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import Results, gather
from evoexp.shipped import Option
from evoexp.store.files import write_files
from evoexp.version import __version__

INDEX = "index.md"
_KINDS = {"b": "true or false", "i": "integer", "u": "integer", "f": "number"}


class Request(NamedTuple):
    """The conditions of a report, and the words that ask for it."""

    report_name: str  # directory under `reports`
    experiment: str  # name of the experiment; empty for runs given by their hashes
    budget: str  # name of the budget; empty for runs given by their hashes
    conditions: Sequence[tuple[str, Condition]]  # (label, condition) in the order of the experiment
    settings: ReportSettings
    num_replicates: int | None  # planned for every condition; None: each one's own
    # What was asked for, as words of the command line: "rana_planar budget=smoke"; hashes if empty
    arguments: str = ""
    # Label → the options that were taken; None: the options in the runs' manifests
    options: Mapping[str, tuple[Option, ...]] | None = None
    command: str = "report"  # that draws it
    searched: Searched | None = None  # the trials, if the conditions are those of a search

    @property
    def words(self) -> str:
        """Words of the command line that ask for this report."""
        hashes = dict.fromkeys(condition.id[:12] for _, condition in self.conditions)
        return self.arguments or " ".join(hashes)

    @property
    def hint(self) -> str:
        """The command that helps where nothing is stored."""
        if self.experiment and self.words.split(" ")[0] == self.experiment:
            return f"evoexp run experiment={self.words}"
        return f"evoexp run {self.words}" if self.arguments else f"evoexp show {self.words}"

    def results(self, outputs: Path) -> Results:
        """Read the stored results, see `gather`."""
        words = self.experiment, self.budget, self.hint
        results = gather(outputs, self.conditions, self.num_replicates, *words, self.options)
        return results._replace(as_written="+" not in self.report_name, searched=self.searched)

    def files(self, outputs: Path) -> "ReportFiles":
        """Draw the report as it follows from the outputs; nothing is written."""
        found = self.results(outputs)
        return page_files(self, page_of(found, self.settings), found)

    def write(self, outputs: Path) -> Path:
        """Draw the report and write it; return the path of its `index.html`."""
        return write_report(self.files(outputs))


class ReportFiles(NamedTuple):
    """A report before it is written."""

    directory: Path  # its folder
    files: dict[str, bytes]  # name → content


def page_files(request: Request, page: Page, found: Results) -> ReportFiles:
    """Draw a page's figures and return all its files."""
    files, settings = dict[str, bytes](), request.settings
    for drawing in page.drawings:
        files |= _drawn(drawing, settings)
    players = players_of(page.drawings, found.experiment)
    command = f"evoexp {request.command} {request.words}"
    text = document(page, found, settings, command, players)
    files |= latex_tables(text)
    files[HTML] = html_page(text, files)
    files |= {player.file: player.content for player in players.values()}
    files[INDEX] = markdown.page(text).encode()
    return ReportFiles(found.outputs / "reports" / request.report_name, files)


def write_report(report: ReportFiles) -> Path:
    """Write the files of a report and return the path of its `index.html`."""
    directory, files = report
    directory.mkdir(parents=True, exist_ok=True)
    write_files({directory / name: content for name, content in files.items()})
    for path in stale_files(report):
        path.unlink()
    return directory / HTML


def stale_files(report: ReportFiles) -> list[Path]:
    """Return the files in a report's folder that it does not have: those of an earlier one."""
    directory, files = report
    return sorted(path for path in directory.glob("[!.]*") if path.name not in files)


def _drawn(drawing: Drawing, settings: ReportSettings) -> dict[str, bytes]:
    """Return the files of one figure: pictures, data rows, sidecar."""
    from evoexp.report.figures.style import drawn

    table = drawing.table()
    look = settings.dpi, settings.width, settings.style
    images = drawn(lambda: drawing.draw(table), settings.formats, *look)
    pictures = {f"{drawing.stem}.{kind}": image for kind, image in images.items()}
    rows = table.to_csv(index=False, lineterminator="\n").encode()
    sidecar = {
        "figure": drawing.title,
        "code_version": __version__,
        "conditions": [
            {
                "label": c.label,
                "run": c.condition.id,
                "planned": c.planned,
                "done": c.done,
                "failed": len(c.failures),
                "run_code": c.code,
            }
            for c in drawing.conditions
        ],
        "data": {
            "file": f"{drawing.stem}.csv",
            "rows": len(table),
            "sha256": hashlib.sha256(rows).hexdigest(),
            # kinds of its columns, and what they hold
            "columns": {
                str(name): _KINDS.get(table[name].dtype.kind, "text") for name in table.columns
            },
            "description": drawing.columns,
        },
        "files": {name: hashlib.sha256(image).hexdigest() for name, image in pictures.items()},
    }
    text = json.dumps(sidecar, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    return pictures | {f"{drawing.stem}.csv": rows, f"{drawing.stem}.json": text.encode()}


PACKAGES = r"\usepackage{booktabs, array}"
COLUMN, PAGE = 50, 104  # letters of \footnotesize on a line of one column, of both columns
GAP = 1.2  # letters that the space between two columns of a table takes
LINES = 50  # of \footnotesize on a page, beside the rules of a table
ROW_GAP = 0.2  # lines of \footnotesize between two rows
CAPTION = 70  # letters of a caption, as high as a line of \footnotesize
LONGEST_WORD = 16  # letters; a longer word may be broken, behind a sign if it has one
WIDE_SIGNS = "[A-Zmw−∞→≤≥≈]"  # they take half as much room again as others
NUMBERS = "0123456789−–∞"  # signs that numbers begin with

SIGNS: dict[str, str] = yaml.safe_load(
    resources.files("evoexp").joinpath("assets/latex_signs.yaml").read_text(encoding="utf-8")
)

Cells = list[list[str]]


def escaped(text: str) -> str:
    """Return a text that LaTeX prints as it is; long words may be broken."""
    quoted = re.sub('"([^"]*)"', r"“\1”", _tied(text))
    words = []
    for word in quoted.split(" "):
        parts = ("".join(SIGNS.get(sign, sign) for sign in part) for part in _parts(word))
        words.append(r"\allowbreak{}".join(parts))
    return " ".join(words)


def latex_tables(document: Document) -> dict[str, bytes]:
    """Return the tables of a page, by the names of their files."""
    tables = (*document.results, *document.appendix)
    return {table.file: _latex(table, document).encode() for table in tables}


def _latex(table: Table, document: Document) -> str:
    cells = [
        [_tied(str(getattr(value, "text", value)).replace("`", "")) for value in row]
        for row in (table.headers, *table.rows)
    ]
    # heading, note, and whose runs these are
    title = f"{document.title}: {table.heading}".replace("`", "")
    caption = f"{title}. {table.note} {document.provenance}".replace("`", "")
    words = f"{document.experiment or document.runs[0].hash12} {table.heading}"
    label = f"tab:{'-'.join(re.findall('[a-z0-9]+', words.lower()))}"
    lines = [
        f"% made by {' '.join(document.command.split())}",
        f"% runs: {', '.join(run.hash12 for run in document.runs)}",
        f"% needs {PACKAGES}",
    ]
    floats = []
    for columns in _columns(cells):
        widths = _widths(columns)
        begin, end = _frame(widths, columns)
        floats += [(begin, rows, end) for rows in _pages(columns, widths, len(caption))]
    for number, (begin, rows, end) in enumerate(floats, 1):
        part = f" Part {number} of {len(floats)}." if len(floats) > 1 else ""
        name = f"{label}-{number}" if number > 1 else label
        header, *others = (" & ".join(map(escaped, row)) + r" \\" for row in rows)
        lines += [
            *begin[:2],
            rf"\caption{{{escaped(caption + part)}}}",
            rf"\label{{{name}}}",
            begin[2],
            *(r"\toprule", header, r"\midrule", *others, r"\bottomrule"),
            *end,
        ]
        caption = f"{title}."
    return "\n".join([*lines, ""])


def _tied(text: str) -> str:
    """Return a text on one line; no line ends before a % sign or a figure's number."""
    text = re.sub(r"[^\S\u00a0]+", " ", text).strip(" ")
    return re.sub(r" (?=%)|(?<=Fig\.) |(?<=Eq\.) ", "\u00a0", text)


def _parts(word: str) -> list[str]:
    if len(word) <= LONGEST_WORD:
        return [word]
    return re.findall(rf".{{1,{LONGEST_WORD - 1}}}[._/=:,]|.{{1,{LONGEST_WORD}}}", word)


def _room(text: str) -> float:
    return len(text) + len(re.findall(WIDE_SIGNS, text)) / 2


def _narrowest(cells: Cells) -> FloatArray:
    """Return the least widths of columns, in letters: those of their longest words."""

    def longest(cell: str) -> float:
        return max(_room(part) for word in cell.split(" ") for part in _parts(word))

    return np.array([GAP + max(map(longest, column)) for column in zip(*cells, strict=True)])


def _columns(cells: Cells) -> list[Cells]:
    """Return tables of as many columns as there is room for; each begins with name and unit."""
    narrowest = _narrowest(cells)
    names = [0, 1] if cells[0][1:2] == ["unit"] else [0]
    parts = [names]
    for k in range(len(names), len(narrowest)):
        if narrowest[[*parts[-1], k]].sum() > PAGE:
            parts.append(names)
        parts[-1] = [*parts[-1], k]
    return [[[row[j] for j in part] for row in cells] for part in parts]


def _widths(cells: Cells) -> FloatArray:
    """Return the widths of columns in letters, by which rows have few lines."""
    room = np.array([[_room(cell) for cell in row] for row in cells])
    room[0] /= 2.0  # headers may have two lines
    widths = _narrowest(cells)
    whole: FloatArray = np.maximum(room.max(axis=0) + GAP, widths)
    if whole.sum() <= COLUMN:
        return whole
    # letter by letter to the column that most lines wait for
    steps = np.eye(len(widths))
    while widths.sum() < PAGE - 1:
        lines = np.maximum(room / (widths + steps - GAP)[:, None], 1.0).max(axis=2).sum(axis=1)
        widths += steps[lines.argmin()]
    return widths


def _pages(cells: Cells, widths: FloatArray, caption: int) -> Iterator[Cells]:
    """Yield header and rows for each page, below a caption of so many letters."""
    heights = [
        ROW_GAP
        + max(
            len(textwrap.wrap(cell, round(1.15 * (width - GAP))))
            for cell, width in zip(row, widths, strict=True)
        )
        for row in cells
    ]
    above = heights[0] + caption / CAPTION * (PAGE / COLUMN if widths.sum() <= COLUMN else 1.0)
    rows, height = cells[:1], above
    for row, own in zip(cells[1:], heights[1:], strict=True):
        if height + own > LINES and len(rows) > 1:
            yield rows
            rows, height = cells[:1], above
        rows, height = [*rows, row], height + own
    yield rows


def _frame(widths: FloatArray, cells: Cells) -> tuple[list[str], list[str]]:
    """Return the lines that begin and end a table: `table*` if it is wider than a column."""
    is_narrow = widths.sum() <= COLUMN
    name, shares = ("table", widths / COLUMN) if is_narrow else ("table*", widths / widths.sum())
    # numbers stand to the right
    columns = []
    for k, (_, *column) in enumerate(zip(*cells, strict=True)):
        is_number = k and all(cell[:1] in NUMBERS for cell in column if cell)
        side = "left" if is_number else "right"
        width = rf"p{{\dimexpr {shares[k] - 5e-5:.4f}\linewidth-2\tabcolsep\relax}}"
        columns.append(rf">{{\ragged{side}\arraybackslash\hspace{{0pt}}}}{width}")
    begin = [
        rf"\begin{{{name}}}",
        r"\setlength{\belowcaptionskip}{4pt}\setlength{\tabcolsep}{2pt}"
        r"\setlength{\extrarowheight}{2pt}\centering\footnotesize",
        rf"\begin{{tabular}}{{{''.join(columns)}}}",
    ]
    return begin, [r"\end{tabular}", rf"\end{{{name}}}"]
