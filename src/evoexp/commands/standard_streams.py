"""Standard input, output and error: open whoever started the process, and named by their errors."""

import contextlib
import os
import shutil
import sys
import textwrap
from collections.abc import Iterator
from typing import Any, TextIO, cast

from evoexp.errors import printable

OUTPUT = "standard output"  # the file name of its errors


class _Output:
    """Standard output, whose errors name it: those of the system name no file."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write as the stream does."""
        with _named():
            return self._stream.write(text)

    def flush(self) -> None:
        """Flush the stream."""
        with _named():
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextlib.contextmanager
def _named() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        error.filename = OUTPUT
        raise


def open_streams() -> None:
    """Open those that were closed on nothing, before a file of ours gets the number of one."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            descriptor = os.open(os.devnull, os.O_RDWR)
            if descriptor != number:
                os.dup2(descriptor, number)
                os.close(descriptor)
            mode = "w" if number else "r"
            setattr(sys, name, open(number, mode, closefd=False))  # noqa: SIM115  # for good
    sys.stdout = cast(TextIO, _Output(sys.stdout))


def silence_output() -> None:
    """Let all that is printed from now on vanish: nobody can read it."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


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
