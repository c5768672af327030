"""Expansions that are kept: the same experiments.

Composed anew whenever something that has a say changed.
"""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from evoexp import attachments, shipped
from evoexp.configuration import compose, expansions
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import file_directories
from evoexp.errors import EvoexpError

WORDS = ["experiment=rana_planar", "budget=smoke"]
ROBOT = [
    "robot=urdf",
    "scenario=urdf_reach",
    "planner=posture_es",
    "ga=corsepius",
    "objective=corsepius_reach",
]
ROBOT += ["collision=corsepius_spheres"]
SIX_R = Path(__file__).parents[1] / "robots" / "data" / "ur5_like" / "ur5_like.urdf"


@pytest.fixture
def composed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], int]:
    """Have a cache of this test's own; return how often something was composed."""
    monkeypatch.setenv("EVOEXP_CACHE", str(tmp_path / "cache"))
    calls: list[object] = []
    expand = compose.expand

    def counted(*words: object, **more: object) -> list[Experiment]:
        calls.append(words)
        return expand(*words, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(compose, "expand", counted)
    return lambda: len(calls)


@pytest.mark.parametrize(
    "words", [WORDS, [*WORDS, "runner.num_workers=1", "report.formats=[pdf]", "seed=3"]]
)
def test_what_is_kept_is_what_was_composed(composed: Callable[[], int], words: list[str]) -> None:
    first, second = expansions.expand(words), expansions.expand(words)
    assert composed() == 1
    assert first == second == compose.expand(words)
    assert [c.condition.id for c in second[0].conditions] == [
        c.condition.id for c in first[0].conditions
    ]


def test_other_words_are_composed(composed: Callable[[], int]) -> None:
    plain = expansions.expand(["experiment=rana_planar"])
    seeds = expansions.expand(["experiment=rana_planar", "seed=0,1"], multirun=True)
    (one,) = expansions.expand(
        ["experiment=rana_planar", "seed=0,1"], multirun=True, only=["random search · seed=1"]
    )
    assert composed() == 3
    assert (len(plain[0].conditions), len(seeds[0].conditions), len(one.conditions)) == (3, 6, 1)
    assert one.changed


def test_several_experiments_are_kept_one_by_one(composed: Callable[[], int]) -> None:
    first = expansions.expand(["experiment=lavoie_7dof", "budget=smoke"])
    words = ["experiment=lavoie_7dof,chen_fields", "budget=smoke"]
    both = expansions.expand(words, multirun=True)
    assert composed() == 2, "the first one was kept"
    assert both[:1] == first
    assert both == compose.expand(words, multirun=True)
    before = composed()
    assert expansions.expand(words, multirun=True) == both
    assert composed() == before, "both are kept"
    swept = [*words, "seed=0,1"]
    assert expansions.expand(swept, multirun=True) == compose.expand(swept, multirun=True)


@pytest.mark.parametrize(
    ("words", "multirun"),
    [
        (["experiment=lavoie_7dof,chen_fields"], False),
        (["experiment=lavoie_7dof,lavoie_7dof"], True),
        (["experiment=lavoie_7dof,nothing_like_it"], True),
        (["experiment=lavoie_7dof,"], True),
    ],
)
def test_several_experiments_are_refused_as_hydra_refuses_them(
    composed: Callable[[], int], words: list[str], multirun: bool
) -> None:
    with pytest.raises(EvoexpError) as expected:
        compose.expand(words, multirun=multirun)
    with pytest.raises(EvoexpError) as found:
        expansions.expand(words, multirun=multirun)
    assert str(found.value) == str(expected.value)


def test_a_changed_file_of_conf_is_composed_anew(
    composed: Callable[[], int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    conf = tmp_path / "conf"
    shutil.copytree(shipped.config_directory(), conf)
    monkeypatch.setattr(shipped, "config_directory", lambda: conf)
    before = expansions.expand(["experiment=rana_planar"])
    path = conf / "ga" / "rana_planar.yaml"
    path.write_text(path.read_text().replace("population_size: ", "population_size: 1", 1))
    after = expansions.expand(["experiment=rana_planar"])
    assert composed() == 2
    assert before[0].conditions[0].condition.id != after[0].conditions[0].condition.id


def test_damage_is_noticed_and_mended(composed: Callable[[], int], tmp_path: Path) -> None:
    first = expansions.expand(WORDS)
    (path,) = (tmp_path / "cache" / "expansions").iterdir()
    path.write_bytes(path.read_bytes().replace(b"smoke", b"paper", 1))
    assert expansions.expand(WORDS) == first
    assert expansions.expand(WORDS) == first
    assert composed() == 2


@pytest.mark.parametrize(
    "words", [[*WORDS, "seed=${num_replicates}"], [*ROBOT, f"robot.path={SIX_R}"]]
)
def test_what_urdf_files_or_interpolations_have_a_say_in_is_not_kept(
    composed: Callable[[], int], tmp_path: Path, words: list[str]
) -> None:
    assert expansions.expand(words) == expansions.expand(words)
    assert composed() == 2
    assert not (tmp_path / "cache" / "expansions").exists()


def test_files_are_read_again(
    composed: Callable[[], int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["experiment=chen_fields"]
    first = expansions.expand(words)
    condition = first[0].conditions[0].condition
    files = condition.files()
    monkeypatch.setattr(attachments, "_contents", {})  # as in another process
    assert expansions.expand(words) == first
    assert composed() == 1
    assert len(files) == 1
    assert condition.files() == files
    shadow = (
        tmp_path / "chen_fig_1.txt"
    )  # what lies in the current directory comes before what is shipped
    shadow.write_text((file_directories()[-1] / "chen_fig_1.txt").read_text().replace("*", ".", 1))
    other = expansions.expand(words)
    assert other[0].conditions[0].condition.id != condition.id
    shadow.unlink()
    assert expansions.expand(words) == first


def test_errors_are_not_kept(composed: Callable[[], int]) -> None:
    for _ in range(2):
        with pytest.raises(EvoexpError):
            expansions.expand([*WORDS, "ga.populaton_size=3"])
    assert composed() == 2


def test_only_the_newest_are_kept(
    composed: Callable[[], int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(expansions, "NUM_KEPT", 2)
    for seed in range(4):
        expansions.expand(["experiment=rana_planar", f"seed={seed}"])
    assert len(list((tmp_path / "cache" / "expansions").iterdir())) == 2
