"""`plans.json`: how many replicates of a run were asked for, and how many were stored by then."""

import contextlib
import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from evoexp.store.identity import DamagedFile, read_object

if TYPE_CHECKING:
    from evoexp.store.run_directory import RunDirectory

PLANS = "plans.json"


class Plan(NamedTuple):
    """A number of replicates that was asked for.

    Attributes:
        num_replicates: All of them, those stored by then included.
        stored: Logs that were there already, whose results could be known.
    """

    num_replicates: int
    stored: int


def read_plans(path: Path) -> list[Plan]:
    """Return the plans that a file holds, the first one first; none where there is no file.

    Raises:
        DamagedFile: The file is damaged.
    """
    if not os.path.lexists(path):
        return []
    try:
        found = [(each["num_replicates"], each["stored"]) for each in read_object(path)["plans"]]
    except (KeyError, TypeError) as error:
        raise DamagedFile(f"{path}: damaged: no list of plans") from error
    if not all(type(number) is int and number >= 0 for plan in found for number in plan):
        raise DamagedFile(f"{path}: damaged: a plan is two whole numbers")
    return [Plan(*each) for each in found]


def num_planned(run: "RunDirectory", asked: int = 0) -> int:
    """Return how many replicates of a run were ever asked for; at least those that are there.

    Args:
        run: Whose.
        asked: How many are asked for now.
    """
    with contextlib.suppress(DamagedFile):
        asked = max([asked, *(plan.num_replicates for plan in run.plans())])
    return max([asked, *(1 + k for k in run.completed() | run.failed())])


def as_json(plans: Iterable[Plan]) -> bytes:
    """Return plans as the content of their file."""
    text = json.dumps({"plans": [plan._asdict() for plan in plans]}, indent=2)
    return text.encode() + b"\n"
