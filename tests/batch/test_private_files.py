"""Sockets and temporary files of a batch are its user's alone, and gone when it ends."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from batch_samples import digests, run

from evoexp.condition import Condition
from evoexp.store.run_directory import RunDirectory

WATCHED = """
import os, stat, sys
from multiprocessing.util import get_temp_dir
from pathlib import Path
import joblib
from evoexp.batch import workers

os.umask(0)
workers.num_cores = lambda: 2
workers.start_server()
results = workers.in_workers(2, (joblib.delayed(abs)(-k) for k in range(20)))
print(next(results) >= 0, len(set(Path("/dev/shm").glob(f"joblib*_{os.getpid()}_*"))))
folder = Path(get_temp_dir())
print(folder)
for path in (folder, *folder.glob("listener*")):
    print(oct(stat.S_IMODE(path.stat().st_mode)))
print(len(list(results)))
"""


@pytest.mark.skipif(not Path("/dev/shm").is_dir(), reason="Linux")
def test_sockets_and_folders_are_private_whatever_the_umask() -> None:
    done = subprocess.run(
        [sys.executable, "-c", WATCHED], capture_output=True, text=True, timeout=300
    )
    first, folder, *modes, count = done.stdout.splitlines()
    assert (first, modes, count) == ("True 0", ["0o700", "0o600"], "19"), done
    assert done.stderr == ""
    assert not Path(folder).exists()


def test_a_clock_that_is_set_back_changes_nothing(
    faulty: Condition, undisturbed: dict[int, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    outputs = tmp_path / "outputs"
    run(outputs, (faulty, 6))
    for path in RunDirectory(outputs, faulty.id).path.rglob("*"):
        os.utime(path, (4e9, 4e9))  # written in what is now the future
    monkeypatch.setattr(time, "time", lambda: 0.0)
    run(outputs, (faulty, 12))
    assert digests(outputs, faulty) == undisturbed
