"""A command that is done leaves, whatever has become of its workers."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

STOPPED = """
import os, signal, sys
import joblib
from joblib.externals.loky import reusable_executor
from evoexp import cli
from evoexp.batch import workers

def command(words, is_process):
    workers.num_cores = lambda: 2
    workers.start_server()
    found = list(workers.in_workers(2, (joblib.delayed(abs)(-k) for k in range(20))))
    stopped = list(reusable_executor._executor._processes)
    for process in stopped:
        os.kill(process, signal.SIGSTOP)
    print(len(found), *stopped)
    return 0

cli._run = command
sys.exit(cli.main())
"""


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="nobody can be stopped here")
def test_workers_that_no_longer_answer_keep_nobody_waiting() -> None:
    done = subprocess.run(
        [sys.executable, "-c", STOPPED], capture_output=True, text=True, timeout=60
    )
    count, *stopped = done.stdout.split()
    assert (done.returncode, done.stderr, count, len(stopped)) == (0, "", "20", 2)


LOCKED = """
import os, signal, sys, threading
from evoexp import cli
from evoexp.batch import workers
from evoexp.commands import interruption

def command(words, is_process):
    os.kill(os.getpid(), signal.SIGTERM)
    threading.Event().wait(60)

interruption.CLOSING_S = 0.5
workers.end_all = threading.Event().wait  # a library that waits for somebody who is gone
cli._run = command
sys.exit(cli.main())
"""


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer here")
def test_an_interrupted_command_leaves_whatever_libraries_wait_for() -> None:
    done = subprocess.run(
        [sys.executable, "-c", LOCKED], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 128 + signal.SIGTERM
    assert done.stderr.splitlines()[-1] == "evoexp: interrupted"


INTERRUPTED = """
import os, signal, sys
import joblib
from joblib.externals.loky import process_executor, reusable_executor
from evoexp import cli
from evoexp.batch import workers

def start(thread):
    print(*reusable_executor._executor._processes, flush=True)
    os.kill(os.getpid(), signal.SIGINT)

def command(words, is_process):
    workers.start_server()
    list(workers.in_workers(2, (joblib.delayed(abs)(-k) for k in range(20))))
    return 0

process_executor._ExecutorManagerThread.start = start
cli._run = command
sys.exit(cli.main())
"""


def test_workers_end_where_the_thread_that_manages_them_never_started() -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 128 + signal.SIGINT
    assert done.stderr == "evoexp: interrupted\n"
    workers = [int(word) for word in done.stdout.split()]
    assert len(workers) == 2
    assert not [worker for worker in workers if is_running(worker)]


STRUCK = """
import itertools, multiprocessing.popen_forkserver, os, signal, sys
from multiprocessing import forkserver
import joblib
from joblib.externals.loky import reusable_executor
from evoexp import cli
from evoexp.batch import workers

read, asked = forkserver.read_signed, itertools.count()

def read_signed(fd):
    if next(asked) == int(sys.argv[1]):
        server = forkserver._forkserver._forkserver_pid
        print(*(reusable_executor._executor._processes), flush=True)
        os.kill(server, signal.SIGKILL)
        raise EOFError("unexpected EOF")
    return read(fd)

def command(words, is_process):
    workers.num_cores = lambda: 2
    workers.start_server()
    multiprocessing.popen_forkserver.forkserver.read_signed = read_signed
    found = workers.in_workers(2, (joblib.delayed(abs)(-k) for k in range(20)), ordered=True)
    assert list(found) == list(range(20))
    return 0

cli._run = command
sys.exit(cli.main())
"""


@pytest.mark.parametrize("worker", [0, 1])
def test_a_server_that_dies_while_it_starts_a_worker_is_started_again(worker: int) -> None:
    done = subprocess.run(
        [sys.executable, "-c", STRUCK, str(worker)], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")
    started = [int(word) for word in done.stdout.split()]
    assert len(started) == worker
    assert not [process for process in started if is_running(process)]


REPLACED = """
import time
import joblib
from evoexp.batch import workers

def grow(k):
    import builtins, os
    builtins.held = [*getattr(builtins, "held", ()), bytearray(400_000_000)]
    time.sleep(1.2)
    return os.getpid()

found = list(workers.in_workers(2, (joblib.delayed(grow)(k) for k in range(6))))
print(len(found), len(set(found)))
"""


def test_a_batch_goes_on_where_workers_that_grew_large_are_replaced() -> None:
    """Though loky warns of it, and warnings are errors here."""
    pytest.importorskip("psutil")  # by which loky knows
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", REPLACED], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")
    count, workers = map(int, done.stdout.split())
    assert count == 6 and workers > 2


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
