"""The planner keeps every obligation of a planner; the experiments can be composed."""

import pytest

from evoexp.testing import CHECKS, Check, conditions

CONDITIONS = conditions("experiment=my_paper")


@pytest.mark.parametrize("label", CONDITIONS)
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_the_planner_keeps_its_obligations(check: Check, label: str) -> None:
    check(CONDITIONS[label])


def test_readings_of_the_paper_differ() -> None:
    readings = conditions("experiment=my_paper_claims")
    assert len({condition.id for condition in readings.values()}) == len(readings)
