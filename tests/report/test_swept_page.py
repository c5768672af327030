"""The page of a sweep: what a sweep is, effects against pairs by hand, figures of every kind."""

import itertools
import math
from collections import defaultdict
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from evoexp.cli import main
from evoexp.configuration import compose
from evoexp.report.figures import convergence, style
from evoexp.report.pages.page_builder import page_of
from evoexp.report.pages.swept import labelled, main_effects, sweep_of
from evoexp.report.results.stored_results import Results, gather
from evoexp.shipped import shipped
from report_samples import SMALL, can_be_drawn, page_settings, store

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
