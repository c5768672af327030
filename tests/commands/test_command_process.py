"""Temporary files of a command are in one folder; too little memory is said in one line."""

import errno
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from evoexp.cli import main
from evoexp.commands import command_process
from evoexp.commands.command_process import memory_shortage
from evoexp.errors import SettingError
from matrix import counts

COMMAND = """
import sys, tempfile
from pathlib import Path
from evoexp import cli
from evoexp.batch.workers import Workers, in_order

def command(words):
    Path(tempfile.mkdtemp(), "file").write_text("of a library")
    with Workers(2) as workers:
        print(tempfile.gettempdir(), *in_order(workers, tempfile.gettempdir, [()]), flush=True)
    return 0

cli.command_function = lambda name: command
sys.exit(cli.main())
"""


def run(place: Path) -> tuple[int, list[str]]:
    """Run a command with temporary files in a place; return its exit code and its folders."""
    command = [sys.executable, "-c", f"import os; os.umask(0)\n{COMMAND}", "list"]
    environment = os.environ | {"TMPDIR": str(place)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert done.stderr == ""
    return done.returncode, done.stdout.split()


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
