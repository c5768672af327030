"""A configuration made to harm is refused in one line, or can be prepared in little memory.

The canonical forms of shipped conditions, as they come out of somebody's log, are changed at
random, with a fixed seed: whatever evoexp is asked to run goes through the same door.
"""

import copy
import json
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from confinement import confined, no_longer
from evoexp.condition import Condition
from evoexp.errors import EvoexpError
from matrix import counts, matrices_are_asked_for
from shipped_conditions import EXAMPLES, KINDS, Kind, of_kind

KNOWN: tuple[Kind, ...] = (*EXAMPLES, *(KINDS if matrices_are_asked_for() else ()))
PER_KIND = counts(90, 900) if matrices_are_asked_for() else 12  # × 112 kinds: 10^4
MEMORY = 1500  # [MiB] beyond what the process has
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 2, 1.5, -0.5, 1e-320, 1e-9, 1e9, 1e308, -1e308),
    *(500, 10**4, 10**5, 10**6, 10**9, 2**31, 2**62, 2**63, 2**64, 10**30, 10**400),
    *(float("inf"), float("-inf"), float("nan")),
    *(
        "",
        "x",
        "arms",
        "null",
        "../x",
        "/etc/passwd",
        "\x1b[31m",
        "λ",
        "a" * 10_000,
        "${oc.env:HOME}",
    ),
    *([], [[]], [None], [1], [1, 2, 3], [0.0] * 7, [1e308] * 3, ["a"], [[1, 2], [3]], [0] * 5000),
    *({}, {"a": 1}, {"_target_": "os.system"}, {"_target_": 3}, {"_target_": "arms"}),
    *({"_target_": "genetic", "revision": 1}, {"sha256": "0" * 64}, {"file": "/etc/passwd"}),
)


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the path of every value in plain data."""
    items: Any = ()
    if isinstance(value, dict):
        items = value.items()
    elif isinstance(value, list):
        items = enumerate(value)
    for key, item in items:
        yield (*path, key)
        yield from places(item, (*path, key))


def at(value: Any, path: tuple[Any, ...]) -> Any:
    """Return the value at a path."""
    for key in path:
        value = value[key]
    return value


def mutated(config: Any, rng: random.Random) -> Any:
    """Return a configuration that is changed in one to three places."""
    config = copy.deepcopy(config)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        known = list(places(config))
        if not known:
            return config
        path = rng.choice(known)
        node, last = at(config, path[:-1]), path[-1]
        match rng.randrange(10):
            case 0:
                del node[last]
            case 1 if isinstance(node, dict):
                node[rng.choice(("x", "", "_target_", "λ", f"{last}_"))] = rng.choice(VALUES)
            case 2 if isinstance(node, list):
                node.extend(copy.deepcopy(node) * rng.choice((1, 3, 50)))
            case 3:
                node[last] = copy.deepcopy(at(config, rng.choice(known[: known.index(path) + 1])))
            case 4 if type(node[last]) in (int, float) and abs(node[last]) < 1e300:
                node[last] *= rng.choice((-1, 0, 2, 10, 1000, 10**6, 0.5, 1e-3, 1e-12))
            case _:
                node[last] = copy.deepcopy(rng.choice(VALUES))
    return config


def refusal(config: Any) -> str:
    """Return the refusal of a configuration, an empty text if it can be prepared."""
    try:
        with no_longer():
            Condition.from_json(json.dumps(config).encode()).prepare()
    except EvoexpError as error:
        text = str(error)
        assert "\n" not in text and len(text) < 1500, text
        return text
    return ""


def tries(kind: Kind) -> list[str]:
    """Return the refusals of mutated configurations of a kind."""
    rng, base = random.Random(str(kind)), json.loads(of_kind(kind, "smoke").to_json())
    found = []
    for k in range(PER_KIND):
        config = mutated(base, rng)
        try:
            found.append(refusal(config))
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
    at(config, tuple(parents))[last] = value
    assert reason in confined(lambda: refusal(config), tmp_path, MEMORY)


@pytest.mark.examples(4)
@pytest.mark.parametrize("kind", KNOWN, ids=str)
def test_a_mutated_configuration_is_refused_in_one_line_or_prepared(
    kind: Kind, tmp_path: Path
) -> None:
    of_kind(kind, "smoke").prepare()  # what is loaded late is loaded here
    refusals = confined(lambda: tries(kind), tmp_path, MEMORY)
    assert sum(map(bool, refusals)) > len(refusals) // 3
