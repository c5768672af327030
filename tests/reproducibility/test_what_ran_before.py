"""A result does not depend on what the same process ran before, nor on what it runs next."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from evoexp.condition import Condition
from matrix import counts
from shipped_conditions import KINDS, of_kind

SCRIPT = Path(__file__).parent / "shuffled_conditions.py"


def results(directory: Path, conditions: list[Condition], *seeds: int) -> list[dict[str, str]]:
    """Return condition → its log's hash, of each alone and of each order."""
    (directory / "files").mkdir()
    for condition in conditions:
        for name, content in condition.files().items():
            (directory / "files" / Path(name).name).write_bytes(content)
    lines = [condition.to_json() for condition in conditions]
    (directory / "conditions").write_bytes(b"\n".join(lines))
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(directory), *map(str, seeds)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def check(directory: Path, conditions: list[Condition], *seeds: int) -> None:
    """Compare every order with each condition alone in its process."""
    alone, *orders = results(directory, conditions, *seeds)
    assert len(alone) == len(conditions)
    assert len(set(alone.values())) == len(conditions), "results tell conditions apart"
    for seed, order in zip(seeds, orders, strict=True):
        assert list(order) != list(alone)
        assert order == alone, f"order {seed}"


SAMPLE = (  # circles, boxes of a machine's body, grids with a second stage, a reference
    ("rana_obstacles", 0),
    ("corsepius_ball", 0),
    ("chen_mission", 0),
    ("chen_placement", 3),
)


def test_a_sample(tmp_path: Path) -> None:
    check(tmp_path, [of_kind(example, "smoke") for example in SAMPLE], 1)


@pytest.mark.matrix
def test_all_kinds(tmp_path: Path) -> None:
    check(tmp_path, [of_kind(kind, "smoke") for kind in KINDS], *range(1, 1 + counts(1, 3)))
