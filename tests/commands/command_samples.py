"""Small runs, and commands run in this process."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from evoexp.cli import main
from evoexp.store.run_directory import RunDirectory

SMALL = (
    *("budget=smoke", "ga.population_size=8", "ga.num_generations=2"),
    "planner.num_new_trajectories=1",
)
SERIAL = (*SMALL, "runner=serial")


class Said(NamedTuple):
    """What a command did."""

    code: int
    out: str
    err: str

    @property
    def text(self) -> str:
        """Its output without the lines of tables, in one line."""
        return " ".join(self.out.replace("│", " ").split())


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


def with_manifest(run: RunDirectory, **entries: object) -> None:
    """Give a stored run other entries of its manifest."""
    path = run.path / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | entries))
