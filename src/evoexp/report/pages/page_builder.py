"""Builds a page from what a paper's `page.yaml` says of it, see `page_file`."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any, cast

from evoexp.report.pages import page_parts, sweeps
from evoexp.report.pages.judged_claims import Headline, judged_as_written
from evoexp.report.pages.page_file import PageFile, Scope, own_pages, read_page_file
from evoexp.report.pages.page_parts import Claim, Drawing, Page, Quantity, Table, quantity
from evoexp.report.pages.page_values import best_motions
from evoexp.report.report_settings import GENERIC, ReportSettings, page_registration
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics import comparisons
from evoexp.report.statistics.judging import left_out

TITLE = "{paper}: {experiment}"
LENGTH = "length"
PARTS = ("arguments", "words")  # of a figure, which one of its kind adds to
Entry = Mapping[str, Any]


def page_of(results: Results, settings: ReportSettings) -> Page:
    """Return the page that the settings name, filled from results; sweeps have their own."""
    chosen = page_registration(settings)
    if results.searched is not None:
        searched, motions = results.searched, best_motions(sweeps.best_of(results))
        return own_page("search", results, settings, searched=searched, best_motions=motions)
    if sweep := sweeps.sweep_of(results):
        motions = best_motions(sweeps.best_condition(sweep, results))
        return own_page("sweep", results, settings, sweep=sweep, best_motions=motions)
    if chosen.target.endswith(".yaml"):
        page = build(read_page_file(*chosen.target.split(":")), chosen.name, results, settings)
    else:
        page = cast("Page", chosen.load()(results, settings))
    page = page._replace(claims=(*page.claims, *left_out(results, page.claims)))
    if any(drawing.plays for drawing in page.drawings):
        return page
    file = own_pages()
    scope = Scope(file.functions, {"results": results, "settings": settings})
    scene = PageBuilder(file, scope).drawings("scene")
    return page._replace(drawings=(*page.drawings, *scene))


def own_page(name: str, results: Results, settings: ReportSettings, **values: object) -> Page:
    """Build one of evoexp's own pages, with the values that its entry is given."""
    return build(own_pages(), name, results, settings, **values)


def build(
    file: PageFile, name: str, results: Results, settings: ReportSettings, **values: object
) -> Page:
    """Build a page; another one, or the generic one, if the results do not fit it."""
    entry = file.entries["pages"][name]
    bound = {"results": results, "settings": settings, "rules": file.rules, "page": entry}
    scope = Scope(file.functions, {**bound, "paper": file.name, **values})
    fits = entry.get("fits", ())
    if not all(map(scope.value, [fits] if isinstance(fits, str) else fits)):
        other = entry.get("otherwise", GENERIC)
        return build(own_pages() if other == GENERIC else file, other, results, settings)
    if "headlines" not in entry:
        return PageBuilder(file, scope.inner(compared=family_comparisons(scope, entry))).page(entry)
    return own_page(
        "readings",
        results,
        settings,
        paper=file.name,
        rules=file.rules,
        read_results=scope.value(entry.get("conditions", "results")),
        headlines=[_headline(scope, each) for each in entry["headlines"]],
    )


class PageBuilder:
    """Fills the entries of a paper's file with the values of one page."""

    def __init__(self, file: PageFile, scope: Scope) -> None:
        self.file = file
        self.entries = file.entries
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
            if name not in self.entries["quantities"]:
                yield from self.scope[name]
            else:
                for title, unit, values in self.entries["quantities"][name]:
                    unit = self.scope["unit"] if unit == LENGTH else unit
                    yield quantity(results, self.scope.text(title), unit, self.scope[values])

    def claims(self, entries: Sequence[str | Entry], scope: Scope | None = None) -> Iterator[Claim]:
        """Yield claims, judged one after the other, or several of each item."""
        for entry in entries:
            if isinstance(entry, str):
                judged = (self.scope if scope is None else scope)[entry]
                yield from [judged] if isinstance(judged, Claim) else judged or ()
            elif "claim" in entry:
                yield from judged_as_written(self.items(entry, scope), entry)
            else:
                for inner in self.items(entry, scope):
                    yield from self.claims(entry["judge"], inner)

    def tables(self, names: Sequence[str]) -> Iterator[Table]:
        """Yield the tables that have rows."""
        for name in names:
            entry = self.entries["tables"][name]
            if rows := tuple(map(tuple, self.rows(entry))):
                behind = self.scope.value(entry["behind"]) if "behind" in entry else ()
                headers = (*map(self.scope.text, entry["headers"]), *behind)
                note = self.scope.text(entry.get("note", ""))
                yield Table(self.scope.text(entry["heading"]), headers, rows, note)

    def rows(self, entry: Entry) -> Iterator[Sequence[object]]:
        """Yield the rows of a table: those of a function, or one per item."""
        if "rows" in entry:
            yield from self.scope.value(entry["rows"])
            return
        for scope in self.items(entry):
            if "row" in entry:
                yield scope.value(entry["row"])
            else:
                yield [scope.text(cell) for cell in entry["cells"]]

    def checks(self, names: Sequence[str]) -> Iterator[tuple[str, str]]:
        """Yield checks, (title, finding); a finding of several items is their texts, joined."""
        for row in (row for name in names for row in self.entries["checks"][name]):
            entry = dict(zip(("title", "finding"), row, strict=True)) if type(row) is list else row
            for scope in self.items(entry):
                if "rows" in entry:
                    yield from scope.value(entry["rows"])
                    continue
                finding = entry["finding"]
                if isinstance(finding, Mapping):
                    texts = (each.text(finding["text"]) for each in self.items(finding, scope))
                    yield scope.text(entry["title"]), "; ".join(texts)
                else:
                    yield scope.text(entry["title"]), scope.text(finding)

    def comparisons(self, entry: Entry) -> Iterator[tuple[str, tuple[comparisons.Comparison, ...]]]:
        """Yield (heading, comparisons)."""
        results, settings = self.scope["results"], self.scope["settings"]
        for each in entry.get("comparisons", ()):
            if isinstance(each, str):
                yield from self.scope[each]
            elif "controls" in each:
                own = [measure(self.scope, *row) for row in each["controls"]]
                yield from comparisons.compared_with_controls(results, settings, own)
            elif "pairs" in each:
                by_label = {c.label: c for c in results.with_data}
                known = [pair for pair in self.scope[each["pairs"]] if by_label.keys() >= {*pair}]
                pairs = [(by_label[one], by_label[two]) for one, two in known]
                for row in each["measures"] if pairs else ():
                    of = measure(self.scope, *row)
                    rows = of.compared(pairs, settings, named=comparisons.AGAINST)
                    yield f"{of.name}: {each['heading']}", rows
        for one in self.scope["compared"]:
            if one.rows:
                yield f"{one.measure.name}: {one.family.name} against …", one.rows

    def items(self, entry: Entry, scope: Scope | None = None) -> Iterator[Scope]:
        """Yield the scope of every item that an entry is repeated for, or the page's."""
        own = self.scope if scope is None else scope
        scopes = [own]
        if "each" in entry:
            words, _, items = str(entry["each"]).rpartition(" in ")
            names = words.split(", ")
            scopes = []
            for item in own.value(items):
                inner = own  # of several names one scope inside of the other
                for name, value in zip(names, item if len(names) > 1 else (item,), strict=True):
                    inner = inner.inner(**{name: value})
                scopes.append(inner)
        return (each for each in scopes if _is_shown(each, entry))

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
        entry = {**self.file.shared, **self.entries["figures"]}[name]
        if "kind" in entry:  # begins with one of the figures that all pages share
            base = self.file.shared[entry["kind"]]
            parts = {part: {**base.get(part, {}), **entry.get(part, {})} for part in PARTS}
            entry = {"stem": entry["kind"], **base, **entry, **parts}
        for outer in self.items(entry):
            items: dict[str, Any] = {"names": entry.get("names", {})}
            if "shows" in entry:
                items["shown"] = outer.value(entry["shows"])
            if "of" in entry:
                items["of"] = _argument(outer, entry["of"])
            if "among" in entry:  # results of some conditions alone
                conditions = outer.value(entry["among"])
                items["results"] = outer["results"]._replace(conditions=conditions)
            inner = outer.inner(**items)
            words = {word: inner.text(text) for word, text in entry.get("words", {}).items()}
            values = entry.get("arguments", {}).items()
            arguments = {argument: _argument(inner, value) for argument, value in values}
            scope = inner.inner(**words, **arguments)
            is_empty = "needs" in entry and not any(scope.value(entry["needs"]).values())
            if not is_empty and ("shows" not in entry or scope["shown"]):
                yield self.drawing(name, scope, entry, arguments)

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
        suffix = scope["suffix"] if "each" in entry and "suffix" in scope else ""
        title = scope.text(entry["title"])
        return Drawing(
            stem=scope.text(entry.get("stem", name)) + suffix,
            title=f"{title} ({conditions[0].label})" if suffix else title,
            caption=scope.text(entry["caption"]),
            table=partial(scope.call, table, **arguments),
            draw=partial(draw, **entry["options"]) if "options" in entry else draw,
            conditions=tuple(conditions),
            plays=tuple(
                page_parts.PlayedRun(one.condition, one.replicate)
                for one in played
                if one.replicate is not None
            ),
            columns=entry.get("columns") or " ".join((table.__doc__ or "").split()),
        )


def _is_shown(scope: Scope, entry: Entry) -> bool:
    return "when" not in entry or scope.holds(entry["when"])


def _argument(scope: Scope, value: Any) -> Any:
    """Return an argument: the value of a name, functions by their texts, or a number itself."""
    if isinstance(value, Mapping):
        return {scope.text(text): scope.function(name) for text, name in value.items()}
    return scope.value(value) if isinstance(value, str) else value


def measure(
    scope: Scope, name: str, values: str, unit: str = "–", better: str = "lower"
) -> comparisons.Measure:
    """Return a quantity that conditions are compared in: its name, values, unit, and order."""
    return comparisons.Measure(scope.text(name), scope[values], unit, better == "lower")


def family_comparisons(scope: Scope, page: Entry) -> tuple[comparisons.FamilyComparison, ...]:
    """Return the comparisons of families that a page asks for, which functions name `compared`."""
    found: list[comparisons.FamilyComparison] = []
    for entry in page.get("comparisons", ()):
        if isinstance(entry, Mapping) and "families" in entry:
            rows = entry["measures"]
            own = scope[rows] if isinstance(rows, str) else [measure(scope, *row) for row in rows]
            found += comparisons.compare_families(scope[entry["families"]], own, scope["settings"])
    return tuple(found)


def _headline(scope: Scope, entry: Entry) -> Headline:
    """Return a headline claim of a paper, which a function judges on one condition."""

    def judged(condition: Any, controls: Any) -> Claim | None:
        inner, judge = scope.inner(condition=condition, controls=controls), entry["judge"]
        if isinstance(judge, Mapping):
            shown = [inner] if _is_shown(inner, judge) else []
            return next(judged_as_written(shown, {"claim": entry["claim"], **judge}), None)
        return cast("Claim | None", inner.call(scope.functions[judge]))

    return Headline(entry["claim"], scope.text(entry["quantity"]), scope[entry["values"]], judged)
