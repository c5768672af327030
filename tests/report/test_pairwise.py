"""All conditions against each other: which pairs, which tests, which tables."""

import dataclasses

import numpy as np
import pytest

from evoexp.report.pages import page_values
from evoexp.report.pages.page_builder import own_page
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import ConditionResults, Results
from evoexp.report.statistics.inference import holm


def changed(condition: ConditionResults, label: str, **columns: object) -> ConditionResults:
    summaries = condition.summaries.assign(**columns)
    return dataclasses.replace(condition, label=label, summaries=summaries)


def copies(results: Results, count: int) -> Results:
    """Return results of some conditions, each of which costs more than the one before."""
    first = results.conditions[0]
    costs, slope = first.column("best_cost"), 1.0 + 0.1 * np.arange(first.done)
    conditions = (changed(first, f"+{k}", best_cost=costs + k * slope) for k in range(count))
    return results._replace(conditions=tuple(conditions))


@pytest.mark.parametrize(("count", "rows"), [(4, 6), (6, 15), (7, 6)])
def test_every_pair_is_compared_and_of_many_conditions_the_first_with_each(
    results: Results, settings: ReportSettings, count: int, rows: int
) -> None:
    found = copies(results, count)
    (_, costs), *_ = page_values.pairs_of_conditions(found, settings, page_values.differing(found))
    assert len(costs) == len({row.quantity for row in costs}) == rows
    assert [row.p_adjusted for row in costs] == holm([row.better.p_value for row in costs])
    assert all(row.better.a12 > 0.5 for row in costs)  # the first of a pair costs less


def test_a_quantity_that_never_differs_is_left_out(results: Results) -> None:
    names = page_values.differing(results._replace(conditions=results.conditions[:1] * 2))
    assert "evaluations" not in names and "best cost" in names  # of two seeds


def test_shares_that_differ_are_tested_pair_by_pair(results: Results) -> None:
    first = results.conditions[0]
    some, none = changed(first, "all", solved=True), changed(first, "none", solved=False)
    both = results._replace(conditions=(some, none))
    assert [row[:2] for row in page_values.share_rows_of_all(both, 0.95)] == [
        ("all", "2 of 2 = 100 % [34, 100]"),
        ("none", "0 of 2 = 0 % [0, 66]"),
    ]
    (row,) = (row for row in page_values.difference_rows(both, 0.95) if row[0] == "solved")
    assert row[1:3] == ("all against none", "100 [7, 100]")
    assert float(str(row[3])) == pytest.approx(1.0 / 3.0, abs=0.01)  # 2 of 6 tables
    assert not page_values.difference_rows(results._replace(conditions=(some,)), 0.95)


def test_the_generic_page_holds_all_of_it(results: Results, settings: ReportSettings) -> None:
    page = own_page("generic", copies(results, 4), settings)
    names = ("best cost", "CPU time, search [s]")  # all took as many evaluations
    headings = [heading for heading, _ in page.comparisons]
    assert headings == [f"{name}: pairs of conditions" for name in names]
    stems = ["convergence", "values", "scene", "joints", "covers"]
    assert [drawing.stem for drawing in page.drawings] == stems
    assert page.tables[0].headers == ("condition", "solved", "certified", "required margin kept")
    assert {"best cost", "CPU time of the search"} <= {q.name for q in page.quantities}
