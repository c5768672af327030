"""A page in HTML: complete in itself, readable without scripts, offline."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from evoexp.report.index import FAILURES
from evoexp.report.page_summary import summary_of
from evoexp.report.page_templates import script_json, verdict_class, written
from evoexp.report.page_text import Document, FigureText, Section, TableText, Verdict

FEW = 3  # failures named at the top
PIXELS_PER_POINT = 4.0 / 3.0
_SIZE = re.compile(rb'<svg [^>]*?height="([\d.]+)pt"[^>]*? width="([\d.]+)pt"')


class FigurePlace(NamedTuple):
    """A figure on the page."""

    text: FigureText  # title, caption, files
    anchor: str  # its address on the page
    file: str  # the picture that is shown; empty if there is none
    size: tuple[int, int] | None  # width and height [px]; None: not known


class SectionPlace(NamedTuple):
    """A section on the page."""

    text: Section  # its content
    heading: str  # above it
    anchor: str  # its address on the page
    figures: tuple[FigurePlace, ...]  # those in it
    verdicts: tuple[tuple[str, int], ...]  # (verdict, number of claims); empty where it has none


def html_page(document: Document, pictures: Mapping[str, bytes]) -> bytes:
    """Return a page as HTML; the same text gives the same bytes.

    Args:
        document: Its text.
        pictures: File name → content of its pictures.
    """
    sections = tuple(_places(document, pictures))
    failures = document.section(FAILURES)
    places = [(section.heading, section.anchor) for section in sections]
    places += [(each.text.title, each.anchor) for section in sections for each in section.figures]
    return written(
        "report_page.html",
        {run.hash12: run.label for run in document.runs},
        document=document,
        sections=sections,
        failures=failures.table if failures else None,
        failures_anchor=next((s.anchor for s in sections if s.heading == FAILURES), ""),
        few=FEW,
        summary=script_json(summary_of(document, places)),
    )


def verdict_counts(verdicts: Sequence[str]) -> tuple[tuple[str, int], ...]:
    """Return how often each verdict was given, without the reasons in brackets, in one order."""
    order = ("reproduced", "contradicted", "inconclusive", "not")
    found = Counter(verdict.split(" (")[0] for verdict in verdicts)
    ranks = {word: rank for rank, word in enumerate(order)}
    return tuple(
        sorted(found.items(), key=lambda item: (ranks.get(verdict_class(item[0]), 9), item[0]))
    )


def _places(document: Document, pictures: Mapping[str, bytes]) -> Iterator[SectionPlace]:
    taken: Counter[str] = Counter({"commands": 1, "content": 1})
    for section in document.sections:
        anchor = _anchor(section.heading, taken)
        figures = tuple(_figure(figure, pictures, taken) for figure in section.figures)
        verdicts = verdict_counts(list(_verdicts(section.table)))
        yield SectionPlace(section, section.heading, anchor, figures, verdicts)


def _verdicts(table: TableText | None) -> Iterator[str]:
    for row in table.rows if table else ():
        yield from (cell.text for cell in row if isinstance(cell, Verdict))


def _figure(figure: FigureText, pictures: Mapping[str, bytes], taken: Counter[str]) -> FigurePlace:
    file = figure.picture("svg", "png")
    return FigurePlace(figure, _anchor(figure.stem, taken), file, _size(pictures.get(file, b"")))


def _size(picture: bytes) -> tuple[int, int] | None:
    """Return width and height of an SVG [px]."""
    found = _SIZE.search(picture[:2000])
    if found is None:
        return None
    width, height = float(found[2]), float(found[1])
    return round(width * PIXELS_PER_POINT), round(height * PIXELS_PER_POINT)


def _anchor(name: str, taken: Counter[str]) -> str:
    """Return an address on the page that no other place has."""
    slug = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "part"
    taken[slug] += 1
    return slug if taken[slug] == 1 else f"{slug}--{taken[slug]}"
