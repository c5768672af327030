"""Options are found in all folders, the first folder wins, and every option tells its origin."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from evoexp import registry
from evoexp.cli import main
from evoexp.configuration import compose
from evoexp.configuration.compose import expand
from evoexp.configuration.search_path import (
    description,
    find,
    folders,
    groups,
    options,
    searched_first,
)
from evoexp.errors import EvoexpError, RegistrationError, SettingError, UnknownOption
from guests import on_path, write_distribution

SHIPPED = Path(find("ga", "rana_planar").path).read_text()
HEAD = "# @package _global_\n# evoexp run experiment=mine\n# Mine.\n"
DEFAULTS = Path(find("experiment", "rana_obstacles").path).read_text().partition("defaults:")[2]


def write_ga(folder: Path, name: str, population_size: int) -> Path:
    """Write a `ga` option into a folder of options; return the folder."""
    (folder / "ga").mkdir(parents=True, exist_ok=True)
    text = SHIPPED.replace("population_size: 50", f"population_size: {population_size}")
    assert text != SHIPPED
    (folder / "ga" / f"{name}.yaml").write_text(text)
    return folder


def population_size(*words: str) -> int:
    """Return the population size of the first condition of an experiment."""
    (experiment,) = expand(words)
    return int(experiment.conditions[0].condition.planner.ga.population_size)


@pytest.fixture
def package(tmp_path: Path) -> Iterator[Path]:
    """Install a distribution with a folder of options inside its package; return the folder."""
    conf = write_ga(tmp_path / "site" / "my_options" / "conf", "mine", 13)
    (conf.parent / "__init__.py").write_text("raise RuntimeError('imported')")
    write_distribution(tmp_path / "site", "my-options", "0.3", conf={"any": "my_options:conf"})
    with on_path(tmp_path / "site"):
        yield conf


def test_each_place_is_searched_before_the_next_one(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One option in all places: each wins once those before it have it no more."""
    words = ("experiment=rana_obstacles",)  # with ga=rana_planar, which is shipped with 50
    given = [tmp_path / f"given {k}, [a]='b'" for k in (1, 2)]
    variable = [tmp_path / f"variable{k}" for k in (1, 2)]
    places = [*given, *variable, package]
    for size, folder in enumerate(places, 11):
        write_ga(folder, "rana_planar", size)
    monkeypatch.setenv("EVOEXP_CONFIG_DIR", os.pathsep.join(map(str, variable)))
    found = []
    with searched_first(map(str, given)):
        assert [folder.path for folder in folders()][:5] == places
        for folder in [*places, None]:
            found.append((population_size(*words), find("ga", "rana_planar").origin))
            if folder is not None:
                (folder / "ga" / "rana_planar.yaml").unlink()
        assert {"mine", "lavoie"} <= set(options("ga"))
    names = [*map(str, given), *map(str, variable), "my-options 0.3", "evoexp"]
    assert found == list(zip([11, 12, 13, 14, 15, 50], names, strict=True))


def test_an_option_may_replace_a_shipped_one_and_says_so(tmp_path: Path) -> None:
    folder = write_ga(tmp_path / "own", "rana_planar", 7)
    with searched_first([str(folder)]):
        (experiment,) = expand(["experiment=rana_obstacles"])
        taken = {option.group: option for option in experiment.options["rana_obstacles"]}
        assert taken["ga"].source == f"{folder}: ga/rana_planar.yaml"
        assert taken["robot"].source == "conf/robot/two_planar_2r.yaml"
        assert taken["experiment"].name == "rana_obstacles"
        assert "control" not in taken
        names = experiment.origin("rana_obstacles", "")["options"]
        assert names["ga"] == {"name": "rana_planar", "origin": str(folder)}
    assert population_size("experiment=rana_obstacles") == 50


def test_options_of_every_label_are_recorded() -> None:
    (experiment,) = compose.expand(["experiment=rana_planar"])
    assert set(experiment.options) == {"via-point GA", "random search", "multi-start"}
    origins = [experiment.origin(label, "") for label, _ in experiment.conditions]
    controls = [origin["options"].get("control") for origin in origins]
    assert controls == [
        None,
        {"name": "random_search", "origin": "evoexp"},
        {"name": "multi_start", "origin": "evoexp"},
    ]


def test_a_folder_that_is_none_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SettingError, match=r"--config-dir: must be a folder, was 'nowhere'"):
        with searched_first(["nowhere"]):
            raise AssertionError
    monkeypatch.setenv("EVOEXP_CONFIG_DIR", f"{tmp_path}{os.pathsep}nowhere")
    with pytest.raises(SettingError, match=r"EVOEXP_CONFIG_DIR: must be a folder, was 'nowhere'"):
        folders()
    assert main(["run", "experiment=rana_planar"]) == 2
    assert "EVOEXP_CONFIG_DIR: must be a folder" in capsys.readouterr().err


def test_a_package_without_its_folder_is_named(tmp_path: Path) -> None:
    write_distribution(tmp_path, "gone", "2.1", conf={"any": "no_such_package:conf"})
    with (
        on_path(tmp_path),
        pytest.raises(RegistrationError, match=r"any: gone 2\.1 declares the f"),
    ):
        folders()


def test_a_package_beside_src_and_an_inner_folder(tmp_path: Path) -> None:
    (tmp_path / "src" / "laid_out").mkdir(parents=True)
    (tmp_path / "src" / "laid_out" / "__init__.py").touch()
    write_ga(tmp_path / "more" / "conf", "laid", 6)
    write_distribution(tmp_path / "src", "laid-out", conf={"any": "laid_out:more.conf"})
    with on_path(tmp_path / "src"):
        assert find("ga", "laid").path == str(tmp_path / "more" / "conf" / "ga" / "laid.yaml")


def test_messages_list_the_options_of_all_folders(package: Path, tmp_path: Path) -> None:
    with searched_first([str(write_ga(tmp_path / "own", "minute", 9))]):
        with pytest.raises(UnknownOption) as caught:
            expand(["experiment=rana_obstacles", "ga=minnute"])
    assert {"mine", "minute", "lavoie"} <= set(caught.value.known)
    assert "did you mean 'minute'?" in str(caught.value)


def test_of_a_folder_only_the_options_count(tmp_path: Path) -> None:
    (write_ga(tmp_path, "mine", 12) / "config.yaml").write_text("seed: 5\nnonsense: 3\n")
    with searched_first([str(tmp_path)]):
        (experiment,) = expand(["experiment=rana_obstacles", "ga=mine"])
    assert experiment.conditions[0].condition.seed == 0


def test_files_are_looked_for_beside_the_scenarios_of_all_folders(package: Path) -> None:
    (package / "scenario").mkdir()
    shipped = folders()[-1].path / "scenario/chen_fig_1.txt"
    (package / "scenario" / "my_map.txt").write_text(shipped.read_text().replace("*", ".", 1))
    words = ["experiment=chen_fields", "scenario.map={file: my_map.txt}"]
    plain, other = (expand(given)[0].conditions[0].condition.id for given in (words[:1], words))
    assert plain != other


# Experiments that are files


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., str]:
    """Return a function that writes an experiment file that lies anywhere, and gives its path."""

    def write(text: str, name: str = "mine") -> str:
        path = tmp_path / "any where, [or] {other}" / f"{name}.yaml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        return str(path)

    return write


def test_an_experiment_may_be_a_file_anywhere(
    write: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(f"{HEAD}defaults:{DEFAULTS}\nga:\n  population_size: 31\n")
    (experiment,) = expand([f"experiment={path}"])
    assert (experiment.name, experiment.changed) == ("mine", False)
    assert experiment.conditions[0].label == "mine"
    assert experiment.conditions[0].condition.planner.ga.population_size == 31
    assert experiment.options["mine"][0].source == path
    assert description(path) == "Mine."
    monkeypatch.chdir(Path(path).parent)
    assert expand(["experiment=mine.yaml"])[0].conditions == experiment.conditions
    assert expand(["experiment=./mine.yaml", "seed=1"])[0].changed
    own = write_ga(tmp_path / "own", "mine", 8)
    with searched_first([str(own)]):
        text = DEFAULTS.replace("override /ga: rana_planar", "override /ga: mine")
        assert population_size(f"experiment={write(f'{HEAD}defaults:{text}', 'other')}") == 8


def test_experiments_that_are_files_are_swept_over(write: Callable[..., str]) -> None:
    for name in ("one", "two"):
        write(f"{HEAD}defaults:{DEFAULTS}", name)
    folder = Path(write("", "unused")).parent
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        found = expand(["experiment=one.yaml,two.yaml,rana_planar"], multirun=True)
        assert [experiment.name for experiment in found] == ["one", "two", "rana_planar"]
        with pytest.raises(SettingError, match="experiment: must be names that differ"):
            expand(["experiment=one.yaml,./one.yaml"], multirun=True)


def test_a_kept_expansion_of_a_file_follows_its_content(
    write: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    found = []
    for size in (21, 22):
        path = write(f"{HEAD}defaults:{DEFAULTS}\nga:\n  population_size: {size}\n")
        (experiment,) = compose.expand([f"experiment={path}"])
        found.append(experiment.conditions[0].condition.planner.ga.population_size)
    assert found == [21, 22]


@pytest.mark.examples(2)
@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            f"defaults:{DEFAULTS}",
            "experiment: must be a file that begins with '# @package _global_'",
        ),
        (f"{HEAD}defaults:{DEFAULTS}\nga: [1,\n", "experiment: must be a YAML file (line "),
        (f"{HEAD}defaults:{DEFAULTS}\ngaa: 3\n", "gaa: unknown setting; did you mean 'ga'?"),
        (
            f"{HEAD}defaults:{DEFAULTS}\nga: 3\n",
            "ga: must be a mapping of settings, was 3",
        ),
        (f"{HEAD}defaults:{DEFAULTS}\nconditions: 3\n", "conditions: must be a mapping of labels"),
        (
            f"{HEAD}defaults: 3\n",
            "experiment: must be a file of settings whose 'defaults' are a list",
        ),
        (f"{HEAD}- 1\n- 2\n", "experiment: must be a file of settings whose 'defaults' are a list"),
        (f"{HEAD}defaults:\n  - override /gaa: x\n", "group: no option 'gaa'; did you mean 'ga'?"),
        (f"{HEAD}defaults:\n  - override /ga: minus\n", "ga: no option 'minus'"),
        (
            f"{HEAD}defaults:\n  - override /ga: lavoie\n",
            "collision: must be chosen: chen, ",
        ),
        ("", "experiment: must be a file that begins with '# @package _global_'"),
    ],
)
def test_files_that_cannot_be_composed(write: Callable[..., str], text: str, message: str) -> None:
    with pytest.raises(EvoexpError) as caught:
        expand([f"experiment={write(text)}"])
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_refused() -> None:
    with pytest.raises(SettingError, match="experiment: must be the path of a file, or the name"):
        expand(["experiment=no/such.yaml"])
    with pytest.raises(UnknownOption, match="experiment: no option 'no/such'"):
        expand(["experiment=no/such"])


def test_groups_are_those_of_the_root_configuration() -> None:
    assert {"experiment", "robot", "budget", "control"} <= set(groups())
    assert registry.registrations(registry.CONF)[0].is_own
    assert compose.parse("scenario.phases[2].goal[0]=1").key == "scenario.phases.2.goal.0"
