"""Runs hostile examples where they can do no harm, and tells what they tried.

A task runs in a child process with little memory beyond what its parent has. The child notes every
file that is opened for writing, removed or renamed outside of one folder, every process that is
started and every connection that is made: data must never bring any of that about.
"""

import contextlib
import os
import pickle
import resource
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any, TypeVar

from evoexp.numeric.cache_folder import cache_root

Result = TypeVar("Result")

SECONDS = 20.0  # [CPU s] a hostile example takes far less
MEGABYTE = 2**20
_FORBIDDEN = (
    *("os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.startfile", "subprocess.Popen"),
    *("socket.connect", "pty.spawn"),
)
_CHANGES = (
    *("os.remove", "os.rename", "os.rmdir", "os.mkdir"),
    *("os.symlink", "os.link", "os.truncate"),
)
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND


class Hang(BaseException):
    """An example took too long; no `except Exception` keeps it."""


@contextlib.contextmanager
def no_longer(seconds: float = SECONDS) -> Iterator[None]:
    """End the body with `Hang` if it takes too long."""

    def ring(signum: int, frame: FrameType | None) -> None:
        raise Hang(f"still at it after {seconds} s of CPU time")

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def confined(task: Callable[[], Result], folder: Path, memory_mb: int) -> Result:
    """Return the result of a task that ran in a child process, with so much more memory [MiB].

    It fails if it does what data must not bring about, or writes anywhere but in the folder.
    """
    sys.stdout.flush()
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        with os.fdopen(writer, "wb") as answer:
            pickle.dump(_attempt(task, folder, memory_mb), answer)
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as answer:
        content = answer.read()
    status = os.waitpid(child, 0)[1]
    assert content, f"the task's process ended with status {status}"
    outcome, deeds = pickle.loads(content)
    assert not deeds, deeds[:5]
    if isinstance(outcome, _Failure):
        raise AssertionError(outcome)
    return outcome  # type: ignore[no-any-return]


class _Failure(str):
    """The trace of an exception."""


def _attempt(task: Callable[[], Any], folder: Path, memory_mb: int) -> tuple[Any, list[str]]:
    deeds: list[str] = []
    sys.dont_write_bytecode = True  # of modules that are imported late
    sys.addaudithook(_watcher(folder, deeds))
    os.chdir(folder)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    limit = used + memory_mb * MEGABYTE
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    try:
        return task(), deeds
    except BaseException:
        return _Failure(traceback.format_exc()), deeds


def _watcher(folder: Path, deeds: list[str]) -> Callable[[str, tuple[Any, ...]], None]:
    """Return an audit hook that notes deeds which data must not bring about."""
    temporary = tempfile.gettempdir() + "/tmp"  # `tempfile`'s
    allowed = (str(folder.resolve()), str(cache_root().resolve()), temporary, "/dev/null")

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        is_change = event in _CHANGES
        if event == "open":
            _, mode, flags = arguments
            is_change = bool(flags & _WRITES) if mode is None else not {*"wax+"}.isdisjoint(mode)
        place = "/dev/null"
        if is_change and not isinstance(arguments[0], int):
            place = os.path.abspath(os.fsdecode(arguments[0]))
        if event in _FORBIDDEN or not place.startswith(allowed):
            deeds.append(f"{event}{arguments!r:.200}")

    return watch
