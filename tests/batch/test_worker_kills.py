"""A worker may be killed at any moment, while it sends its result, too: every batch ends.

No result differs from the undisturbed one. With ./scripts/test --all, twenty workers are killed at
random moments, with --exhaustive 300.
"""

import os
import random
import signal
import time
from collections import deque
from pathlib import Path
from typing import Any

import pytest
from process_table import processes

from evoexp.batch.workers import Died, Workers
from matrix import counts
from worker_tasks import LEAST, MEGABYTE, MOST, Struck, content, work

SEED = 39
NUM_KILLS = counts(20, 300)
SPEED = 200 * MEGABYTE  # [B/s] about that of hashing and sending on a busy machine
PER_BATCH = 10  # kills

pytestmark = pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")


def struck(rng: random.Random, number: int, folder: Path) -> Struck:
    size = round(LEAST * (MOST / LEAST) ** rng.random())
    delay_s = rng.uniform(0.0, 1.5 * size / SPEED + 0.002) if rng.random() < 0.9 else None
    return Struck(number, size, delay_s, folder / str(number))


class Retried:
    """Tasks that are done until they end: a late kill may hit the next task of its worker, too."""

    def __init__(self, tasks: list[Struck]) -> None:
        self._waiting = deque(tasks)
        self.num_deaths = 0

    def next_task(self, num_running: int) -> tuple[Struck] | None:
        return (self._waiting.popleft(),) if self._waiting else None

    def end_task(self, task: tuple[Struck], end: Any) -> Any | None:
        if isinstance(end, Died):
            self.num_deaths += 1
            self._waiting.append(task[0])
            return None
        return end


@pytest.mark.matrix
def test_every_batch_ends_and_nothing_differs(tmp_path: Path) -> None:
    rng, number, num_deaths = random.Random(SEED), 0, 0
    while num_deaths < NUM_KILLS:
        tasks = [struck(rng, number + k, tmp_path) for k in range(PER_BATCH)]
        number += PER_BATCH
        retried = Retried(tasks)
        with Workers(2) as workers:
            ended = sorted(workers.results(work, retried.next_task, retried.end_task))
        assert [place for place, _, _ in ended] == [task.number for task in tasks]
        for task, (_, computed, _) in zip(tasks, ended, strict=True):
            assert computed == content(task.number, task.size), task
        num_deaths += retried.num_deaths


def test_half_a_message_keeps_nobody_waiting() -> None:
    """A worker is killed while it sends a result that nobody reads yet."""
    tasks = [Struck(0, 1, None, None), Struck(1, 20 * MEGABYTE, None, None)]
    retried = Retried(tasks)
    with Workers(2) as workers:
        results = workers.results(work, retried.next_task, retried.end_task)
        ended = [next(results)]
        time.sleep(2.0)  # the other one fills its pipe
        servers = [each.number for each in processes() if each.parent == os.getpid()]
        for worker in (each.number for each in processes() if each.parent in servers):
            os.kill(worker, signal.SIGKILL)
        ended += results
    assert retried.num_deaths >= 1  # the idle one is killed, too, and noticed late
    assert [computed for _, computed, _ in ended] == [content(k, tasks[k].size) for k in (0, 1)]
