"""The pages on Chen & Zalzala: routes and printed grids, docking postures, from small runs."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.papers.chen import docking_postures, path_claims
from evoexp.papers.chen.docking_postures import Case
from evoexp.papers.chen.figures import placements
from evoexp.papers.chen.figures.printed_fields import MISSING, SURPLUS, WRONG, compare
from evoexp.papers.chen.path_claims import inside_points, routes, signature
from evoexp.report.pages.page_file import read_page_file
from evoexp.report.statistics import judging
from report_samples import page_claims, smoke_report, smoke_results

PRINTED = read_page_file("evoexp.papers.chen").functions["printed_postures"]()
CENTRES = inside_points([(2, 2, 3, 3), (6, 2, 7, 3)])
ABOVE = np.array([[0, 2], [1, 4], [4, 5], [9, 2]], dtype=float)
BELOW = np.array([[0, 2], [1, 1], [8, 1], [9, 2]], dtype=float)
BETWEEN = np.array([[0, 2], [1, 4], [4, 4], [5, 1], [9, 2]], dtype=float)


def test_routes_are_told_by_the_sides_that_are_passed_and_named_by_frequency() -> None:
    signatures = [signature(path, CENTRES) for path in (ABOVE, BELOW, BETWEEN)]
    assert signatures == [(1, 1), (0, 0), (1, 0)]
    found = routes({1: BELOW, 2: ABOVE, 3: BETWEEN, 4: ABOVE + 0.0}, CENTRES)
    assert list(found.items()) == [("A", (2, 4)), ("B", (1,)), ("C", (3,))]


@given(st.integers(0, 2**32))
def test_a_path_that_goes_there_and_back_passes_nothing(seed: int) -> None:
    path = np.random.default_rng(seed).integers(0, 10, (8, 2)).astype(float)
    assert set(signature(np.vstack([path, path[::-1]]), CENTRES)) == {0}


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
    groups = [*path_claims.groups(smoke_results(outputs, "chen_path"))]
    weights = {group.name: group.weights for group in groups}
    assert weights == {"(a)": (1, 0), "(b)": (0.1, 10), "(c)": (0.12, 20)}
    for group in groups:
        bound = path_claims.bound_known(group.truth)
        assert bound <= path_claims.cost_known(group.truth)
        assert [c.is_control for c in group.conditions] == [False, False, True, True]
        assert all((c.column("best_cost") >= bound - 1e-9).all() for c in group.conditions)
        assert group.truth is not None
        assert path_claims.shortest_known(group.truth) == pytest.approx(39.62741699796952)


@pytest.fixture(scope="module")
def cases(outputs: Path) -> list[Case]:
    return list(docking_postures.cases(smoke_results(outputs, "chen_placement"), PRINTED))


def test_conditions_are_told_apart(cases: list[Case]) -> None:
    assert [case.name for case in cases] == list(PRINTED)
    for case in cases:
        assert case.landscape is None and all(c is not None for c in case[1:6])
        assert list(case.evolved) == ["GA", "GA, elitism", "random search"]
        assert ("Newton-type, smooth form" in case.ends()) == (case.name == "minimax torque")
        assert case.optimum is not None and case.optimum.planned == 1


@pytest.mark.matrix
def test_no_point_of_a_landscape_is_below_its_optimum(outputs: Path) -> None:
    table = pd.read_csv(smoke_report(outputs, "chen_landscapes") / "fig_9_landscapes.csv")
    assert set(table["element"]) == {*placements.LOOKS, placements.GRID}
    least = table.groupby(["element", "case"])["cost"].min()
    assert (least[placements.OPTIMUM] <= least[placements.GRID]).all()


def test_postures_end_at_the_target(cases: list[Case]) -> None:
    table = placements.postures_table(cases)
    tips = table[(table["element"] == "link") & (table["size"] == 3.0)][["x_end", "y_end"]]
    np.testing.assert_allclose(tips, [[5.0, 1.4]] * len(tips), atol=1e-9)
    assert set(table["posture"]) == {"", *placements.POSTURE_LOOKS}
    assert len(table[table["element"] == "obstacle"]) == 2


def test_gaps_are_those_of_the_summaries(cases: list[Case]) -> None:
    table = placements.gaps_table(cases)
    assert (table["gap"] >= 0.0).all()
    own = table[(table["case"] == "minimax torque") & (table["method"] == "GA")]["gap"]
    np.testing.assert_allclose(
        own, cases[1].plain.column("best_cost") / cases[1].least - 1.0, atol=1e-12
    )


def test_verdicts_where_they_are_judged(outputs: Path) -> None:
    judged = page_claims("chen_placement", smoke_results(outputs, "chen_placement"))
    verdicts = {c.text: c.verdict for c in judged}
    norm = "the best posture has a torque norm of"
    for text, verdict in {
        f"least torque norm: {norm} 1.73": judging.REPRODUCED,
        f"obstacle and link 2: {norm} 2.08": judging.REPRODUCED,
        f"obstacle and platform: {norm} 3.01": judging.REPRODUCED,
        "manipulability and torque: the Newton-type method gets stuck": judging.REPRODUCED,
    }.items():
        assert verdicts[text] == verdict, text
    angles = [v for text, v in verdicts.items() if "is at or near the optimum" in text]
    assert angles == [judging.REPRODUCED] * 2
