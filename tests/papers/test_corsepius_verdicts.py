"""The rules by which claims of Corsépius 2001 are judged, on made-up runs of its conditions."""

import functools
from collections.abc import Callable
from functools import partial

import numpy as np
import pandas as pd
import pytest

import report_samples
from evoexp.papers.corsepius import claims as paper_claims
from evoexp.papers.corsepius import measures
from evoexp.report.pages.page_file import read_page_file
from evoexp.report.pages.page_parts import Claim
from evoexp.report.results.stored_results import Results
from evoexp.report.statistics import judging
from evoexp.report.statistics.judging import CONTRADICTED, NOT_JUDGED, REPRODUCED, UNDECIDED
from report_samples import page_claims
from shipped_conditions import expanded

RULES = read_page_file("evoexp.papers.corsepius").rules
SETTINGS = report_samples.page_settings("", "corsepius")
JUDGE = judging.Judge("", SETTINGS, RULES)
RUNS = 40
TRUE = pd.array([True] * RUNS, dtype="boolean")
Rows = Callable[[str], dict[str, object]]
Effort = Callable[[str, float], tuple[float, int]]  # task, size → cycles of a run, runs at the goal


def made_up(name: str, rows: Rows) -> Results:
    """Return results in which the runs of every condition have these columns and the usual ones."""
    usual = {"stop_reason": ["goal"] * RUNS, "clearance": np.ones(RUNS), "certified_margin": TRUE}
    return report_samples.made_up(expanded(name, "paper"), lambda label: usual | rows(label))


@functools.cache
def study(name: str) -> list[Claim]:
    def rows(label: str) -> dict[str, object]:
        task, settings = label.split(", λ = ")
        size = float(settings.split(", ")[0])
        cycles, having = STUDIES[name](task, size)
        spread = cycles * (1.0 + 0.01 * (np.arange(RUNS) % 5))
        evaluations = spread * size
        columns = {"term_cycles": spread, "evaluations": evaluations, "cpu_s": 1e-6 * evaluations}
        solved = np.arange(RUNS) < having
        return columns | {"solved": solved, "certified": TRUE, "certificate_s": np.zeros(RUNS)}

    results = made_up("corsepius_population", rows)
    return page_claims("corsepius_population", results)


FASTER = "Larger populations do not plan faster, on any task: "
STEEP = "Smaller populations increase planning times over-proportionally: "
REASONABLE = "100 individuals are reasonable: "
NOT_ALWAYS = "Larger populations do not necessarily plan faster: "
LESS = "Smaller populations reduce convergence"


STUDIES: dict[str, Effort] = {
    "equal cycles": lambda task, size: (20.0, RUNS),
    "one task faster": lambda task, size: (20.0 if task != "pose" else 4e5 / size**2, RUNS),
    "steep": lambda _, size: (20.0 * max(1.0, (100.0 / size) ** 2), RUNS if size >= 100 else 5),
    "half fail": lambda task, size: (20.0, RUNS if size == 100 else RUNS // 2),
    "too narrow": lambda task, size: (20.0, RUNS if task != "narrow gate" or size > 100 else 0),
    "nothing solved": lambda task, size: (20.0, 0),
}


@pytest.mark.parametrize(
    ("name", "text", "verdict", "evidence"),
    [
        ("equal cycles", FASTER + "evaluations", REPRODUCED, ""),
        ("equal cycles", FASTER + "cycles", UNDECIDED, ""),
        ("equal cycles", STEEP + "cycles", CONTRADICTED, ""),
        ("equal cycles", LESS, UNDECIDED, ""),
        ("equal cycles", REASONABLE + "cycles", REPRODUCED, ""),
        ("equal cycles", REASONABLE + "evaluations", CONTRADICTED, ""),  # ten take a tenth
        ("one task faster", FASTER + "evaluations", CONTRADICTED, "pose × 0.5 (200)"),
        ("one task faster", NOT_ALWAYS + "evaluations", REPRODUCED, ""),
        *(("steep", STEEP + metric, REPRODUCED, "") for metric in paper_claims.METRICS),
        ("steep", LESS, REPRODUCED, ""),
        ("steep", f"{LESS}: parents in proportion", REPRODUCED, "in 16 of 16 cases"),
        ("half fail", FASTER + "cycles", REPRODUCED, "ball × 2 (200)"),  # half of them in vain
        ("too narrow", REASONABLE + "cycles", CONTRADICTED, ""),
        ("too narrow", FASTER + "cycles", CONTRADICTED, ""),
        ("nothing solved", REASONABLE + "cycles", UNDECIDED, ""),
        ("nothing solved", LESS, UNDECIDED, ""),
    ],
)
def test_sizes_are_judged(name: str, text: str, verdict: str, evidence: str) -> None:
    claim = next(claim for claim in study(name) if claim.text.startswith(text))
    assert claim.verdict == verdict
    assert evidence in claim.evidence


def test_nothing_solved_reproduces_nothing() -> None:
    assert {claim.verdict for claim in study("nothing solved")} <= {UNDECIDED, CONTRADICTED}


def task_rows(having: dict[str, int], label: str, free: int = RUNS) -> dict[str, object]:
    solved = np.arange(RUNS) < having.get(label, RUNS)
    return {
        "solved": solved,
        "best_cost": np.arange(RUNS) + len(label),
        "evaluations": 100.0 + np.arange(RUNS),
        "certified": pd.array(np.arange(RUNS) < free, dtype="boolean"),
        "stop_reason": np.where(solved, "goal", "stagnation"),
        "term_greatest_upright_deg": np.full(RUNS, 9.5),
        "term_greatest_upright_between_deg": np.where(np.arange(RUNS) < free, 9.6, 10.1),
    }


def judged(name: str, having: dict[str, int], free: int = RUNS) -> dict[str, str]:
    """Return the verdicts on a task of which only some runs of each condition meet the goal."""
    results = made_up(name, partial(task_rows, having, free=free))
    return {claim.text: claim.verdict for claim in page_claims("corsepius", results)}


def test_obstacles_that_never_act_say_nothing() -> None:
    for cost, names in ((0.0, {"goals_met"}), (1.0, {"goals_met", "paths_avoid_obstacles"})):

        def rows(label: str, cost: float = cost) -> dict[str, object]:
            empty = "empty scene" in label
            return task_rows({}, label) | {"best_cost": np.full(RUNS, 0.0 if empty else cost)}

        judged = page_claims("corsepius", made_up("corsepius_pose", rows))
        assert {claim.name for claim in judged if claim.text.startswith("pose: ")} == names


MINIMUM = "wall: the search gets stuck in a local minimum, which a sub-goal opens"
STUCK = "The search gets stuck at obstacles: the same goals are met without them"
MET = "wall: goals in work space are met without inverse kinematics"


@pytest.mark.parametrize(
    ("text", "having", "expected"),
    [
        (MINIMUM, {"wall": 0}, REPRODUCED),
        (MINIMUM, {}, UNDECIDED),
        (MINIMUM, {"with a sub-goal": 0}, CONTRADICTED),
        (STUCK, {"wall": 0}, REPRODUCED),
        (STUCK, {"wall": 0, "wall, empty scene": 0}, CONTRADICTED),
        (STUCK, {"wall": RUNS - 1}, UNDECIDED),
        (STUCK, {}, CONTRADICTED),
        (MET, {"wall": RUNS}, REPRODUCED),
        (MET, {"wall": 21}, REPRODUCED),
        (MET, {"wall": 20}, CONTRADICTED),  # most runs must meet them
    ],
)
def test_the_wall_is_judged(text: str, having: dict[str, int], expected: str) -> None:
    assert judged("corsepius_wall", having)[text] == expected


@pytest.mark.parametrize(("free", "expected"), [(RUNS, REPRODUCED), (RUNS - 1, CONTRADICTED)])
def test_one_tilted_or_touching_path_contradicts(free: int, expected: str) -> None:
    found = judged("corsepius_pick_and_place", {}, free)
    assert found["pick and place: paths avoid obstacles"] == expected
    assert found["pick and place: the grasped object is not tilted"] == expected


def test_one_certified_path_is_enough_for_redundant_arms() -> None:
    name, text = "corsepius_gate_narrow", "The approach works for highly redundant arms"
    labels = [label for label, _ in expanded(name, "paper").conditions]
    nobody = dict.fromkeys(labels, 0)
    assert judged(name, nobody)[text] == CONTRADICTED
    assert judged(name, nobody | {labels[0]: 1})[text] == REPRODUCED
    # what happens in a scene without the gate is no evidence
    assert judged(name, nobody | {labels[1]: 1})[text] == CONTRADICTED
    assert text not in judged("corsepius_pick_and_place", {})


def test_empty_scenes_are_controls_and_make_no_claims_of_their_own() -> None:
    found = judged("corsepius_gate_wide", {})
    assert found
    assert not [text for text in found if text.split(":")[0].endswith("empty scene")]
    main = made_up("corsepius_gate_wide", partial(task_rows, {})).main
    pairs = [(c.label, empty.label) for c, empty in measures.pairs_but_for("empty_scene", main)]
    assert pairs == [(c.label, f"{c.label}, empty scene") for c in measures.obstructed(main)]


def test_allowed_contacts_are_named_with_the_verdict() -> None:
    contacts = {"allowed_contacts": ["table – bottle, hand – bottle"] * RUNS}
    results = made_up("corsepius_pick_and_place", lambda label: task_rows({}, label) | contacts)
    claims = page_claims("corsepius", results)
    told = next(c.evidence for c in claims if c.name == "paths_avoid_obstacles")
    assert "may touch, 0.001 m deep at most: table – bottle, hand – bottle" in told


def test_below_the_papers_budget_nothing_is_judged() -> None:
    results = made_up("corsepius_wall", partial(task_rows, {"wall": 0}))._replace(budget="smoke")
    for claim in page_claims("corsepius", results, reason=None):
        assert claim.verdict.startswith(NOT_JUDGED)
