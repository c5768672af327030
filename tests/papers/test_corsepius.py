"""The pages on Corsépius 2001: their tables and figures, and claims on made-up runs."""

import functools
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import report_samples
from evoexp.configuration import compose
from evoexp.numeric.elementary import DEGREE
from evoexp.papers import trails
from evoexp.papers.corsepius import claims as paper_claims
from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.claims import SizeComparison
from evoexp.papers.corsepius.figures import population_effort, posture_motions
from evoexp.papers.corsepius.measures import ShownPath
from evoexp.report.pages.page_builder import page_of
from evoexp.report.pages.page_file import read_page_file
from evoexp.report.pages.page_parts import Claim
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import Results, gather
from evoexp.report.statistics.inference import Interval, Proportion
from evoexp.report.statistics.judging import CONTRADICTED, NOT_JUDGED, REPRODUCED, UNDECIDED
from report_samples import can_be_drawn, page_claims, page_settings, smoke_results, store
from shipped_conditions import expanded

FEW = 3  # replicates


@functools.cache
def solved(outputs: Path, name: str) -> Results:
    """Return three runs at the paper's budget: the smoke budget would cut their cycles."""
    experiment = compose.expand([f"experiment={name}", f"num_replicates={FEW}"])[0]
    store(outputs, experiment)
    return gather(outputs, experiment.conditions, FEW, name, experiment.budget, "")


def test_a_way_through_subgoals_has_phases_and_is_no_manoeuvre(outputs: Path) -> None:
    results = smoke_results(outputs, "corsepius_wall")
    two = results._replace(conditions=results.main[:2])  # enough to be compared
    pages = (
        page_of(results, page_settings("corsepius_wall")),
        page_of(two, page_settings("corsepius_wall", "corsepius_sweep")),
    )
    stems, swept = ({drawing.stem for drawing in found.drawings} for found in pages)
    assert "Phases" in {table.heading for table in pages[0].tables} and "values" in swept
    assert not any(stem.startswith("manoeuvre") for stem in stems)


def test_conditions_of_one_task_are_told_by_all_but_the_setting(outputs: Path) -> None:
    found = measures.tasks(smoke_results(outputs, "corsepius_population"), "num_offspring")
    names = "ball, pose, bottle, shelf, wide gate, narrow gate, wall, pick and place"
    assert ", ".join(task.name for task in found) == names
    assert all(list(task.by_value) == [10, 25, 50, 100, 200, 400, 800] for task in found)
    assert found[0].by_value[100.0].label == "ball, λ = 100"


def test_phases_add_up_to_the_cycles_of_the_run(outputs: Path) -> None:
    condition = solved(outputs, "corsepius_wall").conditions[2]
    runs = measures.phase_cycles(condition).groupby("replicate")
    assert list(runs["cycles"].sum()) == list(measures.cycles(condition))
    reached = runs["reached"].all() & (runs.size() == 2)
    assert reached.any() and list(reached) == list(condition.summaries["solved"])


def test_lengths_and_detours_of_paths(outputs: Path) -> None:
    condition = solved(outputs, "corsepius_ball").conditions[0]
    lengths, detours = measures.path_lengths(condition), measures.detours(condition)
    for k, q in enumerate(measures.paths(condition).values()):
        length = sum(np.linalg.norm(b - a) for a, b in zip(q[:-1], q[1:], strict=True))
        assert lengths[k] == pytest.approx(length)
        assert detours[k] == pytest.approx(length / np.linalg.norm(q[-1] - q[0]))
    assert (detours >= 1.0).all()


def test_models_show_bodies_and_covers_that_hold_them(outputs: Path) -> None:
    condition = smoke_results(outputs, "corsepius_ball").conditions[0]
    table = posture_motions.models_table([("MANUS", condition)])
    bodies, covers = (table[table["element"] == kind] for kind in ("body", "cover"))
    problem = condition.prepared.problem
    assert list(bodies["name"]) == list(problem.bodies.names)
    assert len(covers) == problem.bodies.num_shapes
    inner, outer = trails.corners(bodies), trails.corners(covers)
    assert (inner.min(axis=0) >= outer.min(axis=0) - 1e-9).all()
    assert (inner.max(axis=0) <= outer.max(axis=0) + 1e-9).all()
    assert can_be_drawn(table, posture_motions.draw_models)


def test_every_child_lies_in_the_box_of_its_parent(outputs: Path) -> None:
    table = posture_motions.scope_table(solved(outputs, "corsepius_ball").conditions[0])
    path = table[table["element"] == posture_motions.POSTURE].sort_values("order")
    for axis in ("x", "y"):
        assert (path[axis].diff().abs().dropna() <= path[f"half_{axis}"].iloc[0] + 1e-9).all()
    assert path["half_x"].iloc[0] == pytest.approx(0.1 / DEGREE)
    assert set(table["factor"].dropna()) == set(posture_motions.FACTORS)
    assert can_be_drawn(table, posture_motions.draw_scope)


def test_histories_keep_the_last_value_of_searches_that_ended(outputs: Path) -> None:
    results = solved(outputs, "corsepius_ball")
    table = population_effort.history_table(results)
    assert (table["begun"] == FEW).all()
    assert table.groupby("quantity")["running"].max().tolist() == [FEW, FEW]
    last = table[table["quantity"] == population_effort.DISTANCE].sort_values("cycle").iloc[-1]
    assert last["median"] == pytest.approx(np.median(measures.residuals(results.conditions[0])))
    assert can_be_drawn(table, population_effort.draw_history)


@pytest.mark.matrix
def test_what_is_held_moves_in_the_manoeuvre(outputs: Path) -> None:
    condition = solved(outputs, "corsepius_pick_and_place").conditions[0]
    assert run_measures.solved(condition).any()
    shown = ShownPath("x", condition, measures.shown_replicate(condition), True)
    table = posture_motions.motions_table([shown])
    held = table[table["element"] == posture_motions.HELD]
    assert sorted(held["panel"].unique()) == [2, 3, 4]
    carried = held[held["panel"] == 3].sort_values("instant")[["x", "y", "z"]].to_numpy()
    assert np.linalg.norm(carried[-1] - (0.52, -0.22, 0.745)) < 0.0101  # goal and its tolerance
    standing = table[(table["element"] == posture_motions.OBSTACLE) & (table["name"] == "bottle")]
    assert sorted(standing["panel"].unique()) == [0, 1, 5]
    assert can_be_drawn(table, posture_motions.draw_motions)


@pytest.mark.matrix
def test_the_trap_shows_both_kinds_of_runs(outputs: Path) -> None:
    pair = posture_motions.stuck_pair(solved(outputs, "corsepius_wall").main)
    assert [c.label for c in pair] == ["wall", "with a sub-goal"]
    table = posture_motions.trap_table(*pair)
    tools = table[table["element"] == posture_motions.TOOL].sort_values("order")
    ends = tools.groupby(["series", "replicate"])["value"].last()
    assert (ends["stuck"] > 0.1).all() and (ends["helped"] < 0.01).all()
    assert list(table[table["element"] == posture_motions.ESCAPE]["x"]) == list(
        posture_motions.BOXES
    )
    assert can_be_drawn(table, posture_motions.draw_trap)


def test_expected_effort_counts_failures(outputs: Path) -> None:
    found = measures.tasks(smoke_results(outputs, "corsepius_population"), "num_offspring")[:1]
    shares = {"goal met": lambda c: Proportion(1, 2)}
    effort = {"spent [-]": lambda c: np.array([3.0, 5.0])}
    table = population_effort.effort_table(found, shares, effort, 0.95, 50)
    rows = dict(list(table.groupby("quantity")["expected"]))
    assert set(rows["goal met"]) == {0.5}
    own = found[0].by_value.values()
    expected = [8.0 / c.solved if c.solved else np.inf for c in own]
    assert list(rows["spent [-]"]) == expected
    draw = functools.partial(population_effort.draw_effort, setting="λ", marked=100.0)
    assert can_be_drawn(table, draw)


def test_the_slope_of_the_floor_is_that_of_the_medians(outputs: Path) -> None:
    found = measures.tasks(smoke_results(outputs, "corsepius_scope"), "scope", "")
    assert [task.name for task in found] == ["surface", "point", "snake at a point"]
    table = population_effort.floor_table(found).set_index(["quantity", "task"])
    for task in found:
        assert list(task.by_value) == [0.0125, 0.025, 0.05, 0.1, 0.2, 0.4]
        medians = table.loc[(population_effort.RESIDUAL, task.name), "median"].astype(float)
        expected = np.polyfit(np.log(list(task.by_value)), np.log(medians), 1)[0]
        assert population_effort.slope(task) == pytest.approx(expected)
    assert can_be_drawn(table.reset_index(), population_effort.draw_floor)


def test_a_series_without_points_is_not_in_the_legend() -> None:
    shown = SizeComparison("ball", 200.0, 0.5, Interval(0.4, 0.6), 1.0)
    empty = SizeComparison("narrow gate", 200.0, 0.0, Interval(0.0, 0.0), 1.0)
    rows = {"cycles": [shown, empty]}
    tasks = tuple(measures.Task(name, {}) for name in ("ball", "narrow gate"))
    table = population_effort.ratios_table(rows, tasks, 100.0)
    figure = population_effort.draw_ratios(table, "λ [-]")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["ball"]


@pytest.mark.matrix
def test_released_objects_stand_upright_on_the_table(outputs: Path) -> None:
    condition = solved(outputs, "corsepius_pick_and_place").conditions[0]
    found = [*measures.releases(condition)]
    assert found
    assert all(abs(gap) <= 0.001 + 1e-9 and tilt <= 1.0 * DEGREE for gap, tilt in found)
    assert "table – bottle" in measures.allowed_contacts(condition)
    assert 0.0 <= condition.summaries["penetration"].max() <= 0.001 + 3e-6


RULES = read_page_file("evoexp.papers.corsepius").rules
SETTINGS = page_settings("", "corsepius")
RUNS = 40
TRUE = pd.array([True] * RUNS, dtype="boolean")
Rows = Callable[[str], dict[str, object]]
Effort = Callable[[str, float], tuple[float, int]]  # task, size → cycles of a run, runs at the goal


def made_up_task(name: str, rows: Rows) -> Results:
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

    results = made_up_task("corsepius_population", rows)
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
    results = made_up_task(name, partial(task_rows, having, free=free))
    return {claim.text: claim.verdict for claim in page_claims("corsepius", results)}


def test_obstacles_that_never_act_say_nothing() -> None:
    for cost, names in ((0.0, {"goals_met"}), (1.0, {"goals_met", "paths_avoid_obstacles"})):

        def rows(label: str, cost: float = cost) -> dict[str, object]:
            empty = "empty scene" in label
            return task_rows({}, label) | {"best_cost": np.full(RUNS, 0.0 if empty else cost)}

        judged = page_claims("corsepius", made_up_task("corsepius_pose", rows))
        assert {claim.name for claim in judged if claim.text.startswith("pose: ")} == names


MINIMUM = "wall: the search gets stuck in a local minimum, and a sub-goal leads out of it"
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
    main = made_up_task("corsepius_gate_wide", partial(task_rows, {})).main
    pairs = [(c.label, empty.label) for c, empty in measures.pairs_but_for("empty_scene", main)]
    assert pairs == [(c.label, f"{c.label}, empty scene") for c in measures.obstructed(main)]


def test_allowed_contacts_are_named_with_the_verdict() -> None:
    contacts = {"allowed_contacts": ["table – bottle, hand – bottle"] * RUNS}
    results = made_up_task(
        "corsepius_pick_and_place", lambda label: task_rows({}, label) | contacts
    )
    claims = page_claims("corsepius", results)
    told = next(c.evidence for c in claims if c.name == "paths_avoid_obstacles")
    assert "may touch, 0.001 m deep at most: table – bottle, hand – bottle" in told


def test_below_the_papers_budget_nothing_is_judged() -> None:
    results = made_up_task("corsepius_wall", partial(task_rows, {"wall": 0}))._replace(
        budget="smoke"
    )
    for claim in page_claims("corsepius", results, reason=None):
        assert claim.verdict.startswith(NOT_JUDGED)
