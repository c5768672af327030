"""Every condition of every shipped experiment, composed once: composing is what takes long.

Nothing is composed while tests are collected: they are parametrised over rows of the shipped table,
or over `KINDS`, and ask for conditions when they run.
"""

import functools
import os
import re
from collections import Counter

from evoexp.condition import Condition
from evoexp.configuration import expansions
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import options

KINDS = range(66)  # numbers of all kinds of conditions; `test_shipped` checks how many there are


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


@functools.cache
def expanded(name: str, budget: str) -> Experiment:
    """Return a shipped experiment at a budget; it is kept on disk."""
    return expansions.expand([f"experiment={name}", f"budget={budget}"])[0]


@functools.cache
def different_conditions(budget: str) -> dict[str, Condition]:
    """Return "experiment: label" → condition, each condition once, in its smallest experiment."""
    rows = shipped_conditions(budget)
    sizes = Counter(name for name, _ in rows)
    largest_first = sorted(rows.items(), key=lambda row: -sizes[row[0][0]])
    found = {c.id: (f"{name}: {label}", c) for (name, label), c in largest_first}
    return dict(found.values())


@functools.cache
def kinds_of_conditions(budget: str) -> list[Condition]:
    """Return `different_conditions`, of those that differ in numbers only the last.

    Sweeps are long and alike.
    """
    numbers = re.compile(r"-?\d+(\.\d+)?([eE][-+]?\d+)?")
    found = {
        numbers.sub("0", c.to_json().decode()): c for c in different_conditions(budget).values()
    }
    return list(found.values())
