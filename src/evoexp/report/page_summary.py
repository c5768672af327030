"""The summary that a report's page carries for the home page: title, claims, runs, picture."""

import html
import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import Field, TypeAdapter

from evoexp.report.index import CLAIMS
from evoexp.report.page_text import Document, Verdict

HTML, MARKDOWN = "index.html", "index.md"
TELLING = ("snapshot", "scene", "motion", "stages", "operational", "posture", "path")
"""Parts of the names of figures that show what an experiment is about, the best one first."""
_SUMMARY = re.compile(r'<script type="application/json" id="summary">(.*?)</script>', re.DOTALL)
_MADE_BY = re.compile(r"^Made by `evoexp ([^`]*)`", re.MULTILINE)


Hash = Annotated[str, Field(pattern="^[0-9a-f]{12}$")]
Picture = Annotated[str, Field(pattern=r"^([\w.-]+\.(svg|png))?$")]  # in the report's own folder


class ReportSummary(NamedTuple):
    """A report that is there."""

    folder: str  # its name under `reports`
    file: str  # its page in the folder
    title: str  # heading
    command: str = ""  # that draws it, without `evoexp`; empty where it is not known
    partial: str = ""  # the remark that results are missing; empty if none is
    failed: int = 0  # number of failed replicates
    # (text, place on the page) of its sections and figures
    headings: tuple[tuple[str, str], ...] = ()
    claims: tuple[tuple[str, str], ...] = ()  # (text, verdict)
    runs: tuple[tuple[Hash, str], ...] = ()  # (hash, label) of its conditions
    picture: Picture = (
        ""  # file of the figure that shows best what it is about; empty if there is none
    )

    @property
    def experiment(self) -> str:
        """Name of the experiment in its folder's name: without budget and overrides."""
        return re.split("[@+]", self.folder)[0]


_REPORT = TypeAdapter(ReportSummary)


def summary_of(document: Document, places: Iterable[tuple[str, str]]) -> dict[str, Any]:
    """Return the summary of a page as plain data."""
    claims = document.section(CLAIMS)
    figures = [figure for section in document.sections for figure in section.figures]
    names = [name for each in figures if (name := each.picture("svg", "png"))]
    ranked = sorted(names, key=telling_rank)
    partial = [n.text for n in document.notices if n.title == "Partial results"]
    return {
        "title": document.title,
        "command": document.command.removeprefix("evoexp "),
        "partial": "".join(partial),
        "failed": sum(run.failed for run in document.runs),
        "headings": [list(place) for place in places],
        "claims": [
            [str(row[0]), cell.text]
            for row in (claims.table.rows if claims and claims.table else ())
            for cell in row
            if isinstance(cell, Verdict)
        ],
        "runs": [[run.hash12, run.label] for run in document.runs],
        "picture": ranked[0] if ranked else "",
    }


def telling_rank(name: str) -> int:
    """Return the place of a figure among those that tell what an experiment is about; 0: best."""
    return next((k for k, word in enumerate(TELLING) if word in name), len(TELLING))


def read_summary(folder: Path) -> ReportSummary | None:
    """Return the summary of a report's folder; None if it holds no report.

    A report of an earlier version, which has no HTML page, has only a title and its command.
    """
    try:
        found = _SUMMARY.search((folder / HTML).read_text(encoding="utf-8"))
        if found:
            named = {"folder": folder.name, "file": HTML, **json.loads(found[1])}
            return _REPORT.validate_python(named)
    except (OSError, ValueError, TypeError):
        pass  # nobody's page, or no page of ours
    try:
        text = (folder / MARKDOWN).read_text(encoding="utf-8")
    except (OSError, ValueError):
        return None
    title = text.partition("\n")[0].removeprefix("# ")
    made = _MADE_BY.search(text)
    command = html.unescape(made[1]) if made else ""
    return ReportSummary(folder.name, MARKDOWN, html.unescape(title) or folder.name, command)
