"""A worker may be killed at any moment, while it sends its result, too: every batch ends.

No result differs from the undisturbed one. With ./scripts/test --exhaustive, 300 workers are
killed. `EVOEXP_KILLS` names a file for a line about each.
"""

import os
import random
import signal
from collections import Counter, deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from evoexp.batch import workers as workers_module
from evoexp.batch.workers import Died, Workers, in_order
from matrix import counts
from worker_tasks import LEAST, MEGABYTE, MOST, Struck, content, work

SEED = 39
NUM_KILLS = counts(20, 300)
SPEED = 100 * MEGABYTE  # [B/s] about that of computing and sending on a busy machine
PER_BATCH = 10  # kills
NOTES = "EVOEXP_KILLS"

pytestmark = pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")


def struck(rng: random.Random, number: int, folder: Path) -> Struck:
    size = round(LEAST * (MOST / LEAST) ** rng.random())
    delay_s = rng.uniform(0.0, 1.5 * size / SPEED + 0.002) if rng.random() < 0.9 else None
    return Struck(number, size, delay_s, folder / str(number))


class Retried:
    """Tasks that are done until they end: a late kill may hit the next task of its worker, too."""

    def __init__(self, tasks: list[Struck]) -> None:
        self._waiting = deque(tasks)

    def next_task(self, num_running: int) -> tuple[Struck] | None:
        return (self._waiting.popleft(),) if self._waiting else None

    def end_task(self, task: tuple[Struck], end: Any) -> Any | None:
        if isinstance(end, Died):
            self._waiting.append(task[0])
            return None
        return end


@pytest.fixture
def deaths(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int | None, int]]:
    """Return the workers that died: number of the task, or None, and bytes received of its end."""
    found: list[tuple[int | None, int]] = []
    bury: Callable[[Workers, workers_module._Worker], None] = Workers._bury

    def noted(self: Workers, worker: workers_module._Worker) -> None:
        found.append((worker.process, len(worker._received)))
        bury(self, worker)

    monkeypatch.setattr(Workers, "_bury", noted)
    return found


def test_every_batch_ends_and_nothing_differs(
    deaths: list[tuple[int | None, int]], tmp_path: Path
) -> None:
    rng, lines = random.Random(SEED), list[str]()
    for first in range(0, NUM_KILLS, PER_BATCH):
        before = len(deaths)
        tasks = [
            struck(rng, number, tmp_path)
            for number in range(first, min(first + PER_BATCH, NUM_KILLS))
        ]
        with Workers(2) as workers:
            ended = sorted(workers.results(work, Retried(tasks)))
        assert [number for number, _, _ in ended] == [task.number for task in tasks]
        for task, (number, computed, digest) in zip(tasks, ended, strict=True):
            assert computed == content(number, task.size)
            lines.append(f"task {number}: {task.size} B, kill at {task.delay_s} s, {digest}")
        new = deaths[before:]
        assert new, "workers were killed"
        lines.append(f"batch {first // PER_BATCH}: {len(new)} deaths, half messages of ")
        lines[-1] += ", ".join(f"{size} B" for _, size in new if size) or "none"
    assert all((tmp_path / str(number)).exists() for number in range(NUM_KILLS))
    kinds = Counter("half a message" if size else "none or all" for _, size in deaths)
    lines.append(f"{NUM_KILLS} tasks struck, {len(deaths)} deaths: {dict(kinds)}; all ended")
    if NOTES in os.environ:
        Path(os.environ[NOTES]).write_text("\n".join(lines) + "\n")


def test_half_a_message_keeps_nobody_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each worker is killed when the first bytes of its result have arrived."""
    receive = workers_module._Worker.receive
    struck = set[int]()

    def receive_and_kill(worker: workers_module._Worker) -> bool:
        has_said = receive(worker)
        if worker.task is not None and (number := worker.task[1][0].number) not in struck:
            struck.add(number)
            assert worker.process is not None
            os.kill(worker.process, signal.SIGKILL)
        return has_said

    monkeypatch.setattr(workers_module._Worker, "receive", receive_and_kill)
    tasks = [(Struck(number, 20 * MEGABYTE, None, None),) for number in range(4)]
    with Workers(2) as workers:
        ended = [(number, computed) for number, computed, _ in in_order(workers, work, tasks)]
    assert ended == [(number, content(number, 20 * MEGABYTE)) for number in range(4)]
    assert struck == {0, 1, 2, 3}
