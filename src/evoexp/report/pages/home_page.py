"""The home page of all reports: papers, other reports, stored runs, and a search over them."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple
from urllib.parse import quote

from pydantic import Field, TypeAdapter

from evoexp.report.pages.html_page import HTML, script_json, tallies, telling_rank, written

MAX_LINKS = 3  # reports named beside a run
FROM_HOME = "?home"  # tells a report that it can link back
COMPARE = "compare"
USUAL = {"Conditions", "Results", "Claims", "Motions", "Figures", "Parameters", "Failures"}
"""Headings of nearly every report, which nobody looks for."""
_SUMMARY = re.compile(r'<script type="application/json" id="summary">(.*?)</script>', re.DOTALL)

Hash = Annotated[str, Field(pattern="^[0-9a-f]{12}$")]
Picture = Annotated[str, Field(pattern=r"^([\w.-]+\.(svg|png))?$")]  # in the report's own folder


class ReportSummary(NamedTuple):
    """A report that is there, as its page says."""

    folder: str  # its name under `reports`
    title: str  # heading
    command: str = ""  # that draws it, without `evoexp`; empty where it is not known
    partial: str = ""  # the remark that results are missing; empty if none is
    failed: int = 0  # number of failed replicates
    # (text, place on the page) of its sections and figures
    headings: tuple[tuple[str, str], ...] = ()
    claims: tuple[tuple[str, str], ...] = ()  # (text, verdict) of the paper's sentences
    questions: tuple[tuple[str, str], ...] = ()  # (text, verdict) of questions of ours
    runs: tuple[tuple[Hash, str], ...] = ()  # (hash, label) of its conditions
    picture: Picture = ""  # the figure that shows best what it is about; empty if there is none

    @property
    def experiment(self) -> str:
        """Name of the experiment in its folder's name: without budget and overrides."""
        return re.split("[@+]", self.folder)[0]

    def url(self, place: str = "") -> str:
        """Return its address, or that of a place in it, relative to the home page."""
        return f"{quote(self.folder)}/{HTML}{FROM_HOME}" + f"#{place}" * bool(place)

    @property
    def picture_url(self) -> str:
        """The address of its picture."""
        return f"{quote(self.folder)}/{quote(self.picture)}"

    @property
    def is_comparison(self) -> bool:
        """Whether `evoexp compare` draws it."""
        return self.command.split(" ")[0] == COMPARE


_REPORT = TypeAdapter(ReportSummary)


class Paper(NamedTuple):
    """A paper that is reproduced."""

    name: str  # the names of its experiments begin with it
    title: str  # authors and year
    subtitle: str  # what it is about
    experiments: tuple[str, ...]  # names of its experiments
    claims: dict[str, int]  # experiment → number of claims that it judges

    def has(self, experiment: str) -> bool:
        """Whether an experiment is one of this paper's, by its name."""
        return experiment == self.name or experiment.startswith(f"{self.name}_")


class StoredRun(NamedTuple):
    """A stored run."""

    hash12: str  # the twelve hex digits that name it
    experiment: str  # that it belongs to; empty if that is not known
    label: str  # of its condition; empty if that is not known
    budget: str  # empty if that is not known
    done: int  # finished replicates
    planned: int  # planned replicates
    failed: int  # failed replicates
    damage: str = ""  # what is wrong with it; empty if nothing is

    @property
    def state(self) -> str:
        """Done, partial, planned, failed or damaged, in words."""
        if self.damage:
            return "damaged"
        if self.failed:
            return "failed"
        if self.done >= self.planned:
            return "done"
        return "partial" if self.done else "planned"


def read_summary(folder: Path) -> ReportSummary | None:
    """Return the summary of a report's folder; None if it holds no report."""
    try:
        text = (folder / HTML).read_text(encoding="utf-8")
        if found := _SUMMARY.search(text):
            return _REPORT.validate_python({"folder": folder.name, **json.loads(found[1])})
    except (OSError, ValueError, TypeError):
        pass  # nobody's page, or no page of ours
    return None


def summaries(reports: Path) -> list[ReportSummary]:
    """Return the summaries of all reports in a folder, by the names of their folders."""
    folders = sorted(each for each in reports.glob("[!.]*") if each.is_dir())
    return [found for folder in folders if (found := read_summary(folder)) is not None]


def home_page(
    found: Sequence[ReportSummary], papers: Sequence[Paper], runs: Sequence[StoredRun]
) -> bytes:
    """Return the home page; the same reports and runs give the same bytes."""
    search = list[dict[str, Any]]()  # the entries that the search looks through
    for each in found:
        entries = [
            ("report", each.title, ""),
            *(("heading", text, place) for text, place in each.headings if text not in USUAL),
            *(
                (f"claim, {verdict}", text, "claims")
                for text, verdict in (*each.claims, *each.questions)
            ),
            *(("run", f"{name} {label}", f"run-{name}") for name, label in each.runs),
        ]
        search += [
            {"text": text, "kind": kind, "report": each.folder, "url": each.url(place)}
            for kind, text, place in entries
        ]
    content = site(found, papers, runs)
    return written("home_page.html", site=content, search=script_json(search))


def site(
    found: Sequence[ReportSummary], papers: Sequence[Paper], runs: Sequence[StoredRun]
) -> dict[str, Any]:
    """Return the content of the home page, by the names that its template has."""
    owned = {
        paper.name: [r for r in found if paper.has(r.experiment) and not r.is_comparison]
        for paper in papers
    }
    of_papers = {each.folder for several in owned.values() for each in several}
    others = [each for each in found if each.folder not in of_papers]
    drawn = {each.experiment for each in others if not each.is_comparison}
    names = {name for paper in papers for name in paper.experiments}
    elsewhere = {name for name in names if not any(paper.has(name) for paper in papers)}
    arenas = [each for each in others if not each.is_comparison]
    groups: tuple[tuple[str, list[ReportSummary], list[str]], ...] = (
        ("Arenas and other experiments", arenas, sorted(elsewhere - drawn)),
        ("Comparisons", [each for each in others if each.is_comparison], []),
    )
    return {
        "num_reports": len(found),
        "partial": [each for each in found if each.partial],
        "unfinished": sum(run.state != "done" for run in runs),
        "papers": [_card(paper, owned[paper.name]) for paper in papers],
        "others": [group for group in groups if group[1] or group[2]],
        "runs": [
            (run, [each for each in found if run.hash12 in dict(each.runs)][:MAX_LINKS])
            for run in runs
        ],
    }


def _card(paper: Paper, reports: Sequence[ReportSummary]) -> dict[str, Any]:
    """Return the card of a paper; its claims are those of whole experiments, not of variants."""
    whole = [each for each in reports if each.folder == each.experiment]
    drawn, shown = {each.folder for each in whole}, {each.experiment for each in reports}
    names = (*paper.experiments, *paper.claims)
    return {
        "paper": paper,
        # the report whose figure is shown
        "face": min(
            (each for each in whole or reports if each.picture),
            key=lambda each: (telling_rank(each.picture), -len(each.claims), each.folder),
            default=None,
        ),
        "tallies": tallies(
            [claim for each in whole for claim in each.claims],
            [claim for each in whole for claim in each.questions],
        ),
        # claims of experiments without a report at the paper's budget
        "unjudged": sum(count for name, count in paper.claims.items() if name not in drawn),
        "reports": reports,
        # experiments without a report
        "missing": sorted({name for name in names if paper.has(name)} - shown),
    }
