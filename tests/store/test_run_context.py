"""Manifests of runs, and tables of many runs: every row says which run it is of."""

import json
import subprocess
from importlib import metadata
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import evoexp
from evoexp import load
from evoexp.batch.replicate import run_replicate
from evoexp.configuration import compose
from evoexp.shipped import shipped
from evoexp.store import manifest as module
from evoexp.store.manifest import git_state, manifest
from evoexp.store.run_context import origin, run_context
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import summary_table

SWEEP = ["ga.population_size=8,10", "ga.num_generations=2", "planner.num_new_trajectories=1"]


def test_all_tables_together_are_grouped_by_a_setting(tmp_path: Path) -> None:
    words, runs, plain = ["experiment=rana_planar", "budget=smoke", *SWEEP], [], []
    for experiment in compose.expand(words, multirun=True, only=["via-point GA"]):
        for label, condition in experiment.conditions:
            run = RunDirectory(tmp_path, condition.id)
            notes = {"experiment": experiment.name, "label": label}
            run.create(condition.to_json(), manifest(condition.id) | notes)
            run.write_logs({k: run_replicate(condition, k).content for k in range(2)})
            runs.append(run)
            plain.append(summary_table(run))
    tables = [pq.read_table(path) for path in sorted(tmp_path.glob("runs/*/summary.parquet"))]
    whole = pa.concat_tables(tables, promote_options="default")
    assert sorted(whole["population_size"].to_pylist()) == [8.0, 8.0, 10.0, 10.0]
    assert set(whole["experiment"].to_pylist()) == {"rana_planar"}
    assert set(whole["seed"].to_pylist()) == {json.loads(runs[0].config_json())["seed"]}
    for run, table in zip(runs, plain, strict=True):  # readers have the columns of summaries alone
        assert "population_size" not in table.column_names
        assert summary_table(run).equals(table)
    door = load("rana_planar", *SWEEP, budget="smoke", multirun=True, outputs=tmp_path).summaries
    assert {"seed", "population_size"} <= set(door.columns)
    assert "crossover_distance" not in door.columns  # the same in all
    sizes = door.groupby("condition")["population_size"].first()
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
    name = ("rana_planar_ablations", "as printed", "paper")
    (row,) = (row for row in shipped() if row[:3] == name)
    shared = {each.experiment for each in shipped() if each.condition_id == row.condition_id}
    assert "rana_planar" in shared
    mine = {"experiment": "rana_planar_ablations", "label": "via-point GA", "budget": "quick"}
    # a label that was made for it, in an experiment that has no such condition
    named = {"experiment": "lavoie", "label": "cma_es", "budget": "smoke"}
    for noted, condition_id, expected in (
        (mine, row.condition_id, (*name, False)),
        (named, row.condition_id, ("lavoie", "cma_es", "paper", True)),
        (named, "0" * 64, ("lavoie", "cma_es", "smoke", True)),
        ({}, "0" * 64, (None, None, None, False)),
    ):
        assert tuple(origin(noted, condition_id).values()) == expected
    unlabelled = origin({"experiment": "e", "budget": "smoke"}, row.condition_id)
    assert tuple(unlabelled.values())[2:] == ("paper", False)


# Manifests


def test_manifest_names_versions_and_processor_and_no_paths() -> None:
    made = manifest("a" * 64)
    assert made["condition"] == "a" * 64
    assert made["versions"]["numpy"] == metadata.version("numpy")
    assert set(made["cpu"]) == {"name", "features"} and isinstance(made["cpu"]["features"], list)
    text = json.dumps(made)
    assert json.loads(text) == made
    assert str(Path.home()) not in text
    assert str(Path(evoexp.__file__).parent) not in text


def test_git_state_of_a_checkout(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = tmp_path / "src" / "evoexp" / "store" / "manifest.py"
    monkeypatch.setattr(module, "__file__", str(path))
    assert git_state.__wrapped__() is None, "an installed package has none"
    path.parent.mkdir(parents=True)
    path.write_text("")
    (tmp_path / "pyproject.toml").write_text("")
    git = ["git", "-C", str(tmp_path), "-c", "user.name=x", "-c", "user.email=x@x"]
    subprocess.run([*git, "init", "-q"], check=True)
    assert git_state.__wrapped__() == {"commit": None, "dirty": True}
    subprocess.run([*git, "add", "."], check=True)
    subprocess.run([*git, "commit", "-q", "-m", "x"], check=True)
    clean = git_state.__wrapped__()
    assert clean is not None and len(clean["commit"]) == 40 and clean["dirty"] is False
    path.write_text("x = 1\n")
    assert git_state.__wrapped__() == {"commit": clean["commit"], "dirty": True}

    def absent(*_: object, **__: object) -> None:
        raise FileNotFoundError("git")

    monkeypatch.setattr(subprocess, "run", absent)
    assert git_state.__wrapped__() == {"commit": None, "dirty": None}
