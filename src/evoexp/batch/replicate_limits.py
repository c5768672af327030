"""Limits of a single replicate: of its time, and of its memory in a worker process.

What takes too long is ended softly at first: by an exception, which compiled code notices when it
returns. A worker whose replicate does not end so is ended as a whole; the replicate is its only
loss, as the others in flight run again.
"""

import contextlib
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
    """Keep the body within limits.

    Raises:
        TookTooLong: The body took too long.
        MemoryError: It took too much memory.
    """
    with _in_time(limits, in_worker), _in_memory(limits.memory_b if in_worker else None):
        yield


@contextlib.contextmanager
def _in_time(limits: ReplicateLimits, in_worker: bool) -> Iterator[None]:
    seconds = limits.timeout_s
    alone = threading.current_thread() is not threading.main_thread()
    if seconds is None or not hasattr(signal, "setitimer") or (alone and not in_worker):
        yield
        return
    if alone:  # no signal reaches a thread
        with open(os.devnull, "w") as nowhere:
            faulthandler.dump_traceback_later(seconds, exit=True, file=nowhere)
            try:
                yield
            finally:
                faulthandler.cancel_dump_traceback_later()
        return

    def tell(number: int, frame: Any) -> None:
        raise TookTooLong(limits.reason)

    before = signal.signal(signal.SIGALRM, tell)
    with open(os.devnull, "w") as nowhere:
        if in_worker:  # a thread of C, which needs nothing of the interpreter
            faulthandler.dump_traceback_later(seconds + GRACE_S, exit=True, file=nowhere)
        signal.setitimer(signal.ITIMER_REAL, seconds)
        try:
            yield
        finally:
            if signal.getsignal(signal.SIGALRM) is tell:  # else an interruption has the timer now
                signal.setitimer(signal.ITIMER_REAL, 0.0)
                signal.signal(signal.SIGALRM, before)
            if in_worker:
                faulthandler.cancel_dump_traceback_later()


@contextlib.contextmanager
def _in_memory(limit: int | None) -> Iterator[None]:
    """Limit the addresses that this process may take besides those that it has, where one can."""
    used, (soft, hard) = used_addresses(), resource.getrlimit(resource.RLIMIT_AS)
    if limit is None or not used or allowed_addresses() is not None:
        yield
        return
    resource.setrlimit(resource.RLIMIT_AS, (used + limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def allowed_addresses() -> int | None:
    """Return how many addresses this process may take [B]; None: no limit is set."""
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if soft in (resource.RLIM_INFINITY, -1) else soft


def used_addresses() -> int:
    """Return how many addresses this process has taken [B]; 0 where the system does not tell."""
    with contextlib.suppress(OSError, ValueError):
        return int(_STATUS.read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    return 0
