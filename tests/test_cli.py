"""The command line: exit codes, help, any directory."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from evoexp import __version__
from evoexp.cli import COMMANDS, main


def run(*words: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "evoexp", *words],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=120,
    )


def test_help_names_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["--help"])
    assert left.value.code == 0
    out = capsys.readouterr().out
    assert all(f"\n    {name}" in out for name in COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main([command, "--help"])
    assert left.value.code == 0
    out = capsys.readouterr().out
    assert out.startswith(f"usage: evoexp {command} ")
    assert COMMANDS[command][1:] in " ".join(out.split())


def test_evaluate_says_what_a_motion_file_is(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["evaluate", "--help"])
    out = " ".join(capsys.readouterr().out.split())
    assert "(.json: nested lists, .npy: an array)" in out
    assert "a joint trajectory as export writes it (.csv, .json, .yaml)" in out


def test_no_words_and_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert "usage: evoexp" in capsys.readouterr().out
    with pytest.raises(SystemExit) as left:
        main(["--version"])
    assert left.value.code == 0
    assert capsys.readouterr().out == f"evoexp {__version__}\n"


def test_a_refusal_is_one_line_and_exit_code_2_in_a_process_too(tmp_path: Path) -> None:
    done = run("run", "experiment=rana_planr", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith(
        "evoexp: experiment: no option 'rana_planr'; did you mean 'rana_planar'?"
    )
    assert list(tmp_path.iterdir()) == []


def test_a_programming_error_keeps_its_traceback(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from evoexp.commands import list_

    def broken(*_: object) -> int:
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(list_, "main", broken)
    with pytest.raises(ZeroDivisionError):
        main(["list"])


def test_a_machine_without_memory_is_told_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(arguments: object) -> int:
        raise MemoryError("Unable to allocate 1. TiB for an array")

    monkeypatch.setattr("evoexp.commands.list_.main", fail)
    assert main(["list"]) == 2
    assert (
        capsys.readouterr().err == "evoexp: out of memory: Unable to allocate 1. TiB for an array\n"
    )


def test_ctrl_c_is_exit_code_130(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from evoexp.commands import list_

    def interrupted(*_: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(list_, "main", interrupted)
    assert main(["list"]) == 130
    assert capsys.readouterr().err.startswith("evoexp: interrupted")


def test_a_reader_that_closes_the_pipe_is_no_error(tmp_path: Path) -> None:
    command = f"{sys.executable} -m evoexp list | true; echo ${{PIPESTATUS[0]}}"
    done = subprocess.run(
        ["bash", "-c", command], cwd=tmp_path, capture_output=True, text=True, timeout=120
    )
    assert done.stdout == "0\n"
    assert done.stderr == ""


def test_outputs_are_in_the_current_directory_unless_said_otherwise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    small = (
        "budget=smoke",
        "ga.population_size=8",
        "ga.num_generations=1",
        "planner.num_new_trajectories=0",
    )
    words = [
        "run",
        "experiment=rana_obstacles",
        *small,
        "num_replicates=1",
        "runner=serial",
        "--no-report",
    ]
    monkeypatch.delenv("EVOEXP_OUTPUTS", raising=False)
    monkeypatch.chdir(tmp_path)
    assert main(words) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["outputs"]
    assert len(list(tmp_path.glob("outputs/runs/*/replicates/0000.mcap"))) == 1
    monkeypatch.setenv("EVOEXP_OUTPUTS", "elsewhere")
    assert main(words) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"outputs", "elsewhere"}
    capsys.readouterr()
