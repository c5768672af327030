"""The rules by which claims of Corsépius 2001 are judged.

On made-up runs of the shipped conditions.
"""

import functools
from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

import report_samples
from evoexp.configuration.experiment import Experiment
from evoexp.papers.corsepius import claims as paper_claims
from evoexp.papers.corsepius import measures
from evoexp.report.pages.page_file import read_page_file
from evoexp.report.pages.page_parts import Claim
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics import judging
from evoexp.report.statistics.judging import (
    CONTRADICTED,
    NOT_JUDGED,
    REPRODUCED,
    UNDECIDED,
    Judge,
)
from report_samples import REPORT
from shipped_conditions import expanded

RULES = read_page_file("evoexp.papers.corsepius").rules
SETTINGS = ReportSettings(**REPORT, figures="corsepius")  # type: ignore[arg-type]
RUNS = 40
Effort = Callable[
    [str, float], tuple[float, int]
]  # task, size → cycles of every run, runs that meet the goal


@functools.cache
def conditions_of(name: str) -> Experiment:
    return expanded(name, "paper")


def made_up(name: str, rows: Callable[[str], dict[str, object]]) -> Results:
    """Return results in which the runs of every condition have these columns."""
    given = {"stop_reason": ["goal"] * RUNS}
    return report_samples.made_up(conditions_of(name), lambda label: given | rows(label))


def study(effort: Effort) -> dict[str, Claim]:
    def rows(label: str) -> dict[str, object]:
        task, size = label.split(", λ = ")
        cycles, having = effort(task, float(size))
        spread = 1.0 + 0.01 * (np.arange(RUNS) % 5)
        evaluations = cycles * spread * float(size)
        return {
            "solved": np.arange(RUNS) < having,
            "certified": pd.array([True] * RUNS, dtype="boolean"),
            "clearance": np.ones(RUNS),
            "certified_margin": pd.array([True] * RUNS, dtype="boolean"),
            "term_cycles": cycles * spread,
            "evaluations": evaluations,
            "cpu_s": 1e-6 * evaluations,
            "certificate_s": np.zeros(RUNS),
        }

    found = measures.tasks(made_up("corsepius_population", rows), "num_offspring")
    compared = {
        metric: paper_claims.compare_sizes(found, metric, SETTINGS)
        for metric in paper_claims.METRICS
    }
    return {
        claim.text: claim
        for claim in paper_claims.judge_study(Judge("", SETTINGS, RULES), found, compared)
    }


def verdict(claims: dict[str, Claim], text: str) -> str:
    return next(claim.verdict for name, claim in claims.items() if name.startswith(text))


def test_equal_evaluations_per_cycle_make_larger_populations_slower() -> None:
    """Where cycles do not depend on the size, evaluations go with it."""
    claims = study(lambda task, size: (20.0, RUNS))
    assert (
        verdict(claims, "Larger populations do not plan faster, on any task: evaluations")
        == REPRODUCED
    )
    assert (
        verdict(claims, "Larger populations do not plan faster, on any task: cycles") == UNDECIDED
    )
    assert (
        verdict(claims, "Smaller populations increase planning times over-proportionally: cycles")
        == CONTRADICTED
    )
    assert verdict(claims, "Smaller populations reduce convergence") == UNDECIDED
    assert verdict(claims, "100 individuals are reasonable: cycles") == REPRODUCED
    assert (
        verdict(claims, "100 individuals are reasonable: evaluations") == CONTRADICTED
    )  # ten take a tenth


def test_one_task_that_large_populations_plan_faster_contradicts() -> None:
    claims = study(lambda task, size: (20.0 if task != "pose" else 4e5 / size**2, RUNS))
    assert (
        verdict(claims, "Larger populations do not plan faster, on any task: evaluations")
        == CONTRADICTED
    )
    assert (
        verdict(claims, "Larger populations do not necessarily plan faster: evaluations")
        == REPRODUCED
    )
    text = next(
        c.evidence
        for n, c in claims.items()
        if n.startswith("Larger populations do not plan faster, on any")
    )
    assert "pose × 0.25 (200)" in text


def test_steep_costs_of_small_populations_are_over_proportional() -> None:
    claims = study(
        lambda task, size: (20.0 * max(1.0, (100.0 / size) ** 2), RUNS if size >= 100 else 5)
    )
    for metric in paper_claims.METRICS:
        text = f"Smaller populations increase planning times over-proportionally: {metric}"
        assert verdict(claims, text) == REPRODUCED
    assert verdict(claims, "Smaller populations reduce convergence") == REPRODUCED


def test_failures_count_in_the_expected_effort() -> None:
    claims = study(lambda task, size: (20.0, RUNS if size == 100 else RUNS // 2))
    found = claims["Larger populations do not plan faster, on any task: cycles"]
    assert found.verdict == REPRODUCED, "the same cycles, half of them in vain"
    assert "ball × 2 (200)" in found.evidence


def test_what_100_never_solves_and_more_do_contradicts_it() -> None:
    claims = study(lambda task, size: (20.0, RUNS if task != "narrow gate" or size > 100 else 0))
    assert verdict(claims, "100 individuals are reasonable: cycles") == CONTRADICTED
    assert (
        verdict(claims, "Larger populations do not plan faster, on any task: cycles")
        == CONTRADICTED
    )


def test_nothing_solved_says_nothing() -> None:
    claims = study(lambda task, size: (20.0, 0))
    assert {claim.verdict for claim in claims.values()} <= {UNDECIDED, CONTRADICTED}
    assert verdict(claims, "100 individuals are reasonable: cycles") == UNDECIDED
    assert verdict(claims, "Smaller populations reduce convergence") == UNDECIDED


def task_rows(having: dict[str, int], free: int = RUNS) -> Callable[[str], dict[str, object]]:
    def rows(label: str) -> dict[str, object]:
        solved = np.arange(RUNS) < having.get(label, RUNS)
        return {
            "solved": solved,
            "certified": pd.array(np.arange(RUNS) < free, dtype="boolean"),
            "clearance": np.ones(RUNS),
            "certified_margin": pd.array([True] * RUNS, dtype="boolean"),
            "stop_reason": np.where(solved, "goal", "stagnation"),
            "term_greatest_upright_deg": np.full(RUNS, 9.5),
            "term_greatest_upright_between_deg": np.where(np.arange(RUNS) < free, 9.6, 10.1),
        }

    return rows


def judged(name: str, rows: Callable[[str], dict[str, object]]) -> dict[str, str]:
    own = paper_claims.judge_tasks(Judge("", SETTINGS, RULES), made_up(name, rows))
    return {c.text: c.verdict for c in own}


def test_a_wall_that_a_subgoal_opens_is_a_local_minimum() -> None:
    text = "wall: the search gets stuck in a local minimum, which a sub-goal opens"
    assert judged("corsepius_wall", task_rows({"wall": 0}))[text] == REPRODUCED
    assert judged("corsepius_wall", task_rows({}))[text] == UNDECIDED
    assert judged("corsepius_wall", task_rows({"with a sub-goal": 0}))[text] == CONTRADICTED


def test_one_tilted_or_touching_path_contradicts() -> None:
    name = "corsepius_pick_and_place"
    for free, expected in ((RUNS, REPRODUCED), (RUNS - 1, CONTRADICTED)):
        found = judged(name, task_rows({}, free))
        assert found["pick and place: paths avoid obstacles"] == expected
        assert found["pick and place: the grasped object is not tilted"] == expected


def test_one_certified_path_is_enough_for_redundant_arms() -> None:
    text = "The approach works for highly redundant arms"
    labels = [label for label, _ in conditions_of("corsepius_gate_narrow").conditions]
    nobody = dict.fromkeys(labels, 0)
    assert judged("corsepius_gate_narrow", task_rows(nobody))[text] == CONTRADICTED
    one, in_empty_space = ({**nobody, label: 1} for label in labels[:2])
    assert judged("corsepius_gate_narrow", task_rows(one))[text] == REPRODUCED
    found = judged("corsepius_gate_narrow", task_rows(in_empty_space))
    assert found[text] == CONTRADICTED, "what happens without the gate is no evidence"
    assert text not in judged("corsepius_pick_and_place", task_rows({}))


@pytest.mark.parametrize(
    ("having", "expected"),
    [
        ({"wall": 0}, REPRODUCED),
        ({"wall": 0, "wall, empty scene": 0}, CONTRADICTED),
        ({"wall": RUNS - 1}, UNDECIDED),
        ({}, CONTRADICTED),
    ],
)
def test_obstacles_are_judged_by_the_same_task_in_an_empty_scene(
    having: dict[str, int], expected: str
) -> None:
    text = "The search gets stuck at obstacles: the same goals are met without them"
    assert judged("corsepius_wall", task_rows(having))[text] == expected


def test_empty_scenes_are_controls_and_make_no_claims_of_their_own() -> None:
    found = judged("corsepius_gate_wide", task_rows({}))
    assert found
    assert not [text for text in found if text.split(":")[0].endswith("empty scene")]
    results = made_up("corsepius_gate_wide", task_rows({}))
    pairs = measures.with_empty_scenes(results.main)
    assert [(c.label, e.label) for c, e in pairs] == [
        (c.label, f"{c.label}, empty scene") for c in measures.obstructed(results.main)
    ]


@pytest.mark.parametrize(
    ("having", "expected"), [(RUNS, REPRODUCED), (21, REPRODUCED), (20, CONTRADICTED)]
)
def test_goals_are_met_if_most_runs_meet_them(having: int, expected: str) -> None:
    text = "wall: goals in work space are met without inverse kinematics"
    assert judged("corsepius_wall", task_rows({"wall": having}))[text] == expected


def test_allowed_contacts_are_named_with_the_verdict() -> None:
    def rows(label: str) -> dict[str, object]:
        return task_rows({})(label) | {"allowed_contacts": ["table – bottle, hand – bottle"] * RUNS}

    results = made_up("corsepius_pick_and_place", rows)
    found = paper_claims.judge_tasks(Judge("", SETTINGS, RULES), results)
    told = next(c.evidence for c in found if c.name == "paths_avoid_obstacles")
    assert "may touch, 0.001 m deep at most: table – bottle, hand – bottle" in told


def test_below_the_papers_budget_nothing_is_judged() -> None:
    results = made_up("corsepius_wall", task_rows({"wall": 0}))._replace(budget="smoke")
    for claim in paper_claims.judge_tasks(judging.judge(results, SETTINGS, RULES), results):
        assert claim.verdict.startswith(NOT_JUDGED)
