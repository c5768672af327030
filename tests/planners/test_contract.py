"""Every kind of shipped condition keeps the obligations of a planner; departures are named."""

import numpy as np
import pyarrow as pa
import pytest

from evoexp.planners import answers
from evoexp.records import flatten
from evoexp.store.log_reader import read_summary
from evoexp.testing import CHECKS, Check
from evoexp.testing.contract import evolution, finished
from shipped_conditions import KIND_EXAMPLES, Kind, of_kind


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("kind", KIND_EXAMPLES)  # each runs once for all checks
def test_a_planner_keeps_its_obligations(check: Check, kind: Kind) -> None:
    check(of_kind(kind, "smoke"))


@pytest.mark.parametrize("kind", KIND_EXAMPLES)
def test_the_summary_is_the_row_that_its_log_gives(kind: Kind) -> None:
    content, summary = finished(of_kind(kind, "smoke"), 0)
    given, read = (
        pa.Table.from_pylist([flatten(each)]) for each in (summary, read_summary(content))
    )
    assert set(given.schema) == set(read.schema)
    assert repr(sorted(given.to_pylist()[0].items())) == repr(
        sorted(read.to_pylist()[0].items())
    )  # NaN equals NaN


DISTURBED = [  # (experiment and its condition, place in the flat solution, by how much, phrase)
    (("rana_planar", 1), 0, 10.0, "the start of arm 1 is not the task's: 10 deg away"),
    (("rana_planar", 1), -1, -3.0, "the goal of arm 2 is not the task's: 3 deg away"),
    (("curkovic_motion", 1), 0, 5.0, "the start of robot 1 is not the task's: 5 deg away"),
    (("curkovic_motion", 1), -1, 7.0, "the goal of robot 2 is not the task's: 7 deg away"),
    (("curkovic_motion", 1), 2, 500.0, "link 1 of robot 1 leaves its limits by"),
    (("lavoie_7dof", 0), 0, 0.25, "the start is not the task's: 0.25 rad away"),
    (("lavoie_7dof", 0), 7, 9.0, "joint 1 leaves its limits by"),
    (("corsepius_ball", 0), 1, 0.125, "the start is not the task's: 0.125 rad away"),
    (("corsepius_ball", 0), -1, 99.0, "joint 6 leaves its limits by"),
    (("chen_path", 4), 0, 1.0, "missed ends: 1"),
    (("chen_placement", 3), 0, 1000.0, "θ1 leaves its limits by"),
    (("chen_mission", 0), 0, 1000.0, "θ1 leaves its limits by"),
]


@pytest.mark.parametrize(("example", "place", "change", "phrase"), DISTURBED)
def test_a_disturbed_solution_departs(
    example: tuple[str, int], place: int, change: float, phrase: str
) -> None:
    found = evolution(of_kind(example, "smoke"))
    best = np.array(found.last.best)
    before = found.planner.departures(found.problem, best)
    best[place] += change
    new = set(found.planner.departures(found.problem, best)) - set(before)
    assert any(one.startswith(phrase) for one in new), new


def test_rounded_numbers_are_no_departure() -> None:
    one, two = np.array([1.0, 2.0]), np.array([1.0, 2.0 + 1e-7])
    assert answers.of_place("the start", one, two, "deg") == []
    limits = np.array([[0.0, 1.0], [0.0, 2.0]])
    names = answers.joint_names(2)
    assert answers.of_limits(names, two[:, None], limits, "rad") == []
    assert answers.of_limits(names, np.array([[0.5, -0.5], [1.0, 2.5]]), limits, "rad") == [
        "joint 1 leaves its limits by 0.5 rad",
        "joint 2 leaves its limits by 0.5 rad",
    ]
