"""A plug-in for tests: Rana & Zalzala's planner, which fails where the environment tells it to.

`FAULTY` holds `<what>:<replicates>`, several with `;`: `raise:1,3`, `kill:2`, `kill_once:4`,
`hang:5,6`, `slow:1`, `slow_once:1`, `deaf:1` (slow, and no signal ends it), `eat:1` (80 GB). It is
no part of the condition, so that results can be compared with those of an undisturbed run.
"""

import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

import numpy as np

from evoexp.planners.via_point_ga.planner import Problem, ViaPointGa
from evoexp.records import Generation, generations

HANG_S = 3600.0  # [s] until somebody ends the process


class Faulty(ViaPointGa):
    component: ClassVar[str] = "faulty"

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Generation]:
        seed = rng.bit_generator.seed_seq
        assert isinstance(seed, np.random.SeedSequence)
        for generation in generations(super().evolve(problem, rng)):
            if generation.index == 1:
                fail(seed.spawn_key[0])
            yield generation


def fail(replicate: int) -> None:
    parts = [part.partition(":") for part in os.environ.get("FAULTY", "").split(";") if part]
    faults = {what for what, _, replicates in parts if str(replicate) in replicates.split(",")}
    if "raise" in faults:
        raise ArithmeticError(f"replicate {replicate} is [bold]told[/] to fail\nand says why")
    if "eat" in faults:
        assert np.ones(10**10).any()
    if "slow" in faults or ("slow_once" in faults and count(f"slow {replicate}") == 1):
        time.sleep(HANG_S)
    if in_worker() and "deaf" in faults:
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGALRM])  # as compiled code
    if in_worker() and faults & {"hang", "deaf"}:
        time.sleep(HANG_S)
    is_struck = in_worker() and faults & {"kill", "kill_once"}
    if is_struck and (count(str(replicate)) == 1 or "kill" in faults):
        os.kill(os.getpid(), signal.SIGKILL)


def count(name: str) -> int:
    """Return how often this has been asked for; a file notes it."""
    flag = Path(os.environ["FAULTY_FLAGS"]) / name
    number = int(flag.read_text()) + 1 if flag.exists() else 1
    flag.write_text(str(number))
    return number


def in_worker() -> bool:
    is_forked = any("worker_server" in word for word in sys.orig_argv)
    return is_forked or multiprocessing.parent_process() is not None  # that of dask
