"""Tables of proven answers, also of planners that have none."""

import numpy as np
import pytest

from evoexp.report.results.planner_runs import PlannerRuns, Problem
from evoexp.report.results.proven_answers import Answer, answer_table

SOME = [
    Answer(0, 0, 50, 1000, 9.0, 4.0, True, False),
    Answer(0, 3, 200, 4000, 6.0, 4.0, True, True),
    Answer(0, 7, 400, 8000, 5.0, 4.0, True, True),
    Answer(2, 1, 100, 2000, 7.0, 4.0, False, True),
]


def runs_of(answers: list[Answer], *spent: float) -> PlannerRuns:
    table, replicates = answer_table(answers), tuple(range(len(spent)))
    return PlannerRuns("", Problem("p"), "", table, replicates, np.array(spent), None)


def test_the_first_and_the_best_answers_of_runs() -> None:
    runs = runs_of(SOME, 9000.0, 9100.0, 9200.0)
    assert runs.best_lengths.tolist() == [5.0, np.inf, 7.0]
    effort, reached = runs.first_reached(5.5)
    assert effort.tolist() == [8000.0, 9100.0, 9200.0]
    assert reached.tolist() == [True, False, False]


def test_no_answer_at_all_is_a_table_too() -> None:
    table = answer_table([])
    assert list(table.dtypes) == list(answer_table(SOME).dtypes)
    runs = runs_of([], 3.0, 4.0)
    assert runs.best_lengths.tolist() == [np.inf, np.inf]
    effort, reached = runs.first_reached()
    assert effort.tolist() == [3.0, 4.0]
    assert not reached.any()
    assert table[table["solved"]].groupby("replicate")["collision_queries"].min().empty


@pytest.mark.parametrize("answers", [SOME, []])
def test_columns_are_the_fields_of_an_answer(answers: list[Answer]) -> None:
    assert tuple(answer_table(answers).columns) == Answer._fields
