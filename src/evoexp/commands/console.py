"""What commands print on: readable at any width, exact when piped."""

import os
import sys

from rich.console import Console
from rich.table import Table

PIPED_WIDTH = 160  # columns of a table in a pipe, where nobody has to read it on a narrow screen


class _Console(Console):
    """Goes on in silence where the reader of a pipe has left.

    The work and its exit code are the same.
    """

    def on_broken_pipe(self) -> None:
        self.quiet = True
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def plain_console() -> Console:
    """Return a console on stdout that prints text as it is: a label like `[4, 4]` is no markup."""
    piped = not sys.stdout.isatty() and "COLUMNS" not in os.environ
    return _Console(markup=False, highlight=False, width=PIPED_WIDTH if piped else None)


def new_table(title: str = "") -> Table:
    """Return an empty table."""
    return Table(title=title or None, title_justify="left")


def add_hash_column(table: Table, name: str = "hash") -> None:
    """Add a column of twelve hex digits, which are never cut."""
    table.add_column(name, no_wrap=True, min_width=12)


def add_columns(table: Table, *names: str, right: bool = False) -> None:
    """Add columns whose cells are folded where the terminal is too narrow, never cut."""
    for name in names:
        table.add_column(name, justify="right" if right else "left", overflow="fold")
