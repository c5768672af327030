"""Every condition of every shipped experiment, composed once: composing is what takes long."""

import functools
import os
import re

from evoexp.condition import Condition
from evoexp.configuration import expansions
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import options


@functools.cache
def shipped_conditions(budget: str) -> dict[tuple[str, str], Condition]:
    """Return (experiment, label) → condition.

    Test processes begin at both ends of the list: each finds on disk what another has composed.
    """
    names = options("experiment")
    from_behind = os.environ.get("PYTEST_XDIST_WORKER", "gw0")[-1] in "13579"
    found = {name: expanded(name, budget) for name in (reversed(names) if from_behind else names)}
    return {
        (name, label): condition for name in names for label, condition in found[name].conditions
    }


def expanded(name: str, budget: str) -> Experiment:
    """Return a shipped experiment at a budget.

    Kept on disk under the content of `conf` and the code.
    """
    return expansions.expand([f"experiment={name}", f"budget={budget}"])[0]


def different_conditions(budget: str) -> dict[str, Condition]:
    """Return "experiment: label" → condition, each condition once: experiments share some."""
    found = {
        condition.id: (f"{name}: {label}", condition)
        for (name, label), condition in _smallest_last(budget)
    }
    return dict(found.values())


def kinds_of_conditions(budget: str) -> dict[str, Condition]:
    """Return `different_conditions`, of those that differ in numbers only the last.

    Sweeps are long and alike.
    """
    found = {
        _kind(condition): (name, condition)
        for name, condition in different_conditions(budget).items()
    }
    return dict(found.values())


def _kind(condition: Condition) -> str:
    """Return the canonical form without its numbers; how many there are stays."""
    numbers = re.compile(r"-?\d+(\.\d+)?([eE][-+]?\d+)?")
    return numbers.sub("0", condition.to_json().decode())


def _smallest_last(budget: str) -> list[tuple[tuple[str, str], Condition]]:
    """Return all conditions, those of the experiments with the fewest last, in a fixed order."""
    rows = list(shipped_conditions(budget).items())
    sizes = {name: sum(other == name for (other, _), _ in rows) for (name, _), _ in rows}
    return sorted(rows, key=lambda row: -sizes[row[0][0]])
