"""Standard input, output and error: open whoever started the process; one-line complaints."""

import contextlib
import os
import shutil
import sys
import textwrap

from evoexp.errors import printable

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
