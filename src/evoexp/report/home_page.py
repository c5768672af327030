"""The home page of all reports: papers, other reports, stored runs, and a search over them."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from evoexp.report.html_page import verdict_counts
from evoexp.report.page_summary import HTML, ReportSummary, read_summary, telling_rank
from evoexp.report.page_templates import script_json, written

MAX_LINKS = 3  # reports named beside a run
FROM_HOME = "?home"  # tells a report that it can link back
COMPARE = "compare"
USUAL = {"Conditions", "Results", "Claims", "Motions", "Figures", "Parameters", "Failures"}
"""Headings of nearly every report, which nobody looks for."""


class Paper(NamedTuple):
    """A paper that is reproduced."""

    name: str  # the names of its experiments begin with it
    title: str  # authors and year
    subtitle: str  # what it is about
    experiments: tuple[str, ...]  # names of its experiments
    claims: dict[str, int]  # experiment → number of claims that it judges


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


class Link(NamedTuple):
    """A link to a report."""

    text: str  # name of its folder
    url: str  # relative to the home page
    partial: bool = False  # whether results are missing
    failed: int = 0  # number of failed replicates
    detail: str = ""  # its title


class Picture(NamedTuple):
    """A figure of a report: its file, and the report that it leads to."""

    file: str
    url: str
    text: str


class PaperCard(NamedTuple):
    """A paper on the home page."""

    title: str  # authors and year
    subtitle: str  # what it is about
    picture: Picture | None  # of one of its reports; None if none has any
    # (verdict, number of claims), over the reports of its experiments
    counts: tuple[tuple[str, int], ...]
    unjudged: int  # claims of experiments without a report at the paper's budget
    links: tuple[Link, ...]  # to its reports
    missing: tuple[str, ...]  # experiments without a report


class Site(NamedTuple):
    """The content of the home page."""

    num_reports: int  # of all reports
    partial: tuple[Link, ...]  # links to those whose results are not complete
    num_earlier: int  # reports of an earlier version, of which only the title is known
    unfinished: int  # runs of which planned replicates are missing, or failed
    papers: tuple[PaperCard, ...]  # one card each
    others: tuple[tuple[str, tuple[Link, ...]], ...]  # (heading, links): reports of no paper
    runs: tuple[tuple[StoredRun, tuple[Link, ...]], ...]  # stored runs with links to reports


def summaries(reports: Path) -> list[ReportSummary]:
    """Return the summaries of all reports in a folder, by the names of their folders."""
    folders = sorted(each for each in reports.glob("[!.]*") if each.is_dir())
    return [found for folder in folders if (found := read_summary(folder)) is not None]


def home_page(
    found: Sequence[ReportSummary], papers: Sequence[Paper], runs: Sequence[StoredRun]
) -> bytes:
    """Return the home page; the same reports and runs give the same bytes."""
    content = site(found, papers, runs)
    return written("home_page.html", site=content, search=script_json(list(_search(found))))


def site(
    found: Sequence[ReportSummary], papers: Sequence[Paper], runs: Sequence[StoredRun]
) -> Site:
    """Return the content of the home page; see `home_page`."""
    owned = {paper.name: [r for r in found if _is_of(paper, r)] for paper in papers}
    of_papers = {each.folder for several in owned.values() for each in several}
    others = [each for each in found if each.folder not in of_papers]
    compared = [each for each in others if each.command.split(" ")[0] == COMPARE]
    rest = [each for each in others if each not in compared]
    groups = (("Arenas and other experiments", rest), ("Comparisons", compared))
    return Site(
        len(found),
        tuple(_link(each) for each in found if each.partial),
        sum(each.file != HTML for each in found),
        sum(run.state != "done" for run in runs),
        tuple(_card(paper, owned[paper.name]) for paper in papers),
        tuple((name, tuple(map(_link, each))) for name, each in groups if each),
        tuple((run, tuple(_links(run, found))) for run in runs),
    )


def _is_of(paper: Paper, report: ReportSummary) -> bool:
    return _begins(report.experiment, paper.name) and report.command.split(" ")[0] != COMPARE


def _begins(experiment: str, name: str) -> bool:
    return experiment == name or experiment.startswith(f"{name}_")


def _card(paper: Paper, reports: Sequence[ReportSummary]) -> PaperCard:
    """Return the card of a paper; its claims are those of whole experiments, not of variants."""
    whole = [each for each in reports if each.folder == each.experiment]
    drawn, shown = {each.folder for each in whole}, {each.experiment for each in reports}
    names = (*paper.experiments, *paper.claims)
    pictured = min(
        (each for each in whole or reports if each.picture),
        key=lambda each: (telling_rank(each.picture), -len(each.claims), each.folder),
        default=None,
    )
    return PaperCard(
        paper.title,
        paper.subtitle,
        _picture(pictured) if pictured else None,
        verdict_counts([verdict for each in whole for _, verdict in each.claims]),
        sum(count for name, count in paper.claims.items() if name not in drawn),
        tuple(map(_link, reports)),
        tuple(sorted({name for name in names if _begins(name, paper.name)} - shown)),
    )


def _picture(report: ReportSummary) -> Picture:
    return Picture(f"{quote(report.folder)}/{quote(report.picture)}", _url(report), report.folder)


def _link(report: ReportSummary) -> Link:
    return Link(report.folder, _url(report), bool(report.partial), report.failed, report.title)


def _url(report: ReportSummary, place: str = "") -> str:
    """Return the address of a report, or of a place in it."""
    if report.file != HTML:
        return f"{quote(report.folder)}/{report.file}"
    return f"{quote(report.folder)}/{HTML}{FROM_HOME}" + f"#{place}" * bool(place)


def _links(run: StoredRun, found: Iterable[ReportSummary]) -> Iterator[Link]:
    """Yield links to a run's place in the reports that show it, at most `MAX_LINKS`."""
    shown = [each for each in found if run.hash12 in dict(each.runs)]
    for each in shown[:MAX_LINKS]:
        yield Link(each.folder, _url(each, f"run-{run.hash12}"))


def _search(found: Iterable[ReportSummary]) -> Iterator[dict[str, Any]]:
    """Yield the entries that the search looks through."""
    for each in found:
        yield _entry(each, "report", each.title)
        for heading, place in each.headings:
            if heading not in USUAL:
                yield _entry(each, "heading", heading, place)
        for text, verdict in each.claims:
            yield _entry(each, f"claim, {verdict}", text, "claims")
        for name, label in each.runs:
            yield _entry(each, "run", f"{name} {label}", f"run-{name}")


def _entry(report: ReportSummary, kind: str, text: str, place: str = "") -> dict[str, Any]:
    return {"text": text, "kind": kind, "report": report.folder, "url": _url(report, place)}
