"""Processes of this machine, as /proc lists them, and waiting for what they do."""

import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

PATIENCE_S = 120.0  # [s] for anything that a busy machine may take long for


class Process(NamedTuple):
    """A living process: a dead one may still wait for whoever inherited it."""

    number: int
    parent: int
    group: int
    is_server: bool  # from which workers are forked


def processes() -> list[Process]:
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, parent, group = stat.read_text().rpartition(") ")[2].split()[:3]
            is_server = b"worker_server" in (stat.parent / "cmdline").read_bytes()
            if state != "Z":
                found.append(Process(int(stat.parent.name), int(parent), int(group), is_server))
    return found


def of_group(group: int) -> list[Process]:
    return [each for each in processes() if each.group == group]


def eventually(holds: Callable[[], object], patience_s: float = PATIENCE_S) -> bool:
    """Return whether something holds before patience ends."""
    end = time.monotonic() + patience_s
    while not holds():
        if time.monotonic() > end:
            return False
        time.sleep(0.005)
    return True


def are_gone(*numbers: int) -> bool:
    """Return whether processes end soon."""
    return eventually(lambda: not {each.number for each in processes()} & {*numbers}, 20.0)
