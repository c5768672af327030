"""The answers of a comparison as CSV: read back, every number and name is there."""

import csv
import io

import numpy as np

from evoexp.report.pages.comparison import Rated, as_csv
from evoexp.report.statistics.inference import Interval, Spread

ROWS = [
    Rated(
        "p_1: A&B",
        "[A] & B_1 50%",
        "p_1",
        4,
        3,
        10.0,
        1234.5,
        Interval(900.25, 2000.125),
        Spread(4.0 / 3.0, 1.0, 2.0, 4),
        1.0,
        np.nan,
        1.0,
        0,
        4,
        20.0,
        51.5,
        0.25,
    ),
    Rated(
        "q: C",
        "C (given)",
        "q, {a}",
        2,
        0,
        np.nan,
        np.inf,
        Interval(1e6, np.inf),
        Spread(np.inf, np.inf, np.inf, 2),
        np.nan,
        np.nan,
        np.nan,
        0,
        0,
    ),
]


def test_csv_has_all_digits() -> None:
    head, first, second = csv.reader(io.StringIO(as_csv(ROWS).decode()))
    assert head[:4] == ["planner", "problem", "n", "proven"] and len(set(head)) == 13
    assert first[:4] == ["[A] & B_1 50%", "p_1", "4", "3"]
    numbers = [1234.5, 900.25, 2000.125, 4 / 3, 1.0, 2.0, 24690.0, 51.5, 0.25]
    assert [float(cell) for cell in first[4:]] == numbers
    unknown = ["", "", ""]  # of runs that were given
    assert second == ["C (given)", "q, {a}", "2", "0", "inf", "1000000.0", *["inf"] * 4, *unknown]
