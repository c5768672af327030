"""The files shipped beside the code: the options in `conf`, and a table of hashes and digests.

The table has the hash of every shipped condition and the digest of its first replicate. It finds a
shipped condition by its hash on a machine that never ran it, gives `reproduce` something to compare
with, and makes a test fail when results change without a raised revision.
"""

import functools
import itertools
import shlex
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import orjson

ORIGIN = "evoexp"  # of shipped options


class Option(NamedTuple):
    """A file that a configuration chooses: one option of a group."""

    group: str  # such as `ga`
    name: str  # of the option in its group
    # The folder that it was found in, as typed; the package that brings it, as `my-planner 0.3`; or
    # `evoexp`. Of an experiment that is a file: its path, as typed.
    origin: str
    path: str  # of the file, absolute

    @property
    def source(self) -> str:
        """Where the option stands, as tables name it: `conf/ga/rana_planar.yaml`."""
        inner = f"{self.group}/{self.name}.yaml"
        if self.origin == ORIGIN:
            return f"conf/{inner}"
        return self.origin if self.origin.endswith((".yaml", ".yml")) else f"{self.origin}: {inner}"


def config_directory() -> Path:
    """Return the shipped `conf`: in the wheel inside the package, in a checkout beside `src`."""
    inside = Path(__file__).parent / "conf"
    return inside if inside.is_dir() else Path(__file__).parents[2] / "conf"


def described(path: Path) -> str:
    """Return the line of an experiment file that says what the experiment is; empty: none does.

    It is the first comment that neither names Hydra's package nor the command that runs the file.
    """
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    comments = itertools.takewhile(lambda line: line.startswith("#"), text.splitlines())
    lines = (line.removeprefix("#").strip() for line in comments)
    return next((line for line in lines if not line.startswith(("@package", "evoexp run"))), "")


class Shipped(NamedTuple):
    """One shipped condition at one budget."""

    experiment: str  # name of the experiment file
    label: str  # of the condition
    budget: str  # `paper` or `smoke`
    condition_id: str  # 64 hex digits
    digest: str  # of replicate 0; of a reference its cost, `cost 1.7…`, which is compared to 1e-9

    @property
    def command(self) -> str:
        """The command that runs it."""
        budget = "" if self.budget == "paper" else f" budget={self.budget}"
        return f"evoexp run experiment={self.experiment}{budget} --only {shlex.quote(self.label)}"


@functools.cache
def shipped() -> tuple[Shipped, ...]:
    """Return the table."""
    content = (Path(__file__).parent / "assets/shipped.json").read_bytes()
    return tuple(Shipped(**row) for row in orjson.loads(content))


def rows_of(condition_id: str) -> list[Shipped]:
    """Return the rows of the table that a condition has."""
    return [row for row in shipped() if row.condition_id == condition_id]


def find(prefix: str) -> list[Shipped]:
    """Return the shipped conditions whose hash begins with a prefix, each in one experiment."""
    sizes = Counter((row.experiment, row.budget) for row in shipped())
    rows = sorted(shipped(), key=lambda row: -sizes[row.experiment, row.budget])  # smallest last
    named = [row for row in rows if row.condition_id.startswith(prefix.lower())]
    return list({row.condition_id: row for row in named}.values())
