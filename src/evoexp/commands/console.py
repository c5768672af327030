"""The console that commands print on: readable at any width, exact when piped; and JSON."""

import json
import math
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from evoexp.errors import EvoexpError, printable

PIPED_WIDTH = 160  # columns of a table in a pipe, where nobody has to read it on a narrow screen


class _Console(Console):
    """A console that goes on in silence when the reader of a pipe has left."""

    def render_str(self, text: str, **look: Any) -> Text:
        return super().render_str(printable(text), **look)

    def print(self, *objects: Any, soft_wrap: bool | None = None, **look: Any) -> None:
        """Print; on a terminal, break between words a line that a pipe has whole."""
        super().print(*objects, soft_wrap=soft_wrap and not self.is_terminal, **look)

    def on_broken_pipe(self) -> None:
        self.quiet = True
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def plain_console() -> Console:
    """Return a console on stdout that prints text as it is: a label like `[4, 4]` is no markup."""
    size: Any = {}
    if not sys.stdout.isatty() and "COLUMNS" not in os.environ:
        size["width"] = PIPED_WIDTH
    elif os.environ.get("TERM") == "dumb":  # which rich takes to be 80 columns wide
        size["width"], size["height"] = shutil.get_terminal_size()
    return _Console(markup=False, emoji=False, highlight=False, **size)


def say(*parts: str | Text | Table) -> None:
    """Print a table, or a line, which a pipe has whole."""
    plain_console().print(*parts, soft_wrap=not isinstance(parts[0], Table))


def say_each(draws: Iterable[Callable[[], object]]) -> None:
    """Draw reports, and say where each is; one that cannot be drawn keeps no other from it."""
    errors = []
    for draw in draws:
        try:
            say(f"report: {draw()}")
        except EvoexpError as error:
            errors.append(error)
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise EvoexpError("; ".join(map(str, errors)))


def coloured(text: str, colour: str = "") -> Text:
    """Return a text for a cell, in a colour, its control characters made visible."""
    return Text(printable(text), colour)


def new_table(
    title: str, *columns: str | Column, rows: Iterable[Iterable[str | Text]] = ()
) -> Table:
    """Return a table of rows whose cells are folded where the terminal is too narrow, never cut."""
    heads = [Column(each, overflow="fold") if isinstance(each, str) else each for each in columns]
    table = Table(*heads, title=title or None, title_justify="left")
    for row in rows:
        table.add_row(*row)
    return table


def hash_column(name: str = "hash") -> Column:
    """Return a column of twelve hex digits, which are never broken."""
    return Column(name, no_wrap=True, min_width=12)


def right(*names: str) -> list[Column]:
    """Return columns of numbers, which stand on the right."""
    return [Column(name, justify="right", overflow="fold") for name in names]


def print_json(value: Any) -> None:
    """Print valid JSON: numbers that are not finite, which JSON does not have, become null."""
    print(json.dumps(_plain(value), indent=2, allow_nan=False))


def _plain(value: Any) -> Any:
    """Return a value that JSON can hold: scalars of numpy as Python's, other values as text."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "dtype") and hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, bool | int | float | str | None) else str(value)
