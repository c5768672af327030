"""Workers share nothing, are replaced when they die, and end with whoever started them."""

import os
import random
import signal
import sys
import threading
import time
from collections import deque
from pathlib import Path
from subprocess import PIPE, Popen
from typing import Any

import pytest
from process_table import PATIENCE_S, are_gone, processes

import worker_tasks
from evoexp.batch import workers as workers_module
from evoexp.batch.workers import DIED_TWICE, Died, WorkerError, Workers, in_order
from matrix import counts
from worker_tasks import LEAST, MEGABYTE, MOST, Struck, content, end, end_once, refuse, work


def test_results_come_in_order_from_workers_of_one_thread_per_library() -> None:
    names = ("OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    before = [os.environ.get(name) for name in names]
    with Workers(2) as workers:
        assert list(in_order(workers, abs, ((-k,) for k in range(20)))) == list(range(20))
        assert list(in_order(workers, abs, [])) == []
        pids = set(in_order(workers, os.getpid, [()] * 20))
        assert list(in_order(workers, os.getenv, ((name,) for name in names))) == ["1", "1"]
    assert 1 <= len(pids) <= 2
    assert are_gone(*pids)
    assert [os.environ.get(name) for name in names] == before


def test_an_error_of_a_task_is_raised_with_its_text() -> None:
    """Though some cannot be made of their text alone."""
    with Workers(1) as workers:
        with pytest.raises(LookupError, match="^nobody") as raised:
            list(in_order(workers, refuse, [("nobody",)]))
        assert "in refuse" in raised.value.__notes__[0]
        with pytest.raises(Exception, match=r"^ga\.population_size: must be positive, was -1$"):
            list(in_order(workers, refuse, [("setting",)]))
        with pytest.raises(Exception, match="pickle"):
            list(in_order(workers, threading.Lock, [()]))


@pytest.mark.parametrize("way", ["kill", "exit"])
def test_a_task_whose_worker_dies_is_done_once_more(way: str, tmp_path: Path) -> None:
    with Workers(2) as workers:
        tasks = [(k, str(tmp_path), way) for k in range(6)]
        assert list(in_order(workers, end_once, tasks)) == list(range(6))
        with pytest.raises(WorkerError, match=DIED_TWICE):
            list(in_order(workers, end, [("kill",)]))
        assert list(in_order(workers, abs, [(-1,)])) == [1]


def test_what_the_server_does_first_is_there_in_all_workers(tmp_path: Path) -> None:
    with Workers(2) as workers:
        workers.call_first(os.chdir, str(tmp_path))
        assert set(in_order(workers, os.getcwd, [()] * 20)) == {str(tmp_path)}


@pytest.mark.parametrize("call", [(refuse, "nobody"), (end, "kill"), (end, "exit")])
def test_a_first_call_that_fails_or_ends_the_server_costs_no_result(call: tuple[Any, ...]) -> None:
    with Workers(2) as workers:
        workers.call_first(*call)
        assert list(in_order(workers, abs, [(-1,), (-2,)])) == [1, 2]


def test_a_server_that_dies_is_started_again(tmp_path: Path) -> None:
    with Workers(2) as workers:
        for process in processes():
            if process.parent == os.getpid() and process.is_server:  # it is loading
                os.kill(process.number, signal.SIGKILL)
        assert list(in_order(workers, abs, ((-k,) for k in range(4)))) == [0, 1, 2, 3]
        (server,) = in_order(workers, os.getppid, [()])
        os.kill(server, signal.SIGKILL)
        assert are_gone(server)
        tasks = [(k, str(tmp_path), "kill") for k in range(4)]
        assert list(in_order(workers, end_once, tasks)) == list(range(4))


def test_workers_that_never_begin_are_not_started_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers_module, "LIBRARIES", ["no_such_module"])
    with pytest.raises(ImportError, match="no_such_module"), Workers(2) as workers:
        list(in_order(workers, abs, [(1,)]))
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(WorkerError, match="die before they start"), Workers(2) as workers:
        list(in_order(workers, abs, [(1,)]))


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_dead_worker_is_noticed_whoever_inherited_its_socket() -> None:
    begun = time.monotonic()
    with Workers(1) as workers, pytest.raises(WorkerError, match=DIED_TWICE):
        list(in_order(workers, worker_tasks.fork_and_die, [(10 * PATIENCE_S,)]))
    assert time.monotonic() - begun < 10 * PATIENCE_S


def test_workers_that_no_longer_answer_keep_nobody_waiting() -> None:
    with Workers(2) as workers:
        stopped = set(in_order(workers, os.getpid, [()] * 20))
        for process in stopped:
            os.kill(process, signal.SIGSTOP)
    assert are_gone(*stopped)


# The command's process

BUSY = """
import os, signal, sys, time
from evoexp import cli
from evoexp.batch.workers import Workers, in_order

def command(words):
    with Workers(2) as workers:
        for process in in_order(workers, os.getpid, [()] * 8):
            print(process)
        print(*in_order(workers, os.getppid, [()]), flush=True)  # the server
        list(in_order(workers, time.sleep, [(3600,)] * 2))
    return 0

cli.command_function = lambda name: command
sys.exit(cli.main())
"""


@pytest.mark.examples(2)
@pytest.mark.parametrize("name", ["SIGKILL", "SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT"])
def test_workers_end_with_their_parent_whatever_they_do(name: str) -> None:
    words, number = [sys.executable, "-c", BUSY, "list"], getattr(signal, name)
    with Popen(words, stdout=PIPE, stderr=PIPE, text=True) as process:
        assert process.stdout is not None and process.stderr is not None
        group = {int(process.stdout.readline()) for _ in range(9)}
        process.send_signal(number)
        complaint = process.stderr.read()
        returncode = process.wait(PATIENCE_S)
    if name in ("SIGINT", "SIGTERM", "SIGHUP"):
        assert (returncode, complaint) == (128 + number, "evoexp: interrupted\n")
    else:
        assert (returncode, complaint) == (-number, "")
    assert are_gone(*group)


# A worker may be killed at any moment, while it sends its result, too: every batch ends

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
