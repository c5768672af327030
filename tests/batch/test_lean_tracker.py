"""What loky leaves behind is cleaned up, by a process that loads next to nothing."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

LOADED = """
import sys
from evoexp.batch.lean_tracker import main
print(main.__code__.co_filename, *{"joblib.parallel", "numpy"} & set(sys.modules))
"""


def test_the_tracker_is_that_of_loky_without_the_rest_of_joblib() -> None:
    done = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True)
    [path] = done.stdout.split()
    assert (done.returncode, done.stderr) == (0, "")
    assert Path(path).parts[-3:] == ("loky", "backend", "resource_tracker.py")


KILLED = """
import os, signal, sys, time
from pathlib import Path
from joblib.externals.loky.backend import resource_tracker
from evoexp.batch import workers

workers.num_cores = lambda: 2
workers.start_server()
resource_tracker.register(sys.argv[1], "folder")
tracker, until = resource_tracker._resource_tracker._pid, time.monotonic() + 30.0
command = b""
while b"tracker" not in command and time.monotonic() < until:  # it has just begun
    command = Path(f"/proc/{tracker}/cmdline").read_bytes()
print(command, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(not Path("/proc/self/cmdline").is_file(), reason="Linux")
def test_it_removes_what_a_killed_process_leaves(tmp_path: Path) -> None:
    folder = tmp_path / "shared"
    folder.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", KILLED, str(folder)], capture_output=True, text=True
    )
    assert "evoexp.batch.lean_tracker" in done.stdout
    until = time.monotonic() + 30.0
    while folder.exists() and time.monotonic() < until:
        time.sleep(0.01)
    assert not folder.exists()
