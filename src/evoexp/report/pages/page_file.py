"""Pages as data: the file `page.yaml` of a paper, read and checked, and the values that it names.

The format stands at the head of the file `page.yaml` beside this one, which has evoexp's own pages.

A paper's functions take their arguments by name, as tests take pytest's fixtures: a function
`def effort(condition, threshold)` is given the condition at hand and what the function `threshold`
returns. Values are computed when they are first named, and once per page or per item (a
condition, a task) that they depend on.
"""

import functools
import importlib
import importlib.util
import inspect
import re
import string
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple, get_origin

import yaml

from evoexp.errors import SettingError, UnknownSetting, nearest
from evoexp.report.pages import markdown, page_values
from evoexp.report.report_settings import GENERIC
from evoexp.report.results import run_measures
from evoexp.report.statistics.judging import NO_RULES, Rules, read_rules
from evoexp.store.log import TERM

CONDITION = "condition"  # the item that columns of summaries belong to
COLUMNS = (  # of summaries, which pages may name beside the planner's own terms
    "best_cost",
    "clearance",
    "collision_queries",
    "cpu_s",
    "evaluations",
    "first_feasible_generation",
)


class Functions(dict[str, Callable[..., Any]]):
    """The functions that a page may name."""

    def __init__(self, functions: Mapping[str, Callable[..., Any]]) -> None:
        super().__init__(functions)
        self._needs: dict[str, frozenset[str]] = {}

    def needs(self, name: str) -> frozenset[str]:
        """Return the items and values that a name depends on, through all functions between."""
        if name not in self:
            return frozenset({CONDITION} if is_column(name) else {name})
        if name not in self._needs:
            self._needs[name] = frozenset()  # a function that needs itself needs nothing more
            for each, is_function in parameters(self[name]).items():
                self._needs[name] |= self.needs(each) - ({CONDITION} if is_function else set())
        return self._needs[name]


def parameters(function: Callable[..., Any]) -> dict[str, bool]:
    """Return the arguments that a function must be given: name → whether it is a function itself.

    The annotation says so: `effort: FloatArray` is the effort of the condition at hand, `effort:
    Values` the function that gives the effort of any condition.
    """
    return {
        each.name: get_origin(each.annotation) is Callable
        for each in inspect.signature(function).parameters.values()
        if each.default is each.empty
    }


def is_column(name: str) -> bool:
    """Return whether a name is that of a column of summaries."""
    return name in COLUMNS or name.startswith(TERM)


class Scope:
    """Values by name. An inner scope binds an item and sees everything of its outer one."""

    def __init__(
        self, functions: Functions, values: Mapping[str, Any], outer: "Scope | None" = None
    ) -> None:
        self.functions = functions
        self.outer = outer
        self._bound = frozenset(values)
        self._values = dict(values)  # those that are bound, later also those that are computed
        self._inner: dict[tuple[tuple[str, int], ...], Scope] = {}

    def inner(self, **items: Any) -> "Scope":
        """Return the scope in which items are bound, once for the same items."""
        key = tuple((name, id(item)) for name, item in items.items())
        return self._inner.setdefault(key, Scope(self.functions, items, self))

    def __contains__(self, name: str) -> bool:
        known = name in self._values or name in self.functions
        return known or (self.outer is not None and name in self.outer)

    def __getitem__(self, name: str) -> Any:
        """Return a value; a function of a condition itself where no condition is bound."""
        if name not in self._values:
            needs = self.functions.needs(name)
            if self.outer is not None and not self._bound & needs:
                return self.outer[name]
            if CONDITION in needs and CONDITION not in self:
                value = self.function(name)
            elif name in self.functions:
                value = self.call(self.functions[name])
            elif is_column(name):
                value = self[CONDITION].column(name)
            else:
                raise KeyError(name)
            self._values[name] = value
        return self._values[name]

    def call(self, function: Callable[..., Any], **arguments: Any) -> Any:
        """Call a function with the values that its arguments name."""
        for name, is_function in parameters(function).items():
            if name not in arguments:
                arguments[name] = self.function(name) if is_function else self[name]
        value = function(**arguments)
        return tuple(value) if isinstance(value, Iterator) else value

    def function(self, name: str) -> Any:
        """Return the function that gives the value of this name for any condition."""
        if CONDITION not in self.functions.needs(name):
            return self[name]
        return lambda condition: self.inner(condition=condition)[name]

    def value(self, path: str) -> Any:
        """Return the value of a dotted name: `results.main`, `collision.blind`."""
        return markdown.Sentence(self).get_field(path, (), self)[0]

    def holds(self, condition: str) -> bool:
        """Return whether `name` is true, or `not name` is false."""
        name = condition.removeprefix("not ")
        return bool(self.value(name)) == (name == condition)

    def text(self, template: object) -> str:
        """Return a text with its words in braces filled in, see `markdown.filled`.

        Of a list all parts that are texts, or mappings of a `text` and of a condition that holds.
        """
        if not isinstance(template, list):
            return markdown.filled(str(template), self)
        parts = (part if isinstance(part, Mapping) else {"text": part} for part in template)
        shown = (part["text"] for part in parts if "when" not in part or self.holds(part["when"]))
        return " ".join(map(self.text, shown))


def names_in(template: object) -> Iterator[str]:
    """Yield the names that a text with words in braces begins its words with."""
    for _, field, _, _ in string.Formatter().parse(str(template)):
        if field:
            yield field.partition(".")[0].partition("[")[0]


FIGURES = "evoexp.report.figures"  # those that papers share
FILE, RULES_FILE = "page.yaml", "claims.yaml"
FORMAT = yaml.safe_load(Path(__file__).with_name("page_keys.yaml").read_text(encoding="utf-8"))
KEYS: dict[str, list[str]] = FORMAT["keys"]
_EACH = re.compile(r"(\w+(?:, \w+)*) in ([\w.]+)")
_FIRST = re.compile(r"[.\[]")  # ends the first part of a name


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
    bound, uses = {*FORMAT["bound"], *file.functions}, list[tuple[str, str, str]]()
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
    for key in FORMAT["names"]:
        for path in entry[key] if isinstance(entry.get(key), list) else (entry.get(key),):
            if isinstance(path, str):
                yield key, _FIRST.split(path.removeprefix("not "))[0]
    for key in FORMAT["texts"]:
        yield from ((key, name) for text in _texts(entry.get(key)) for name in names_in(text))


def _texts(value: Any) -> Iterator[str]:
    """Yield the texts in the parts of a text, and their conditions as words in braces."""
    if isinstance(value, str):
        yield value
    for part in value if isinstance(value, list) else ():
        if isinstance(part, Mapping):
            yield "{" + str(part.get("when", "")).removeprefix("not ") + "}"
        yield from _texts(part["text"] if isinstance(part, Mapping) else part)
