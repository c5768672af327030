"""The schema of the data behind a figure: its columns, and what they hold."""

import functools
import inspect
import re
import sys
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import pandas as pd

_RETURNS = re.compile(r"^Returns:\n((?:(?: .*)?\n?)+)", re.MULTILINE)
_NAME = re.compile(r"`([A-Za-z_][\w.]*)`")
_KINDS = {"b": "true or false", "i": "integer", "u": "integer", "f": "number"}


def schema(table: pd.DataFrame, source: Callable[..., Any]) -> dict[str, Any]:
    """Return the schema of a table as plain data: kinds of its columns, and what is in them.

    Args:
        table: The data, one row per mark of the figure.
        source: Gives the table; the section `Returns:` of its docstring tells the columns.
    """
    columns = {str(name): _kind(table[name]) for name in table.columns}
    return {"columns": columns, "description": description(source)}


def description(source: Callable[..., Any]) -> str:
    """Return the words of a function's docstring on the table that it returns, as one line.

    Where it names another table (`links_table`) or a list of columns (`COLUMNS`), that is told
    behind it.
    """
    return " ".join(_told(source, set()))


def _told(source: Callable[..., Any], told: set[str]) -> Iterator[str]:
    while isinstance(source, functools.partial):
        source = source.func
    text = inspect.getdoc(source) or ""
    found = _RETURNS.search(text)
    text = " ".join((found[1] if found else text).split())
    yield text
    module = sys.modules.get(getattr(source, "__module__", ""))
    for name in dict.fromkeys(_NAME.findall(text)):
        named = _named(module, name)
        if named is None or name in told:
            continue
        told.add(name)
        if isinstance(named, list | tuple):
            yield f"`{name}`: {', '.join(map(str, named))}."
        elif callable(named):
            first, *more = _told(named, told)
            yield " ".join([f"`{name}`: {first}", *more])


def _named(module: Any, name: str) -> Any:
    """Return the object of a dotted name in a module; of a module its `COLUMNS`."""
    found = module
    for part in name.split("."):
        found = getattr(found, part, None)
    return getattr(found, "COLUMNS", None) if isinstance(found, ModuleType) else found


def _kind(values: pd.Series) -> str:
    return _KINDS.get(values.dtype.kind, "text")
