"""Ctrl-C, SIGTERM and a terminal that closes: each ends a command in the same orderly way.

The first signal raises `Interrupted`, by which everything is closed that a command has open. While
that lasts, further signals do nothing: whoever presses Ctrl-C again disturbs nothing. If it takes
longer than `PATIENCE_S`, the next one ends the process at once; if it takes longer than
`CLOSING_S`, as where a library waits for a task that never ends, no further one is needed. Nothing
is lost by that: finished files are whole at any moment.

A library may catch the exception with a bare `except:` and go on. A timer therefore looks whether
the exception is still under way, and raises another one if not.
"""

import contextlib
import os
import signal
import sys
import threading
import time
from types import FrameType
from typing import NoReturn

PATIENCE_S = 5.0  # [s] that closing may take before a further signal ends the process at once
CLOSING_S = 15.0  # [s] that closing may take at all
AGAIN_S = 0.25  # [s] between two looks whether the exception is still under way
_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # some systems lack the last one


class Interrupted(BaseException):
    """Ends a command; no `KeyboardInterrupt`, after which Python may end by SIGINT anyhow."""


class Interruption:
    """Hears the signals that ask this process to end.

    Attributes:
        number: The first signal that was heard; None: none was.
    """

    def __init__(self) -> None:
        """Hear nothing yet."""
        self.number: int | None = None
        self._since = 0.0  # when it was heard
        self._ended = False  # whether the command did
        self._numbers: list[int] = []

    @property
    def exit_code(self) -> int:
        """130 after Ctrl-C, 143 after SIGTERM: as a shell counts."""
        return 128 + (self.number or signal.SIGINT)

    def hear(self) -> None:
        """Hear signals from now on; one that this process was started to ignore stays ignored."""
        for name in _NAMES:
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self._heard)
                self._numbers.append(number)
        # What a callback cannot raise is printed elsewhere; this is raised again instead, and what
        # a library's destructors and threads say of their interrupted work helps nobody.
        unraised, printed, told = sys.unraisablehook, sys.excepthook, threading.excepthook
        sys.unraisablehook = lambda it: None if self.number is not None else unraised(it)
        threading.excepthook = lambda it: None if self.number is not None else told(it)
        sys.excepthook = lambda *it: None if it[0] is Interrupted else printed(*it)

    def end(self) -> None:
        """Raise nothing any more: the command has ended, and the process soon will."""
        if self._ended:
            return
        self._ended = True
        if self.number is not None and hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0.0)

    def leave(self) -> None:
        """Ignore signals while the interpreter ends: one more would change the exit code.

        After a signal it may take `CLOSING_S` at most, whatever libraries wait for.
        """
        for number in self._numbers:
            signal.signal(number, signal.SIG_IGN)
        if self.number is not None and hasattr(signal, "setitimer"):
            signal.signal(signal.SIGALRM, lambda number, frame: self._leave_at_once())
            signal.setitimer(signal.ITIMER_REAL, CLOSING_S)

    def _heard(self, number: int, frame: FrameType | None) -> None:
        if self.number is None and not self._ended:
            self.number, self._since = number, time.monotonic()
            if hasattr(signal, "setitimer"):
                signal.signal(signal.SIGALRM, self._look)
                signal.setitimer(signal.ITIMER_REAL, AGAIN_S, AGAIN_S)
            raise Interrupted
        if self._since and time.monotonic() - self._since > PATIENCE_S:
            self._leave_at_once()
        self._look(number, frame)

    def _leave_at_once(self) -> NoReturn:
        """End the process; its workers end with it."""
        shown_cursor = "\x1b[?25h" if sys.stderr.isatty() else ""
        with contextlib.suppress(OSError):
            os.write(2, f"{shown_cursor}\nevoexp: interrupted\n".encode())
        os._exit(self.exit_code)

    def _look(self, number: int, frame: FrameType | None) -> None:
        """Raise again if the exception was caught somewhere and the command goes on."""
        if self.number is None or self._ended:
            return
        if time.monotonic() - self._since > CLOSING_S:
            self._leave_at_once()
        error = sys.exception()
        while error is not None and not isinstance(error, Interrupted):
            error = error.__context__
        if error is None:
            raise Interrupted
