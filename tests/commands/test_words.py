"""The words of a command: overrides, motion files, folders of options, files of experiments."""

import json
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import Evoexp

from evoexp.commands.command_parser import is_motion, is_override

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
