"""Builds a page from what a paper's `page.yaml` says of it, see `page_file`."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from evoexp.report.pages.page_file import GENERIC, PageFile, own_pages
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
)

TITLE = "{paper}: {experiment}"
LENGTH = "length"
Entry = Mapping[str, Any]


def own_page(name: str, results: Results, settings: ReportSettings, **values: object) -> Page:
    """Build one of evoexp's own pages, with the values that its entry is given."""
    return build(own_pages(), name, results, settings, **values)


def scene_drawing(results: Results, settings: ReportSettings) -> tuple[Drawing, ...]:
    """Return the figure of robots and scenes, with the motions to be played; none without any."""
    file = own_pages()
    scope = Scope(file.functions, {"results": results, "settings": settings})
    return tuple(PageBuilder(file, scope).drawings("scene"))


def build(
    file: PageFile, name: str, results: Results, settings: ReportSettings, **values: object
) -> Page:
    """Build a page; another one, or the generic one, if the results do not fit it."""
    entry = file.pages[name]
    given = {"results": results, "settings": settings, "rules": file.rules, "page": entry}
    scope = Scope(file.functions, {**given, "paper": file.words.name, **values})
    fits = entry.get("fits", ())
    if not all(map(scope.value, [fits] if isinstance(fits, str) else fits)):
        other = entry.get("otherwise", GENERIC)
        own = own_pages() if other == GENERIC else file
        return build(own, other, results, settings)
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
            introduction=self.scope.text(entry["introduction"]).strip(),
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
            if name not in self.words["quantities"]:
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
        """Yield the rows of a table: those of a function, or one per item."""
        if "rows" in entry:
            yield from self.scope.value(entry["rows"])
            return
        for scope in self.items(entry):
            row = scope.value(entry["row"]) if "row" in entry else map(scope.text, entry["cells"])
            yield tuple(row)

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
                own = [measure(self.scope, *row) for row in each["controls"]]
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
        return (each for each in scopes if "when" not in entry or _holds(each, entry["when"]))

    def figures(self, names: Sequence[str | Sequence[str]]) -> Iterator[Drawing]:
        """Yield the figures in order; of a list of them those of each item together."""
        for name in names:
            if isinstance(name, str):
                yield from self.drawings(name)
            else:
                for together in zip(*map(self.drawings, name), strict=True):
                    yield from together

    def drawings(self, name: str) -> Iterator[Drawing]:
        """Yield a figure, or one of each item; none where what it is drawn of is empty."""
        entry = {**self.file.shared, **self.words["figures"]}[name]
        if "kind" in entry:  # begins with one of the figures that all pages share
            base = self.file.shared[entry["kind"]]
            parts = {part: {**base.get(part, {}), **entry.get(part, {})} for part in PARTS}
            entry = {"stem": entry["kind"], **base, **entry, **parts}
        for scope in self.items(entry):
            bound, arguments = self.bound(scope, entry)
            is_empty = "needs" in entry and not any(bound.value(entry["needs"]).values())
            if not is_empty and ("shows" not in entry or bound["shown"]):
                yield self.drawing(name, bound, entry, arguments)

    def bound(self, scope: Scope, entry: Entry) -> tuple[Scope, dict[str, Any]]:
        """Return the scope of a figure, and the arguments of its table, which are bound in it."""
        items: dict[str, Any] = {"names": entry.get("names", {})}
        if "shows" in entry:
            items["shown"] = scope.value(entry["shows"])
        if "of" in entry:
            items["of"] = _argument(scope, entry["of"])
        if "among" in entry:  # results of some conditions alone
            items["results"] = scope["results"]._replace(conditions=scope.value(entry["among"]))
        inner = scope.inner(**items)
        words = {name: inner.text(text) for name, text in entry.get("words", {}).items()}
        arguments = entry.get("arguments", {}).items()
        given = {name: _argument(inner, value) for name, value in arguments}
        return inner.inner(**words, **given), given

    def drawing(
        self, name: str, scope: Scope, entry: Entry, arguments: Mapping[str, Any]
    ) -> Drawing:
        """Return a figure, of the scope in which the arguments of its table are bound."""
        table, draw = self.file.table_and_drawing(entry["functions"])
        shown = scope["shown"] if "shows" in entry else ()
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
            table=partial(scope.call, table, **arguments),
            draw=partial(draw, **entry["options"]) if "options" in entry else draw,
            conditions=tuple(conditions),
            plays=tuple(
                PlayedRun(one.condition, one.replicate)
                for one in played
                if one.replicate is not None
            ),
            columns=entry.get("columns", ""),
        )


PARTS = ("arguments", "words")  # of a figure, which one of its kind adds to


def _holds(scope: Scope, condition: str) -> bool:
    """Return whether the value of a name is true, or, behind "not", false."""
    name = condition.removeprefix("not ")
    return bool(scope.value(name)) == (name == condition)


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


def _assumptions(file: PageFile, scope: Scope, entry: Entry) -> Page:
    """Build the page of what a paper leaves open."""
    from evoexp.report.pages import assumptions  # which is built here, too

    def headline(each: Entry) -> "assumptions.Headline":
        def judged(_: Any, condition: Any, controls: Any) -> Claim:
            own = scope.inner(condition=condition, controls=controls)
            return own.call(file.functions[each["judge"]])  # type: ignore[no-any-return]

        quantity = scope.text(each["quantity"])
        return assumptions.Headline(each["claim"], quantity, scope[each["values"]], judged)

    results = scope.value(entry["conditions"]) if "conditions" in entry else scope["results"]
    found = map(headline, entry["headlines"])
    name = file.words.name
    page = assumptions.page(results, scope["settings"], file.rules, name, tuple(found))
    rows = PageBuilder(own_pages(), scope).quantities(["usual"])
    return page._replace(quantities=tuple(rows))  # of all conditions
