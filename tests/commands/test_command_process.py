"""Temporary files of a command are in one folder; too little memory is said in one line."""

import errno
import fcntl
import os
import resource
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from evoexp.cli import main
from evoexp.commands import command_process
from evoexp.commands.command_process import LOCK, PREFIX, memory_shortage, remove_abandoned
from evoexp.errors import SettingError
from matrix import counts

COMMAND = """
import os, signal, sys, tempfile
from pathlib import Path
from evoexp import cli
from evoexp.batch.workers import Workers, in_order

def command(words):
    Path(tempfile.mkdtemp(), "file").write_text("of a library")
    with Workers(2) as workers:
        print(tempfile.gettempdir(), *in_order(workers, tempfile.gettempdir, [()]), flush=True)
        if sys.argv[2:] == ["--failed"]:
            os.kill(os.getpid(), signal.SIGKILL)
    return 0

cli.command_function = lambda name: command
sys.exit(cli.main())
"""


def run(place: Path, *words: str) -> tuple[int, list[str]]:
    """Run a command with temporary files in a place; return its exit code and its folders."""
    command = [sys.executable, "-c", f"import os; os.umask(0)\n{COMMAND}", "list", *words]
    environment = os.environ | {"TMPDIR": str(place)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert done.stderr == ""
    return done.returncode, done.stdout.split()


def test_what_a_killed_command_leaves_is_removed_by_the_next(tmp_path: Path) -> None:
    code, (folder, of_worker) = run(tmp_path, "--failed")
    (left,) = tmp_path.iterdir()
    assert (code, folder, of_worker) == (-signal.SIGKILL, str(left), str(left))
    assert stat.S_IMODE(left.stat().st_mode) == 0o700
    assert list(left.rglob("file"))
    code, (other, _) = run(tmp_path)
    assert (code, list(tmp_path.iterdir())) == (0, [])
    assert other != folder


def folder_of(place: Path, name: str) -> Path:
    folder = place / f"{PREFIX}{name}"
    folder.mkdir()
    (folder / LOCK).touch()
    (folder / "file").touch()
    return folder


def test_folders_with_a_living_owner_stay(tmp_path: Path) -> None:
    alive, abandoned = folder_of(tmp_path, "alive"), folder_of(tmp_path, "abandoned")
    os.utime(alive, (0, 0))  # age decides nothing
    with open(alive / LOCK) as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        remove_abandoned(tmp_path)
        assert (alive / "file").exists()
        assert not abandoned.exists()
    remove_abandoned(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_nothing_else_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place, elsewhere = tmp_path / "place", tmp_path / "elsewhere"
    for folder in (f"{PREFIX}without_lock", f"{PREFIX}linked_lock", "evoexp-cache", "joblib_1"):
        (place / folder).mkdir(parents=True)
    elsewhere.mkdir()
    (place / f"{PREFIX}file").touch()
    (place / "evoexp-cache" / LOCK).touch()
    target = folder_of(elsewhere, "target")
    (place / f"{PREFIX}link").symlink_to(target)
    (place / f"{PREFIX}linked_lock" / LOCK).symlink_to(target / LOCK)
    before = sorted(tmp_path.rglob("*"))
    remove_abandoned(place)
    assert sorted(tmp_path.rglob("*")) == before
    left = folder_of(place, "of_another_user")
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    remove_abandoned(place)
    assert sorted(tmp_path.rglob("*")) == sorted([*before, left, *left.iterdir()])


@pytest.mark.parametrize("place", ["missing", f"{'d' * 60}/{'e' * 60}"])
def test_temporary_files_may_be_anywhere(place: str, tmp_path: Path) -> None:
    """Where no socket can be, as its path is too long, workers are started without a server."""
    is_missing = place == "missing"
    if not is_missing:
        (tmp_path / place).mkdir(parents=True)
    code, (folder, of_worker) = run(tmp_path / place)
    assert (code, folder) == (0, of_worker)
    assert (tmp_path / place in Path(folder).parents) != is_missing
    assert is_missing or list((tmp_path / place).iterdir()) == []
    assert not (tmp_path / "missing").exists()


RUN = ("run", "experiment=rana_planar", "budget=smoke", "--no-report", "num_replicates=2")
SERIAL, WORKERS = (*RUN, "runner=serial"), (*RUN, "runner.num_workers=2")
IS_EXHAUSTIVE = counts(0, 1) == 1
MEGABYTES = range(100, 4_000, 300) if IS_EXHAUSTIVE else (40, command_process.LEAST_MB - 1)

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of addresses are kept here")


def run_within(megabytes: int, outputs: Path, *words: str) -> tuple[int, str]:
    """Run a command with few addresses; return its exit code and what it complains of."""
    limit = megabytes * command_process.MEGABYTE
    done = subprocess.run(
        [sys.executable, "-m", "evoexp", *words],
        env={"EVOEXP_OUTPUTS": str(outputs), "PATH": "", "HOME": str(outputs)},
        capture_output=True,
        text=True,
        timeout=1_200,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)),
    )
    return done.returncode, done.stderr


@pytest.mark.parametrize("words", [("list",), SERIAL, WORKERS], ids=["list", "serial", "workers"])
@pytest.mark.parametrize("megabytes", MEGABYTES)
def test_it_is_one_line(words: tuple[str, ...], megabytes: int, tmp_path: Path) -> None:
    code, complaint = run_within(megabytes, tmp_path / "outputs", *words)
    assert code == (2 if megabytes < command_process.LEAST_MB else 0), complaint
    if code == 0:
        assert complaint == ""
    else:
        assert complaint.startswith("evoexp: out of memory: ") and complaint.count("\n") == 1
        assert f"(`ulimit -v` allows {megabytes:,} MB)" in complaint


@pytest.mark.parametrize(
    ("megabytes", "words"),
    [  # kernels compile for minutes in a new home
        (command_process.LEAST_MB, SERIAL if IS_EXHAUSTIVE else ("list",)),
        (40, ("--help",)),
    ],
)
def test_the_least_memory_is_enough(megabytes: int, words: tuple[str, ...], tmp_path: Path) -> None:
    assert run_within(megabytes, tmp_path / "outputs", *words) == (0, "")


NO_SEGMENT = "libx.so: failed to map segment from shared object"


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (MemoryError(), "the system gives no more"),
        (MemoryError("Unable to allocate 3 GiB"), "Unable to allocate 3 GiB"),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "[Errno 12] Cannot allocate memory"),
        (RuntimeError("can't start new thread"), "can't start new thread"),
        (ImportError(f"advice\n\n{NO_SEGMENT}"), NO_SEGMENT),
        (ImportError("no module named nothing"), ""),
        (OSError(errno.ENOSPC, "No space"), ""),
        (ValueError("x"), ""),
    ],
)
def test_errors_that_mean_it(error: Exception, text: str) -> None:
    assert memory_shortage(error).startswith(f"out of memory: {text}" if text else "")
    assert bool(memory_shortage(error)) == bool(text)
    outer = RuntimeError("a library explains at length")
    outer.__cause__ = error
    assert text in memory_shortage(outer)


def test_a_refusal_stays_a_refusal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*words: object) -> int:
        raise SettingError("ga.population_size", "positive", -1) from MemoryError()

    monkeypatch.setattr("evoexp.commands.list_.main", refuse)
    assert main(["list"]) == 2
    assert capsys.readouterr().err == "evoexp: ga.population_size: must be positive, was -1\n"
