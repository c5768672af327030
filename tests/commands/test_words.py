"""The words of a command: overrides, motion files, folders of options, files of experiments."""

import json
import shlex
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_samples import Evoexp

from evoexp.commands.arguments import is_motion, is_override
from store_lookup import find_runs

Refused = Callable[..., str]
PLANAR = ("experiment=rana_planar", "budget=smoke")


@pytest.fixture
def motion(tmp_path: Path) -> str:
    """Return a file with the straight motion of the two arms, 21 instants."""
    ends = ([[45.0, 225.0], [225.0, 225.0]], [[135.0, 135.0], [315.0, 315.0]])
    path = tmp_path / "motion.json"
    path.write_text(json.dumps(np.linspace(*ends, 21).swapaxes(0, 1).tolist()))
    return str(path)


@pytest.fixture
def conf(tmp_path: Path) -> str:
    """Return a folder with an experiment and an option of its own."""
    folder = tmp_path / "conf"
    (folder / "experiment").mkdir(parents=True)
    (folder / "ga").mkdir()
    (folder / "experiment/mine.yaml").write_text(
        "# @package _global_\n# evoexp run experiment=mine\n# Arms and few of them.\ndefaults:\n"
        + "".join(
            f"  - override /{group}: {name}\n"
            for group, name in (
                ("robot", "two_planar_2r"),
                ("scenario", "rana_obstacles"),
                ("planner", "rana_planar"),
                ("ga", "few"),
                ("objective", "rana_planar"),
                ("collision", "rana_planar"),
            )
        )
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
    evoexp: Evoexp, motion: str, words: tuple[str, ...]
) -> None:
    for given in ((motion, *PLANAR, *words), (*words, motion, *PLANAR)):
        said = evoexp("evaluate", *given, "--json")
        assert (said.code, said.err) == (0, ""), said.err
        rows = json.loads(said.out)
        shown = json.loads(evoexp("show", *PLANAR, *words, "--json").out)
        ids = [each["condition"] for each in (shown if isinstance(shown, list) else [shown])]
        assert [row["condition"] for row in (rows if isinstance(rows, list) else [rows])] == ids


@pytest.mark.parametrize("command", ["view", "play", "export"])
def test_a_motion_is_shown_under_every_override(
    evoexp: Evoexp, motion: str, outputs: Path, command: str
) -> None:
    words = (*PLANAR, "~control", "--only", "via-point GA")
    said = evoexp(command, motion, *words)
    assert (said.code, said.err) == (0, "")
    assert list((outputs / "motions").glob("motion.*"))


def test_a_motion_file_alone_lacks_an_experiment(refused: Refused, motion: str) -> None:
    for command in ("evaluate", "view", "play", "export"):
        assert refused(command, motion).startswith("experiment: must be chosen: ")


@pytest.mark.matrix
def test_all_commands_search_a_folder_of_options(
    evoexp: Evoexp, outputs: Path, motion: str, conf: str, tmp_path: Path
) -> None:
    folder = ("--config-dir", conf)
    words = ("experiment=mine", "num_replicates=1", "runner=serial", *folder)
    assert "mine" in evoexp("list", *folder).out
    assert evoexp("run", *words, "report.formats=[png]", "report.dpi=20").code == 0
    (run,) = find_runs(outputs)
    command = shlex.split(run.manifest()["command"])
    assert "nothing to run" in evoexp(*command[1:], "--no-report").out
    (page,) = outputs.glob("reports/*/index.md")
    assert f"--config-dir {conf}" in page.read_text()
    assert evoexp("report", "mine", "report.formats=[png]", "report.dpi=20", *folder).code == 0
    assert json.loads(evoexp("show", *words[:1], *folder, "--json").out)["result"]["done"] == 1
    assert evoexp("evaluate", motion, *words[:1], *folder).code == 0
    assert evoexp("view", motion, *words[:1], *folder, "-o", str(tmp_path / "a.html")).code == 0
    assert evoexp("play", motion, *words[:1], *folder, "-o", str(tmp_path / "a.mcap")).code == 0
    assert evoexp("export", motion, *words[:1], *folder, "-o", str(tmp_path / "b.json")).code == 0
    assert evoexp("reproduce", run.hash12).code == 0


@pytest.mark.parametrize("command", ["run", "report", "show", "evaluate", "view"])
def test_errors_list_the_options_of_all_folders(
    refused: Refused, conf: str, motion: str, command: str
) -> None:
    given = (motion,) if command in ("evaluate", "view") else ()
    said = refused(command, *given, "experiment=mime", "--config-dir", conf)
    assert said.startswith("experiment: no option 'mime'; did you mean 'mine'? (options: ")
    assert "(options: mine, lavoie, " in said


def test_a_folder_that_is_none_is_refused(refused: Refused) -> None:
    for command in ("run", "list", "show"):
        words = ("experiment=rana_planar",) if command != "list" else ()
        said = refused(command, *words, "--config-dir", "nowhere")
        assert said == "--config-dir: must be a folder, was 'nowhere'"


def test_an_experiment_that_is_a_file(evoexp: Evoexp, outputs: Path, conf: str) -> None:
    file = f"{conf}/experiment/mine.yaml"
    words = (f"experiment={file}", "num_replicates=1", "runner=serial", "--config-dir", conf)
    assert evoexp("run", *words, "report.formats=[png]", "report.dpi=20").code == 0
    (page,) = outputs.glob("reports/*/index.md")
    command = next(line for line in page.read_text().splitlines() if "evoexp report" in line)
    typed = shlex.split(command.partition("evoexp ")[2].partition("`")[0])
    assert file in typed
    assert evoexp(*typed).code == 0
