"""The shipped references to postures, composed once for all tests.

Composing takes longer than they do.
"""

import functools
from typing import Any

from evoexp.condition import Condition
from evoexp.references.reference import Truth
from shipped_conditions import expanded

LABELS = {
    "torque_norm": "A torque norm",
    "minimax": "A minimax",
    "obstacle_link": "B link",
    "obstacle_platform": "B platform",
    "manipulability": "C manipulability",
}


@functools.cache
def conditions(experiment: str) -> dict[str, Condition]:
    return dict(expanded(experiment, "paper").conditions)


def problem(case: str) -> Any:
    return conditions("chen_placement")[LABELS[case]].prepare()[1]


@functools.cache
def found(case: str, kind: str) -> tuple[Truth, Any, Any]:
    """Return the truth of a reference, the reference and its problem.

    Kind: optimum, conventional or landscape.
    """
    experiment = "chen_landscapes" if kind == "landscape" else "chen_placement"
    planner, prepared = conditions(experiment)[f"{LABELS[case]}, {kind}"].prepare()
    return planner.truth(prepared), planner, prepared
