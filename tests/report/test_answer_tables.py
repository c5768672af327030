"""Tables of proven answers, also of planners that have none."""

import numpy as np
import pytest

from evoexp.report.results.proven_answers import Answer, answer_table, best_lengths, first_reached

SOME = [
    Answer(0, 0, 50, 1000, 9.0, 4.0, True, False),
    Answer(0, 3, 200, 4000, 6.0, 4.0, True, True),
    Answer(0, 7, 400, 8000, 5.0, 4.0, True, True),
    Answer(2, 1, 100, 2000, 7.0, 4.0, False, True),
]


def test_the_first_and_the_best_answers_of_runs() -> None:
    table, spent = answer_table(SOME), np.array([9000.0, 9100.0, 9200.0])
    assert best_lengths(table, [0, 1, 2]).tolist() == [5.0, np.inf, 7.0]
    effort, reached = first_reached(table, [0, 1, 2], 5.5, spent)
    assert effort.tolist() == [8000.0, 9100.0, 9200.0]
    assert reached.tolist() == [True, False, False]


def test_no_answer_at_all_is_a_table_too() -> None:
    table = answer_table([])
    assert list(table.dtypes) == list(answer_table(SOME).dtypes)
    assert best_lengths(table, [0, 1]).tolist() == [np.inf, np.inf]
    effort, reached = first_reached(table, [0, 1], np.inf, np.array([3.0, 4.0]))
    assert effort.tolist() == [3.0, 4.0]
    assert not reached.any()
    assert table[table["solved"]].groupby("replicate")["collision_queries"].min().empty


@pytest.mark.parametrize("answers", [SOME, []])
def test_columns_are_the_fields_of_an_answer(answers: list[Answer]) -> None:
    assert tuple(answer_table(answers).columns) == Answer._fields
