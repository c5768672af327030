"""Small runs, and commands run in this process."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from evoexp.cli import main

SMALL = (
    "budget=smoke",
    "ga.population_size=8",
    "ga.num_generations=2",
    "planner.num_new_trajectories=1",
)
SERIAL = (*SMALL, "runner=serial")


class Said(NamedTuple):
    """What a command did."""

    code: int
    out: str
    err: str


Evoexp = Callable[..., Said]


def exit_code(*words: str) -> int:
    """Run a command; return its exit code."""
    try:
        return main(words)
    except SystemExit as left:
        return int(left.code or 0)


def content(directory: Path) -> dict[Path, bytes]:
    """Return every file under a directory but the locks, which are empty."""
    return {p: p.read_bytes() for p in directory.rglob("*") if p.is_file() and p.name != ".lock"}
