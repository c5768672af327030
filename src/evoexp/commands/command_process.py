"""The process of a command: its streams, temporary files, lack of memory, and interruptions.

Whatever library makes a temporary file, in this process or a worker, makes it in the command's
folder, which is removed at the end.

Where addresses are limited (`ulimit -v`), a library that cannot be loaded is an `ImportError`, a
thread that cannot be started a `RuntimeError`, and some libraries end the process by themselves.

Ctrl-C, SIGTERM and a terminal that closes each end a command in the same orderly way. The first
signal raises `Interrupted`, by which everything is closed that a command has open. While that
lasts, further signals do nothing: whoever presses Ctrl-C again disturbs nothing. The exception can
be lost: Python drops exceptions raised in callbacks of its garbage collector and import system, and
a library may catch it with a bare `except:`. Closing can hang. A timer therefore raises the
exception again when it was lost, or when closing takes longer than `PATIENCE_S`; after `CLOSING_S`
the signal ends the process by its default action, with the same exit code in a shell. No result is
lost: finished files are complete at any moment.
"""

import atexit
import contextlib
import errno
import os
import shutil
import signal
import sys
import tempfile
import textwrap
import threading
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any, NoReturn

from evoexp.batch.replicate_limits import allowed_addresses
from evoexp.errors import Notice, printable
from evoexp.numeric.cache_folder import remove_at_exit

OUTPUT = "standard output"  # the file name of its errors
MEGABYTE = 10**6
LEAST_MB = 2_500  # [MB] of addresses; a shipped run that compiles its kernels took 2,219
_TEXTS = ("failed to map segment", "cannot allocate memory", "can't start new thread", "bad_alloc")
PATIENCE_S = 3.0  # [s] that closing may take before what it waits for is interrupted, too
CLOSING_S = 15.0  # [s] that closing may take at all
ENDING_S = 3.0  # [s] that the interpreter may take to end: an interrupted thread may never do
AGAIN_S = 0.25  # [s] between two looks whether the exception is still under way
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def use_temporary_folder() -> None:
    """Have temporary files of this process, and of those it starts, in a folder of its own.

    Without one, where none can be made, they are where they would be anyhow.
    """
    with contextlib.suppress(OSError):
        folder = tempfile.mkdtemp(prefix="evoexp-command-")
        remove_at_exit(Path(folder))
        os.environ["TMPDIR"] = tempfile.tempdir = folder


def refuse_too_little_memory() -> None:
    """Refuse limits with which libraries or the compiler end the process, or never come back."""
    allowed = allowed_addresses()
    if allowed is not None and allowed < LEAST_MB * MEGABYTE:
        raise MemoryError(f"a command needs at least {LEAST_MB:,} MB of address space")


def memory_shortage(error: BaseException) -> str:
    """Describe the lack of memory that an error means; empty if it means something else."""
    chain: list[BaseException] = []
    cause: BaseException | None = error
    while cause is not None and cause not in chain:
        chain.append(cause)
        cause = cause.__cause__ or cause.__context__
    texts = []
    for each in chain:
        lines = [line.strip() for line in str(each).splitlines() if line.strip()]
        named = [line for line in lines if any(text in line.lower() for text in _TEXTS)]
        is_named = isinstance(each, OSError) and each.errno == errno.ENOMEM
        if named or is_named or isinstance(each, MemoryError):
            texts.append((named or lines or ["the system gives no more"])[0])
    if not texts:
        return ""
    allowed = allowed_addresses()
    limit = f" (`ulimit -v` allows {allowed // MEGABYTE:,} MB)" if allowed is not None else ""
    return f"out of memory: {texts[-1]}{limit}"


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
def notices_in_lines() -> Iterator[None]:
    """Print notices as `evoexp: …`, each line once, while the body runs."""
    said: set[str] = set()
    with warnings.catch_warnings():
        shown = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *place: Any, **rest: Any) -> None:
            if not issubclass(category, Notice):
                shown(message, category, *place, **rest)
            elif (text := " ".join(str(message).split())) not in said:
                said.add(text)
                print(f"evoexp: {printable(text)}", file=sys.stderr)

        warnings.simplefilter("always", Notice)
        warnings.showwarning = show
        yield


class Interrupted(BaseException):
    """Ends a command; no `KeyboardInterrupt`, after which Python may end by SIGINT anyhow."""


class Interruption:
    """Hears the signals that ask this process to end.

    Attributes:
        number: The first signal that was heard; None: none was.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self._since = self._raised = 0.0  # when it was heard, and `Interrupted` raised last [s]
        self._has_ended = False  # whether the command did

    @property
    def exit_code(self) -> int:
        """130 after Ctrl-C, 143 after SIGTERM: as a shell counts."""
        return 128 + (self.number or signal.SIGINT)

    def hear(self) -> None:
        """Hear signals from now on; one that this process was started to ignore stays ignored."""
        for number in _SIGNALS:
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._hear)
        # the timer of `end` stops once threads have ended, and what libraries do at exit is done:
        # Python takes its handlers back then, and the timer alone would change the exit code
        atexit.register(signal.setitimer, signal.ITIMER_REAL, 0.0)
        # what callbacks and threads of libraries say of their interrupted work helps nobody
        in_callback, in_thread = sys.unraisablehook, threading.excepthook
        sys.unraisablehook = lambda it: None if self.number is not None else in_callback(it)
        threading.excepthook = lambda it: None if self.number is not None else in_thread(it)

    def end(self) -> None:
        """Raise nothing any more: the command has ended, and the process soon will.

        After a signal, further ones are ignored: they would change the exit code.
        """
        self._has_ended = True
        if self.number is not None:
            for number in _SIGNALS:
                if signal.getsignal(number) == self._hear:
                    signal.signal(number, signal.SIG_IGN)
            signal.setitimer(signal.ITIMER_REAL, ENDING_S)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        if self.number is None and not self._has_ended:
            self.number, self._since = number, time.monotonic()
            signal.signal(signal.SIGALRM, self._look)
            signal.setitimer(signal.ITIMER_REAL, AGAIN_S, AGAIN_S)
            self._raise()

    def _look(self, number: int, frame: FrameType | None) -> None:
        """Raise again if the exception was lost, or if closing takes too long."""
        assert self.number is not None, "the timer runs after a signal"
        now, error = time.monotonic(), sys.exception()
        while error is not None and not isinstance(error, Interrupted):
            error = error.__context__  # raised while the exception was handled
        if self._has_ended or now - self._since > CLOSING_S:
            signal.signal(self.number, signal.SIG_DFL)
            os.kill(os.getpid(), self.number)
        elif now - self._raised > PATIENCE_S or error is None:
            self._raise()

    def _raise(self) -> NoReturn:
        self._raised = time.monotonic()
        raise Interrupted
