"""Every kind of shipped condition keeps the obligations of a planner."""

import pyarrow as pa
import pytest

from evoexp.records import flatten
from evoexp.store.log_reader import read_summary
from evoexp.testing import CHECKS, Check
from evoexp.testing.contract import finished
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
