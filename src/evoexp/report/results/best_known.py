"""The shortest proven answer known of each problem: a fixed length that targets are multiples of.

The best of the runs that are being compared would not do: it would change with every run added, and
with it all shares of targets reached. So the lengths stand in a file of their own,
`assets/best_known.yaml`, and change only where somebody writes lower ones into it
(`scripts/update-best-known`). A problem is known by a key of robot and scenario, see
`planner_runs.problem_key`:

    "0123456789ab": {problem: "box_panda", length: 3.77, run: "4da9210db51b", replicate: 3}

Run and replicate are those that found it.
"""

import math
import re
from pathlib import Path
from typing import NamedTuple

import yaml

import evoexp
from evoexp.errors import SettingError
from evoexp.input_files import read_bounded

_HASH = re.compile("[0-9a-f]{12}")


class BestKnown(NamedTuple):
    """The shortest proven answer known of a problem."""

    problem: str  # its name, for readers
    length: float  # of the joints' path [rad, m]
    run: str  # hash of the run that found it, 12 hex digits
    replicate: int  # of that run


def shipped_best_known() -> dict[str, BestKnown]:
    """Return the shipped file's content by the keys of problems."""
    return read_best_known(Path(evoexp.__file__).parent / "assets/best_known.yaml")


def read_best_known(path: str | Path) -> dict[str, BestKnown]:
    """Return a file's content by the keys of problems.

    Raises:
        SettingError: If something in it cannot be.
        OSError: If it cannot be read.
    """
    return parsed(read_bounded(path), Path(path).name)


def parsed(content: bytes, name: str) -> dict[str, BestKnown]:
    """Return a file's content by the keys of problems."""
    try:
        found = yaml.safe_load(content) or {}
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as error:
        raise SettingError(name, "YAML", str(error).splitlines()[0]) from None
    if not isinstance(found, dict):
        raise SettingError(name, "a mapping of keys of problems", found)
    known = {}
    for key, entry in found.items():
        if not isinstance(key, str) or not _HASH.fullmatch(key):
            raise SettingError(name, "keys of 12 hex digits in quotation marks", key)
        where = f"{name}, {key}"
        if not isinstance(entry, dict) or set(entry) != set(BestKnown._fields):
            raise SettingError(where, f"a mapping of {', '.join(BestKnown._fields)}", entry)
        length, run, replicate = entry["length"], entry["run"], entry["replicate"]
        if type(length) not in (int, float) or not 0.0 < length < math.inf:
            raise SettingError(f"{where}, length", "a number above 0", length)
        if not isinstance(run, str) or not _HASH.fullmatch(run):
            raise SettingError(f"{where}, run", "12 hex digits in quotation marks", run)
        if type(replicate) is not int or replicate < 0:
            raise SettingError(f"{where}, replicate", "a whole number, at least 0", replicate)
        known[key] = BestKnown(str(entry["problem"]), float(length), run, replicate)
    return known
