"""Builds a page from what a paper's `page.yaml` says of it, see `page_file`."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from evoexp.report.pages import assumptions, generic, sweep_figures
from evoexp.report.pages.page_file import GENERIC, PageFile
from evoexp.report.pages.page_parts import Claim, Drawing, Page, PlayedRun, Quantity, Table
from evoexp.report.pages.page_scope import Scope
from evoexp.report.pages.page_words import quantity
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics.comparisons import (
    Comparison,
    FamilyComparison,
    Measure,
    compare_families,
    compared_with_controls,
    headed,
    rows_by_name,
)

TITLE = "{paper}: {experiment}"
TERMS, LENGTH = "terms", "length"
Entry = Mapping[str, Any]
SHARED = {"best": generic.best_drawing, "convergence": generic.cost_drawing}


def build(file: PageFile, name: str, results: Results, settings: ReportSettings) -> Page:
    """Build a page; another one, or the generic one, if the results do not fit it."""
    entry = file.pages[name]
    values = {"results": results, "settings": settings, "rules": file.rules}
    scope = Scope(file.functions, {**values, "paper": file.words.name, "page": entry})
    if "fits" in entry and not scope.value(entry["fits"]):
        other = entry.get("otherwise", GENERIC)
        return (
            generic.page(results, settings)
            if other == GENERIC
            else build(file, other, results, settings)
        )
    if "headlines" in entry:
        return _assumptions(file, scope, entry)
    return PageBuilder(file, scope.inner(compared=_compared(scope, entry))).page(entry)


class PageBuilder:
    """Fills the entries of a paper's file with the values of one page."""

    def __init__(self, file: PageFile, scope: Scope) -> None:
        self.file = file
        self.words = file.words.words
        self.scope = scope

    def page(self, entry: Entry) -> Page:
        """Return the page."""
        return Page(
            title=self.scope.text(entry.get("title", TITLE)),
            introduction=self.scope.text(entry["introduction"]),
            quantities=tuple(self.quantities(entry.get("quantities", ()))),
            claims=tuple(self.claims(entry.get("claims", ()))),
            tables=tuple(self.tables(entry.get("tables", ()))),
            checks=tuple(self.checks(entry.get("checks", ()))),
            comparisons=tuple(self.comparisons(entry)),
            drawings=tuple(self.figures(entry.get("figures", ()))),
        )

    def quantities(self, names: Sequence[str]) -> Iterator[Quantity]:
        """Yield rows of the table of results, by the names of their lists or functions."""
        results = self.scope["results"]
        for name in names:
            if name == TERMS:
                yield from generic.term_quantities(results)
            elif name not in self.words["quantities"]:
                yield from self.scope[name]
            else:
                for title, unit, values in self.words["quantities"][name]:
                    unit = self.scope["unit"] if unit == LENGTH else unit
                    yield quantity(results, self.scope.text(title), unit, self.scope[values])

    def claims(self, entries: Sequence[str | Entry]) -> Iterator[Claim]:
        """Yield claims, judged one after the other, or several of each item."""
        for entry in entries:
            each: Entry = {"judge": [entry]} if isinstance(entry, str) else entry
            for scope in self.items(each):
                for name in each["judge"]:
                    judged = scope[name]
                    yield from [judged] if isinstance(judged, Claim) else judged or ()

    def tables(self, names: Sequence[str]) -> Iterator[Table]:
        """Yield the tables that have rows."""
        for name in names:
            entry = self.words["tables"][name]
            rows = tuple(self.rows(entry))
            if rows:
                before, behind = (self.scope.value(entry[k]) if k in entry else () for k in SIDES)
                headers = (*before, *map(self.scope.text, entry["headers"]), *behind)
                note = self.scope.text(entry.get("note", ""))
                yield Table(self.scope.text(entry["heading"]), headers, rows, note)

    def rows(self, entry: Entry) -> Iterator[tuple[object, ...]]:
        """Yield the rows of a table: those of a function, or one of texts per item."""
        if "rows" in entry:
            yield from self.scope.value(entry["rows"])
            return
        for scope in self.items(entry):
            yield tuple(map(scope.text, entry["cells"]))

    def checks(self, names: Sequence[str]) -> Iterator[tuple[str, str]]:
        """Yield checks, (title, finding)."""
        for name in names:
            for row in self.words["checks"][name]:
                entry: Entry = (
                    {"title": row[0], "finding": row[1]} if isinstance(row, list) else row
                )
                for scope in self.items(entry):
                    if "rows" in entry:
                        yield from scope.value(entry["rows"])
                    else:
                        yield scope.text(entry["title"]), self.finding(scope, entry["finding"])

    def finding(self, scope: Scope, entry: str | Entry) -> str:
        """Return a finding; of several items: their texts, joined."""
        if isinstance(entry, str):
            return scope.text(entry)
        return "; ".join(own.text(entry["text"]) for own in self.items(entry, scope))

    def comparisons(self, entry: Entry) -> Iterator[tuple[str, tuple[Comparison, ...]]]:
        """Yield (heading, comparisons)."""
        for each in entry.get("comparisons", ()):
            if isinstance(each, str):
                yield from self.scope[each]
            elif "controls" in each:
                found = [measure(self.scope, *row) for row in each["controls"]]
                own = [(one.name, one.lower_is_better, one.values) for one in found]
                yield from compared_with_controls(
                    self.scope["results"], self.scope["settings"], own
                )
        yield from headed(self.scope["compared"])

    def items(self, entry: Entry, scope: Scope | None = None) -> Iterator[Scope]:
        """Yield the scope of every item that an entry is repeated for, or the page's."""
        own = self.scope if scope is None else scope
        scopes = [own]
        if "each" in entry:
            names, _, items = str(entry["each"]).rpartition(" in ")
            scopes = [_bound(own, names.split(", "), item) for item in own.value(items)]
        return (each for each in scopes if "when" not in entry or each.value(entry["when"]))

    def figures(self, names: Sequence[str | Sequence[str]]) -> Iterator[Drawing]:
        """Yield the figures in order; of a list of them those of each item together."""
        for name in names:
            if isinstance(name, str):
                yield from self.drawings(name)
            else:
                for together in zip(*map(self.drawings, name), strict=True):
                    yield from together

    def drawings(self, name: str) -> Iterator[Drawing]:
        """Yield a figure, or one of each item."""
        if name in SHARED and name not in self.words["figures"]:
            yield SHARED[name](self.scope["results"])
            return
        entry = self.words["figures"][name]
        for scope in self.items(entry):
            if "kind" in entry:
                yield from KINDS[entry["kind"]](scope, entry)
            elif "shows" not in entry or scope.value(entry["shows"]):
                yield self.drawing(name, scope, entry)

    def drawing(self, name: str, scope: Scope, entry: Entry) -> Drawing:
        """Return a figure of the paper's own."""
        shown = scope.value(entry["shows"]) if "shows" in entry else ()
        bound = scope.inner(shown=shown)
        given = {
            name: _argument(bound, value) for name, value in entry.get("arguments", {}).items()
        }
        if "among" in entry:  # results of some conditions alone
            given["results"] = scope["results"]._replace(conditions=scope.value(entry["among"]))
        functions = entry["functions"]
        pair = functions if isinstance(functions, list) else [functions]
        found = [self.file.function(path) for path in pair]
        table, draw = found if len(found) == 2 else found[0]
        if "conditions" in entry or "among" in entry:
            conditions = scope.value(entry.get("conditions") or entry["among"])
        elif shown:
            conditions = [one.condition for one in shown]
        else:
            conditions = (scope["condition"],) if "condition" in scope else scope["conditions"]
        played = scope.value(entry["plays"]) if "plays" in entry else shown
        suffix = scope.get("suffix", "") if "each" in entry else ""
        title = scope.text(entry["title"])
        return Drawing(
            stem=scope.text(entry.get("stem", name)) + suffix,
            title=f"{title} ({conditions[0].label})" if suffix else title,
            caption=scope.text(entry["caption"]),
            table=partial(bound.call, table, **given),
            draw=partial(draw, **entry["options"]) if "options" in entry else draw,
            conditions=tuple(conditions),
            plays=tuple(
                PlayedRun(one.condition, one.replicate)
                for one in played
                if one.replicate is not None
            ),
            columns=entry.get("columns", ""),
        )


def _argument(scope: Scope, value: Any) -> Any:
    """Return an argument: the value of a name, functions by their texts, or a number itself."""
    if isinstance(value, Mapping):
        return {scope.text(text): scope.function(name) for text, name in value.items()}
    return scope.value(value) if isinstance(value, str) else value


def _bound(scope: Scope, names: Sequence[str], item: Any) -> Scope:
    """Return the scope of an item: of several names one scope inside of the other."""
    for name, value in zip(names, item if len(names) > 1 else (item,), strict=True):
        scope = scope.inner(**{name: value})
    return scope


SIDES = ("before", "behind")  # of a table: headers that a function gives


def measure(
    scope: Scope, name: str, values: str, unit: str = "–", better: str = "lower"
) -> Measure:
    """Return a quantity that conditions are compared in: its name, values, unit, and order."""
    return Measure(scope.text(name), scope[values], unit, better == "lower")


def _compared(scope: Scope, page: Entry) -> tuple[FamilyComparison, ...]:
    """Return the comparisons of families that a page asks for: what functions know as `compared`.

    Measures are a function's, or rows of the page.
    """
    found: list[FamilyComparison] = []
    for entry in page.get("comparisons", ()):
        if isinstance(entry, Mapping) and "families" in entry:
            rows = entry["measures"]
            own = scope[rows] if isinstance(rows, str) else [measure(scope, *row) for row in rows]
            found += compare_families(scope[entry["families"]], own, scope["settings"])
    return tuple(found)


def _values(scope: Scope, entry: Entry) -> tuple[Drawing, ...]:
    results = scope["results"]
    if "among" in entry:
        results = results._replace(conditions=scope.value(entry["among"]))
    every = {scope.text(name): scope[of] for name, of in entry["of"].items()}
    values = {  # without those that no run has
        name: of
        for name, of in every.items()
        if any(not np.isnan(of(c)).all() for c in results.with_data)
    }
    return (sweep_figures.values_drawing(results, values),)


def _effects(scope: Scope, entry: Entry) -> tuple[Drawing, ...]:
    found = scope.value(entry["rows"]) if "rows" in entry else rows_by_name(scope["compared"])
    names = entry.get("of", {name: name for name in found})
    rows = {scope.text(shown): found[name] for name, shown in names.items() if found.get(name)}
    words = [scope.text(entry[key]) for key in ("first", "better") if key in entry]
    return sweep_figures.effects_drawings(scope["results"], scope["settings"], rows, *words)


def _shares(scope: Scope, entry: Entry) -> tuple[Drawing, ...]:
    results = scope["results"]
    rows = (
        scope.value(entry["rows"])
        if "rows" in entry
        else [
            (name, results.position(c.label), c.label, scope[of](c))
            for name, of in entry["of"].items()
            for c in results.with_data
        ]
    )
    printed = scope.value(entry["printed"]) if "printed" in entry else {}
    caption = scope.text(entry["caption"])
    return (sweep_figures.shares_drawing(results, scope["settings"], rows, caption, printed),)


def _convergence(scope: Scope, entry: Entry) -> tuple[Drawing, ...]:
    return (generic.cost_drawing(scope["results"]),)


KINDS = {"convergence": _convergence, "values": _values, "effects": _effects, "shares": _shares}


def _assumptions(file: PageFile, scope: Scope, entry: Entry) -> Page:
    """Build the page of what a paper leaves open."""

    def headline(each: Entry) -> assumptions.Headline:
        def judged(_: Any, condition: Any, controls: Any) -> Claim:
            own = scope.inner(condition=condition, controls=controls)
            return own.call(file.functions[each["judge"]])  # type: ignore[no-any-return]

        quantity = scope.text(each["quantity"])
        return assumptions.Headline(each["claim"], quantity, scope[each["values"]], judged)

    results = scope.value(entry["conditions"]) if "conditions" in entry else scope["results"]
    found = map(headline, entry["headlines"])
    name = file.words.name
    page = assumptions.page(results, scope["settings"], file.rules, name, tuple(found))
    return page._replace(quantities=generic.quantities(scope["results"]))
