"""Single conditions of shipped experiments, and scripts of the checkout, as tests load them."""

import functools
import tempfile
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from typing import Any

import yaml

from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import find


@functools.cache
def alone(*words: str, label: str | int = "") -> Experiment:
    """Return an experiment of which one condition is left, by its label or number; else the first.

    Words are as on the command line, `experiment=NAME` the first of them, if any.
    """
    group, _, name = words[0].partition("=")
    if group != "experiment":
        return compose.expand(words)[0]
    settings = yaml.safe_load(Path(find("experiment", name).path).read_text())
    if entries := settings.get("conditions"):  # else the experiment is one condition
        labels = dict(pair for own in entries.items() for pair in compose.readings(*own))
        chosen = list(labels)[label] if isinstance(label, int) else label or next(iter(labels))
        settings["conditions"] = {chosen: labels[chosen]}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.yaml"
        path.write_text(f"# @package _global_\n{yaml.safe_dump(settings, sort_keys=False)}")
        return compose.expand([f"experiment={path}", *words[1:]])[0]


def composed(*words: str, label: str | int = "") -> Condition:
    """Return one condition of an experiment; see `alone`."""
    return alone(*words, label=label).conditions[0].condition


def script(name: str) -> Any:
    """Return a script of the checkout as a module."""
    loader = SourceFileLoader(name, str(Path(__file__).parents[1] / "scripts" / name))
    spec = spec_from_loader(name, loader)
    assert spec is not None
    module = module_from_spec(spec)
    loader.exec_module(module)
    return module
