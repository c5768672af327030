"""The pages on Corsépius 2001: what they hold, and the tables behind their figures."""

import functools
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from evoexp.configuration import compose
from evoexp.numeric.elementary import DEGREE
from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.claims import SizeComparison
from evoexp.papers.corsepius.figures import (
    population_effort,
    posture_history,
    posture_motions,
    posture_trap,
    solids,
)
from evoexp.papers.corsepius.figures.posture_motions import ShownPath
from evoexp.report.pages.page_builder import page_of
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import Results, gather
from evoexp.report.statistics.inference import Interval, Proportion
from report_samples import (
    can_be_drawn,
    page_settings,
    smoke_results,
    store,
)

FEW = 3  # replicates


@functools.cache
def solved(outputs: Path, name: str) -> Results:
    """Return results of three runs at the paper's budget.

    Whose cycles the smoke budget would cut.
    """
    experiment = compose.expand([f"experiment={name}", f"num_replicates={FEW}"])[0]
    store(outputs, experiment)
    return gather(outputs, experiment.conditions, FEW, name, experiment.budget, "")


@pytest.mark.examples(1)
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("corsepius_population", {"effort", "ratios"}),
        ("corsepius_scope", {"floor"}),
        ("corsepius_options", {"shares", "values", "effects"}),
    ],
)
def test_studies_have_figures_and_a_row_per_condition(
    outputs: Path, name: str, expected: set[str]
) -> None:
    results = smoke_results(outputs, name)
    found = page_of(results, page_settings(name))
    assert {drawing.stem for drawing in found.drawings} <= {*expected, "scene"}
    assert len(found.tables[0].rows) == len(results.conditions)
    for drawing in found.drawings:
        table = drawing.table()
        assert len(table)
        assert can_be_drawn(table, drawing.draw)


def test_the_study_reads_no_log(outputs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Thousands of runs: summaries say all of it."""

    def refuse(*_: object) -> None:
        raise AssertionError("a log was read")

    results = smoke_results(outputs, "corsepius_population")
    monkeypatch.setattr("evoexp.report.results.stored_results.read_generations", refuse)
    monkeypatch.setattr("evoexp.report.results.stored_results.read_solution", refuse)
    for drawing in page_of(results, page_settings("corsepius_population")).drawings:
        drawing.table()


def test_a_way_through_subgoals_has_phases_and_is_no_manoeuvre(outputs: Path) -> None:
    results = smoke_results(outputs, "corsepius_wall")
    found = page_of(results, page_settings("corsepius_wall"))
    stems = {drawing.stem for drawing in found.drawings}
    assert "phases" in stems
    assert not any(stem.startswith("manoeuvre") for stem in stems)
    two = results._replace(conditions=results.main[:2])  # enough to be compared
    swept = page_of(two, page_settings("corsepius_wall", "corsepius_sweep"))
    assert "values" in {drawing.stem for drawing in swept.drawings}


def test_conditions_of_one_task_are_told_by_all_but_the_setting(outputs: Path) -> None:
    found = measures.tasks(smoke_results(outputs, "corsepius_population"), "num_offspring")
    assert [task.name for task in found] == [
        *("ball", "pose", "bottle", "shelf", "wide gate", "narrow gate", "wall", "pick and place")
    ]
    assert all(task.values == (10, 25, 50, 100, 200, 400, 800) for task in found)
    first = found[0].by_value[100.0]
    assert first.label == "ball, λ = 100"


def test_phases_add_up_to_the_cycles_of_the_run(outputs: Path) -> None:
    condition = solved(outputs, "corsepius_wall").conditions[2]
    table = measures.phase_cycles(condition)
    assert list(table.groupby("replicate")["cycles"].sum()) == list(measures.cycles(condition))
    expected = {k: bool(v) for k, v in condition.summaries["solved"].items()}
    reached = table.groupby("replicate")["reached"].all() & (table.groupby("replicate").size() == 2)
    assert reached.to_dict() == expected
    assert any(expected.values())


def test_lengths_and_detours_of_paths(outputs: Path) -> None:
    condition = solved(outputs, "corsepius_ball").conditions[0]
    lengths, detours = measures.path_lengths(condition), measures.detours(condition)
    for k, q in enumerate(measures.paths(condition).values()):
        steps = [np.linalg.norm(b - a) for a, b in zip(q[:-1], q[1:], strict=True)]
        assert lengths[k] == pytest.approx(sum(steps))
        assert detours[k] == pytest.approx(sum(steps) / np.linalg.norm(q[-1] - q[0]))
    assert (detours >= 1.0).all()


def test_models_show_bodies_and_covers_that_hold_them(outputs: Path) -> None:
    condition = smoke_results(outputs, "corsepius_ball").conditions[0]
    table = solids.models_table([("MANUS", condition)])
    bodies, covers = (table[table["element"] == kind] for kind in (solids.BODY, solids.COVER))
    problem = measures.problem(condition)
    assert list(bodies["name"]) == list(problem.bodies.names)
    assert len(covers) == problem.bodies.num_shapes
    least, most = solids.corners(covers).min(axis=0), solids.corners(covers).max(axis=0)
    assert (solids.corners(bodies).min(axis=0) >= least - 1e-9).all()
    assert (solids.corners(bodies).max(axis=0) <= most + 1e-9).all()
    assert can_be_drawn(table, solids.draw_models)


def test_every_child_lies_in_the_box_of_its_parent(outputs: Path) -> None:
    condition = solved(outputs, "corsepius_ball").conditions[0]
    table = posture_motions.scope_table(condition)
    path = table[table["element"] == posture_motions.POSTURE].sort_values("order")
    for axis in ("x", "y"):
        assert (path[axis].diff().abs().dropna() <= path[f"half_{axis}"].iloc[0] + 1e-9).all()
    assert path["half_x"].iloc[0] == pytest.approx(0.1 / DEGREE)
    assert set(table["factor"].dropna()) == set(posture_motions.FACTORS)
    assert can_be_drawn(table, posture_motions.draw_scope)


def test_histories_keep_the_last_value_of_searches_that_ended(outputs: Path) -> None:
    results = solved(outputs, "corsepius_ball")
    table = posture_history.history_table(results)
    assert (table["begun"] == FEW).all()
    assert table.groupby("quantity")["running"].max().tolist() == [FEW, FEW]
    last = table[table["quantity"] == posture_history.DISTANCE].sort_values("cycle").iloc[-1]
    assert last["median"] == pytest.approx(np.median(measures.residuals(results.conditions[0])))
    assert can_be_drawn(table, posture_history.draw_history)


@pytest.mark.matrix
def test_what_is_held_moves_in_the_manoeuvre(outputs: Path) -> None:
    condition = solved(outputs, "corsepius_pick_and_place").conditions[0]
    replicate = measures.shown_replicate(condition)
    assert run_measures.solved(condition).any()
    table = posture_motions.motions_table([ShownPath("x", condition, replicate, True)])
    assert list(dict.fromkeys(table["title"])) == [
        *("1  approach", "2  grasp", "3  lift", "4  carry", "5  place", "6  detach")
    ]
    held = table[table["element"] == posture_motions.HELD]
    assert sorted(held["panel"].unique()) == [2, 3, 4]
    carried = held[held["panel"] == 3].sort_values("instant")[["x", "y", "z"]].to_numpy()
    assert (
        np.linalg.norm(carried[-1] - (0.52, -0.22, 0.745)) < 0.0101
    )  # the goal of carrying, within its tolerance
    standing = table[(table["element"] == posture_motions.OBSTACLE) & (table["name"] == "bottle")]
    assert sorted(standing["panel"].unique()) == [0, 1, 5]
    assert can_be_drawn(table, posture_motions.draw_motions)


@pytest.mark.matrix
def test_the_trap_shows_both_kinds_of_runs(outputs: Path) -> None:
    pair = posture_trap.stuck_pair(solved(outputs, "corsepius_wall").main)
    assert [c.label for c in pair] == ["wall", "with a sub-goal"]
    table = posture_trap.trap_table(*pair)
    tools = table[table["element"] == posture_trap.TOOL]
    ends = tools.sort_values("order").groupby(["series", "replicate"])["value"].last()
    assert (ends["stuck"] > 0.1).all()
    assert (ends["helped"] < 0.01).all()
    escape = table[table["element"] == posture_trap.ESCAPE]
    assert list(escape["x"]) == list(posture_trap.BOXES)
    assert can_be_drawn(table, posture_trap.draw_trap)


def test_expected_effort_counts_failures(outputs: Path) -> None:
    found = measures.tasks(smoke_results(outputs, "corsepius_population"), "num_offspring")[:1]
    shares, effort = (
        {"goal met": lambda c: Proportion(1, 2)},
        {"spent [-]": lambda c: np.array([3.0, 5.0])},
    )
    table = population_effort.effort_table(found, shares, effort, 0.95, 50)
    assert set(table.loc[table["quantity"] == "goal met", "expected"]) == {0.5}
    own = table[table["quantity"] == "spent [-]"]
    for c, expected in zip(found[0].conditions, own["expected"], strict=True):
        assert expected == (8.0 / c.solved if c.solved else np.inf)
    assert can_be_drawn(table, partial(population_effort.draw_effort, setting="λ", marked=100.0))


def test_the_slope_of_the_floor_is_that_of_the_medians(outputs: Path) -> None:
    found = measures.tasks(smoke_results(outputs, "corsepius_scope"), "scope", "")
    assert [task.name for task in found] == ["surface", "point", "snake at a point"]
    table = population_effort.floor_table(found)
    for task in found:
        assert task.values == (0.0125, 0.025, 0.05, 0.1, 0.2, 0.4)
        own = table[
            (table["quantity"] == population_effort.RESIDUAL) & (table["task"] == task.name)
        ]
        medians = own["median"].to_numpy(dtype=np.float64)
        expected = np.polyfit(np.log(task.values), np.log(medians), 1)[0]
        assert population_effort.slope(task) == pytest.approx(expected)
    assert can_be_drawn(table, population_effort.draw_floor)


def test_a_series_without_points_is_not_in_the_legend() -> None:
    rows = {
        "cycles": [
            SizeComparison("ball", 200.0, 0.5, Interval(0.4, 0.6), 1.0),
            SizeComparison("narrow gate", 200.0, 0.0, Interval(0.0, 0.0), 1.0),
        ]
    }
    table = population_effort.ratios_table(rows, ["ball", "narrow gate"], 100.0)
    figure = population_effort.draw_ratios(table, "λ [-]")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["ball"]


@pytest.mark.matrix
def test_released_objects_stand_upright_on_the_table(outputs: Path) -> None:
    results = solved(outputs, "corsepius_pick_and_place")
    found = measures.releases(results.conditions[0])
    assert found
    for one in found:
        assert abs(one.gap) <= 0.001 + 1e-9
        assert one.tilt <= 1.0 * DEGREE
    condition = results.conditions[0]
    told = measures.allowed_contacts(condition)
    assert told is not None
    assert "table – bottle" in told.pairs
    deepest = condition.summaries["penetration"].max()
    assert 0.0 <= deepest <= 0.001 + 3e-6
