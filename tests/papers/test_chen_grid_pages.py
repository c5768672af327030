"""Pages of the grid paths: routes, printed grids, and what the pages say of small runs."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.papers.chen import path_claims
from evoexp.papers.chen.figures.printed_fields import MISSING, SURPLUS, WRONG, compare
from evoexp.papers.chen.path_claims import inside_points, routes, signature
from report_samples import smoke_results

CENTRES = inside_points([(2, 2, 3, 3), (6, 2, 7, 3)])
ABOVE = np.array([[0, 2], [1, 4], [4, 5], [9, 2]], dtype=float)
BELOW = np.array([[0, 2], [1, 1], [8, 1], [9, 2]], dtype=float)
BETWEEN = np.array([[0, 2], [1, 4], [4, 4], [5, 1], [9, 2]], dtype=float)


def test_signatures_tell_the_sides_that_are_passed() -> None:
    assert signature(ABOVE, CENTRES) == (1, 1)
    assert signature(BELOW, CENTRES) == (0, 0)
    assert signature(BETWEEN, CENTRES) == (1, 0)


@given(st.integers(0, 2**32))
def test_a_path_that_goes_there_and_back_passes_nothing(seed: int) -> None:
    path = np.random.default_rng(seed).integers(0, 10, (8, 2)).astype(float)
    assert set(signature(np.vstack([path, path[::-1]]), CENTRES)) == {0}


def test_routes_are_named_by_frequency() -> None:
    found = routes({1: BELOW, 2: ABOVE, 3: BETWEEN, 4: ABOVE + 0.0}, CENTRES)
    assert list(found.items()) == [("A", (2, 4)), ("B", (1,)), ("C", (3,))]


@pytest.mark.parametrize(
    ("printed", "slips"),
    [
        ("1 2 3 4", []),
        ("1 9 3 4", [(1, WRONG)]),
        ("1 3 4", [(1, MISSING)]),
        ("1 5 2 3 4", [(1, SURPLUS)]),
        ("1 3 4 4", [(1, MISSING), (4, SURPLUS)]),
    ],
)
def test_rows_are_aligned_by_the_fewest_slips(printed: str, slips: list[tuple[int, str]]) -> None:
    table = compare("a", [["1", "2", "3", "4"]], [printed.split()])
    assert sorted(set(table.loc[table["slip"] != SURPLUS, "column"])) == [0, 1, 2, 3]
    found = table[table["slip"] != ""]
    assert [(int(r.column), r.slip) for r in found.itertuples(index=False)] == slips


def test_no_gap_is_below_the_bound_and_groups_are_the_weightings(outputs: Path) -> None:
    results = smoke_results(outputs, "chen_path")
    groups = path_claims.groups(results)
    assert [(group.name, group.weights) for group in groups] == [
        ("(a)", (1, 0)),
        ("(b)", (0.1, 10)),
        ("(c)", (0.12, 20)),
    ]
    for group in groups:
        assert group.bound <= group.optimum
        assert [c.is_control for c in group.conditions] == [False, False, True, True]
        for c in group.conditions:
            assert (c.column("best_cost") >= group.bound - 1e-9).all()
    assert path_claims.shortest(groups) == pytest.approx(39.62741699796952)
