"""`evoexp completion`: the shell completes commands, options, experiments and hashes."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import Evoexp

from evoexp.commands.command_parser import COMMANDS
from evoexp.commands.completion import script
from evoexp.configuration.search_path import options

Complete = Callable[..., list[str]]


@pytest.fixture
def complete(tmp_path: Path) -> Complete:
    """Return a function that gives the words that bash offers in the place of the last one."""
    program, bash_script = tmp_path / "bin" / "evoexp", tmp_path / "bin" / "script"
    program.parent.mkdir()
    bash_script.write_text(script("bash"))
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m evoexp "$@"\n')
    program.chmod(0o755)

    def offered(*words: str) -> list[str]:
        line = " ".join(f"'{word}'" for word in words)
        code = (
            f"source {bash_script}; COMP_WORDS=(evoexp {line}); COMP_CWORD={len(words)}; "
            "_evoexp_complete 2>/dev/null; printf '%s\\n' \"${COMPREPLY[@]}\""
        )
        environment = os.environ | {"EVOEXP_OUTPUTS": str(tmp_path / "outputs")}
        environment["PATH"] = f"{program.parent}:{os.environ['PATH']}"
        out = subprocess.check_output(
            ["bash", "-c", code], text=True, cwd=tmp_path, env=environment
        )
        return [word.strip() for word in out.splitlines() if word.strip()]

    return offered


def test_commands_and_options(complete: Complete) -> None:
    assert set(complete("")) == set(COMMANDS)
    assert complete("repro") == ["reproduce"]
    assert "--config-dir" in complete("run", "--")
    assert set(complete("export", "m.json", "--format", "")) >= {"csv", "json"}
    assert complete("new", "") == ["planner", "operator", "paper"]


def test_overrides_and_their_options(complete: Complete) -> None:
    assert complete("run", "exp") == ["experiment="]
    # bash takes "=" for a word of its own
    assert complete("run", "experiment", "=", "rana_pu") == ["rana_puma", "rana_puma_ablations"]
    assert set(complete("run", "experiment", "=")) == set(options("experiment"))
    assert complete("run", "experiment", "=", "rana", "budget", "=", "sm") == ["smoke"]
    assert complete("run", "ga.num_elites", "=", "") == []


def test_what_is_in_folders(complete: Complete, tmp_path: Path) -> None:
    (tmp_path / "conf" / "ga").mkdir(parents=True)
    (tmp_path / "conf/ga/rana_mine.yaml").write_text("_target_: genetic\n")
    words = ("show", "--config-dir", str(tmp_path / "conf"), "ga", "=", "rana_m")
    assert complete(*words) == ["rana_mine"]
    (tmp_path / "outputs/runs/0123456789ab").mkdir(parents=True)
    assert complete("show", "0123") == ["0123456789ab"]
    (tmp_path / "motion.json").write_text("[]")
    assert complete("evaluate", "mot") == ["motion.json"]


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_scripts_are_printed_and_parse(evoexp: Evoexp, shell: str, tmp_path: Path) -> None:
    said = evoexp("completion", shell)
    assert (said.code, said.err) == (0, "")
    assert all(name in said.out for name in COMMANDS)
    (tmp_path / "script").write_text(said.out)
    if shutil.which(shell):
        subprocess.run([shell, "-n", str(tmp_path / "script")], check=True)


def test_options_of_a_group_and_the_line_to_type(evoexp: Evoexp) -> None:
    assert evoexp("completion", "options", "budget").out.split() == ["paper", "quick", "smoke"]
    assert evoexp("completion", "options", "ga.num_elites").out == ""
    out = evoexp("completion", "--help").text
    assert "evoexp completion bash > ~/.local/share/bash-completion/completions/evoexp" in out
