"""The shipped references to postures, found once for all tests."""

import functools
from typing import Any

from composed import composed
from evoexp.references.reference import Truth

LABELS = {
    "torque_norm": "A torque norm",
    "minimax": "A minimax",
    "obstacle_link": "B link",
    "obstacle_platform": "B platform",
    "manipulability": "C manipulability",
}


def problem(case: str) -> Any:
    return composed("experiment=chen_placement", label=LABELS[case]).prepare()[1]


@functools.cache
def found(case: str, kind: str) -> tuple[Truth, Any, Any]:
    """Return the truth, reference and problem of an optimum, a conventional one or a landscape."""
    experiment = "chen_landscapes" if kind == "landscape" else "chen_placement"
    label = f"{LABELS[case]}, {kind}"
    planner, prepared = composed(f"experiment={experiment}", label=label).prepare()
    return planner.truth(prepared), planner, prepared
