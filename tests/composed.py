"""Single conditions of shipped experiments: composing all 25 of an experiment takes seconds."""

import functools
import tempfile
from pathlib import Path

import yaml

from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import find


@functools.cache
def alone(*words: str, label: str | int = "") -> Experiment:
    """Return an experiment of which one condition is left, composed once in a process.

    Args:
        words: As on the command line, `experiment=NAME` the first of them, if any.
        label: Of the condition, or its number; the first if empty.
    """
    group, _, name = words[0].partition("=")
    if group != "experiment":
        return compose.expand(words)[0]
    settings = yaml.safe_load(Path(find("experiment", name).path).read_text())
    if labels := settings.get("conditions"):  # else the experiment is one condition
        chosen = list(labels)[label] if isinstance(label, int) else label or next(iter(labels))
        settings["conditions"] = {chosen: labels[chosen]}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.yaml"
        path.write_text(f"# @package _global_\n{yaml.safe_dump(settings, sort_keys=False)}")
        return compose.expand([f"experiment={path}", *words[1:]])[0]


def composed(*words: str, label: str | int = "") -> Condition:
    """Return one condition of an experiment; see `alone`."""
    return alone(*words, label=label).conditions[0].condition
