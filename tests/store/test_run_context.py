"""Tables of many runs are one table: every row says which run it is of."""

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from evoexp import load
from evoexp.batch.replicate import run_replicate
from evoexp.configuration import compose
from evoexp.shipped import shipped
from evoexp.store.manifest import manifest
from evoexp.store.run_context import origin, run_context
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import summary_table

SWEEP = ["ga.population_size=8,10", "ga.num_generations=2", "planner.num_new_trajectories=1"]


def stored(outputs: Path) -> list[RunDirectory]:
    words = ["experiment=rana_planar", "budget=smoke", *SWEEP]
    found = []
    for experiment in compose.expand(words, multirun=True, only=["via-point GA"]):
        for label, condition in experiment.conditions:
            run = RunDirectory(outputs, condition.id)
            notes = {"experiment": experiment.name, "label": label}
            run.create(condition.to_json(), manifest(condition.id) | notes)
            run.write_logs({k: run_replicate(condition, k).content for k in range(2)})
            found.append(run)
    return found


def test_all_tables_together_are_grouped_by_a_setting(tmp_path: Path) -> None:
    runs = stored(tmp_path)
    plain = [summary_table(run) for run in runs]
    tables = [pq.read_table(path) for path in sorted(tmp_path.glob("runs/*/summary.parquet"))]
    whole = pa.concat_tables(tables, promote_options="default")
    sizes = whole["population_size"].to_pylist()
    assert sorted(sizes) == [8.0, 8.0, 10.0, 10.0]
    costs = np.array(whole["best_cost"].to_pylist())
    by_size = {size: costs[np.array(sizes) == size].min() for size in (8.0, 10.0)}
    assert len(by_size) == 2 and set(whole["experiment"].to_pylist()) == {"rana_planar"}
    assert set(whole["seed"].to_pylist()) == {json.loads(runs[0].config_json())["seed"]}
    for run, table in zip(runs, plain, strict=True):  # readers have the columns of summaries alone
        assert "population_size" not in table.column_names
        assert summary_table(run).equals(table)


def test_the_python_door_tells_conditions_apart(tmp_path: Path) -> None:
    runs = stored(tmp_path)
    found = load("rana_planar", *SWEEP, budget="smoke", multirun=True, outputs=tmp_path).summaries
    assert {"seed", "population_size"} <= set(found.columns)
    assert "crossover_distance" not in found.columns  # the same in all
    sizes = found.groupby("condition")["population_size"].first()
    for run in runs:
        own = json.loads(run.config_json())["planner"]["ga"]["population_size"]
        assert sizes[run.condition_id] == own


def test_names_are_short_where_nothing_else_has_them(tmp_path: Path) -> None:
    config = {
        "planner": {"_target_": "a", "revision": 3, "size": 1, "inner": {"size": 2.5, "on": True}},
        "scenario": {"best_cost": 1, "points": [[0, 1]], "objects": [{"x": 1}], "bad name": 1},
        "seed": 7,
    }
    (tmp_path / "config.json").write_text(json.dumps(config))
    (tmp_path / "manifest.json").write_text(json.dumps({"experiment": "e", "label": "l"}))
    assert run_context(tmp_path, "0" * 64, ["best_cost"]) == {
        "experiment": "e",
        "label": "l",
        "planner": "a",
        "planner.size": 1,
        "planner.inner.size": 2.5,
        "on": True,
        "scenario.best_cost": 1,
        "points": "[[0, 1]]",
        "seed": 7,
    }
    (tmp_path / "config.json").write_text("[" * 100_000)
    assert run_context(tmp_path, "0" * 64, []) == {"experiment": "e", "label": "l"}


def test_the_origin_of_a_run_follows_from_its_condition() -> None:
    def known(manifest: dict[str, str], condition_id: str) -> tuple[object, ...]:
        return tuple(origin(manifest, condition_id).values())

    (row,) = (
        row for row in shipped() if row[:3] == ("rana_planar_ablations", "as printed", "paper")
    )
    others = {each.experiment for each in shipped() if each.condition_id == row.condition_id}
    assert "rana_planar" in others
    mine = {"experiment": "rana_planar_ablations", "label": "via-point GA", "budget": "quick"}
    assert known(mine, row.condition_id) == (*row[:3], False)
    assert known({"experiment": "e", "budget": "smoke"}, row.condition_id)[2:] == ("paper", False)
    # a label that was made for it, in an experiment that has no such condition
    named = {"experiment": "lavoie", "label": "cma_es", "budget": "smoke"}
    assert known(named, row.condition_id) == ("lavoie", "cma_es", "paper", True)
    assert known(named, "0" * 64) == ("lavoie", "cma_es", "smoke", True)
    assert known({}, "0" * 64) == (None, None, None, False)
