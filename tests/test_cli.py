"""The command line: exit codes, help, any directory."""

import subprocess
import sys
from pathlib import Path

import pytest

from evoexp import __version__
from evoexp.cli import COMMANDS, main


def printed_before_exit(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    with pytest.raises(SystemExit) as left:
        main(words)
    assert left.value.code == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    out = printed_before_exit(capsys, command, "--help")
    assert out.startswith(f"usage: evoexp {command} ")
    text = " ".join(out.split())
    assert COMMANDS[command][1:] in text
    if command == "evaluate":
        assert "(.json: nested lists, .npy: an array)" in text
        assert "a joint trajectory as export writes it (.csv, .json, .yaml)" in text


def test_no_words_help_and_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert "usage: evoexp" in capsys.readouterr().out
    out = printed_before_exit(capsys, "--help")
    assert all(f"\n    {name}" in out for name in COMMANDS)
    assert printed_before_exit(capsys, "--version") == f"evoexp {__version__}\n"


def test_a_refusal_is_one_line_and_exit_code_2_in_a_process_too(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "evoexp", "run", "experiment=rana_planr"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    hint = "no option 'rana_planr'; did you mean 'rana_planar'?"
    assert done.stderr.startswith(f"evoexp: experiment: {hint}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (MemoryError("Unable to allocate 1. TiB"), 2, "out of memory: Unable to allocate 1. TiB\n"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (ZeroDivisionError("a bug"), None, ""),  # a programming error keeps its traceback
    ],
)
def test_errors_that_are_no_refusals(
    error: BaseException,
    code: int | None,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(*_: object) -> int:
        raise error

    monkeypatch.setattr("evoexp.commands.list_.main", fail)
    if code is None:
        with pytest.raises(type(error)):
            main(["list"])
    else:
        assert main(["list"]) == code
        assert capsys.readouterr().err.startswith(f"evoexp: {said}")


def test_a_reader_that_closes_the_pipe_is_no_error(tmp_path: Path) -> None:
    command = f"{sys.executable} -m evoexp list | true; echo ${{PIPESTATUS[0]}}"
    words = ["bash", "-c", command]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert (done.stdout, done.stderr) == ("0\n", "")


def test_outputs_are_in_the_current_directory_unless_said_otherwise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["run", "experiment=rana_obstacles", "budget=smoke", "num_replicates=1"]
    words += ["ga.population_size=8", "ga.num_generations=1", "planner.num_new_trajectories=0"]
    words += ["runner=serial", "--no-report"]
    monkeypatch.delenv("EVOEXP_OUTPUTS", raising=False)
    monkeypatch.chdir(tmp_path)
    assert main(words) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["outputs"]
    assert len(list(tmp_path.glob("outputs/runs/*/replicates/0000.mcap"))) == 1
    monkeypatch.setenv("EVOEXP_OUTPUTS", "elsewhere")
    assert main(words) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"outputs", "elsewhere"}
