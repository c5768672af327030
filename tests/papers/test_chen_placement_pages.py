"""The pages on Chen & Zalzala's docking postures: tables, claims and figures from small runs."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from evoexp.papers.chen import cases as case_results
from evoexp.papers.chen import placement_claims
from evoexp.papers.chen.cases import Case
from evoexp.papers.chen.figures import placements
from evoexp.report.pages.page_file import read_page_file
from evoexp.report.statistics import judging
from report_samples import figure_stems, page_settings, smoke_report, smoke_results


@pytest.fixture(scope="module")
def cases(outputs: Path) -> list[Case]:
    return case_results.cases(smoke_results(outputs, "chen_placement"))


def test_conditions_are_told_apart(cases: list[Case]) -> None:
    assert [case.name for case in cases] == list(case_results.PRINTED)
    for case in cases:
        assert case.landscape is None
        assert all(c is not None for c in case[1:6])
        assert list(case.evolved) == ["GA", "GA, elitism", "random search"]
        assert ("Newton-type, smooth form" in case.ends()) == (case.name == "minimax torque")
        assert case.optimum is not None
        assert case.optimum.planned == 1


@pytest.mark.matrix
def test_the_landscapes(outputs: Path) -> None:
    directory = smoke_report(outputs, "chen_landscapes")
    assert figure_stems(directory) == {"fig_9_landscapes", "scene"}
    table = pd.read_csv(directory / "fig_9_landscapes.csv")
    assert set(table["element"]) == {*placements.LOOKS, placements.GRID}
    grid = table[table["element"] == placements.GRID]
    least = grid.groupby("case")["cost"].min()
    best = table[table["element"] == placements.OPTIMUM].groupby("case")["cost"].min()
    assert (best <= least).all()


def test_postures_end_at_the_target(cases: list[Case]) -> None:
    table = placements.postures_table(cases)
    tips = table[(table["element"] == "link") & (table["size"] == 3.0)]
    np.testing.assert_allclose(
        tips[["x_end", "y_end"]].to_numpy(), [[5.0, 1.4]] * len(tips), atol=1e-9
    )
    assert set(table["posture"]) == {"", *placements.POSTURE_NAMES}
    assert len(table[table["element"] == "obstacle"]) == 2


def test_gaps_are_those_of_the_summaries(cases: list[Case]) -> None:
    table = placements.gaps_table(cases)
    assert (table["gap"] >= 0.0).all()
    own = table[(table["case"] == "minimax torque") & (table["method"] == "GA")]
    assert cases[1].plain is not None
    np.testing.assert_allclose(
        own["gap"], cases[1].plain.column("best_cost") / cases[1].least - 1.0, atol=1e-12
    )


def test_verdicts_where_they_are_judged(cases: list[Case]) -> None:
    settings = page_settings("chen_placement")
    judge = judging.Judge("", settings, read_page_file("evoexp.papers.chen").rules)
    found = placement_claims.judge_cases(judge, cases)
    verdict = {one.text: one.verdict for one in found}
    assert (
        verdict["least torque norm: the best posture has a torque norm of 1.73"]
        == judging.REPRODUCED
    )
    assert (
        verdict["obstacle and link 2: the best posture has a torque norm of 2.08"]
        == judging.CONTRADICTED
    )
    assert (
        verdict["obstacle and platform: the best posture has a torque norm of 3.01"]
        == judging.REPRODUCED
    )
    angles = [text for text in verdict if "is at or near the optimum" in text]
    assert len(angles) == 2
    assert {verdict[text] for text in angles} == {judging.REPRODUCED}
    assert (
        verdict["manipulability and torque: the Newton-type method gets stuck"]
        == judging.REPRODUCED
    )
