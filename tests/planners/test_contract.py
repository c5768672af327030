"""Every kind of shipped condition keeps the obligations of a planner."""

import pyarrow as pa
import pytest

from evoexp.records import flatten
from evoexp.store.log_reader import read_summary
from evoexp.testing import CHECKS, Check
from evoexp.testing.evolution_record import finished
from shipped_conditions import KINDS, kinds_of_conditions


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("kind", KINDS)  # each runs once for all checks
def test_a_planner_keeps_its_obligations(check: Check, kind: int) -> None:
    check(kinds_of_conditions("smoke")[kind])


@pytest.mark.parametrize("kind", KINDS)
def test_the_summary_is_the_row_that_its_log_gives(kind: int) -> None:
    content, summary = finished(kinds_of_conditions("smoke")[kind], 0)
    given, read = (
        pa.Table.from_pylist([flatten(each)]) for each in (summary, read_summary(content))
    )
    assert set(given.schema) == set(read.schema)
    assert repr(sorted(given.to_pylist()[0].items())) == repr(
        sorted(read.to_pylist()[0].items())
    )  # NaN equals NaN
