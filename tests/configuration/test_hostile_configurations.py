"""A configuration made to harm is refused in one line, or can be prepared in little memory.

The canonical forms of shipped conditions, as they come out of somebody's log, are changed at
random, with a fixed seed: whatever evoexp is asked to run goes through the same door.
"""

import json
import random
from pathlib import Path
from typing import Any

import pytest

from confinement import confined
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.configuration.search_path import searched_first
from evoexp.errors import EvoexpError
from hostile_data import at, mutated, refusal
from matrix import counts, matrices_are_asked_for
from shipped_conditions import EXAMPLES, KINDS, Kind, of_kind

KNOWN: tuple[Kind, ...] = (*EXAMPLES, *(KINDS if matrices_are_asked_for() else ()))
PER_KIND = counts(90, 900) if matrices_are_asked_for() else 12  # × 112 kinds: 10^4
MEMORY = 1500  # [MiB] beyond what the process has
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 2, 1.5, -0.5, 1e-320, 1e-9, 1e9, 1e308, -1e308),
    *(500, 10**4, 10**5, 10**6, 10**9, 2**31, 2**62, 2**63, 2**64, 10**30, 10**400),
    *(float("inf"), float("-inf"), float("nan")),
    *("", "x", "arms", "null", "../x", "/etc/passwd", "\x1b[31m", "λ", "a" * 10_000),
    "${oc.env:HOME}",
    *([], [[]], [None], [1], [1, 2, 3], [0.0] * 7, [1e308] * 3, ["a"], [[1, 2], [3]], [0] * 5000),
    *({}, {"a": 1}, {"_target_": "os.system"}, {"_target_": 3}, {"_target_": "arms"}),
    *({"_target_": "genetic", "revision": 1}, {"sha256": "0" * 64}, {"file": "/etc/passwd"}),
)


def prepare(config: Any) -> None:
    Condition.from_json(json.dumps(config).encode()).prepare()


def refusals(kind: Kind) -> list[str]:
    """Return the refusals of mutated configurations of a kind."""
    rng, base = random.Random(str(kind)), json.loads(of_kind(kind, "smoke").to_json())
    found = []
    for k in range(PER_KIND):
        config = mutated(base, rng, VALUES)
        try:
            found.append(refusal(lambda config=config: prepare(config)))
        except BaseException as error:
            raise AssertionError(f"case {k}: {json.dumps(config)[:3000]}") from error
    return found


GEOMETRY = "between -1e+07 and 1e+07"
FOUND: tuple[tuple[Kind, str, Any, str], ...] = (  # tracebacks, hangs and crashes of before
    (("corsepius_ball", 0), "robot.bodies.5.size.0", 10**9, GEOMETRY),  # coal: a segmentation fault
    (("corsepius_ball", 0), "robot.bodies.1.start.0", 2**31, GEOMETRY),  # 214 GB of spheres
    (("corsepius_ball", 0), "robot.bodies.1.start.0", 10**6, "coverable by 10000 spheres"),
    (("corsepius_ball", 0), "robot.bodies.5.size.2", 1e308, GEOMETRY),
    (("corsepius_ball", 0), "planner.collision.inflation", 1e-90, "coverable by 10000 spheres"),
    (("corsepius_ball", 0), "planner.scope", None, "planner.scope: must be a list"),
    (("corsepius_ball", 0), "planner.scope", [float("inf")], "planner.scope[0]: must be a finite"),
    (("corsepius_pick_and_place", 0), "scenario.obstacles.2.end.2", 2.0**31, GEOMETRY),
    (("rana_obstacles", 0), "planner.collision.spheres_per_link", 5000, "at most 1000"),
    (("rana_obstacles", 0), "planner.num_via_points", 10**6, "at most 10000"),
    (("rana_obstacles", 0), "planner.ga.population_size", 10**12, "at most 1000000000"),
    (("rana_obstacles", 0), "planner.ga.population_size", 10**30, "between -1e+18 and 1e+18"),
    (("rana_obstacles", 0), "planner.ga.revision", "x" * 500, "was revision xxxxxxxxxxxxxxxxxxxx,"),
    (("rana_obstacles", 0), "seed", 2**200, "seed: must be less than 2^128"),
    (("chen_path", 4), "scenario.size", [32, 10**6], "of at most 20,000,000 nodes"),
    (("chen_path", 4), "scenario.size", [10**6] * 3, "at most 20,000,000"),
)


@pytest.mark.parametrize(
    ("kind", "path", "value", "reason"), FOUND, ids=lambda value: str(value)[:40]
)
def test_what_once_harmed_is_refused(
    kind: Kind, path: str, value: Any, reason: str, tmp_path: Path
) -> None:
    config = json.loads(of_kind(kind, "smoke").to_json())
    *parents, last = (int(part) if part.isdecimal() else part for part in path.split("."))
    at(config, parents)[last] = value
    assert reason in confined(lambda: refusal(lambda: prepare(config)), tmp_path, MEMORY)


@pytest.mark.examples(4)
@pytest.mark.parametrize("kind", KNOWN, ids=str)
def test_a_mutated_configuration_is_refused_in_one_line_or_prepared(
    kind: Kind, tmp_path: Path
) -> None:
    of_kind(kind, "smoke").prepare()  # what is loaded late is loaded here
    found = confined(lambda: refusals(kind), tmp_path, MEMORY)
    assert sum(map(bool, found)) > len(found) // 3


# Option files: they unfold to little, read no environment and run no code

BASE = "experiment=rana_obstacles"
NAMES = "abcdefghi"
LAUGHS = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"{new}: &{new} [{', '.join([f'*{old}'] * 10)}]\n"
    for old, new in zip(NAMES, NAMES[1:], strict=False)
)
GA = "_target_: genetic\npopulation_size: 8\nnum_generations: 2\nnum_elites: 1\n"
GA += "crossover_rate: 0.5\nmutation_rate: 0.5\n"
MANY = "at most 100,000 values"
HOSTILE = {
    "aliases that unfold": (LAUGHS, f"{MANY}, aliases unfolded"),
    "aliases as keys": (LAUGHS.replace("i: &i", "<<: &i"), MANY),
    "a large file": ("x: " + "y" * 2_000_000, "larger than 1 mb"),
    "an alias of itself": ("a: &a [*a]\n", MANY),
    "nested deeply": ("a: " + "[" * 20_000 + "]" * 20_000, "50 deep"),
    "code": ("x: !!python/object/apply:os.system ['touch harm']\n", "not determine a constructor"),
    "code by name": ("_target_: os.system\ncommand: touch harm\n", "a registered component"),
    "the environment": (f"{GA}x: ${{oc.env:SECRET}}\n", "functions such as oc.env are not allowed"),
    "the environment in words": (f"{GA}x: a${{oc.env:SECRET}}b\n", "functions such as oc.env"),
    "a function of it": (f"{GA}x: ${{oc.decode:${{oc.env:SECRET}}}}\n", "functions such as oc.env"),
    "a device": ("/dev/zero", "no option 'mine'"),
}


def expand_mine(folder: Path) -> None:
    with searched_first([str(folder)]):
        compose.expand([BASE, "budget=smoke", "ga=mine"])


@pytest.mark.parametrize("name", HOSTILE)
def test_an_option_that_harms_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SECRET", "hush")
    text, reason = HOSTILE[name]
    file = tmp_path / "ga" / "mine.yaml"
    file.parent.mkdir()
    file.symlink_to(text) if text == "/dev/zero" else file.write_text(text)
    found = confined(lambda: refusal(lambda: expand_mine(tmp_path)), tmp_path, 500)
    assert reason in found and "hush" not in found
    assert not (tmp_path / "harm").exists()


def test_nothing_of_the_environment_enters_by_an_override(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SECRET", "hush")
    with pytest.raises(EvoexpError, match="functions such as oc.env are not allowed") as caught:
        compose.expand([BASE, "budget=smoke", "scenario.length_unit=${oc.env:SECRET}"])
    assert "hush" not in str(caught.value)
