"""Warnings of a damaged store as lines on stderr."""

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO

from evoexp.errors import DamagedStore, printable


@contextmanager
def damage_in_lines() -> Iterator[None]:
    """Print warnings of damaged files as `evoexp: …`, each line once, while the body runs."""
    said: set[str] = set()
    with warnings.catch_warnings():
        shown = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if not issubclass(category, DamagedStore):
                shown(message, category, filename, lineno, file, line)
            elif (text := " ".join(str(message).split())) not in said:
                said.add(text)
                print(f"evoexp: {printable(text)}", file=sys.stderr)

        warnings.simplefilter("always", DamagedStore)
        warnings.showwarning = show
        yield
