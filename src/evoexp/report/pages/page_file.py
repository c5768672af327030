"""Pages as data: the file `page.yaml` of a paper, read and checked.

A paper, ours or a guest's, is a package with a file `page.yaml`, which says what its pages show,
and modules with the functions that it names; rules of claims stand in `claims.yaml` beside it.
Its entry points `evoexp.pages` name the file: `my_paper = "my_paper:page.yaml"` registers the page
`my_paper` of the file.

    name: "Lavoie & Boudreau 2001"
    functions: [measures, claims]     # modules of the package: their functions may be named
    pages:
      lavoie:
        fits: planned[redundant_ga]   # or several; where a value is false, another page is shown:
        otherwise: generic            # of this file; `generic` if none is named
        title: "…"                    # "{paper}: {experiment}" if there is none
        introduction: "…"
        quantities: [arms, terms]     # rows of the table of results; `terms`: the planner's own
        claims: [percentages, {each: condition in main, judge: [free]}]
        tables: [tasks]
        comparisons:                  # first conditions of families against the others
          - families: arms
            measures: [[best cost, best_cost], [clearance, clearance, length, higher]]
          - {controls: [[best cost, best_cost]]}  # conditions against their controls
        checks: [arms]
        figures: [attempts, values]
        headlines:                    # of a page of assumptions, see `assumptions`
          - {claim: free, quantity: "clearance [{unit}]", values: clearance, judge: free}
    quantities:
      arms: [[attempts, "–", term_attempts]]  # name, unit, column or function of a condition
    tables:
      tasks:
        heading: "Tasks"
        headers: [task, goal met]
        each: condition in main       # one row each: `cells`, or a function `row`; or all `rows`
        cells: ["{condition.label}", "{success!i}"]
        note: "Median [quartiles]."
    checks:
      arms:
        - ["Time of a run", "the paper prints its own"]
        - title: "Attempts"           # a finding may join the texts of several items
          finding: {each: condition in main, text: "{condition.label}: {attempts}"}
    figures:
      attempts:                       # the stem of its files, unless `stem` gives another
        title: "Attempts"
        caption: "Share of runs that took so many attempts, with Wilson's {level:g} % interval."
        columns: "Columns attempts, having, …"  # of its table, for the file beside it
        functions: figures.attempts.attempts  # attempts_table, draw_attempts; or a list of both
        arguments: {efforts: {"evaluations [-]": evaluations}}  # that are no values of their name
        among: main                   # shows the results of these conditions alone
      effort:
        kind: values                  # begins with a figure that all pages share, of `page.yaml`
        of: {"effort [-]": effort}    # beside this file: values, effects, shares, convergence, best

Words in braces are values and functions by name (`page_scope`), written as `markdown.filled`
does. `each: x in xs` repeats an entry for all items, `when: name` leaves it out where the value is
false, `when: not name` where it is true. Texts of a figure may name its arguments and its `words`,
which are texts by name; it is not drawn without values of the argument that it `needs`. `given` are
the names of values that code brings along, on evoexp's own pages. The keys of each kind of entry
stand in `KEYS`.
"""

import functools
import importlib
import importlib.util
import re
import types
from collections.abc import Iterator, Mapping, Sequence
from importlib import resources
from typing import Any, NamedTuple

import yaml

from evoexp.errors import SettingError, UnknownSetting, nearest
from evoexp.report.pages import page_values
from evoexp.report.pages.page_scope import Functions, is_column, names_in
from evoexp.report.pages.page_words import PageWords
from evoexp.report.results import run_measures
from evoexp.report.statistics.claim_rules import NO_RULES, Rules, read_rules

FIGURES = "evoexp.report.figures"  # those that papers share
FILE, RULES_FILE = "page.yaml", "claims.yaml"
GENERIC = "generic"
KEYS: dict[str, set[str]] = {
    "file": {"name", "functions", "pages", "quantities", "tables", "checks", "figures"},
    "pages": {"fits", "otherwise", "title", "introduction", "quantities", "claims", "tables"}
    | {"comparisons", "checks", "figures", "headlines", "conditions", "given"},
    "claims": {"each", "when", "judge"},
    "comparisons": {"families", "measures", "controls", "when"},
    "headlines": {"claim", "quantity", "values", "judge"},
    "tables": {"heading", "headers", "before", "behind", "each", "when", "cells", "row", "rows"}
    | {"note"},
    "checks": {"title", "finding", "each", "when", "rows"},
    "figures": {"title", "caption", "columns", "stem", "functions", "arguments", "options"}
    | {"each", "when", "conditions", "plays", "shows", "kind", "of", "names", "words", "needs"}
    | {"among"},
}
_EACH = re.compile(r"(\w+(?:, \w+)*) in ([\w.]+)")
_FIRST = re.compile(r"[.\[]")  # ends the first part of a name
_NAMED = (
    "fits",
    "when",
    "among",
    "row",
    "rows",
    "values",
    "judge",
    "families",
    "conditions",
    "plays",
    "shows",
)
_TEXTS = ("title", "caption", "finding", "text", "stem", "note", "cells")
BOUND = (
    *("results", "settings", "rules", "paper", "page", "condition", "controls", "compared"),
    *("shown", "of", "names"),  # in figures
)


class PageFile(NamedTuple):
    """The content of a paper's `page.yaml`, with its functions and the rules of its claims."""

    words: PageWords  # its name, and all entries
    functions: Functions  # of the paper, and of every page
    rules: Rules
    package: str  # that the file is in
    shared: Mapping[str, Any]  # figures that all papers may draw, by their names

    @property
    def pages(self) -> Mapping[str, Any]:
        """The pages by name."""
        return self.words.words["pages"]

    def table_and_drawing(self, paths: str | Sequence[str]) -> list[Any]:
        """Return the functions of a figure: `m.costs` stands for `m.costs_table`, `m.draw_costs`.

        Raises:
            SettingError: If there is none.
        """
        if isinstance(paths, str):
            module, _, name = paths.rpartition(".")
            paths = [f"{module}.{name}_table", f"{module}.draw_{name}"]
        return [self.function(path) for path in paths]

    def function(self, path: str) -> Any:
        """Return a function by its name, or by that of a module of the paper: `figures.x.TABLE`.

        Figures that papers share are found as `convergence.fitness`.

        Raises:
            SettingError: If there is none.
        """
        if path in self.functions:
            return self.functions[path]
        module, _, name = path.rpartition(".")
        for home in (self.package, FIGURES):
            if module and importlib.util.find_spec(f"{home}.{module.partition('.')[0]}"):
                found = getattr(importlib.import_module(f"{home}.{module}"), name, None)
                if found is not None:
                    return found
        hint = nearest(path, self.functions)
        raise SettingError(f"{self.package}:{FILE}", "a function of the paper", path, hint)


@functools.cache
def own_pages() -> PageFile:
    """Return evoexp's own pages: of any experiment, a sweep, a comparison."""
    return read_page_file(__package__)


def read_page_file(package: str, file: str = FILE) -> PageFile:
    """Read a paper's pages.

    Raises:
        SettingError: If an entry lacks something, or names what is not there.
        UnknownSetting: If an entry has a key that it cannot have.
    """
    folder = resources.files(package)
    entries = yaml.safe_load(folder.joinpath(file).read_text(encoding="utf-8"))
    _check_keys(f"{package}:{file}", entries, "file")
    functions = Functions()
    for module in (page_values, run_measures):
        functions |= _functions_of(module)
    for name in entries.get("functions", ()):
        functions |= _functions_of(importlib.import_module(f"{package}.{name}"))
    rules = folder.joinpath(RULES_FILE)
    with resources.as_file(rules) as path:
        own_rules = read_rules(path) if path.is_file() else NO_RULES
    sections = {section: entries.get(section, {}) for section in sorted(KEYS["file"])}
    own = package == __package__
    shared = sections["figures"] if own else own_pages().words.words["figures"]
    found = PageFile(PageWords(entries["name"], sections), functions, own_rules, package, shared)
    _check(found, f"{package}:{file}")
    return found


def _functions_of(module: types.ModuleType) -> dict[str, types.FunctionType]:
    """Return the functions of a module, those among them that it makes of others."""
    return {
        name: each
        for name, each in vars(module).items()
        if isinstance(each, types.FunctionType)
        and not name.startswith("_")
        # a function that the module imports has its own name, and another home
        and (each.__module__ == module.__name__ or each.__name__ != name)
    }


def _check_keys(field: str, entry: Mapping[str, Any], kind: str) -> None:
    for key in entry:
        if key not in KEYS[kind]:
            raise UnknownSetting(f"{field}.{key}", KEYS[kind])


def _check(file: PageFile, field: str) -> None:
    """Check all entries of a file: the names that they use, and the entries that pages name."""
    sections = file.words.words
    entries = list(_entries(sections, field))
    bound = {*BOUND, *file.functions}
    for path, entry in entries:
        if "each" in entry:
            each = _EACH.fullmatch(str(entry["each"]))
            if each is None:
                raise SettingError(f"{path}.each", "'item in items'", entry["each"])
            bound |= set(each[1].split(", "))
        for key in ("given", "arguments", "words"):
            bound |= {*entry.get(key, ())}
    for path, entry in entries:
        for key, name in _names(entry):
            known = name in bound or is_column(name)
            for need in file.functions.needs.get(name, {name}) if known else (name,):
                if need not in bound and not is_column(need):
                    must = "a value or function"
                    must += "" if need == name else f" for this argument of {name}"
                    raise SettingError(f"{path}.{key}", must, need, nearest(need, bound))
    for page, entry in file.pages.items():
        for section in ("tables", "checks", "figures"):
            known_here = {*sections[section], *(file.shared if section == "figures" else ())}
            for name in _flat(entry.get(section, ())):
                if name not in known_here:
                    must, hint = f"one of the {section} of this file", nearest(name, known_here)
                    raise SettingError(f"{field}: pages.{page}.{section}", must, name, hint)
        other = entry.get("otherwise", GENERIC)
        if other not in {*file.pages, GENERIC}:
            must, hint = "a page of this file", nearest(other, file.pages)
            raise SettingError(f"{field}: pages.{page}.otherwise", must, other, hint)


def _flat(names: Sequence[str | Sequence[str]]) -> Iterator[str]:
    """Yield names, those of lists among them, too."""
    for name in names:
        yield from [name] if isinstance(name, str) else name


def _entries(sections: Mapping[str, Any], field: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield every entry that is a mapping with its path, those inside of others after them."""
    for section, entries in sections.items():
        if section not in KEYS or not isinstance(entries, Mapping):
            continue
        for name, entry in entries.items():
            path = f"{field}: {section}.{name}"
            for number, each in enumerate(entry if isinstance(entry, list) else [entry]):
                if isinstance(each, Mapping):
                    where = f"{path}[{number}]" if isinstance(entry, list) else path
                    _check_keys(where, each, section)
                    yield where, each
                    yield from _parts(where, each)


def _parts(path: str, entry: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the entries inside of an entry: claims, comparisons, headlines, joined findings."""
    for kind in ("claims", "comparisons", "headlines"):
        for number, part in enumerate(entry.get(kind, ())):
            if isinstance(part, Mapping):
                _check_keys(f"{path}.{kind}[{number}]", part, kind)
                yield f"{path}.{kind}[{number}]", part
    if isinstance(finding := entry.get("finding"), Mapping):
        yield f"{path}.finding", finding


def _names(entry: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield (key, first part of a name) for the names that an entry uses."""
    for key in _NAMED:
        for path in entry[key] if isinstance(entry.get(key), list) else (entry.get(key),):
            if isinstance(path, str):
                yield key, _FIRST.split(path.removeprefix("not "))[0]
    if "each" in entry:
        yield "each", str(entry["each"]).rpartition(" in ")[2].partition(".")[0]
    for key in _TEXTS:
        for text in entry[key] if key == "cells" and key in entry else (entry.get(key),):
            if isinstance(text, str):
                yield from ((key, name) for name in names_in(text))
