"""Pages as data: the file `page.yaml` of a paper, read and checked.

The format stands at the head of the file `page.yaml` beside this one, which has evoexp's own pages.
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
from evoexp.report.pages import GENERIC, page_values
from evoexp.report.pages.page_scope import Functions, is_column, names_in
from evoexp.report.results import run_measures
from evoexp.report.statistics.claim_rules import NO_RULES, Rules, read_rules

FIGURES = "evoexp.report.figures"  # those that papers share
FILE, RULES_FILE = "page.yaml", "claims.yaml"
_CLAIM = {"each", "when", "claim", "of", "than", "values", "better", "word", "words", "family"}
_CLAIM |= {"elsewhere", "unjudged", "n", "planned", "by", "evidence"}
KEYS: dict[str, set[str]] = {
    "file": {"name", "functions", "values", "pages", "quantities", "tables", "checks", "figures"},
    "pages": {"fits", "otherwise", "title", "introduction", "quantities", "claims", "tables"}
    | {"comparisons", "checks", "figures", "headlines", "conditions", "given"},
    "claims": _CLAIM | {"judge"},
    "judge": _CLAIM | {"judge"},
    "comparisons": {"families", "measures", "controls", "pairs", "heading"},
    "headlines": {"claim", "quantity", "values", "judge"},
    "tables": {"heading", "headers", "behind", "each", "when", "cells", "row", "rows"} | {"note"},
    "checks": {"title", "finding", "each", "when", "rows"},
    "finding": {"each", "when", "text"},
    "figures": {"title", "caption", "columns", "stem", "functions", "arguments", "options"}
    | {"each", "when", "conditions", "plays", "shows", "kind", "of", "names", "words", "needs"}
    | {"among"},
}
_EACH = re.compile(r"(\w+(?:, \w+)*) in ([\w.]+)")
_FIRST = re.compile(r"[.\[]")  # ends the first part of a name
_NAMED = (
    *("fits", "when", "among", "row", "rows", "values", "judge", "families", "conditions"),
    *("plays", "shows", "n", "planned", "by", "pairs"),
)
_TEXTS = ("title", "introduction", "caption", "finding", "text", "stem", "note", "cells")
BOUND = (
    *("results", "settings", "rules", "paper", "page", "condition", "controls", "compared"),
    *("shown", "of", "names"),  # in figures
)


class PageFile(NamedTuple):
    """The content of a paper's `page.yaml`, with its functions and the rules of its claims."""

    name: str  # "Chen & Zalzala 1995"
    entries: Mapping[str, Mapping[str, Any]]  # of pages, figures, tables, …, by their names
    functions: Functions  # of the paper, and of every page
    rules: Rules
    package: str  # that the file is in
    shared: Mapping[str, Any]  # figures that all papers may draw, by their names

    def table_and_drawing(self, paths: str | Sequence[str]) -> list[Any]:
        """Return the functions of a figure: `m.costs` stands for `m.costs_table`, `m.draw_costs`.

        Functions of a module of the paper, and of figures that papers share, have its name before
        theirs: `figures.x.draw`, `convergence.cost`.

        Raises:
            SettingError: If there is none.
        """
        if isinstance(paths, str):
            module, _, name = paths.rpartition(".")
            paths = [f"{module}.{name}_table", f"{module}.draw_{name}"]
        functions = []
        for path in paths:
            function = self.functions.get(path)
            module, _, name = path.rpartition(".")
            for home in (self.package, FIGURES) if module else ():
                if not function and importlib.util.find_spec(f"{home}.{module.partition('.')[0]}"):
                    function = getattr(importlib.import_module(f"{home}.{module}"), name, None)
            if function is None:
                hint = nearest(path, self.functions)
                where = f"{self.package}:{FILE}"
                raise SettingError(where, "a function of the paper", path, hint)
            functions.append(function)
        return functions


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
    folder, field = resources.files(package), f"{package}:{file}"
    entries = yaml.safe_load(folder.joinpath(file).read_text(encoding="utf-8"))
    _check_keys(field, entries, "file")
    modules = [
        importlib.import_module(f"{package}.{name}") for name in entries.get("functions", ())
    ]
    constants = entries.get("values", {}).items()
    functions = Functions({name: lambda value=value: value for name, value in constants})
    for module in (page_values, run_measures, *modules):
        functions |= {  # also those that it makes of others
            name: each
            for name, each in vars(module).items()
            if isinstance(each, types.FunctionType)
            and not name.startswith("_")
            # a function that the module imports has its own name, and another home
            and (each.__module__ == module.__name__ or each.__name__ != name)
        }
        functions |= getattr(module, "PAGE_VALUES", {})
    with resources.as_file(folder.joinpath(RULES_FILE)) as path:
        rules = read_rules(path) if path.is_file() else NO_RULES
    sections = {section: entries.get(section, {}) for section in sorted(KEYS["file"])}
    own = package == __package__
    shared = sections["figures"] if own else own_pages().entries["figures"]
    page_file = PageFile(entries["name"], sections, functions, rules, package, shared)
    _check(page_file, field)
    return page_file


def _check_keys(field: str, entry: Mapping[str, Any], kind: str) -> None:
    for key in entry:
        if key not in KEYS[kind]:
            raise UnknownSetting(f"{field}.{key}", KEYS[kind])


def _check(file: PageFile, field: str) -> None:
    """Check all entries of a file: the names that they use, and the entries that pages name."""
    bound, uses = {*BOUND, *file.functions}, list[tuple[str, str, str]]()
    for section in sorted(KEYS.keys() & file.entries):
        for title, whole in file.entries[section].items():
            for path, entry in _mappings(f"{field}: {section}.{title}", whole, section):
                uses += [(path, key, name) for key, name in _names(entry)]
                for key in ("given", "arguments", "words"):
                    bound |= {*entry.get(key, ())}
                if "each" in entry:
                    each = _EACH.fullmatch(str(entry["each"]))
                    if each is None:
                        raise SettingError(f"{path}.each", "'item in items'", entry["each"])
                    bound |= set(each[1].split(", "))
                    uses.append((path, "each", each[2].partition(".")[0]))
    for path, key, name in uses:
        known = name in bound or is_column(name)
        for need in file.functions.needs(name) if known else (name,):
            if need not in bound and not is_column(need):
                must = "a value or function"
                must += "" if need == name else f" for this argument of {name}"
                raise SettingError(f"{path}.{key}", must, need, nearest(need, bound))
    for page, entry in file.entries["pages"].items():
        pages = {*file.entries["pages"], GENERIC}
        named = [("otherwise", "pages", entry.get("otherwise", GENERIC), pages)]
        for section in ("tables", "checks", "figures"):
            choices = {*file.entries[section], *(file.shared if section == "figures" else ())}
            for each in entry.get(section, ()):
                names = [each] if isinstance(each, str) else each
                named += [(section, section, name, choices) for name in names]
        for key, kind, name, choices in named:
            if name not in choices:
                must, hint = f"one of the {kind} of this file", nearest(name, choices)
                raise SettingError(f"{field}: pages.{page}.{key}", must, name, hint)


def _mappings(path: str, entry: Any, kind: str) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield an entry with its path if it is a mapping, or those of a list, then those in them."""
    if isinstance(entry, list):
        for number, each in enumerate(entry):
            yield from _mappings(f"{path}[{number}]", each, kind)
    elif isinstance(entry, Mapping):
        _check_keys(path, entry, kind)
        yield path, entry
        for part in ("claims", "comparisons", "headlines", "judge", "finding"):
            yield from _mappings(f"{path}.{part}", entry.get(part), part)


def _names(entry: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield (key, first part of a name) for the names that an entry uses."""
    for key in _NAMED:
        for path in entry[key] if isinstance(entry.get(key), list) else (entry.get(key),):
            if isinstance(path, str):
                yield key, _FIRST.split(path.removeprefix("not "))[0]
    for key in _TEXTS:
        yield from ((key, name) for text in _texts(entry.get(key)) for name in names_in(text))


def _texts(value: Any) -> Iterator[str]:
    """Yield the texts in the parts of a text, and their conditions as words in braces."""
    if isinstance(value, str):
        yield value
    for part in value if isinstance(value, list) else ():
        if isinstance(part, Mapping):
            yield "{" + str(part.get("when", "")).removeprefix("not ") + "}"
        yield from _texts(part["text"] if isinstance(part, Mapping) else part)
