"""What is shipped beside the code: `conf`, and a table of hashes and digests.

The table has the hash of every shipped condition and the digest of its first replicate. It finds a
shipped condition by its hash on a machine that never ran it, gives `reproduce` something to compare
with, and makes a test fail when results change without a raised revision.
"""

import functools
import json
import shlex
from collections import Counter
from importlib import resources
from pathlib import Path
from typing import NamedTuple


def config_directory() -> Path:
    """Return the shipped `conf`: in the wheel inside the package, in a checkout beside `src`."""
    inside = Path(__file__).parent / "conf"
    return inside if inside.is_dir() else Path(__file__).parents[2] / "conf"


def file_directory() -> Path:
    """Return where files lie that shipped configurations refer to: beside the scenarios."""
    return config_directory() / "scenario"


class Shipped(NamedTuple):
    """One shipped condition at one budget.

    Attributes:
        experiment: Name of the experiment file.
        label: Of the condition.
        budget: `paper` or `smoke`.
        condition_id: 64 hex digits.
        digest: Of replicate 0; of a reference its cost, `cost 1.7…`, which is compared to 1e-9.
    """

    experiment: str
    label: str
    budget: str
    condition_id: str
    digest: str

    @property
    def command(self) -> str:
        """The command that runs it."""
        budget = "" if self.budget == "paper" else f" budget={self.budget}"
        return f"evoexp run experiment={self.experiment}{budget} --only {shlex.quote(self.label)}"


@functools.cache
def shipped() -> tuple[Shipped, ...]:
    """Return the table."""
    text = resources.files("evoexp").joinpath("assets/shipped.json").read_text(encoding="utf-8")
    return tuple(Shipped(**row) for row in json.loads(text))


def find(prefix: str) -> list[Shipped]:
    """Return the shipped conditions whose hash begins with a prefix, each hash once.

    In its smallest experiment.
    """
    sizes = Counter((row.experiment, row.budget) for row in shipped())
    rows = sorted(shipped(), key=lambda row: -sizes[row.experiment, row.budget])
    return list(
        {
            row.condition_id: row for row in rows if row.condition_id.startswith(prefix.lower())
        }.values()
    )
