"""A plug-in for tests: Rana & Zalzala's planner.

Which misbehaves where the environment tells it to.

`FAULTY` holds `<what>:<replicates>`, several with `;`: `raise:1,3`, `kill:2`, `kill_once:4`,
`hang:5,6`, `slow:1`, `slow_once:1`, `deaf:1` (slow, and no signal ends it), `eat:1` (80 GB),
`tell:7` (whether a server forked the worker). It is no part of the condition, so that
results can be compared with those of an undisturbed run.
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
        faults = faults_of(seed.spawn_key[0])
        for generation in generations(super().evolve(problem, rng)):
            if "hang" in faults and generation.index == 1 and in_worker():
                time.sleep(HANG_S)
            if "slow" in faults and generation.index == 1:
                time.sleep(HANG_S)
            if "slow_once" in faults and generation.index == 1 and is_first(seed.spawn_key[0]):
                time.sleep(HANG_S)
            if "deaf" in faults and generation.index == 1 and in_worker():
                signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGALRM])  # as compiled code
                time.sleep(HANG_S)
            if "eat" in faults and generation.index == 1:
                assert np.ones(10**10).any()
            if "raise" in faults and generation.index == 1:
                raise ArithmeticError(
                    f"replicate {seed.spawn_key[0]} is [bold]told[/] to fail\nand says why"
                )
            if "tell" in faults:
                raise RuntimeError(
                    "a server's worker" if forked_from_server() else "the parent's worker"
                )
            if faults & {"kill", "kill_once"} and generation.index == 1 and in_worker():
                die(seed.spawn_key[0], once="kill_once" in faults)
            yield generation


def faults_of(replicate: int) -> set[str]:
    parts = [part.partition(":") for part in os.environ.get("FAULTY", "").split(";") if part]
    return {what for what, _, replicates in parts if str(replicate) in replicates.split(",")}


def is_first(replicate: int) -> bool:
    """Return whether a replicate has not been here before; note that it has."""
    flag = Path(os.environ["FAULTY_FLAGS"]) / f"slow {replicate}"
    first = not flag.exists()
    flag.touch()
    return first


def in_worker() -> bool:
    return forked_from_server() or multiprocessing.parent_process() is not None  # that of dask


def forked_from_server() -> bool:
    return any("worker_server" in word for word in sys.orig_argv)


def die(replicate: int, once: bool) -> None:
    """Kill this process, and note it in a file; with `once`, not again."""
    flag = Path(os.environ["FAULTY_FLAGS"]) / str(replicate)
    deaths = int(flag.read_text()) if flag.exists() else 0
    if not once or deaths == 0:
        flag.write_text(str(deaths + 1))
        os.kill(os.getpid(), signal.SIGKILL)
