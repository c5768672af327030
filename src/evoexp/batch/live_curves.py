"""Convergence of the replicates that are running: each worker leaves it in a file, now and then."""

import json
import os
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from evoexp.records import Block

INTERVAL_S = 0.2  # [s] between two files of a worker
NUM_POINTS = 48  # of a curve, at most

_written: dict[str, float] = {}  # folder → when this process left a curve there last


class Curve(NamedTuple):
    """Convergence of a replicate so far."""

    condition_id: str  # 64 hex digits
    replicate: int  # its index
    generation: int  # the last one
    # best cost so far at up to `NUM_POINTS` generations, from the first to the last one; inf where
    # nothing is solved
    costs: list[float]


class CurveFile:
    """Hears the generations of one replicate, and leaves their convergence for others to see."""

    def __init__(self, folder: Path, condition_id: str, replicate: int) -> None:
        self._folder, self._of = folder, (condition_id, replicate)
        self._costs: list[float] = []

    def hear(self, block: Block) -> None:
        """Note generations; write at most every `INTERVAL_S`, whatever replicate is running."""
        self._costs += [float(best.cost) for best in block.best_of_each]
        now, key = time.monotonic(), str(self._folder)
        if now - _written.setdefault(key, now) < INTERVAL_S:
            return
        _written[key] = now
        last = len(self._costs) - 1
        steps = min(NUM_POINTS - 1, last)
        thinned = [self._costs[k * last // steps] for k in range(steps)] + self._costs[-1:]
        with suppress(OSError):  # nobody looks any more, or the disk is full
            unfinished = self._folder / f"{os.getpid()}.unfinished"
            unfinished.write_text(json.dumps(Curve(*self._of, last, thinned)))
            unfinished.replace(self._folder / f"{os.getpid()}.json")


def read_curves(folder: Path) -> list[Curve]:
    """Return the curves that the workers left last, one of each."""
    curves = []
    for path in sorted(folder.glob("*.json")):
        with suppress(OSError, ValueError, TypeError):
            curves.append(Curve(*json.loads(path.read_text())))
    return curves
