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
FULL = Path("/dev/full")


def failing(after: int, number: int) -> Callable[[int], None]:
    """Return a stand-in for `os.fsync` that fails from some call on, as a disk does."""
    calls = [0]

    def fsync(descriptor: int) -> None:
        calls[0] += 1
        if calls[0] > after:
            raise OSError(number, os.strerror(number))

    return fsync


@pytest.mark.parametrize(
    ("number", "after"), [(errno.ENOSPC, 0), (errno.EIO, 3), (errno.EDQUOT, 9)]
)
def test_a_run_stops_in_one_line_and_the_same_command_goes_on(
    number: int,
    after: int,
    faulty: Condition,
    undisturbed: dict[int, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    outputs = tmp_path / "outputs"
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(outputs))
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", failing(after, number))
        assert main(COMMAND) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"evoexp: {outputs}/runs")
    assert said.endswith(f": {os.strerror(number)}; {KEPT}\n")
    assert said.count("\n") == 1
    assert not list(outputs.rglob("*.tmp"))
    kept = digests(outputs, faulty)
    assert kept == {k: undisturbed[k] for k in kept}
    assert bool(kept) == (after == 9)
    assert main(COMMAND) == 0
    assert capsys.readouterr().err == ""
    assert digests(outputs, faulty) == undisturbed


@pytest.mark.parametrize("command", ["report", "export", "new"])
def test_other_commands_name_the_file_and_leave_nothing(
    command: str,
    faulty: Condition,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    blank_figures: None,
) -> None:
    outputs = tmp_path / "outputs"
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(outputs))
    few = [*WORDS[:-1], "num_replicates=2"]
    assert main(["run", *few, "runner=serial", "--no-report"]) == 0
    words = {
        "report": ["report", *few, "report=paper", "report.formats=[svg]"],
        "export": ["export", faulty.id[:12]],
        "new": ["new", "planner", "thing_of_mine", "--directory", str(tmp_path)],
    }[command]
    capsys.readouterr()
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", failing(0, errno.ENOSPC))
        assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"evoexp: {tmp_path}/")
    assert err.endswith(": No space left on device\n")
    assert err.count("\n") == 1
    assert not list(tmp_path.rglob("*.tmp"))
    assert main(words) == 0


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
def test_a_full_standard_output_is_named(words: str, unbuffered: bool) -> None:
    code, err = run_to(FULL, *words.split(), unbuffered=unbuffered)
    assert (code, err) == (2, "evoexp: standard output: No space left on device\n")


def test_a_closed_standard_output_is_no_error() -> None:
    assert run_to(None, "list", unbuffered=False) == (0, "")


def test_outputs_that_are_a_file_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path / "file"))
    (tmp_path / "file").touch()
    assert main(COMMAND) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"evoexp: {tmp_path}/file/runs/")
    assert err.endswith(": Not a directory\n")


@pytest.mark.matrix
@pytest.mark.parametrize("place", ["deep", "missing"])
def test_temporary_files_may_be_anywhere(
    place: str, faulty: Condition, tmp_path: Path, plug_in: Path
) -> None:
    """Where no socket can be, as its path is too long, workers are started without a server."""
    deep = tmp_path / ("d" * 60) / ("e" * 60)
    deep.mkdir(parents=True)
    paths = (str(plug_in), str(Path(__file__).parent), os.environ.get("PYTHONPATH", ""))
    environment = os.environ | {
        "EVOEXP_OUTPUTS": str(tmp_path / "outputs"),
        "PYTHONPATH": os.pathsep.join(paths),
        "TMPDIR": str(deep if place == "deep" else tmp_path / "missing"),
    }
    words = ["run", *WORDS, "runner.num_workers=2", "--no-report"]
    done = subprocess.run(
        [sys.executable, "-m", "evoexp", *words],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert len(digests(tmp_path / "outputs", faulty)) == 12
    assert list(deep.iterdir()) == []
