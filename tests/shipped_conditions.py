"""Every condition of every shipped experiment, composed once, and when a test asks for it."""

import functools
import os
import re
from collections import Counter

import pytest

from composed import composed
from evoexp.condition import Condition
from evoexp.configuration import compose
from evoexp.configuration.experiment import Experiment
from evoexp.configuration.search_path import options
from matrix import examples

KINDS = range(264)  # numbers of all kinds of conditions; `test_shipped` checks how many there are
EXAMPLES = (  # (experiment, number of its condition): every planner, and its rarer parts
    ("rana_obstacles", 0),
    ("rana_planar", 1),  # random search
    ("rana_planar", 2),  # multi-start
    ("curkovic_motion", 1),  # cubic splines
    ("lavoie_7dof", 0),
    ("lavoie_coding", 1),  # binary
    ("corsepius_ball", 0),
    ("corsepius_pick_and_place", 0),
    ("rrt_connect", 0),
    ("chen_mission", 0),  # two stages: both planners of Chen & Zalzala
    ("chen_path", 4),  # elitism
    ("chen_placement", 3),  # a reference
)
Kind = int | tuple[str, int]
KIND_EXAMPLES = [  # as parameters: the examples always, all kinds with --all
    *(pytest.param(example, id=f"{example[0]} {example[1]}") for example in EXAMPLES),
    *examples(KINDS, lambda kind: False),
]


def of_kind(kind: Kind, budget: str) -> Condition:
    """Return the condition of an example, or that of a kind's number."""
    if isinstance(kind, tuple):
        return composed(f"experiment={kind[0]}", f"budget={budget}", label=kind[1])
    return kinds_of_conditions(budget)[kind]


@functools.cache
def shipped_conditions(budget: str) -> dict[tuple[str, str], Condition]:
    """Return (experiment, label) → condition."""
    names = options("experiment")
    # test processes begin at both ends: each finds on disk what another has composed
    from_behind = os.environ.get("PYTEST_XDIST_WORKER", "gw0")[-1] in "13579"
    found = {name: expanded(name, budget) for name in (reversed(names) if from_behind else names)}
    return {(name, label): c for name in names for label, c in found[name].conditions}


@functools.cache
def expanded(name: str, budget: str) -> Experiment:
    """Return a shipped experiment at a budget; it is kept on disk."""
    return compose.expand([f"experiment={name}", f"budget={budget}"])[0]


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
    """Return `different_conditions`, of those that differ in numbers and files only the last."""
    numbers = re.compile(r'"[0-9a-f]{64}"|-?\d+(\.\d+)?([eE][-+]?\d+)?')
    every = different_conditions(budget).values()
    return list({numbers.sub("0", c.to_json().decode()): c for c in every}.values())
