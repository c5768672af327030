"""A worker may be killed at any moment, while it sends its result, too: every batch ends.

No result differs from the undisturbed one. With ./scripts/test --all, twenty workers are killed at
random moments, with --exhaustive 300. `EVOEXP_KILLS` names a file for a line about each.
"""

import os
import random
from collections import deque
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
SPEED = 200 * MEGABYTE  # [B/s] about that of hashing and sending on a busy machine
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
def deaths(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the bytes that were received of the result of each worker that died."""
    found: list[int] = []
    forget: Callable[[Workers, workers_module._Worker], None] = Workers._forget

    def noted(self: Workers, worker: workers_module._Worker) -> None:
        found.append(len(worker._received))
        forget(self, worker)

    monkeypatch.setattr(Workers, "_forget", noted)
    return found


@pytest.mark.matrix
def test_every_batch_ends_and_nothing_differs(deaths: list[int], tmp_path: Path) -> None:
    rng, lines, number = random.Random(SEED), list[str](), 0
    while len(deaths) < NUM_KILLS:
        before = len(deaths)
        tasks = [struck(rng, number + k, tmp_path) for k in range(PER_BATCH)]
        number += PER_BATCH
        with Workers(2) as workers:
            ended = sorted(workers.results(work, Retried(tasks)))
        assert [place for place, _, _ in ended] == [task.number for task in tasks]
        for task, (_, computed, digest) in zip(tasks, ended, strict=True):
            assert computed == content(task.number, task.size)
            lines.append(f"task {task.number}: {task.size} B, kill at {task.delay_s} s, {digest}")
        new = deaths[before:]
        halves = ", ".join(f"{size} B" for size in new if size) or "none"
        lines.append(f"batch ended: {len(new)} kills, of half a message: {halves}")
    halves = sum(1 for size in deaths if size)
    lines.append(
        f"{len(deaths)} kills, {halves} after half a message; all batches ended, no result differs"
    )
    if NOTES in os.environ:
        Path(os.environ[NOTES]).write_text("\n".join(lines) + "\n")


def test_half_a_message_keeps_nobody_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each worker is killed when the first bytes of its result have arrived."""
    messages = workers_module._Worker.messages
    struck = set[int]()

    def receive_and_kill(worker: workers_module._Worker) -> list[Any]:
        received = list(messages(worker))
        if worker.task is not None and (number := worker.task[1][0].number) not in struck:
            struck.add(number)
            worker.kill()
        return received

    monkeypatch.setattr(workers_module._Worker, "messages", receive_and_kill)
    tasks = [(Struck(number, 20 * MEGABYTE, None, None),) for number in range(4)]
    with Workers(2) as workers:
        ended = [(number, computed) for number, computed, _ in in_order(workers, work, tasks)]
    assert ended == [(number, content(number, 20 * MEGABYTE)) for number in range(4)]
    assert struck == {0, 1, 2, 3}
