"""The values that a page's texts, tables and figures name, and the functions that give them.

A paper's functions take their arguments by name, as tests take pytest's fixtures: a function
`def effort(condition, threshold)` is given the condition at hand and what the function `threshold`
returns. Values are computed when they are first named, and once per page or per item (a
condition, a task) that they depend on.
"""

import functools
import inspect
import string
from collections.abc import Callable, Iterator, Mapping
from typing import Any, get_origin

from evoexp.report.pages import markdown
from evoexp.store.messages import TERM

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

    @functools.cached_property
    def needs(self) -> dict[str, frozenset[str]]:
        """The items and values that each depends on, through all functions between."""
        found: dict[str, frozenset[str]] = {}

        def collect(name: str) -> frozenset[str]:
            if name not in self:
                return frozenset({CONDITION} if is_column(name) else {name})
            if name not in found:
                found[name] = frozenset()  # a function that needs itself needs nothing more
                for each, is_function in parameters(self[name]).items():
                    found[name] |= collect(each) - ({CONDITION} if is_function else set())
            return found[name]

        for name in self:
            collect(name)
        return found


def parameters(function: Callable[..., Any]) -> dict[str, bool]:
    """Return the arguments that a function must be given: name → whether it is a function itself.

    The annotation says so: `effort: FloatArray` is the effort of the condition at hand, `effort:
    Values` the function that gives the effort of any condition.
    """
    found = inspect.signature(function).parameters.values()
    return {
        each.name: get_origin(each.annotation) is Callable
        for each in found
        if each.default is each.empty
    }


def is_column(name: str) -> bool:
    """Return whether a name is that of a column of summaries."""
    return name in COLUMNS or name.startswith(TERM)


class Scope(Mapping[str, Any]):
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

    def __getitem__(self, name: str) -> Any:
        """Return a value; a function of a condition itself where no condition is bound.

        Raises:
            KeyError: If nothing has this name, or a function lacks an argument.
        """
        if name not in self._values:
            if self.outer is not None and not self._bound & self.needs(name):
                return self.outer[name]
            self._values[name] = self._computed(name)
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        outer = () if self.outer is None else self.outer
        return iter(dict.fromkeys([*outer, *self.functions, *self._values]))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __contains__(self, name: object) -> bool:
        known = name in self._values or name in self.functions
        return known or (self.outer is not None and name in self.outer)

    def call(self, function: Callable[..., Any], **given: Any) -> Any:
        """Call a function with the values that its arguments name."""
        for name, is_function in parameters(function).items():
            if name not in given:
                given[name] = self.function(name) if is_function else self[name]
        found = function(**given)
        return tuple(found) if isinstance(found, Iterator) else found

    def function(self, name: str) -> Any:
        """Return the function that gives the value of this name for any condition."""
        if CONDITION not in self.needs(name):
            return self[name]
        return lambda condition: self.inner(condition=condition)[name]

    def value(self, path: str) -> Any:
        """Return the value of a dotted name: `results.main`, `collision.blind`."""
        return markdown.Sentence(self).get_field(path, (), self)[0]

    def text(self, template: object) -> str:
        """Return a text with its words in braces filled in, see `markdown.filled`."""
        return markdown.filled(str(template), self)

    def needs(self, name: str) -> frozenset[str]:
        """Return the items and values that a name depends on, through all functions between."""
        if name in self.functions:
            return self.functions.needs[name]
        return frozenset({CONDITION} if is_column(name) else {name})

    def _computed(self, name: str) -> Any:
        if CONDITION in self.needs(name) and CONDITION not in self:
            return self.function(name)
        if name in self.functions:
            return self.call(self.functions[name])
        if not is_column(name):
            raise KeyError(name)
        return self[CONDITION].column(name)


def names_in(template: object) -> Iterator[str]:
    """Yield the names that a text with words in braces begins its words with."""
    for _, field, _, _ in string.Formatter().parse(str(template)):
        if field:
            yield field.partition(".")[0].partition("[")[0]
