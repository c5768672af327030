"""A motion file made to harm is refused in one line, or is judged."""

import functools
import json
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from confinement import confined, no_longer
from evoexp.commands.motion_files import flatten, read_motion
from evoexp.errors import EvoexpError
from evoexp.planners.proofs import judge_motion
from evoexp.records import generations
from matrix import counts, matrices_are_asked_for
from shipped_conditions import Kind, of_kind

KINDS: tuple[Kind, ...] = (
    ("rana_obstacles", 0),
    ("curkovic_motion", 1),
    ("lavoie_7dof", 0),
    ("corsepius_ball", 0),
    ("chen_path", 0),
    ("chen_placement", 0),
)
PER_KIND = counts(170, 1700) if matrices_are_asked_for() else 15  # × 6 kinds: 10^3
MEMORY = 1000  # [MiB] beyond what the process has
NUMBERS: tuple[Any, ...] = (
    *(float("nan"), float("inf"), 1e308, 1e7, -1e7, 1e-320, 0.0, -1.0, 10**400, 2**63, 1.5, 7),
    *(None, True, "0", [], [[]], {}, [1, 2], "\x1b[31m"),
)


@functools.cache
def intact(kind: Kind) -> Any:
    """Return a solution of a kind in its documented shape, as nested lists."""
    condition = of_kind(kind, "smoke")
    planner, problem = condition.prepare()
    best = next(iter(generations(planner.evolve(problem, condition.rng(0))))).best
    shape = planner.shape(problem)
    if shape[0] is ...:
        return best.reshape(-1, *shape[1]).tolist()
    sizes = np.cumsum([int(np.prod(part)) for part in shape])[:-1]
    parts = zip(np.split(best, sizes), shape, strict=True)
    return [part.reshape(own).tolist() for part, own in parts]


def mutated(values: Any, rng: random.Random) -> Any:
    """Return nested lists that are changed in one place."""
    values = json.loads(json.dumps(values))
    node, k = values, rng.randrange(len(values))
    while isinstance(node[k], list) and node[k] and rng.random() < 0.9:
        node = node[k]
        k = rng.randrange(len(node))
    match rng.randrange(6):
        case 0:
            del node[k]
        case 1:
            node.insert(k, node[k])
        case 2:
            node[k:] = [node[k]] * rng.choice((1, 30))
        case 3 if isinstance(node[k], float | int):
            node[k] *= rng.choice((-1, 10, 1000, 1e6))
        case _:
            node[k] = rng.choice(NUMBERS)
    return values


def spoiled(content: bytes, rng: random.Random) -> bytes:
    """Return a file of which some bytes are other ones, or missing."""
    k = rng.randrange(min(len(content), 200))
    other = bytes([rng.choice((0, 48, 57, 91, 93, 123, 255))])
    return rng.choice((content[:k], content[:k] + other + content[k + 1 :], content[k:]))


def refusal(kind: Kind, path: Path) -> str:
    """Return the refusal of a motion, an empty text if it is judged, or does not fit."""
    planner, problem = of_kind(kind, "smoke").prepare()
    try:
        with no_longer():
            solution = flatten(read_motion(path), planner.shape(problem))
            if solution is None:
                return "it does not fit"
            planner.departures(problem, solution)
            planner.evaluate(problem, solution)
            judge_motion(planner, problem, planner.motion(problem, solution))
            planner.listing(problem, solution)
    except EvoexpError as error:
        text = str(error)
        assert "\n" not in text and len(text) < 1500, text
        return text
    return ""


@pytest.mark.examples(3)
@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_a_mutated_motion_is_refused_in_one_line_or_judged(kind: Kind, tmp_path: Path) -> None:
    def tries() -> int:
        rng, refused = random.Random(str(kind)), 0
        for k in range(PER_KIND):
            values = mutated(values_0, rng)
            path = tmp_path / rng.choice(("motion.json", "motion.npy"))
            if path.suffix == ".npy":
                np.save(path, np.array(values_0, dtype=object).astype(np.float64))
            else:
                path.write_text(json.dumps(values))
            if path.suffix == ".npy" or rng.random() < 0.2:
                path.write_bytes(spoiled(path.read_bytes(), rng))
            try:
                refused += bool(refusal(kind, path))
            except BaseException as error:
                raise AssertionError(f"case {k}: {path.read_bytes()[:3000]!r}") from error
        return refused

    values_0 = intact(kind)
    path = tmp_path / "motion.json"
    path.write_text(json.dumps(values_0))
    assert refusal(kind, path) == ""
    assert confined(tries, tmp_path, MEMORY) > PER_KIND // 4


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("deep.json", b"[" * 10**6, "is no json of numbers"),
        ("long.json", b"[" + b"0," * 10**6 + b"0]", "at most 200,000 numbers"),
        ("lists.json", b"[" + b"[]," * 10**6 + b"0]", "at most 200,000 numbers"),
        ("large.json", b" " * 10**7, "larger than 8 MB"),
        ("digits.json", b"[" + b"9" * 10**5 + b"]", "is no json of numbers"),
        ("far.json", b"[[[1e8]]]", "of at most 1e+07"),
        (
            "claims.npy",
            b"\x93NUMPY\x01\x00\x50\x00{'descr': '<f8', 'fortran_order': False, "
            b"'shape': (10000000000,), }         \n" + b" " * 20,
            "is no npy of numbers",
        ),
    ],
)
def test_a_motion_that_takes_more_than_it_is_worth(
    name: str, content: bytes, reason: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    kind = ("rana_obstacles", 0)
    of_kind(kind, "smoke").prepare()
    assert reason in confined(lambda: refusal(kind, path), tmp_path, MEMORY)


def test_a_motion_without_postures_does_not_fit() -> None:
    assert flatten([], (..., (6,))) is None
    assert flatten([], ((2, 2),)) is None
