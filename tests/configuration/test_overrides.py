"""Overrides reach into lists, and each is refused in one line that names a field, or taken."""

import random
import shlex
import string
from pathlib import Path
from typing import Any

import pytest
import yaml

from evoexp.configuration import compose
from evoexp.configuration.building import condition_of
from evoexp.configuration.compose import expand
from evoexp.configuration.experiment import Budget
from evoexp.configuration.overrides import assigned, collect
from evoexp.configuration.search_path import find, searched_first
from evoexp.errors import EvoexpError, SettingError, UnknownOption, UnknownSetting
from hostile_data import places
from matrix import counts, first

PHASES = "experiment=corsepius_pick_and_place"
ARMS = "experiment=rana_obstacles"


def config(*words: str) -> dict[str, Any]:
    """Return the canonical form of the scenario of the first condition."""
    return dict(expand(words)[0].conditions[0].condition.scenario.canonical())


def identity(*words: str) -> str:
    """Return the hash of the first condition."""
    return expand(words)[0].conditions[0].condition.id


def test_a_setting_inside_a_list_is_overridden() -> None:
    plain, changed = config(PHASES), config(PHASES, "scenario.phases.0.contacts=[[hand, ball]]")
    assert changed["phases"][0]["contacts"] == [["hand", "ball"]]
    assert plain["phases"][1:] == changed["phases"][1:]
    assert config(PHASES, "scenario.phases[0].contacts=[[hand, ball]]") == changed


def test_the_hash_is_that_of_the_resulting_configuration() -> None:
    def both(x: int) -> str:
        spheres = (f"{{shape: sphere, center: [{y}, {y}], radius: 1}}" for y in (1, x))
        return f"scenario.obstacles=[{', '.join(spheres)}]"

    moved = [both(0), "scenario.obstacles.1.center=[9,9]"]
    assert identity(ARMS, *moved) == identity(ARMS, *moved[::-1]) == identity(ARMS, both(9))
    assert identity(ARMS, both(9), "scenario.obstacles.1.center.0=8") != identity(ARMS, both(9))


def test_lists_grow_and_shrink() -> None:
    def obstacles(*words: str) -> list[Any]:
        return list(config(ARMS, *words)["obstacles"])

    plain, new = obstacles(), "{shape: sphere, center: [5, 5], radius: 1}"
    (*_, added) = longer = obstacles(f"+scenario.obstacles.{len(plain)}={new}")
    assert longer == [*plain, added]
    assert obstacles("~scenario.obstacles.0") == plain[1:]
    assert obstacles("~scenario.obstacles.0", "~scenario.obstacles.2") == [plain[1]]
    for prefix in ("", "++"):
        assert obstacles(f"{prefix}scenario.obstacles.0={new}") == [added, *plain[1:]]


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
    assert "contacts" not in config(PHASES)["phases"][0]
    assert identity(PHASES, word) == identity(PHASES, f"+{word}") == identity(PHASES, f"++{word}")


REFUSED: dict[str, str] = yaml.safe_load(
    Path(__file__).with_name("refused_overrides.yaml").read_text()
)


@pytest.mark.parametrize(("line", "message"), REFUSED.items())
def test_what_is_refused(line: str, message: str) -> None:
    words = shlex.split(line)
    only = [word.removeprefix("--only=") for word in words if word.startswith("--only=")]
    overrides = [word for word in words if not word.startswith("-")]
    with pytest.raises(EvoexpError) as caught:
        expand(overrides, multirun="-m" in words, only=only)
    assert message in str(caught.value) and "\n" not in str(caught.value)


EXPERIMENTS = (
    *("rana_obstacles", "corsepius_pick_and_place", "curkovic_motion", "lavoie_7dof"),
    *("chen_mission", "chen_placement", "rana_puma"),
)
BUDGET = Budget(name="smoke", max_replicates=2, max_generations=10)
TYPED = r"""
null;true;0;-1;1e400;nan;-inf;1e-320;0x1F;1_000;[];{};[[]];[null];[1,2,3];[a,b];{a: 1};{a};{a:}
{1: 2, null: 3};{_target_: arms};[1,,2];{_target_: os.system};{_target_: 3};{file: nowhere}
{file: 3};{sha256: abc};${ga};${seed};${nothing};${nothing.at.all};${oc.env:NO_SUCH};${;a${seed}b
${.};${planner};${..x};'quoted, text';";a'b;\;a,b;range(3);int(x);glob(*);choice();(;);λ;a=b;???
!!python/object:x;1.5;0.5;7;natural"""
LONG = ("9" * 400, "[" * 300, "{a:" * 60 + "1" + "}" * 60)
VALUES = (*TYPED.replace("\n", ";")[1:].split(";"), "", " ", "\t", "\udcff", *LONG)
PLAUSIBLE = ("3", "0.25", "90", "[1, 2]", "[[0, 1], [2, 3]]", "2e1", "true", "natural")
FOREIGN = ("composable", "Input should", "configuration:", "Error", "HydraExc", "Value err")
PREFIXES = ("", "", "", "", "+", "++", "~", "+++", "~+")


def mutated(path: str, rng: random.Random) -> str:
    """Return a path with a part misspelt, dropped, added, doubled or exchanged; often as it is."""
    parts = path.split(".")
    k = rng.randrange(len(parts))
    match rng.randrange(15):
        case 0:
            parts[k] += rng.choice(string.ascii_letters + "_0.-[]/@:$~")
        case 1:
            parts[k] = parts[k][:-1]
        case 2:
            del parts[k]
        case 3:
            parts.insert(k, rng.choice(("x", "0", "-1", "99", "_target_", "", "λ")))
        case 4:
            parts[k] = rng.choice(("0", "1", "7", "01", "1e3", "x"))
        case 5:
            parts.append(rng.choice(("x", "0", "_target_", "ga", "planner")))
    return ".".join(parts)


def check(refusal: EvoexpError, text: str) -> None:
    """Check that a refusal is one line that says what is wrong with an override."""
    message = str(refusal)
    assert "\n" not in message and len(message) < 1500, text
    assert not any(phrase in message for phrase in FOREIGN), (text, message)
    if isinstance(refusal, SettingError):
        assert refusal.field and refusal.must, (text, message)
    elif isinstance(refusal, UnknownSetting):
        assert refusal.field and refusal.known, (text, message)
    else:
        assert isinstance(refusal, UnknownOption) and refusal.known, (text, message)


@pytest.mark.examples(1)
@pytest.mark.parametrize("experiment", first(3, EXPERIMENTS))
def test_a_mutated_override_is_refused_in_one_line_or_taken(experiment: str) -> None:
    rng = random.Random(experiment)
    num_cases = counts(400, 4000)
    base = compose.Composer(find("experiment", experiment)).chosen({}).config
    every = [".".join(map(str, place)) for place in places(base)]
    paths = [path for path in every if not path.startswith(("report", "conditions"))]
    taken = 0
    for _ in range(num_cases):
        text = rng.choice(PREFIXES) + mutated(rng.choice(paths), rng)
        text += rng.choice((*("=",) * 6, "", "=="))
        if text.endswith("="):
            text += rng.choice(rng.choice((VALUES, PLAUSIBLE)))
        try:
            given = collect([compose.parse(text)])
            config = assigned(base, given)
            if not any(each.is_swept for each in given.values()):
                condition_of(config, BUDGET)
                taken += 1
        except EvoexpError as refusal:
            check(refusal, text)
    assert num_cases // 50 < taken < num_cases // 2
