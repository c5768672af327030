"""The time that numba takes to load and compile kernels, which is no part of a replicate's times.

numba asks for its compiler's lock once per kernel and signature, and holds it while it looks for
the kernel in the cache, waits for another process that compiles it, compiles it, and keeps it.
"""

import time
from typing import NamedTuple

from numba.core import event


class Times(NamedTuple):
    """Processor time and duration of something, or two readings of clocks [s]."""

    cpu_s: float
    wall_s: float

    def __sub__(self, earlier: "Times") -> "Times":
        return Times(self.cpu_s - earlier.cpu_s, self.wall_s - earlier.wall_s)


class _CompilerTimes(event.Listener):
    """Adds up the time during which the compiler's lock is held."""

    def __init__(self) -> None:
        self.cpu_s = self.wall_s = 0.0
        self._depth = 0
        self._begun = Times(0.0, 0.0)

    def on_start(self, event: object) -> None:
        if self._depth == 0:
            self._begun = _clocks()
        self._depth += 1

    def on_end(self, event: object) -> None:
        self._depth -= 1
        if self._depth == 0:
            taken = _clocks() - self._begun
            self.cpu_s += taken.cpu_s
            self.wall_s += taken.wall_s


_processor_time = time.process_time
_compiler = _CompilerTimes()
event.register("numba:compiler_lock", _compiler)


def now() -> Times:
    """Return processor time and time of this process, as if its kernels had always been there."""
    return _clocks() - Times(_compiler.cpu_s, _compiler.wall_s)


def cpu_now() -> float:
    """Return the processor time that `now` returns [s], in a third of the time."""
    return _processor_time() - _compiler.cpu_s


def _clocks() -> Times:
    return Times(_processor_time(), time.perf_counter())
