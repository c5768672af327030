"""The values that a page's texts, tables and figures name, and the functions that give them.

A paper's functions take their arguments by name, as tests take pytest's fixtures: a function
`def effort(condition, threshold)` is given the condition at hand and what the function `threshold`
returns. Values are computed when they are first named, and once per page or per item (a
condition, a task) that they depend on.
"""

import inspect
import string
from collections.abc import Callable, Iterator, Mapping
from typing import Any, get_origin

from evoexp.report.pages import markdown
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
