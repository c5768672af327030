"""Ctrl-C, SIGTERM and a terminal that closes: each ends a command in the same orderly way.

The first signal raises `Interrupted`, by which everything is closed that a command has open. While
that lasts, further signals do nothing: whoever presses Ctrl-C again disturbs nothing.

The exception can be lost: Python drops exceptions raised in callbacks of its garbage collector and
import system, and a library may catch it with a bare `except:`. Closing can hang. A timer therefore
raises the exception again when it was lost, or when closing takes longer than `PATIENCE_S`; after
`CLOSING_S` the signal ends the process by its default action, with the same exit code in a shell.
No result is lost: finished files are complete at any moment.
"""

import atexit
import os
import signal
import sys
import threading
import time
from types import FrameType
from typing import NoReturn

PATIENCE_S = 3.0  # [s] that closing may take before what it waits for is interrupted, too
CLOSING_S = 15.0  # [s] that closing may take at all
ENDING_S = 3.0  # [s] that the interpreter may take to end: an interrupted thread may never do
AGAIN_S = 0.25  # [s] between two looks whether the exception is still under way
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


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
