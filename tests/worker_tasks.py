"""Calls for worker processes, which can be killed before they answer, or while they do."""

import hashlib
import os
import random
import signal
import time
from pathlib import Path
from typing import NamedTuple

from evoexp.errors import SettingError

KILOBYTE, MEGABYTE = 10**3, 10**6
LEAST, MOST = KILOBYTE, 50 * MEGABYTE  # [B] of a result


class Struck(NamedTuple):
    """A task whose worker is killed once."""

    number: int  # seeds the result
    size: int  # of the result [B]
    # from the end of the computation to the kill by another process [s]; None: the worker kills
    # itself before it
    delay_s: float | None
    flag: Path | None  # a file that tells that it was killed; None: it is not


def content(number: int, size: int) -> bytes:
    """Return the result of a task."""
    return random.Random(number).randbytes(size)


def work(task: Struck) -> tuple[int, bytes, str]:
    """Compute a result; at its first time, have this process killed."""
    is_struck = task.flag is not None and not task.flag.exists()
    if task.flag is not None:
        task.flag.touch()
    if is_struck and task.delay_s is None:
        os.kill(os.getpid(), signal.SIGKILL)
    computed = content(task.number, task.size)
    if is_struck:
        _kill_later(task.delay_s or 0.0)
    return task.number, computed, hashlib.sha256(computed).hexdigest()


def _kill_later(delay_s: float) -> None:
    """Let another process kill this one; it has inherited all that is open here."""
    worker = os.getpid()
    if os.fork() == 0:
        time.sleep(delay_s)
        os.kill(worker, signal.SIGKILL)
        time.sleep(0.1)  # what it holds outlives the worker
        os._exit(0)


def refuse(what: str) -> None:
    if what == "setting":
        raise SettingError("ga.population_size", "positive", -1)
    raise LookupError(what)


def end_once(number: int, flags: str, way: str) -> int:
    flag = Path(flags) / str(number)
    if not flag.exists():
        flag.touch()
        end(way)
    return number


def end(way: str) -> None:
    if way == "exit":
        raise SystemExit(3)
    os.kill(os.getpid(), signal.SIGKILL)


def fork_and_die(seconds: float) -> None:
    if os.fork() == 0:
        time.sleep(seconds)
        os._exit(0)
    os.kill(os.getpid(), signal.SIGKILL)
