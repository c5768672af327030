"""Whatever is typed is refused by one line that names a field, or gives a condition.

Overrides of every setting of several experiments are mutated at random, with a fixed seed.
"""

import random
import string
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from evoexp.configuration import compose
from evoexp.configuration.assignment import assigned
from evoexp.configuration.building import condition_of
from evoexp.configuration.experiment import Budget
from evoexp.configuration.overrides import collect
from evoexp.configuration.search_path import find
from evoexp.errors import EvoexpError, SettingError, UnknownOption, UnknownSetting
from matrix import counts, first

EXPERIMENTS = (
    "rana_obstacles",
    "corsepius_pick_and_place",
    "curkovic_motion",
    "lavoie_7dof",
    "chen_mission",
    "chen_placement",
    "rana_puma",
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
PREFIXES = ("", "", "", "", "+", "++", "~", "+++", "~+")


def places(value: Any, path: str) -> Iterator[str]:
    """Yield the dotted path of every value in plain data."""
    items = value.items() if isinstance(value, dict) else ()
    for key, item in enumerate(value) if isinstance(value, list) else items:
        inner = f"{path}.{key}" if path else str(key)
        yield inner
        yield from places(item, inner)


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
    for phrase in (
        "composable",
        "Input should",
        "configuration:",
        "Error",
        "HydraExc",
        "Value err",
    ):
        assert phrase not in message, (text, message)
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
    with TemporaryDirectory() as root:
        base = compose.Composer(Path(root), find("experiment", experiment)).chosen({}).config
    paths = [path for path in places(base, "") if not path.startswith(("report", "conditions"))]
    taken = 0
    for _ in range(num_cases):
        text = rng.choice(PREFIXES) + mutated(rng.choice(paths), rng)
        text += rng.choice(("=", "=", "=", "=", "=", "=", "", "=="))
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
