"""Files of a store damaged at random: no command fails but in a line, and `run` mends all of it."""

import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from command_samples import SERIAL, Evoexp

from evoexp.store.log_reader import read_log
from evoexp.store.run_directory import RunDirectory, find_runs
from matrix import first

PLANAR = ("experiment=rana_planar", *SERIAL)
SEEDS = first(2, range(60))

Fault = Callable[[Path, random.Random], object]


def flip(path: Path, draw: random.Random) -> None:
    content = bytearray(path.read_bytes())
    for _ in range(draw.choice((1, 1, 30))):
        content[draw.randrange(len(content))] ^= 1 << draw.randrange(8)
    path.write_bytes(bytes(content))


def cut(path: Path, draw: random.Random) -> None:
    path.write_bytes(path.read_bytes()[: draw.randrange(path.stat().st_size)])


def zero(path: Path, draw: random.Random) -> None:
    content = path.read_bytes()
    start = draw.randrange(len(content))
    path.write_bytes(content[:start] + bytes(len(content) - start))


def replace(path: Path, make: Callable[[Path], object]) -> None:
    path.unlink()
    make(path)


FAULTS: list[Fault] = [
    flip,
    flip,
    cut,
    zero,
    lambda path, draw: path.unlink(),
    lambda path, draw: path.write_bytes(path.read_bytes() + draw.randbytes(9)),
    lambda path, draw: path.write_bytes(draw.randbytes(200)),
    lambda path, draw: path.write_bytes(draw.choice(everything(path)).read_bytes()),
    lambda path, draw: replace(path, Path.mkdir),
    lambda path, draw: replace(path, os.mkfifo),
    lambda path, draw: replace(path, lambda name: os.symlink(name.name, name)),
]


def everything(path: Path) -> list[Path]:
    """Return the files of all runs, but for locks."""
    root = next(parent for parent in path.parents if parent.name == "runs")
    return sorted(each for each in root.rglob("[!.]*") if each.is_file())


def digests(run: RunDirectory) -> list[str]:
    return [read_log(run.log_path(k)).summary.digest for k in sorted(run.completed())]


@pytest.mark.parametrize("seed", SEEDS)
def test_random_damage(evoexp: Evoexp, stored: Path, seed: int) -> None:
    draw = random.Random(seed)
    runs = find_runs(stored)
    expected = {run.hash12: digests(run) for run in runs}
    for _ in range(draw.choice((1, 2, 6))):
        path = draw.choice(everything(runs[0].summary_path))
        draw.choice(FAULTS)(path, draw)
    name = draw.choice(runs).hash12
    for words in (
        ("list",),
        ("verify",),
        ("show", name),
        ("view", name),
        ("reproduce", name),
        ("report", name),
    ):
        said = evoexp(*words)
        assert said.code in (0, 1, 2)
        assert all(line.startswith("evoexp: ") for line in said.err.splitlines()), said.err
    said = evoexp("run", *PLANAR, "--no-report")
    assert said.code == 0, said.err
    said = evoexp("verify")
    assert said.code == 0, said.out
    assert {run.hash12: digests(run) for run in runs} == expected
    shutil.rmtree(stored)
