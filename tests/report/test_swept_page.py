"""The page of a sweep: what a sweep is, effects against pairs by hand, figures of every kind."""

import itertools
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evoexp.cli import main
from evoexp.configuration import compose
from evoexp.report.figures import end_labels, style, sweeps
from evoexp.report.figures.end_labels import CurveEnd, name_ends
from evoexp.report.report_settings import ReportSettings
from evoexp.report.results.stored_results import Results, gather
from evoexp.report.results.swept_settings import main_effects, sweep_of
from evoexp.shipped import shipped
from report_samples import REPORT, SMALL, store

SETTINGS = ReportSettings(**REPORT, figures="rana")  # type: ignore[arg-type]
COSTS = {  # (population, elites) → best costs of seeds 0, 1, 2
    ("20", "0"): [10.0, 12.0, math.inf],
    ("20", "2"): [9.0, 12.0, math.inf],
    ("100", "0"): [7.0, 11.0, 5.0],
    ("100", "2"): [8.0, 6.0, math.inf],
}


def condition(label: str, costs: list[float], first: int = 0) -> Any:
    index = pd.RangeIndex(first, first + len(costs))
    return SimpleNamespace(
        label=label,
        is_reference=False,
        done=len(costs),
        summaries=pd.DataFrame({"best_cost": costs}, index=index),
        column=lambda name: np.array(costs),
    )


def fake(*conditions: Any) -> Any:
    return SimpleNamespace(conditions=conditions)


def two_settings() -> Any:
    labels = {values: f"GA · ga.size={values[0]} · num_elites={values[1]}" for values in COSTS}
    return fake(*(condition(labels[values], costs) for values, costs in COSTS.items()))


def test_settings_and_levels_are_those_of_the_labels() -> None:
    sweep = sweep_of(two_settings())
    assert sweep is not None
    assert sweep.settings == ("ga.size", "num_elites") and sweep.bases == ("GA",)
    assert sweep.levels(0) == ("20", "100") and sweep.levels(1) == ("0", "2")


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
    assert sweep_of(fake(*(condition(label, [1.0]) for label in labels))) is None


def test_no_shipped_experiment_is_taken_for_a_sweep() -> None:
    labels = dict[str, list[str]]()
    for row in shipped():
        if row.budget == "smoke":
            labels.setdefault(row.experiment, []).append(row.label)
    assert len(labels) > 50
    for name, own in labels.items():
        assert sweep_of(fake(*(condition(label, [1.0]) for label in own))) is None, name


def test_effects_are_medians_of_pairs() -> None:
    sweep = sweep_of(two_settings())
    assert sweep is not None
    cost = lambda c: c.column("best_cost")  # noqa: E731
    found = {(e.setting, e.other): e for e in main_effects(sweep, cost, 0.95, 500)}
    assert set(found) == {("ga.size", "100"), ("num_elites", "2")}
    by_hand = []
    for elites, seed in itertools.product("02", range(3)):
        one, other = COSTS["20", elites][seed], COSTS["100", elites][seed]
        by_hand.append(0.0 if one == other else other - one)
    size = found["ga.size", "100"]
    assert size.num_pairs == 6
    assert size.difference == np.median(by_hand)
    assert size.better == pytest.approx(np.mean([(d < 0) + 0.5 * (d == 0) for d in by_hand]))
    assert size.interval.low <= size.difference <= size.interval.high


def test_only_common_seeds_are_paired() -> None:
    sweep = sweep_of(fake(condition("x=1", [1.0, 2.0]), condition("x=2", [5.0, 5.0], first=1)))
    assert sweep is not None
    (effect,) = main_effects(sweep, lambda c: c.column("best_cost"), 0.95, 50)
    assert (effect.num_pairs, effect.difference, effect.better) == (1, 3.0, 0.0)


def test_grids_hold_every_combination() -> None:
    sweep = sweep_of(two_settings())
    assert sweep is not None
    table = sweeps.grid_table(sweep, lambda c: c.column("best_cost"))
    cells = {(row.y, row.x): row.median for row in table.itertuples()}
    assert cells == {values: np.median(costs) for values, costs in COSTS.items()}
    figure = style.drawn(lambda: sweeps.draw_grid(table, "cost"), ("svg",), 60)["svg"]
    assert all(f">{value:.4g}<".encode() in figure for value in cells.values() if value < 100.0)


def test_three_settings_have_a_panel_for_each_value_of_the_first() -> None:
    combinations = itertools.product("ab", "12", "34")
    labels = [f"mode={m} · x={x} · y={y}" for m, x, y in combinations]
    sweep = sweep_of(fake(*(condition(each, [1.0, 2.0]) for each in labels)))
    assert sweep is not None
    table = sweeps.grid_table(sweep, lambda c: c.column("best_cost"))
    assert list(dict.fromkeys(table["panel"])) == ["mode = a", "mode = b"]
    assert (table["x_setting"] == "y").all() and (table["y_setting"] == "x").all()


def test_names_at_the_ends_of_curves_keep_apart() -> None:
    figure, (axes,) = style.panels(3.0)
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    heights = [0.5] * 5 + [0.99, np.nan]
    name_ends(axes, [CurveEnd(0.5, y, str(k), "#000000") for k, y in enumerate(heights)])
    places = sorted(text.xyann[1] for text in axes.texts)  # type: ignore[attr-defined]
    assert len(places) == 6 and np.diff(places).min() >= end_labels.APART - 1e-9
    assert places[0] >= 0.0 and places[-1] <= 1.0
    assert np.mean(places[:5]) == pytest.approx(0.5)  # around their curves
    assert {text.xy for text in axes.texts} == {(0.5, 0.5), (0.5, 0.99)}  # type: ignore[attr-defined]
    assert figure.axes == [axes]


@given(st.lists(st.floats(0.0, 1.0), max_size=40), st.floats(0.01, 0.2))
def test_places_of_names_are_apart_in_order_and_inside(wanted: list[float], gap: float) -> None:
    found = end_labels.apart(np.sort(np.array(wanted)), gap)
    least = min(gap, 1.0 / max(len(wanted) - 1, 1))
    assert len(found) == len(wanted)
    assert (np.diff(found) >= least - 1e-9).all()
    assert ((found >= -1e-9) & (found <= 1.0 + 1e-9)).all()


def test_convergence_has_a_panel_for_each_value_of_the_first_setting(swept: Results) -> None:
    sweep = sweep_of(two_settings())
    assert sweep is not None
    assert sweeps.facets(sweep) == [("GA", "ga.size = 20"), ("GA", "ga.size = 100")]
    own = sweep_of(swept)
    assert own is not None
    table = sweeps.convergence_table(swept, own)
    assert set(table["facet"]) == {""} and set(table["setting"]) == {"num_elites"}
    assert {(row.value, row.level) for row in table.itertuples()} == {("0", 0), ("2", 1)}


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Results:
    words = "experiment=rana_planar", *SMALL, "ga.num_elites=0,2"
    experiment = compose.expand(list(words), multirun=True)[0]
    outputs = tmp_path_factory.mktemp("outputs")
    store(outputs, experiment)
    planned = experiment.num_replicates
    return gather(outputs, experiment.conditions, planned, "rana_planar", "smoke", "")


@pytest.mark.parametrize("width", ["page", "column"])
def test_all_its_figures_are_drawn(swept: Results, width: Any) -> None:
    from evoexp.report.pages.page_builder import page_of

    page = page_of(swept, SETTINGS)
    assert page.title == "rana_planar: a sweep" and page.claims == ()
    stems = [drawing.stem for drawing in page.drawings]
    assert stems[:4] == ["grid_cost", "grid_cpu", "main_effects", "convergence"]
    assert len(stems) == len(set(stems)) < 10  # figures of scene and motion once
    for drawing in page.drawings[:4]:
        table = drawing.table()
        look = style.Look(width)
        images = style.drawn(lambda d=drawing, t=table: d.draw(t), ("png",), 60, look)  # type: ignore[misc]
        assert len(images["png"]) > 2000
    (combinations, effects) = page.tables
    assert len(combinations.rows) == 6 and len(effects.rows) == 3
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
    (folder,) = (tmp_path / "reports").iterdir()
    text = (folder / "index.md").read_text()
    assert "## Effect of each setting" in text and "](motion_" in text
    assert not capsys.readouterr().err
