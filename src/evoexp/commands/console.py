"""The console that commands print on: readable at any width, exact when piped; and JSON."""

import json
import math
import os
import shutil
import sys
from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from evoexp.commands.word_tables import WordTable
from evoexp.errors import printable

PIPED_WIDTH = 160  # columns of a table in a pipe, where nobody has to read it on a narrow screen


class _Console(Console):
    """A console that goes on in silence when the reader of a pipe has left.

    The command does the rest of its work, and its exit code is the same.
    """

    def render_str(self, text: str, **look: Any) -> Text:
        """Render a text as it is, its control characters made visible."""
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


def coloured(text: str, colour: str = "") -> Text:
    """Return a text for a cell, in a colour, its control characters made visible."""
    return Text(printable(text), colour)


def new_table(title: str = "") -> WordTable:
    """Return an empty table."""
    return WordTable(title=title or None, title_justify="left")


def table_without_lines() -> WordTable:
    """Return an empty table whose cells stand two columns apart."""
    table = WordTable(box=None)
    table.gap = 2
    return table


def add_hash_column(table: Table, name: str = "hash") -> None:
    """Add a column of twelve hex digits, which are never cut."""
    table.add_column(name, no_wrap=True, min_width=12)


def add_columns(table: Table, *names: str, right: bool = False) -> None:
    """Add columns whose cells are folded where the terminal is too narrow, never cut."""
    for name in names:
        table.add_column(name, justify="right" if right else "left", overflow="fold")


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
