"""A page in HTML: complete in itself, readable without scripts, offline; all values are escaped."""

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from markdown_it import MarkdownIt
from markupsafe import Markup

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
TELLING = ("snapshot", "scene", "motion", "stages", "operational", "posture", "path")
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
    introduction = _SENTENCE.split(document.introduction)
    summary = {  # that the page carries for the home page
        "title": document.title,
        "command": document.command.removeprefix("evoexp "),
        "partial": dict(document.notices).get("Partial results", ""),
        "failed": sum(run.failed for run in document.runs),
        "headings": [*headings, *((each["figure"].title, each["anchor"]) for each in figures)],
        "claims": sentences,
        "questions": questions,
        "runs": [[run.hash12, run.label] for run in document.runs],
        "picture": face["file"] if face else "",
    }
    return written(
        "report_page.html",
        {run.hash12: run.label for run in document.runs},
        document=document,
        sections=sections,
        introduction=[
            " ".join(introduction[:FEW_SENTENCES]),
            " ".join(introduction[FEW_SENTENCES:]),
        ],
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

    text = (
        environment()
        .get_template(template)
        .render(
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
    word = re.match("[a-z]*", verdict)
    return word[0] if word else ""


def number_columns(headers: Sequence[str], rows: Sequence[Sequence[object]]) -> Mapping[int, bool]:
    """Return position → whether every cell of a column begins with a number, or has no value."""
    found = {}
    for k in range(len(headers)):
        cells = [text for row in rows if (text := str(row[k])) not in NO_VALUE]
        found[k] = bool(cells) and all(
            len(text) <= LONGEST_NUMBER and _NUMBER.match(text) for text in cells
        )
    return found
