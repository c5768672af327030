"""Builds a report; no other module of it writes its files."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from evoexp.condition import Condition
from evoexp.report.pages import markdown
from evoexp.report.pages.html_page import HTML, html_page
from evoexp.report.pages.index import document
from evoexp.report.pages.latex_tables import latex_tables
from evoexp.report.pages.page_builder import page_of
from evoexp.report.pages.page_parts import Drawing, Page
from evoexp.report.pages.page_values import players_of
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
    num_replicates: int | None  # planned for every condition; None: as many as each one has
    # What was asked for, as words of the command line: "rana_planar budget=smoke"; hashes if empty
    arguments: str = ""
    # Label → the options that were taken; None: those that the runs' manifests name
    options: Mapping[str, tuple[Option, ...]] | None = None
    command: str = "report"  # that draws it

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
        return results._replace(as_written="+" not in self.report_name)

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
                "failed": c.failed,
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
