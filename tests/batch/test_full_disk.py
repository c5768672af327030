"""A full or defective disk ends a command in one line; what is finished stays, and it goes on."""

import errno
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from batch_samples import WORDS, digests

from evoexp.cli import KEPT, main
from evoexp.condition import Condition
from matrix import first

COMMAND = ["run", *WORDS, "runner=serial", "--no-report"]
FEW = [*WORDS[:-1], "num_replicates=2"]
FULL = Path("/dev/full")
Failed = Callable[..., str]


@pytest.fixture
def failed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Failed:
    """Return what runs a command that `os.fsync` fails from some call on; it says one line."""

    def run(words: list[str], number: int, after: int = 0) -> str:
        calls = [0]

        def fsync(descriptor: int) -> None:
            calls[0] += 1
            if calls[0] > after:
                raise OSError(number, os.strerror(number))

        capsys.readouterr()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(os, "fsync", fsync)
            assert main(words) == 2
        said = capsys.readouterr().err
        assert said.startswith(f"evoexp: {tmp_path}/") and said.count("\n") == 1
        assert not list(tmp_path.rglob("*.tmp"))
        assert main(words) == 0
        return said

    return run


@pytest.mark.parametrize(
    ("number", "after"), [(errno.ENOSPC, 0), (errno.EIO, 3), (errno.EDQUOT, 9)]
)
def test_a_run_stops_in_one_line_and_the_same_command_goes_on(
    number: int,
    after: int,
    faulty: Condition,
    undisturbed: dict[int, str],
    outputs: Path,
    failed: Failed,
) -> None:
    assert failed(COMMAND, number, after).endswith(f": {os.strerror(number)}; {KEPT}\n")
    assert digests(outputs, faulty) == undisturbed


@pytest.mark.usefixtures("blank_figures")
@pytest.mark.parametrize("command", ["report", "export", "new"])
def test_other_commands_name_the_file_and_leave_nothing(
    command: str, faulty: Condition, outputs: Path, failed: Failed
) -> None:
    assert main(["run", *FEW, "runner=serial", "--no-report"]) == 0
    words = {
        "report": ["report", *FEW, "report=paper", "report.formats=[svg]"],
        "export": ["export", faulty.id[:12]],
        "new": ["new", "planner", "thing_of_mine", "--directory", str(outputs.parent)],
    }
    assert failed(words[command], errno.ENOSPC).endswith(": No space left on device\n")


def run_to(path: Path | None, *words: str, unbuffered: bool) -> tuple[int, str]:
    """Run a command whose standard output is a file, or closed; return exit code and stderr."""
    environment = {name: text for name, text in os.environ.items() if name != "PYTHONUNBUFFERED"}
    environment |= {"PYTHONUNBUFFERED": "1"} if unbuffered else {}
    with open(path or os.devnull, "w") as stdout:
        done = subprocess.run(
            [sys.executable, "-m", "evoexp", *words],
            env=environment,
            stdout=stdout,
            stderr=subprocess.PIPE,
            text=True,
            timeout=300,
            preexec_fn=None if path else lambda: os.close(1),
        )
    return done.returncode, done.stderr


@pytest.mark.skipif(not FULL.exists(), reason="needs /dev/full")
@pytest.mark.parametrize(
    ("words", "unbuffered"), first(1, [("completion bash", True), ("list", False)])
)
def test_a_full_standard_output_is_named_and_a_closed_one_no_error(
    words: str, unbuffered: bool
) -> None:
    full = "evoexp: standard output: No space left on device\n"
    assert run_to(FULL, *words.split(), unbuffered=unbuffered) == (2, full)
    assert run_to(None, *words.split(), unbuffered=unbuffered) == (0, "")
