"""Workers share nothing, are replaced when they die, and end with whoever started them."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from evoexp.batch import workers as workers_module
from evoexp.batch.workers import DIED_TWICE, WorkerError, Workers, in_order
from worker_tasks import end, end_once, fork_and_die, loaded_packages, refuse

PATIENCE_S = 60.0  # [s] for anything that a busy machine may take long for


def test_results_come_in_order_and_each_task_is_done_once() -> None:
    with Workers(2) as workers:
        assert list(in_order(workers, abs, ((-k,) for k in range(20)))) == list(range(20))
        assert list(in_order(workers, abs, [])) == []
        pids = set(in_order(workers, os.getpid, [()] * 20))
    assert 1 <= len(pids) <= 2
    assert not [process for process in pids if is_running(process)]


def test_workers_have_one_thread_per_library_whoever_started_them() -> None:
    names = ("OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    before = [os.environ.get(name) for name in names]
    with Workers(2) as workers:
        found = list(in_order(workers, os.getenv, ((name,) for name in names)))
    assert found == ["1", "1"]
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
        for loading in children():
            os.kill(loading, signal.SIGKILL)
        assert list(in_order(workers, abs, ((-k,) for k in range(4)))) == [0, 1, 2, 3]
        (server,) = in_order(workers, os.getppid, [()])
        os.kill(server, signal.SIGKILL)
        assert not is_running(server)
        tasks = [(k, str(tmp_path), "kill") for k in range(4)]
        assert list(in_order(workers, end_once, tasks)) == list(range(4))


def test_why_the_server_cannot_load_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workers_module, "LIBRARIES", ["no_such_module"])
    with pytest.raises(ImportError, match="no_such_module"), Workers(2) as some:
        list(in_order(some, abs, [(1,)]))


def test_workers_that_never_begin_are_not_started_for_ever(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(WorkerError, match="die before they have begun"), Workers(2) as workers:
        list(in_order(workers, abs, [(1,)]))


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_dead_worker_is_noticed_whoever_inherited_its_socket() -> None:
    begun = time.monotonic()
    with Workers(1) as workers, pytest.raises(WorkerError, match=DIED_TWICE):
        list(in_order(workers, fork_and_die, [(10 * PATIENCE_S,)]))
    assert time.monotonic() - begun < 10 * PATIENCE_S


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="nobody can be stopped here")
def test_workers_that_no_longer_answer_keep_nobody_waiting() -> None:
    with Workers(2) as workers:
        stopped = set(in_order(workers, os.getpid, [()] * 20))
        for process in stopped:
            os.kill(process, signal.SIGSTOP)
    assert not [process for process in stopped if is_running(process)]


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

cli.command_module = lambda name: type("", (), {"main": command})
sys.exit(cli.main())
"""


@pytest.mark.examples(2)
@pytest.mark.parametrize("name", ["SIGKILL", "SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT"])
def test_workers_end_with_their_parent_whatever_they_do(name: str) -> None:
    number = getattr(signal, name)
    with subprocess.Popen(
        [sys.executable, "-c", BUSY, "list"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        processes = {int(process.stdout.readline()) for _ in range(9)}
        process.send_signal(number)
        complaint = process.stderr.read()
        code_of_end = process.wait(PATIENCE_S)
    orderly = name in ("SIGINT", "SIGTERM", "SIGHUP")
    assert code_of_end == (128 + number if orderly else -number)
    assert complaint == ("evoexp: interrupted\n" if orderly else "")
    assert not [one for one in processes if is_running(one)]


LOCKED = """
import os, signal, sys, threading
from evoexp import cli
from evoexp.commands import interruption

def command(words):
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        threading.Event().wait(60)
    finally:
        threading.Event().wait()  # a library that waits for somebody who is gone

interruption.PATIENCE_S = 0.5
cli.command_module = lambda name: type("", (), {"main": command})
sys.exit(cli.main())
"""


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer here")
def test_what_an_interrupted_command_waits_for_is_interrupted_too() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LOCKED, "list"], capture_output=True, text=True, timeout=PATIENCE_S
    )
    assert done.returncode == 128 + signal.SIGTERM
    assert done.stderr == "evoexp: interrupted\n"


def children() -> list[int]:
    """Return the servers of workers that this process has started."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            parent = stat.read_text().rpartition(") ")[2].split()[1]
            is_server = b"worker_server" in (stat.parent / "cmdline").read_bytes()
            found += [int(stat.parent.name)] if int(parent) == os.getpid() and is_server else []
    return found


def is_running(number: int, patience_s: float = 20.0) -> bool:
    """Return whether a process is still there after some time; a zombie is not."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        try:
            os.kill(number, 0)
        except ProcessLookupError:
            return False
        stat = Path(f"/proc/{number}/stat")
        if stat.exists() and stat.read_text().rpartition(")")[2].split()[0] == "Z":
            return False
        time.sleep(0.1)
    return True


def test_a_worker_loads_neither_tables_nor_the_command_line() -> None:
    with Workers(1) as workers:
        (names,) = in_order(workers, loaded_packages, [()])
    assert not {"pandas", "pyarrow", "matplotlib", "hydra", "rich"} & names
