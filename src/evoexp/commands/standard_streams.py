"""Standard input, output and error: open whoever started the process; one-line complaints."""

import contextlib
import os
import shutil
import sys
import textwrap
import warnings
from collections.abc import Iterator
from typing import Any

from evoexp.errors import DamagedStore, printable

OUTPUT = "standard output"  # the file name of its errors


def open_streams() -> None:
    """Open closed standard streams on the null device, before one of our files gets their number.

    They stay open, and are opened in the order of their numbers.
    """
    sys.stdin = sys.stdin or open(os.devnull)  # noqa: SIM115
    sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: SIM115
    sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: SIM115


def settle_streams() -> None:
    """Flush what was printed; where that fails, let it vanish.

    Python tries again when it ends, and what fails then changes the exit code to 120.
    """
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            with contextlib.suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def complain(text: str) -> None:
    """Print words on standard error, if it can be: one line; on a terminal, no word broken."""
    line = f"evoexp: {printable(' '.join(text.split()))}"
    with contextlib.suppress(OSError, ValueError):
        if sys.stderr.isatty():
            columns = shutil.get_terminal_size().columns
            line = textwrap.fill(line, columns, break_long_words=False, break_on_hyphens=False)
        print(line, file=sys.stderr, flush=True)


@contextlib.contextmanager
def damage_in_lines() -> Iterator[None]:
    """Print warnings of damaged files as `evoexp: …`, each line once, while the body runs."""
    said: set[str] = set()
    with warnings.catch_warnings():
        shown = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *place: Any, **rest: Any) -> None:
            if not issubclass(category, DamagedStore):
                shown(message, category, *place, **rest)
            elif (text := " ".join(str(message).split())) not in said:
                said.add(text)
                print(f"evoexp: {printable(text)}", file=sys.stderr)

        warnings.simplefilter("always", DamagedStore)
        warnings.showwarning = show
        yield
