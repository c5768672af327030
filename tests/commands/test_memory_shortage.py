"""Too little memory ends a command in one line that says so, whichever library noticed it."""

import errno
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from evoexp.cli import main
from evoexp.commands.command_process import LEAST_MB, MEGABYTE, memory_shortage
from evoexp.errors import SettingError
from matrix import counts

RUN = ("run", "experiment=rana_planar", "budget=smoke", "--no-report", "num_replicates=2")
SERIAL, WORKERS = (*RUN, "runner=serial"), (*RUN, "runner.num_workers=2")
IS_EXHAUSTIVE = counts(0, 1) == 1
MEGABYTES = range(100, 4_000, 300) if IS_EXHAUSTIVE else (40, LEAST_MB - 1)

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of addresses are kept here")


def run_within(megabytes: int, outputs: Path, *words: str) -> tuple[int, str]:
    """Run a command with few addresses; return its exit code and what it complains of."""
    limit = megabytes * MEGABYTE
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
    if code != 0:
        assert code == 2, complaint
        assert complaint.startswith("evoexp: out of memory: ")
        assert f"(`ulimit -v` allows {megabytes:,} MB)" in complaint
        assert complaint.count("\n") == 1
    else:
        assert complaint == ""
    assert (code == 2) == (megabytes < LEAST_MB)


def test_the_least_memory_is_enough(tmp_path: Path) -> None:
    words = SERIAL if IS_EXHAUSTIVE else ("list",)  # kernels compile for minutes in a new home
    assert run_within(LEAST_MB, tmp_path / "outputs", *words) == (0, "")


def test_help_needs_little(tmp_path: Path) -> None:
    assert run_within(40, tmp_path, "--help") == (0, "")


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (MemoryError(), "the system gives no more"),
        (MemoryError("Unable to allocate 3 GiB"), "Unable to allocate 3 GiB"),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "[Errno 12] Cannot allocate memory"),
        (RuntimeError("can't start new thread"), "can't start new thread"),
        (
            ImportError("advice\n\nlibx.so: failed to map segment from shared object"),
            "libx.so: failed to map segment from shared object",
        ),
    ],
)
def test_errors_that_mean_it(error: Exception, text: str) -> None:
    assert memory_shortage(error).startswith(f"out of memory: {text}")
    outer = RuntimeError("a library explains at length")
    outer.__cause__ = error
    assert text in memory_shortage(outer)


@pytest.mark.parametrize(
    "error",
    [ImportError("no module named nothing"), OSError(errno.ENOSPC, "No space"), ValueError("x")],
)
def test_errors_that_mean_something_else(error: Exception) -> None:
    assert memory_shortage(error) == ""


def test_a_refusal_stays_a_refusal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*words: object) -> int:
        raise SettingError("ga.population_size", "positive", -1) from MemoryError()

    monkeypatch.setattr("evoexp.commands.list_.main", refuse)
    assert main(["list"]) == 2
    assert capsys.readouterr().err == "evoexp: ga.population_size: must be positive, was -1\n"
