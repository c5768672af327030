"""A plug-in for tests: Rana & Zalzala's planner, which misbehaves where the environment tells it to.

`FAULTY` is `<what>:<replicates>`: `raise:1,3`, `kill:2`, `kill_once:2`, `slow:0,1,2`. It is no part of the condition, so
that results can be compared with those of an undisturbed run.
"""

import multiprocessing
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

import numpy as np

from evoexp.planners.via_point_ga import Problem, ViaPointGa
from evoexp.records import Generation

SLOW_S = 0.05  # [s] per generation


class Faulty(ViaPointGa):
    component: ClassVar[str] = "faulty"

    def evolve(self, problem: Problem, rng: np.random.Generator) -> Iterator[Generation]:
        what, _, replicates = os.environ.get("FAULTY", "").partition(":")
        (replicate,) = rng.bit_generator.seed_seq.spawn_key
        concerned = str(replicate) in replicates.split(",")
        worker = multiprocessing.parent_process() is not None
        for generation in super().evolve(problem, rng):
            if concerned and what == "slow" and worker:
                time.sleep(SLOW_S)
            if concerned and what == "raise" and generation.index == 1:
                raise ArithmeticError(f"replicate {replicate} is [bold]told[/] to fail")
            if concerned and what in ("kill", "kill_once") and generation.index == 1 and worker:
                deaths = Path(os.environ["FAULTY_FLAGS"]) / str(replicate)
                count = int(deaths.read_text()) if deaths.exists() else 0
                if what == "kill" or count == 0:
                    deaths.write_text(str(count + 1))
                    os.kill(os.getpid(), signal.SIGKILL)
            yield generation
