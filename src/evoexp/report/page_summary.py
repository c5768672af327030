"""The summary that a report's page carries for the home page: title, claims, runs, picture."""

import html
import json
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from evoexp.report.index import CLAIMS
from evoexp.report.page_text import Document, Verdict

HTML, MARKDOWN = "index.html", "index.md"
TELLING = ("snapshot", "scene", "motion", "stages", "operational", "posture", "path")
"""Parts of the names of figures that show what an experiment is about, the best one first."""
_SUMMARY = re.compile(r'<script type="application/json" id="summary">(.*?)</script>', re.DOTALL)
_MADE_BY = re.compile(r"^Made by `evoexp ([^`]*)`", re.MULTILINE)


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
    runs: tuple[tuple[str, str], ...] = ()  # (hash, label) of its conditions, twelve hex digits
    picture: str = ""  # file of the figure that shows best what it is about; empty if there is none

    @property
    def experiment(self) -> str:
        """Name of the experiment in its folder's name: without budget and overrides."""
        return re.split("[@+]", self.folder)[0]


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
            return _checked(folder.name, json.loads(found[1]))
    except (OSError, ValueError, KeyError, TypeError):
        pass  # nobody's page, or no page of ours
    try:
        text = (folder / MARKDOWN).read_text(encoding="utf-8")
    except (OSError, ValueError):
        return None
    title = text.partition("\n")[0].removeprefix("# ")
    made = _MADE_BY.search(text)
    command = html.unescape(made[1]) if made else ""
    return ReportSummary(folder.name, MARKDOWN, html.unescape(title) or folder.name, command)


def _checked(folder: str, data: Any) -> ReportSummary:
    """Return a summary from plain data.

    Raises:
        ValueError, KeyError, TypeError: If it is none.
    """
    texts = [data[name] for name in ("title", "command", "partial", "picture")]
    pairs = [tuple(pair) for name in ("claims", "runs", "headings") for pair in data[name]]
    words = [*texts, *(word for pair in pairs for word in pair)]
    if not all(isinstance(word, str) for word in words) or any(len(pair) != 2 for pair in pairs):
        raise ValueError(f"{folder}: no summary of a report")
    title, command, partial, picture = texts
    if not re.fullmatch(r"([\w.-]+\.(svg|png))?", picture):
        raise ValueError(f"{folder}: a picture of another folder")
    return ReportSummary(
        folder,
        HTML,
        title,
        command,
        partial,
        int(data["failed"]),
        tuple((text, place) for text, place in data["headings"]),
        tuple((text, verdict) for text, verdict in data["claims"]),
        tuple((name, label) for name, label in data["runs"] if re.fullmatch("[0-9a-f]{12}", name)),
        picture,
    )
