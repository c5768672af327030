"""Settings inside lists can be overridden, and a path that leads nowhere says where it ends."""

from pathlib import Path

import pytest

from evoexp.configuration.compose import expand
from evoexp.configuration.search_path import find, searched_first
from evoexp.errors import EvoexpError

PHASES = "experiment=corsepius_pick_and_place"
ARMS = "experiment=rana_obstacles"


def config(*words: str) -> dict[str, object]:
    """Return the canonical form of the scenario of the first condition."""
    (experiment,) = expand(words)
    scenario: dict[str, object] = experiment.conditions[0].condition.scenario.canonical()
    return scenario


def identity(*words: str) -> str:
    """Return the hash of the first condition."""
    return expand(words)[0].conditions[0].condition.id


def test_a_setting_inside_a_list_is_overridden() -> None:
    plain, changed = config(PHASES), config(PHASES, "scenario.phases.0.contacts=[[hand, ball]]")
    assert changed["phases"][0]["contacts"] == [["hand", "ball"]]  # type: ignore[index]
    assert plain["phases"][1:] == changed["phases"][1:]  # type: ignore[index]
    assert config(PHASES, "scenario.phases[0].contacts=[[hand, ball]]") == changed


def test_the_hash_is_that_of_the_resulting_configuration() -> None:
    centers = (
        "[{shape: sphere, center: [1, 2], radius: 1}, {shape: sphere, center: [9, 9], radius: 2}]"
    )
    whole = identity(ARMS, f"scenario.obstacles={centers}")
    moved = [
        f"scenario.obstacles={centers.replace('9, 9', '0, 0')}",
        "scenario.obstacles.1.center=[9,9]",
    ]
    assert identity(ARMS, *moved) == identity(ARMS, *moved[::-1]) == whole
    assert (
        identity(ARMS, f"scenario.obstacles={centers}", "scenario.obstacles.1.center.0=8") != whole
    )


def test_lists_grow_and_shrink() -> None:
    def obstacles(*words: str) -> list[object]:
        return list(config(ARMS, *words)["obstacles"])  # type: ignore[call-overload]

    plain, new = obstacles(), "{shape: sphere, center: [5, 5], radius: 1}"
    assert len(obstacles(f"+scenario.obstacles.{len(plain)}={new}")) == len(plain) + 1
    assert obstacles("~scenario.obstacles.0") == plain[1:]
    assert obstacles("~scenario.obstacles.0", "~scenario.obstacles.2") == [plain[1]]
    assert (
        obstacles(f"++scenario.obstacles.0={new}")[0]
        == obstacles("scenario.obstacles.0={shape: sphere, center: [5, 5], radius: 1}")[0]
    )


def test_entries_of_experiment_files_reach_into_lists(tmp_path: Path) -> None:
    (tmp_path / "experiment").mkdir()
    text = Path(find("experiment", "rana_obstacles").path).read_text()
    entries = '\nconditions:\n  "x = {}": ["scenario.obstacles.0.center.0=1,2"]\n  plain: []\n'
    (tmp_path / "experiment" / "mine.yaml").write_text(text + entries)
    with searched_first([str(tmp_path)]):
        found = dict(expand(["experiment=mine"])[0].conditions)
        assert list(found) == ["x = 1", "x = 2", "plain"]
    for x in (1, 2):
        assert found[f"x = {x}"].id == identity(ARMS, f"scenario.obstacles.0.center.0={x}")


def test_a_setting_that_the_option_does_not_mention_needs_no_plus() -> None:
    word = "scenario.phases.0.contacts=[[hand, ball]]"
    assert "contacts" not in config(PHASES)["phases"][0]  # type: ignore[index]
    assert identity(PHASES, word) == identity(PHASES, f"+{word}") == identity(PHASES, f"++{word}")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((PHASES, "scenario.phases.6.then=x"), "scenario.phases.6: must be an index from 0 to 5"),
        ((PHASES, "scenario.phases.6=1"), "(+scenario.phases.6=… adds one), was '6'"),
        ((PHASES, "+scenario.phases.7=1"), "scenario.phases.7: must be an index from 0 to 5"),
        ((PHASES, "scenario.phases.first=1"), "scenario.phases.first: must be an index from 0 to"),
        ((PHASES, "scenario.phases.0.contactz=[]"), "did you mean 'contacts'? (known here: cont"),
        ((PHASES, "scenario.phases.0.contacts=3"), "scenario.phases[0].contacts: must be a list"),
        ((PHASES, "scenario.phases.0.contacts.0=3"), "scenario.phases[0].contacts: must be a li"),
        ((PHASES, "scenario.phases.0.name.x=3"), "scenario.phases.0.name.x: must be left out"),
        ((PHASES, "~scenario.phases.0.x"), "scenario.phases.0.x: must be a setting that is th"),
        ((PHASES, "~scenario.phases.0.name=x"), "scenario.phases.0.name: must be "),
        ((PHASES, "+scenario.phases.0.name=x"), "scenario.phases.0.name: must be given without +"),
        ((ARMS, "scenario.obstacles=[]", "scenario.obstacles.0=1"), "the list is empty"),
        ((ARMS, "control.x=1"), "control: must be chosen: cma_es, multi_start, "),
        ((ARMS, "q_start=[]"), "q_start: unknown setting; did you mean 'scenario.q_start'?"),
        ((ARMS, "experiment.x=3"), "experiment.x: must be left out"),
    ],
)
def test_paths_that_lead_nowhere(words: tuple[str, ...], message: str) -> None:
    with pytest.raises(EvoexpError) as caught:
        expand(words)
    assert message in str(caught.value)
