"""Options are found in all folders, the first folder wins, and every option tells its origin."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import yaml

from evoexp.configuration.compose import expand
from evoexp.configuration.search_path import find, folders, options, searched_first
from evoexp.errors import EvoexpError, RegistrationError, SettingError
from evoexp.shipped import described
from guests import on_path, write_distribution

HEAD = "# @package _global_\n# evoexp run experiment=mine\n# Mine.\n"
DEFAULTS = Path(find("experiment", "rana_obstacles").path).read_text().partition("defaults:")[2]
WHOLE = f"{HEAD}defaults:{DEFAULTS}\n"
ENTRY = f"{WHOLE}conditions:\n  a: "
Write = Callable[..., str]


def write_ga(folder: Path, name: str, population_size: int) -> Path:
    """Write a `ga` option into a folder of options; return the folder."""
    (folder / "ga").mkdir(parents=True, exist_ok=True)
    shipped = Path(find("ga", "rana_planar").path).read_text()
    text = shipped.replace("population_size: 50", f"population_size: {population_size}")
    assert text != shipped
    (folder / "ga" / f"{name}.yaml").write_text(text)
    return folder


def population_size(*words: str) -> int:
    """Return the population size of the first condition of an experiment."""
    return int(expand(words)[0].conditions[0].condition.planner.ga.population_size)


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
    given = [tmp_path / f"given {k}, [a]='b'" for k in (1, 2)]
    variable = [tmp_path / f"variable{k}" for k in (1, 2)]
    places = [*given, *variable, package]
    for size, folder in enumerate(places, 11):
        write_ga(folder, "rana_planar", size)
    monkeypatch.setenv("EVOEXP_CONFIG_DIR", os.pathsep.join(map(str, variable)))
    found = []
    with searched_first(map(str, given)):
        assert [folder.path for folder in folders()][:5] == places
        assert {"mine", "lavoie"} <= set(options("ga"))
        for folder in [*places, None]:
            origin = find("ga", "rana_planar").origin
            found.append((population_size("experiment=rana_obstacles"), origin))
            if folder is not None:
                (folder / "ga" / "rana_planar.yaml").unlink()
    names = [*map(str, given), *map(str, variable), "my-options 0.3", "evoexp"]
    assert found == list(zip([11, 12, 13, 14, 15, 50], names, strict=True))


def test_an_option_may_replace_a_shipped_one_and_says_so(tmp_path: Path) -> None:
    folder = write_ga(tmp_path / "own", "rana_planar", 7)
    (folder / "config.yaml").write_text("seed: 5\nnonsense: 3\n")  # of a folder, options count
    with searched_first([str(folder)]):
        (experiment,) = expand(["experiment=rana_obstacles"])
    taken = {option.group: option for option in experiment.options["rana_obstacles"]}
    assert taken["ga"].source == f"{folder}: ga/rana_planar.yaml"
    assert taken["robot"].source == "conf/robot/two_planar_2r.yaml"
    assert taken["experiment"].name == "rana_obstacles" and "control" not in taken
    names = experiment.origin("rana_obstacles", "")["options"]
    assert names["ga"] == {"name": "rana_planar", "origin": str(folder)}
    assert experiment.conditions[0].condition.seed == 0


def test_options_of_every_label_are_recorded() -> None:
    (experiment,) = expand(["experiment=rana_planar"])
    for label, control in (("via-point GA", None), ("multi-start", "multi_start")):
        named = {"name": control, "origin": "evoexp"} if control else None
        assert experiment.origin(label, "")["options"].get("control") == named


def test_a_folder_that_is_none_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("EVOEXP_CONFIG_DIR", f"{tmp_path}{os.pathsep}nowhere")
    with pytest.raises(SettingError, match=r"EVOEXP_CONFIG_DIR: must be a folder, was 'nowhere'"):
        folders()


def test_a_package_without_its_folder_is_named(tmp_path: Path) -> None:
    write_distribution(tmp_path, "gone", "2.1", conf={"any": "no_such_package:conf"})
    refused = pytest.raises(RegistrationError, match=r"any: gone 2\.1 declares the f")
    with on_path(tmp_path), refused:
        folders()


def test_a_package_beside_src_and_an_inner_folder(tmp_path: Path) -> None:
    (tmp_path / "src" / "laid_out").mkdir(parents=True)
    (tmp_path / "src" / "laid_out" / "__init__.py").touch()
    write_ga(tmp_path / "more" / "conf", "laid", 6)
    write_distribution(tmp_path / "src", "laid-out", conf={"any": "laid_out:more.conf"})
    with on_path(tmp_path / "src"):
        assert find("ga", "laid").path == str(tmp_path / "more" / "conf" / "ga" / "laid.yaml")


def test_files_are_looked_for_beside_the_scenarios_of_all_folders(package: Path) -> None:
    (package / "scenario").mkdir()
    shipped = folders()[-1].path / "scenario/chen_fig_1.txt"
    (package / "scenario" / "my_map.txt").write_text(shipped.read_text().replace("*", ".", 1))
    words = ["experiment=chen_fields", "scenario.map={file: my_map.txt}"]
    plain, other = (expand(given)[0].conditions[0].condition.id for given in (words[:1], words))
    assert plain != other


# Experiments that are files


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Return a function that writes an experiment file that lies anywhere, and gives its path."""

    def write(text: str, name: str = "mine") -> str:
        path = tmp_path / "any where, [or] {other}" / f"{name}.yaml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        return str(path)

    return write


def test_an_experiment_may_be_a_file_anywhere(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    for size in (30, 31):  # a kept expansion of a file follows its content
        path = write(f"{WHOLE}ga:\n  population_size: {size}\n")
        assert population_size(f"experiment={path}") == size
    (experiment,) = expand([f"experiment={path}"])
    assert (experiment.name, experiment.changed) == ("mine", False)
    assert experiment.conditions[0].label == "mine"
    assert experiment.options["mine"][0].source == path
    assert described(Path(find("experiment", path).path)) == "Mine."
    monkeypatch.chdir(Path(path).parent)
    assert expand(["experiment=mine.yaml"])[0].conditions == experiment.conditions
    assert expand(["experiment=./mine.yaml", "seed=1"])[0].changed
    with searched_first([str(write_ga(tmp_path / "own", "mine", 8))]):
        text = WHOLE.replace("override /ga: rana_planar", "override /ga: mine")
        assert population_size(f"experiment={write(text, 'other')}") == 8


def test_experiments_that_are_files_are_swept_over(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("one", "two"):
        monkeypatch.chdir(Path(write(WHOLE, name)).parent)
    found = expand(["experiment=one.yaml,two.yaml,rana_planar"], multirun=True)
    assert [experiment.name for experiment in found] == ["one", "two", "rana_planar"]
    with pytest.raises(SettingError, match="experiment: must be names that differ"):
        expand(["experiment=one.yaml,./one.yaml"], multirun=True)


REFUSED: dict[str, str] = yaml.safe_load(Path(__file__).with_name("refused_files.yaml").read_text())
TEXTS = {"HEAD": HEAD, "DEFAULTS": DEFAULTS, "WHOLE": WHOLE, "ENTRY": ENTRY}


@pytest.mark.examples(4)
@pytest.mark.parametrize(("text", "message"), REFUSED.items())
def test_files_that_cannot_be_composed(write: Write, text: str, message: str) -> None:
    for name, whole in TEXTS.items():
        text = text.replace(name, whole)
    with pytest.raises(EvoexpError) as caught:
        expand([f"experiment={write(text)}"])
    assert message in str(caught.value) and "\n" not in str(caught.value)
