"""A command that is done leaves, whatever has become of its workers."""

import signal
import subprocess
import sys

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
