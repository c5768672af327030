"""The words of a command: overrides, motion files, folders of options, files of experiments."""

import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import Evoexp

from evoexp.commands.command_parser import COMMANDS, is_motion, is_override
from evoexp.commands.completion import script
from evoexp.configuration.search_path import options

PLANAR = ("experiment=rana_planar", "budget=smoke")


@pytest.fixture
def conf(tmp_path: Path) -> str:
    """Return a folder with an experiment and an option of its own."""
    folder = tmp_path / "conf"
    (folder / "experiment").mkdir(parents=True)
    (folder / "ga").mkdir()
    chosen = {"robot": "two_planar_2r", "scenario": "rana_obstacles", "ga": "few"}
    chosen |= dict.fromkeys(("planner", "objective", "collision"), "rana_planar")
    (folder / "experiment/mine.yaml").write_text(
        "# @package _global_\n# evoexp run experiment=mine\n# Arms and few of them.\ndefaults:\n"
        + "".join(f"  - override /{group}: {name}\n" for group, name in chosen.items())
    )
    (folder / "ga/few.yaml").write_text(
        "_target_: genetic\npopulation_size: 8\nnum_generations: 2\nnum_elites: 2\n"
        "crossover_rate: 0.9\nmutation_rate: 0.1\n"
    )
    return str(folder)


def test_words_that_are_overrides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for word in ("a.b=c", "~a.b", "+a.b=c", "++a.b=c", "a=two words", "a=mine.json", "~a=b"):
        assert is_override(word) and not is_motion(word), word
    for word in ("mine.json", "dir/mine.npy", "9a95c3", "log.mcap"):
        assert not is_override(word), word
    assert is_motion("mine.json") and is_motion("dir/mine.npy")
    assert not is_motion("9a95c3") and not is_motion("mine.txt")
    Path("lambda=4.json").write_text("[]")
    assert is_motion("lambda=4.json"), "a file that exists is a file, whatever its name"
    Path("~mine.json").write_text("[]")
    assert is_motion("~mine.json")


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    "words",
    [
        ("~control", "--only", "random search"),
        ("+robot.arms.0.joint_limits=[[0,6.3],[0,6.3]]",),
        ("++ga.population_size=30",),
        ("scenario.length_unit=a b",),
        ("scenario.obstacles=[{shape: sphere, center: [9, 9], radius: 0.1}]",),
    ],
)
def test_evaluate_takes_every_override_of_run(
    evoexp: Evoexp, motion: Path, words: tuple[str, ...]
) -> None:
    for given in ((str(motion), *PLANAR, *words), (*words, str(motion), *PLANAR)):
        said = evoexp("evaluate", *given, "--json")
        assert (said.code, said.err) == (0, ""), said.err
        rows = json.loads(said.out)
        shown = json.loads(evoexp("show", *PLANAR, *words, "--json").out)
        ids = [each["condition"] for each in (shown if isinstance(shown, list) else [shown])]
        assert [row["condition"] for row in (rows if isinstance(rows, list) else [rows])] == ids


@pytest.mark.parametrize("command", ["view", "play", "export"])
def test_a_motion_is_shown_under_every_override(
    evoexp: Evoexp, motion: Path, outputs: Path, command: str
) -> None:
    said = evoexp(command, str(motion), *PLANAR, "~control", "--only", "via-point GA")
    assert (said.code, said.err) == (0, "")
    (file, *_) = sorted((outputs / "motions").glob("motion.*"))
    assert command != "view" or "motion.json · ~control" in file.read_text()


MOTIONS = ("evaluate", "view", "play", "export")


@pytest.mark.parametrize("command", ["run", "plan", "report", "show", "compare", *MOTIONS])
def test_errors_list_the_options_of_all_folders(
    refused: Callable[..., str], conf: str, motion: Path, command: str
) -> None:
    given = (str(motion),) if command in MOTIONS else ()
    said = refused(command, *given, "experiment=mime", "--config-dir", conf)
    assert said.startswith("experiment: no option 'mime'; did you mean 'mine'? (options: ")
    assert "(options: mine, lavoie, " in said


def test_an_experiment_that_is_a_file(evoexp: Evoexp, outputs: Path, conf: str) -> None:
    file = f"{conf}/experiment/mine.yaml"
    words = (f"experiment={file}", "num_replicates=1", "runner=serial", "--config-dir", conf)
    assert evoexp("run", *words, "report.formats=[png]", "report.dpi=20").code == 0
    (page,) = outputs.glob("reports/*/index.md")
    command = next(line for line in page.read_text().splitlines() if "evoexp report" in line)
    typed = shlex.split(command.partition("evoexp ")[2].partition("`")[0])
    assert file in typed
    assert evoexp(*typed).code == 0


# `evoexp completion`: the shell completes commands, options, experiments and hashes

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
