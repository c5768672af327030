"""Errors that mean that the system gives no more memory, whichever library noticed it.

Where addresses are limited (`ulimit -v`), a library that cannot be loaded is an `ImportError`, a
thread that cannot be started a `RuntimeError`, and some libraries end the process by themselves.
"""

import contextlib
import errno
import os
import resource
from collections.abc import Iterator
from pathlib import Path

MEGABYTE = 10**6
LEAST_MB = 250  # [MB] of addresses, below which no command can load its libraries
LARGEST_MB = 400  # [MB] of addresses that loading one library and its kernels takes, at most
_TEXTS = ("failed to map segment", "cannot allocate memory", "can't start new thread", "bad_alloc")
_STATUS = Path("/proc/self/statm")


def refuse_too_little() -> None:
    """Refuse limits with which libraries end the process before they can be asked.

    Raises:
        MemoryError: If a limit is below `LEAST_MB`.
    """
    allowed = _allowed()
    if allowed is not None and allowed < LEAST_MB * MEGABYTE:
        raise MemoryError(f"a command needs {LEAST_MB} MB of addresses at least")


def shortage(error: BaseException) -> str:
    """Describe the lack of memory that an error means; empty if it means something else."""
    texts = [text for each in _chain(error) if (text := _shortage(each))]
    if not texts and isinstance(error, ImportError | OSError | RuntimeError | SystemError):
        left = _left()
        texts = [_first_line(error)] if left is not None and left < LARGEST_MB * MEGABYTE else []
    if not texts:
        return ""
    allowed = _allowed()
    limit = f" (`ulimit -v` allows {allowed // MEGABYTE:,} MB)" if allowed is not None else ""
    return f"out of memory: {texts[-1]}{limit}"


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    """Yield an error, and those that led to it."""
    seen = set[int]()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        yield error
        error = error.__cause__ or error.__context__


def _shortage(error: BaseException) -> str:
    is_shortage = (
        isinstance(error, MemoryError)
        or (isinstance(error, OSError) and error.errno == errno.ENOMEM)
        or any(text in str(error).lower() for text in _TEXTS)
    )
    return (_first_line(error) or "the system gives no more") if is_shortage else ""


def _first_line(error: BaseException) -> str:
    """Return the line of an error that names the memory, else its first one."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    named = [line for line in lines if any(text in line.lower() for text in _TEXTS)]
    return (named or lines or [""])[0]


def _allowed() -> int | None:
    """Return how many addresses this process may take [B]; None: no limit is set."""
    soft, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if soft in (resource.RLIM_INFINITY, -1) else soft


def _left() -> int | None:
    """Return how many addresses this process may still take [B]; None: that is not known."""
    allowed = _allowed()
    with contextlib.suppress(OSError, ValueError):
        pages = int(_STATUS.read_text().split()[0])
        return None if allowed is None else allowed - pages * os.sysconf("SC_PAGE_SIZE")
    return None
