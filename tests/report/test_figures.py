"""Figures of runs: curves, boxes, shares, planar arms; the page of a sweep with its figures."""

import dataclasses
import itertools
import math
from collections import defaultdict
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib import cbook
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from evoexp.cli import main
from evoexp.configuration import compose
from evoexp.papers.rana.figures import arm_models, arm_motions
from evoexp.report.figures import convergence, side_by_side, style
from evoexp.report.figures.side_by_side import draw_box
from evoexp.report.pages.page_builder import page_of
from evoexp.report.pages.sweeps import labelled, main_effects, sweep_of
from evoexp.report.results import motion_geometry
from evoexp.report.results.stored_results import ConditionResults, Results, gather
from evoexp.report.statistics.inference import Proportion
from evoexp.shipped import shipped
from report_samples import SMALL, can_be_drawn, page_settings, store


def texts(figure: Figure) -> set[str]:
    """Return every word that a figure shows, its legends included."""
    found = [
        text
        for axes in figure.axes
        for text in (axes.xaxis.label, axes.yaxis.label, *axes.texts, axes.title)
    ]
    found += [text for legend in figure.legends for text in legend.get_texts()]
    left = {axes.get_title(loc="left") for axes in figure.axes}
    return left | {text.get_text() for text in found}


def curves(*evaluations: float) -> pd.DataFrame:
    """Return curves of conditions that take so many evaluations in a generation."""
    generation, parts = np.arange(6), []
    for position, each in enumerate(evaluations):
        median = 100.0 + generation * (position + 1.0)
        columns = {
            "condition": f"condition {position}",
            "position": position,
            "generation": generation,
            "evaluations": each * (generation + 1),
            "median": median,
            "lower": median - 5.0,
            "upper": median + 5.0,
            "replicates": [4, 4, 4, 3, 3, 3],
        }
        names = convergence.NAMES.values()
        parts += [pd.DataFrame(columns | {"quantity": quantity}) for quantity in names]
    return pd.concat(parts, ignore_index=True)


@pytest.mark.parametrize("draw", [convergence.draw_cost, convergence.draw_fitness])
def test_convergence_shows_medians_bands_and_counts(draw: object) -> None:
    figure = draw(curves(50.0, 50.0))
    axes = figure.axes[0]
    lines = [line for line in axes.get_lines() if len(line.get_xdata()) == 6]
    np.testing.assert_array_equal(lines[0].get_ydata(), 100.0 + np.arange(6))
    assert len(lines) == 4
    assert {to_hex(line.get_color()).upper() for line in lines} == set(style.CONDITION_COLOURS[:2])
    assert "condition 0, best so far (n = 3…4)" in texts(figure)
    above = axes.child_axes[0]
    assert (axes.get_xlabel(), above.get_xlabel()) == ("generation", "evaluations")
    assert above._functions[0](5.0) == pytest.approx(300.0)
    infinite, single = curves(50.0), curves(50.0).query("generation == 0")
    infinite.loc[infinite["generation"] < 2, ["median", "lower", "upper"]] = np.inf
    assert can_be_drawn(infinite, draw) and can_be_drawn(single, draw)


def test_conditions_of_other_effort_share_an_axis_of_evaluations() -> None:
    axes = convergence.draw_cost(curves(20.0, 50.0)).axes[0]
    assert (axes.get_xlabel(), axes.get_xlim()[1]) == ("evaluations", 300.0)


def values(*runs: list[float]) -> Axes:
    """Return the axes that show the values of some conditions' runs."""
    parts = [
        {"position": k, "condition": str(k), "replicate": n, "value": value}
        for k, found in enumerate(runs)
        for n, value in enumerate(found)
    ]
    table = pd.DataFrame(parts).assign(quantity="evaluations", failed=0)
    return side_by_side.draw_values(table).axes[0]


def medians(axes: Axes) -> list[float]:
    lines = [line for line in axes.get_lines() if line.get_linewidth() == 2.0]
    return [float(line.get_xdata()[0]) for line in lines]


def test_runs_that_never_get_there_count_in_the_box() -> None:
    """Of 2, 4, 6, never, never the median is 6; of the three successful runs alone it is 4."""
    axes = values([2.0, 3.0, 4.0, 5.0, 6.0], [2.0, 4.0, 6.0, np.inf, np.inf])
    assert medians(axes) == [4.0, 6.0]
    assert [text.get_text() for text in axes.texts] == ["5 of 5", "3 of 5", "never"]
    assert axes.texts[-1].xy[0] == pytest.approx(6.0 + side_by_side.BEYOND * 4.0)
    some = values([np.inf] * 4, [1.0, *[np.inf] * 3])  # a median may be never
    assert medians(some) == [pytest.approx(1.0 + side_by_side.BEYOND)] * 2
    assert medians(values([np.inf] * 4)) == [1.0]
    axes = values([2.0, 3.0, 4.0])
    assert not axes.texts


@pytest.mark.parametrize("size", [5, 30, 200])
def test_a_box_is_tukeys(size: int) -> None:
    sample = np.random.default_rng(3).standard_t(2, size)
    axes = style.figure(2.0).subplots()
    draw_box(axes, 0.0, sample, "#000000")
    (expected,) = cbook.boxplot_stats(sample)
    drawn = np.concatenate([np.ravel(line.get_xdata()) for line in axes.get_lines()])
    for name in ("q1", "med", "q3", "whislo", "whishi"):
        assert np.isclose(drawn, expected[name]).any(), name


def test_panels_of_shares_have_one_scale() -> None:
    rows = [
        ("high", 0, "a", Proportion(180, 200)),
        ("high", 1, "b", Proportion(200, 200)),
        ("low", 0, "a", Proportion(4, 200)),
        ("low", 1, "b", Proportion(0, 0)),
    ]
    panels = side_by_side.draw_shares(side_by_side.shares_table(rows, {}, 0.95)).axes
    (low, high), other = (axes.get_xlim() for axes in panels)
    assert (low, high) == other and low < 0.0 and high > 100.0


@pytest.fixture
def ga(results: Results) -> ConditionResults:
    return results.conditions[0]


def test_fitness_is_the_papers(results: Results) -> None:
    costs, fitness = convergence.cost_table(results), convergence.fitness_table(results)
    np.testing.assert_allclose(fitness["median"], 500.0 - costs["median"])
    widths = [table["upper"] - table["lower"] for table in (fitness, costs)]
    np.testing.assert_allclose(*widths, atol=1e-9)
    best = fitness.set_index(["condition", "quantity"]).loc[("via-point GA", "best so far")]
    assert list(best["generation"]) == [0, 1, 2, 3, 4]
    assert best["median"].is_monotonic_increasing


def test_arms_stand_at_start_and_goal_of_table_2(ga: ConditionResults) -> None:
    table = arm_models.arms_table(ga)
    first = table[(table["posture"] == "start") & (table["joint"] == 0)]
    assert list(first["angle_deg"]) == [45.0, 225.0]
    assert list(first["reference_deg"] % 360.0) == [0.0, 0.0]
    np.testing.assert_allclose(first[["x", "y"]], [[0.0, 0.0], [0.0, 8.0]])
    length = np.hypot(table["x_end"] - table["x"], table["y_end"] - table["y"])
    np.testing.assert_allclose(length, 4.0)
    words = {"θ₁ = 45°", "θ₂ = 225°", "α₁ = 225°", "x [unit]"}
    assert words <= texts(arm_models.draw_arms(table))


def test_via_points_are_those_of_the_solution(ga: ConditionResults) -> None:
    table = arm_models.via_points_table(ga)
    final = table[table["stage"] == "best at the end"][["joint_1_deg", "joint_2_deg"]]
    np.testing.assert_array_equal(final.to_numpy().ravel(), ga.solutions[ga.best_replicate])
    words = texts(arm_models.draw_via_points(table))
    assert {"θ₁ [deg]", "α₂ [deg]", "0", "20", "arm 2"} <= words


def test_circles_show_the_least_distance(ga: ConditionResults) -> None:
    table = arm_models.circles_table(ga)
    elements = table.set_index("element")
    assert len(elements.loc["circle"]) == 18
    centres = elements.loc["centres"]
    q = motion_geometry.configurations(ga.prepared, ga.solutions[ga.best_replicate])
    truth = ga.prepared.problem.centre_distances(q).min()
    assert centres["distance"] == pytest.approx(truth, abs=1e-9)
    drawn = np.hypot(centres["x_end"] - centres["x"], centres["y_end"] - centres["y"])
    assert drawn == pytest.approx(truth)
    assert elements.loc["bodies", "distance"] <= truth + 1e-9
    words = texts(arm_models.draw_circles(table))
    assert f"least distance of circle centres: {truth:.3f} unit" in words


def test_snapshots_cut_the_motion_into_stages(ga: ConditionResults) -> None:
    table = arm_motions.snapshots_table(ga)
    stages = table.groupby("stage")[["first", "last"]].first().to_numpy().tolist()
    assert stages == [[0, 4], [4, 8], [8, 12], [12, 16], [16, 20], [0, 20]]
    whole = table[table["stage"] == 5].set_index(["instant", "arm", "link"])
    assert len(whole) == 21 * 4
    tip = whole.loc[(0, 0, 1), ["x_end", "y_end"]].tolist()
    assert tip == pytest.approx([4.0 * np.sqrt(0.5), 4.0 * np.sqrt(0.5) - 4.0])
    words = {"instants 0–4", "all instants 0–20", "arm 1", "arm 2", "y [unit]"}
    assert words <= texts(arm_motions.draw_snapshots(table))


@pytest.mark.parametrize(
    ("copies", "most", "words"),
    [
        (1, 50, "all replicates (n = 2)"),
        (2, 2, "2 of 4 replicates"),
        (2, 4, "all replicates (n = 4)"),
    ],
)
def test_paths_of_all_or_of_some_replicates_are_drawn(
    ga: ConditionResults, monkeypatch: pytest.MonkeyPatch, copies: int, most: int, words: str
) -> None:
    condition = dataclasses.replace(ga)
    solutions = [*ga.solutions.values()] * copies
    vars(condition)["solutions"] = dict(enumerate(solutions))
    monkeypatch.setattr(arm_motions, "MOST_PATHS", most)
    table = arm_motions.paths_table(condition)
    assert sorted(table["replicate"].unique()) == list(range(-1, min(len(solutions), most)))
    ends = table[(table["arm"] == 0) & (table["instant"] == 20)][["joint_1_deg", "joint_2_deg"]]
    np.testing.assert_allclose(ends, [[135.0, 135.0]] * len(ends))
    assert words in texts(arm_motions.draw_paths(table, ["joint_1_deg", "joint_2_deg"]))


def test_distances_are_best_and_envelope(ga: ConditionResults) -> None:
    table = arm_motions.distances_table(ga, 4)
    rows = table.set_index(["measure", "series", "instant"])["distance"]
    centres, links = rows.loc[arm_motions.CENTRES], rows.loc[arm_motions.LINKS]
    for each in (centres, links):
        best = each.loc[arm_motions.BEST]
        assert (each.loc[arm_motions.LOWEST] <= best).all()
        assert (best <= each.loc[arm_motions.HIGHEST]).all()
        at = each.loc[arm_motions.AT_VIA_POINTS]
        assert list(at.index) == list(range(21)) and at.equals(best[at.index])
    straight = links.loc[arm_motions.STRAIGHT]
    assert (straight <= centres.loc[arm_motions.STRAIGHT] + 1e-9).all()  # circles on links
    assert straight.min() == 0.0
    words = texts(arm_motions.draw_distances(table))
    assert {"below the required distance: 1 unit between arms", "least distance [unit]"} <= words


COSTS = {  # (population, elites) → best costs of seeds 0, 1, 2
    ("20", "0"): [10.0, 12.0, math.inf],
    ("20", "2"): [9.0, 12.0, math.inf],
    ("100", "0"): [7.0, 11.0, 5.0],
    ("100", "2"): [8.0, 6.0, math.inf],
}


def fake(costs: list[tuple[str, list[float]]], first: int = 0) -> Any:
    """Return results of conditions by their labels; each begins `first` seeds after the last."""
    conditions = []
    for k, (label, own) in enumerate(costs):
        table = pd.DataFrame({"best_cost": own}, pd.RangeIndex(k * first, k * first + len(own)))
        fields = {"label": label, "is_reference": False, "done": len(own), "summaries": table}
        conditions.append(SimpleNamespace(**fields, column=lambda name, own=own: np.array(own)))
    return SimpleNamespace(conditions=conditions)


def cost(condition: Any) -> np.ndarray:
    return condition.column("best_cost")


@pytest.fixture
def two_settings() -> Any:
    labels = ((f"GA · ga.size={a} · num_elites={b}", each) for (a, b), each in COSTS.items())
    return sweep_of(fake(list(labels)))


def test_settings_and_levels_are_those_of_the_labels(two_settings: Any) -> None:
    assert two_settings.settings == ("ga.size", "num_elites") and two_settings.bases == ("GA",)
    assert [two_settings.levels(k) for k in (0, 1)] == [("20", "100"), ("0", "2")]


@pytest.mark.parametrize(
    "labels",
    [
        ["a", "b"],
        ["GA · x=1"],
        ["GA · x=1", "GA"],
        ["GA · x=1", "GA · y=2"],
        ["GA · x=1", "RS · x=1"],
        ["λ = 10", "λ = 20"],
        ["GA · x=1", "GA · x=1"],
    ],
)
def test_other_labels_are_no_sweep(labels: list[str]) -> None:
    assert sweep_of(fake([(label, [1.0]) for label in labels])) is None


def test_no_shipped_experiment_is_taken_for_a_sweep() -> None:
    costs = defaultdict[str, list[tuple[str, list[float]]]](list)
    for row in shipped():
        if row.budget == "smoke":
            costs[row.experiment].append((row.label, [1.0]))
    assert len(costs) > 50
    assert [name for name, own in costs.items() if sweep_of(fake(own)) is not None] == []


def test_effects_are_medians_of_pairs(two_settings: Any) -> None:
    effects = main_effects(two_settings, cost, 0.95, 500)
    found = {(e.setting, e.other): e for e in effects.itertuples()}
    assert set(found) == {("ga.size", "100"), ("num_elites", "2")}
    by_hand = []
    for elites, seed in itertools.product("02", range(3)):
        one, other = COSTS["20", elites][seed], COSTS["100", elites][seed]
        by_hand.append(0.0 if one == other else other - one)
    size = found["ga.size", "100"]
    assert (size.pairs, size.difference) == (6, np.median(by_hand))
    assert size.better == pytest.approx(np.mean([(d < 0) + 0.5 * (d == 0) for d in by_hand]))
    assert size.low <= size.difference <= size.high


def test_only_common_seeds_are_paired() -> None:
    sweep = sweep_of(fake([("x=1", [1.0, 2.0]), ("x=2", [5.0, 5.0])], first=1))
    (effect,) = main_effects(sweep, cost, 0.95, 50).itertuples()
    assert (effect.pairs, effect.difference, effect.better) == (1, 3.0, 0.0)


def test_grids_hold_every_combination(two_settings: Any) -> None:
    table = convergence.grid_table(two_settings, cost)
    cells = {(row.y, row.x): row.median for row in table.itertuples()}
    assert cells == {values: np.median(costs) for values, costs in COSTS.items()}
    figure = style.drawn(lambda: convergence.draw_grid(table, "cost"), ("svg",), 60)["svg"]
    assert all(f">{value:.4g}<".encode() in figure for value in cells.values() if value < 100.0)


def test_a_setting_that_is_the_same_everywhere_is_no_axis() -> None:
    sweep = sweep_of(fake([(f"GA · x={x} · planner=ompl", [1.0]) for x in "12"]))
    assert (sweep.settings, sweep.bases, sweep.levels(0)) == (("x",), ("GA",), ("1", "2"))


def test_three_settings_have_a_panel_for_each_value_of_the_first() -> None:
    labels = [f"mode={m} · x={x} · y={y}" for m, x, y in itertools.product("ab", "12", "34")]
    sweep = sweep_of(fake([(label, [1.0, 2.0]) for label in labels]))
    table = convergence.grid_table(sweep, cost)
    assert list(dict.fromkeys(table["panel"])) == ["mode = a", "mode = b"]
    assert (table["x_setting"] == "y").all() and (table["y_setting"] == "x").all()


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Results:
    words = "experiment=rana_planar", *SMALL, "ga.num_elites=0,2"
    experiment = compose.expand(list(words), multirun=True)[0]
    outputs, planned = tmp_path_factory.mktemp("outputs"), experiment.num_replicates
    store(outputs, experiment)
    return gather(outputs, experiment.conditions, planned, "rana_planar", "smoke", "")


def test_convergence_has_a_panel_for_each_value_of_the_first_setting(
    swept: Results, two_settings: Any
) -> None:
    names = {labelled(two_settings, each.values[:-1]) for each in two_settings.conditions}
    assert names == {"ga.size = 20", "ga.size = 100"}
    table = convergence.facets_table(swept, sweep_of(swept))
    assert set(table["facet"]) == {""} and set(table["setting"]) == {"num_elites"}
    assert {(row.value, row.level) for row in table.itertuples()} == {("0", 0), ("2", 1)}


def test_all_its_figures_are_drawn(swept: Results) -> None:
    page = page_of(swept, page_settings("", "rana"))
    assert page.title == "rana_planar: a sweep" and page.claims == ()
    stems = [drawing.stem for drawing in page.drawings]
    assert stems[:4] == ["grid_cost", "grid_cpu", "main_effects", "convergence"]
    assert len(stems) == len(set(stems)) < 10  # figures of scene and motion once
    assert all(can_be_drawn(drawing.table(), drawing.draw) for drawing in page.drawings[:4])
    combinations, effects = page.tables
    assert (len(combinations.rows), len(effects.rows)) == (6, 3)
    assert combinations.headers[:3] == ("condition", "num_elites", "hash")


def test_the_command_draws_it(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    blank_figures: None,
) -> None:
    monkeypatch.setenv("EVOEXP_OUTPUTS", str(tmp_path))
    words = "experiment=rana_planar", *SMALL[1:3], "budget=smoke", "ga.num_elites=0,2"
    assert main(["run", "-m", *words, "--only", "via-point GA"]) == 0
    (index,) = tmp_path.glob("reports/*/index.md")
    text = index.read_text()
    assert "## Effect of each setting" in text and "](motion_" in text
    assert not capsys.readouterr().err
