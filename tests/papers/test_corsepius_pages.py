"""The pages on Corsépius 2001: what they hold, and the tables behind their figures."""

import functools
from pathlib import Path

import numpy as np
import pytest

from evoexp.configuration import compose
from evoexp.numeric.elementary import DEGREE
from evoexp.papers.corsepius import measures
from evoexp.papers.corsepius.claims import SizeComparison
from evoexp.papers.corsepius.figures import (
    population_effort,
    posture_motions,
    solids,
)
from evoexp.papers.corsepius.measures import ShownPath
from evoexp.report.pages.page_builder import page_of
from evoexp.report.results import run_measures
from evoexp.report.results.stored_results import Results, gather
from evoexp.report.statistics.inference import Interval, Proportion
from report_samples import can_be_drawn, page_settings, smoke_results, store

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
    table = solids.models_table([("MANUS", condition)])
    bodies, covers = (table[table["element"] == kind] for kind in (solids.BODY, solids.COVER))
    problem = condition.prepared.problem
    assert list(bodies["name"]) == list(problem.bodies.names)
    assert len(covers) == problem.bodies.num_shapes
    inner, outer = solids.corners(bodies), solids.corners(covers)
    assert (inner.min(axis=0) >= outer.min(axis=0) - 1e-9).all()
    assert (inner.max(axis=0) <= outer.max(axis=0) + 1e-9).all()
    assert can_be_drawn(table, solids.draw_models)


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
    found = measures.releases(condition)
    assert found
    assert all(abs(gap) <= 0.001 + 1e-9 and tilt <= 1.0 * DEGREE for gap, tilt in found)
    assert "table – bottle" in measures.allowed_contacts(condition)
    assert 0.0 <= condition.summaries["penetration"].max() <= 0.001 + 3e-6
