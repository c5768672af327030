"""Limits of a single replicate: of its time, and of its memory in a worker process.

What takes too long is ended by an exception, which compiled code notices when it returns; a worker
whose replicate does not end so is ended as a whole.
"""

import contextlib
import ctypes
import faulthandler
import os
import resource
import signal
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from evoexp.errors import EvoexpError

GRACE_S = 2.0  # [s] between the exception and the end of the process
_STATUS = Path("/proc/self/statm")


class TookTooLong(EvoexpError):
    """A replicate that was not done in time."""


class ReplicateLimits(NamedTuple):
    """Limits of one replicate."""

    timeout_s: float | None = None  # wall time [s]; None: none
    # memory that a worker may take for it beyond what it has [B]; None: none
    memory_b: int | None = None

    @property
    def reason(self) -> str:
        """The reason of a replicate that was not done in time."""
        return f"took longer than runner.timeout_s = {self.timeout_s:g}"


@contextlib.contextmanager
def limited(limits: ReplicateLimits, *, in_worker: bool) -> Iterator[None]:
    """Keep the body within limits, by `TookTooLong` and, in workers, by MemoryError."""
    with _in_time(limits, in_worker):
        used, (soft, hard) = used_addresses(), resource.getrlimit(resource.RLIMIT_AS)
        may_limit = in_worker and used and allowed_addresses() is None
        if limits.memory_b is None or not may_limit:
            yield
            return
        resource.setrlimit(resource.RLIMIT_AS, (used + limits.memory_b, hard))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@contextlib.contextmanager
def _in_time(limits: ReplicateLimits, in_worker: bool) -> Iterator[None]:
    is_main = threading.current_thread() is threading.main_thread()  # else no signal reaches it
    seconds = limits.timeout_s
    if seconds is None or not (is_main or in_worker):
        yield
        return

    def tell(number: int, frame: Any) -> None:
        raise TookTooLong

    late = ctypes.c_ulong(threading.get_ident()), ctypes.py_object(TookTooLong)
    timer = threading.Timer(seconds, ctypes.pythonapi.PyThreadState_SetAsyncExc, late)
    timer.daemon = True
    with open(os.devnull, "w") as nowhere:
        if in_worker:  # a thread of C, which needs nothing of the interpreter
            faulthandler.dump_traceback_later(seconds + GRACE_S, exit=True, file=nowhere)
        if is_main:
            before = signal.signal(signal.SIGALRM, tell)
            signal.setitimer(signal.ITIMER_REAL, seconds)
        else:
            timer.start()
        try:
            yield
        finally:
            if in_worker:
                faulthandler.cancel_dump_traceback_later()
            if not is_main:
                timer.cancel()
                timer.join()  # what it raises is raised by now
            # where an interruption has the timer now, it keeps it
            elif signal.getsignal(signal.SIGALRM) is tell:
                signal.setitimer(signal.ITIMER_REAL, 0.0)
                signal.signal(signal.SIGALRM, before)


def allowed_addresses() -> int | None:
    """Return how many addresses this process may take [B]; None: no limit is set."""
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if soft in (resource.RLIM_INFINITY, -1) else soft


def used_addresses() -> int:
    """Return how many addresses this process has taken [B]; 0 where the system does not tell."""
    with contextlib.suppress(OSError, ValueError):
        return int(_STATUS.read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    return 0
