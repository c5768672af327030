"""Pages in HTML: reports, and the home page of them all, with papers, stored runs and a search.

A page is complete in itself, readable without scripts, offline; all values are escaped.
"""

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple
from urllib.parse import quote

from markdown_it import MarkdownIt
from markupsafe import Markup
from pydantic import Field, TypeAdapter

from evoexp.report.pages.index import CLAIMS, FAILURES, FIGURES, run_logs
from evoexp.report.pages.markdown import asset, environment
from evoexp.report.pages.page_parts import Document, Table, Verdict

HTML = "index.html"
FEW = 3  # failures named at the top
FEW_CLAIMS = 5  # shown at the top before the others unfold
FEW_SENTENCES = 2  # of an introduction, likewise
FEW_COLUMNS = 6  # of a table, likewise
PIXELS_PER_POINT = 4.0 / 3.0
# first words of verdicts, in order
VERDICTS = ("reproduced", "practically", "depends", "contradicted", "undecided", "not")
TELLING = ("snapshot", "motion", "stages", "operational", "posture", "path", "solution")
"""Parts of the names of figures that show what an experiment is about, the best one first."""
NO_VALUE = ("–", "")  # cells of a column of numbers that hold none
LONGEST_NUMBER = 48  # characters of a cell that is still a number, with its interval and unit
_SIZES = [re.compile(rb'<svg [^>]*?\b%s="([\d.]+)pt"' % side) for side in (b"width", b"height")]
_SENTENCE = re.compile(r"(?<=[.!?]) (?=[A-Z])")
_NUMBER = re.compile(r"[-−]?(\d[\d.]*(e[-+−]?\d+)?|∞)($|[ \[%°])")
_HASH = re.compile("<code>([0-9a-f]{12})</code>")
_COUNT = re.compile(r"\s\(n\s=\s\d+\)")  # behind a condition in the head of a table


READER = MarkdownIt("zero").enable("backticks")  # knows code alone: all else in a text is as it is


def html_page(document: Document, pictures: Mapping[str, bytes]) -> bytes:
    """Return a page as HTML, with the sizes of its pictures; the same text gives the same bytes."""
    sections = tuple(_places(document, pictures))
    figures = [figure for section in sections for figure in section["figures"]]
    headings = [(section["heading"], section["anchor"]) for section in sections]
    with_picture = [each for each in figures if each["file"]]
    face = min(with_picture, key=lambda each: telling_rank(each["file"]), default=None)
    played = [run.key for each in (face, *figures) if each for run in each["figure"].plays]
    cells = [(str(row[0]), cell) for row in document.rows_below(CLAIMS) for cell in row]
    claims = [(text, cell) for text, cell in cells if isinstance(cell, Verdict)]
    sentences = [(text, verdict.text) for text, verdict in claims if not verdict.is_ours]
    questions = [(text, verdict.text) for text, verdict in claims if verdict.is_ours]
    told = _SENTENCE.split(document.introduction)
    introduction = told[:FEW_SENTENCES], told[FEW_SENTENCES:]
    summary = {  # that the page carries for the home page
        "title": document.title,
        "command": document.command.removeprefix("evoexp "),
        "partial": dict(document.notices).get("Partial results", ""),
        "failed": sum(len(run.failures) for run in document.runs),
        "headings": [*headings, *((each["figure"].title, each["anchor"]) for each in figures)],
        "claims": sentences,
        "questions": questions,
        "rules": [(text, verdict.rule) for text, verdict in claims],
        "runs": [[run.hash12, run.label] for run in document.runs],
        "picture": face["file"] if face else "",
    }
    return written(
        "report_page.html",
        {run.hash12: run.label for run in document.runs},
        document=document,
        sections=sections,
        introduction=[" ".join(part) for part in introduction],
        tallies=tallies(sentences, questions),
        claims_heading=CLAIMS,
        few_claims=FEW_CLAIMS,
        face=face,
        motion=next((document.players[key] for key in played if key in document.players), None),
        run_logs=run_logs,
        failures=document.rows_below(FAILURES),
        failures_anchor=dict(headings).get(FAILURES, ""),
        few=FEW,
        summary=script_json(summary),
    )


def telling_rank(name: str) -> int:
    """Return the place of a figure among those that tell what an experiment is about; 0: best."""
    return next((k for k, word in enumerate(TELLING) if word in name), len(TELLING))


def tallies(
    sentences: Iterable[Sequence[str]], questions: Iterable[Sequence[str]]
) -> tuple[tuple[str, tuple[tuple[str, int], ...]], ...]:
    """Return (whose claims, verdict counts) of a paper's (text, verdict) and of ours."""
    whose = {"The paper's sentences": sentences, "Our questions": questions}
    counted = ((name, verdict_counts(verdict for _, verdict in own)) for name, own in whose.items())
    return tuple((name, counts) for name, counts in counted if counts)


def verdict_counts(verdicts: Iterable[str]) -> tuple[tuple[str, int], ...]:
    """Return how often each verdict was given, without the reasons in brackets, in one order."""
    counts = Counter(verdict.split(" (")[0] for verdict in verdicts)
    order = {word: rank for rank, word in enumerate(VERDICTS)}
    return tuple(
        sorted(counts.items(), key=lambda each: (order.get(verdict_class(each[0]), 9), each[0]))
    )


def _places(document: Document, pictures: Mapping[str, bytes]) -> Iterator[dict[str, Any]]:
    """Yield sections and their figures with their addresses on the page, for its template."""
    taken: Counter[str] = Counter({"commands": 1, "content": 1})

    def anchor(name: str) -> str:
        """Return an address on the page that no other place has."""
        slug = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "part"
        taken[slug] += 1
        return slug if taken[slug] == 1 else f"{slug}--{taken[slug]}"

    def place(heading: str, table: Table | None) -> dict[str, Any]:
        return {"heading": heading, "anchor": anchor(heading), "table": table, "figures": []}

    yield from (place(table.heading, table) for table in document.results)
    if document.figures:
        section = place(FIGURES, None)
        for figure in document.figures:
            file = document.picture(figure, "svg", "png")
            head = pictures.get(file, b"")[:2000]
            sides = [side.search(head) for side in _SIZES]  # width and height [pt]
            pixels = [round(float(side[1]) * PIXELS_PER_POINT) for side in sides if side]
            own = {"figure": figure, "anchor": anchor(figure.stem), "file": file, "size": pixels}
            section["figures"].append(own)
        yield section
    yield from (place(table.heading, table) for table in document.appendix)


def written(template: str, runs: Mapping[str, str] | None = None, **values: Any) -> bytes:
    """Return a page by its template in `assets/site`, filled with values.

    Codes that name the hash of a run, and heads of tables that name its label, link to its place.
    """
    known = frozenset(runs or {})
    places = {label: name for name, label in reversed(list((runs or {}).items()))}

    def label(text: object) -> Markup:
        """Return the head of a row or column; a label may have its number of runs behind it."""
        name = places.get(_COUNT.sub("", str(text)))
        if name is None:
            return inline(str(text), known)
        return Markup('<a href="#run-{}">{}</a>').format(name, inline(str(text)))

    page = environment().get_template(template)
    text = page.render(
        inline=lambda value: inline(str(value), known),
        label=label,
        few_columns=FEW_COLUMNS,
        is_verdict=lambda value: isinstance(value, Verdict),
        verdict_class=verdict_class,
        number_columns=number_columns,
        style=Markup(asset("site.css")),
        script=Markup(asset("site.js")),
        **values,
    )
    return text.lstrip("\n").encode()


def inline(text: str, hashes: frozenset[str] = frozenset()) -> Markup:
    """Return anybody's text as HTML: words between grave accents as code, all else as it is."""

    def linked(code: re.Match[str]) -> str:
        return f'<a href="#run-{code[1]}">{code[0]}</a>' if code[1] in hashes else code[0]

    return Markup(_HASH.sub(linked, READER.renderInline(text)))


def script_json(value: Any) -> Markup:
    """Return data for a script element: nothing in it can end the element."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), sort_keys=True)
    return Markup(text.replace("<", "\\u003c"))


def verdict_class(verdict: str) -> str:
    """Return the class of a verdict's badge: its first word."""
    return re.split("[^a-z]", verdict, maxsplit=1)[0]


def number_columns(headers: Sequence[str], rows: Sequence[Sequence[object]]) -> Mapping[int, bool]:
    """Return position → whether every cell of a column begins with a number, or has no value."""
    columns = [[str(row[k]) for row in rows] for k in range(len(headers))]
    known = [[text for text in own if text not in NO_VALUE] for own in columns]
    return {
        k: bool(own) and all(len(text) <= LONGEST_NUMBER and _NUMBER.match(text) for text in own)
        for k, own in enumerate(known)
    }


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
    rules: tuple[tuple[str, str], ...] = ()  # (text of a claim, name of its rule)

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
        judged = (*each.claims, *each.questions)
        entries = [
            ("report", each.title, ""),
            *(("heading", text, place) for text, place in each.headings if text not in USUAL),
            *((f"claim, {verdict}", text, "claims") for text, verdict in judged),
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
    others = [each for each in found if not any(each in several for several in owned.values())]
    names = {name for paper in papers for name in paper.experiments}
    elsewhere = {name for name in names if not any(paper.has(name) for paper in papers)}
    arenas = [each for each in others if not each.is_comparison]
    drawn = {each.experiment for each in arenas}
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


def _judged_once(paper: Paper, reports: Sequence[ReportSummary]) -> Iterator[ReportSummary]:
    """Yield reports with the claims that none before judges, on the same runs or in one sentence.

    The page of readings comes first: what it judges counts there alone.
    """
    readings = f"{paper.name}_claims"
    order = list(dict.fromkeys((readings, *paper.claims, *(each.folder for each in reports))))
    known, judged = set[str](), dict[str, set[str]]()  # sentences; rule → the runs it is judged on
    every = {name for each in reports for name, _ in each.runs}
    for each in sorted(reports, key=lambda report: order.index(report.folder)):
        rules, runs = dict(each.rules), {name for name, _ in each.runs}
        told = [text for text, _ in (*each.claims, *each.questions)]
        new = {text for text in told if runs - judged.get(rules.get(text, text), set())} - known
        claims = tuple(claim for claim in each.claims if claim[0] in new)
        questions = tuple(claim for claim in each.questions if claim[0] in new)
        yield each._replace(claims=claims, questions=questions)
        known |= new
        for rule in rules.values():
            judged.setdefault(rule, set()).update(every if each.folder == readings else runs)


def _card(paper: Paper, reports: Sequence[ReportSummary]) -> dict[str, Any]:
    """Return the card of a paper; its claims are those of whole experiments, not of variants."""
    whole = [each for each in reports if each.folder == each.experiment]
    drawn, shown = {each.folder for each in whole}, {each.experiment for each in reports}
    names, judged = (*paper.experiments, *paper.claims), list(_judged_once(paper, whole))
    return {
        "paper": paper,
        # the report whose figure is shown
        "face": min(
            (each for each in whole or reports if each.picture),
            key=lambda each: (telling_rank(each.picture), -len(each.claims), each.folder),
            default=None,
        ),
        "tallies": tallies(
            [claim for each in judged for claim in each.claims],
            [claim for each in judged for claim in each.questions],
        ),
        # claims of experiments without a report at the paper's budget
        "unjudged": sum(count for name, count in paper.claims.items() if name not in drawn),
        "reports": reports,
        # experiments without a report
        "missing": sorted({name for name in names if paper.has(name)} - shown),
    }
