"""The shortest proven answer known of each problem: a fixed length that targets are multiples of.

The best of the runs that are being compared would not do: it would change with every run added, and
with it all shares of targets reached. So the lengths stand in a file of their own,
`assets/best_known.yaml`, and change only where somebody writes lower ones into it
(`scripts/update-best-known`). A problem is known by a key of robot and scenario, see
`planner_runs.problem_key`:

    "0123456789ab": {problem: "box_panda", length: 3.77, run: "4da9210db51b", replicate: 3}
"""

import re
from pathlib import Path
from typing import Annotated

import yaml
from pydantic import Field

import evoexp
from evoexp.errors import SettingError
from evoexp.input_files import read_bounded
from evoexp.validation import NonNegativeCount, Positive, Settings, construct


class BestKnown(Settings):
    """The shortest proven answer known of a problem."""

    problem: str  # its name, for readers
    length: Positive  # of the joints' path [rad, m]
    run: Annotated[str, Field(pattern="^[0-9a-f]{12}$")]  # hash of the run that found it
    replicate: NonNegativeCount  # of that run


def shipped_best_known() -> dict[str, BestKnown]:
    """Return the shipped file's content by the keys of problems."""
    return read_best_known(Path(evoexp.__file__).parent / "assets/best_known.yaml")


def read_best_known(path: str | Path) -> dict[str, BestKnown]:
    """Return a file's content by the keys of problems.

    Raises:
        SettingError: If something in it cannot be.
        UnknownSetting: If an entry has another key.
        OSError: If it cannot be read.
    """
    return parsed(read_bounded(path), Path(path).name)


def parsed(content: bytes, name: str) -> dict[str, BestKnown]:
    """Return a file's content by the keys of problems."""
    try:
        entries = yaml.safe_load(content) or {}
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as error:
        raise SettingError(name, "YAML", str(error).splitlines()[0]) from None
    if not isinstance(entries, dict):
        raise SettingError(name, "a mapping of keys of problems", entries)
    for key, entry in entries.items():
        if not isinstance(key, str) or not re.fullmatch("[0-9a-f]{12}", key):
            raise SettingError(name, "keys of 12 hex digits in quotation marks", key)
        if not isinstance(entry, dict):
            must = f"a mapping of {', '.join(BestKnown.model_fields)}"
            raise SettingError(f"{name}, {key}", must, entry)
    return {key: construct(BestKnown, entry, f"{name}, {key}") for key, entry in entries.items()}
