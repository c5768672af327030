"""Run directories: whole files or none, one writer, and hashes that find their run.

Their manifests, and tables of many runs: every row says which run it is of.
"""

import hashlib
import json
import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from store_samples import CONDITION, CONFIG

import evoexp
from evoexp import load
from evoexp.batch.replicate import run_replicate
from evoexp.configuration import compose
from evoexp.errors import AmbiguousHash, Busy, StoreError, UnknownHash
from evoexp.shipped import shipped
from evoexp.store import identity as module
from evoexp.store.files import NUM_THREADS
from evoexp.store.identity import git_state, manifest, origin, run_context
from evoexp.store.log import Finished
from evoexp.store.run_directory import RunDirectory, lock_all, resolve
from evoexp.store.summaries import summary_table
from store_lookup import find_runs

HOLD = """
    import sys, time
    from pathlib import Path
    from evoexp.store.run_directory import RunDirectory
    run = RunDirectory(Path(sys.argv[1]), sys.argv[2])
    with run.lock():
        print("held", flush=True)
        time.sleep(1000)
"""


@contextmanager
def holder(*arguments: str | Path) -> Iterator[subprocess.Popen[str]]:
    """Have another process hold the lock of a run."""
    command = [sys.executable, "-c", textwrap.dedent(HOLD), *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "held\n"
        try:
            yield process
        finally:
            process.send_signal(signal.SIGKILL)


def create(outputs: Path, config: bytes) -> RunDirectory:
    run = RunDirectory(outputs, hashlib.sha256(config).hexdigest())
    run.create(config, {})
    return run


def test_create_keeps_what_is_there(run: RunDirectory) -> None:
    run.create(CONFIG, {"condition": "later"})
    assert run.manifest() == {"condition": CONDITION}
    assert run.config_json() == CONFIG
    assert sorted(os.listdir(run.path)) == ["config.json", "manifest.json", "replicates"]


def test_completion_is_the_file_itself(run: RunDirectory, add: Callable[..., Finished]) -> None:
    assert run.completed() == run.failed() == set()
    run.write_failure(3, "no path", "Traceback …\n")
    run.write_failure(12345, "no path", "")
    assert run.failed() == {3, 12345}
    assert run.failure(3)["reason"] == "no path" and run.failure(3)["traceback"] == "Traceback …\n"
    content = add(3).content
    assert (run.completed(), run.failed()) == ({3}, {12345})
    assert not run.failure_path(3).exists()
    assert (run.replicates / "0003.mcap").read_bytes() == content
    (run.replicates / ".0004.mcap.1.tmp").write_bytes(b"half")
    run.write_logs({5: content, 12345: content})
    assert (run.completed(), run.failed()) == ({3, 5, 12345}, set())


@pytest.mark.parametrize("count", [1, 2, NUM_THREADS, 3 * NUM_THREADS])
def test_nothing_gets_its_name_before_its_bytes_are_on_the_disk(
    run: RunDirectory, monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    """A machine that loses its power keeps what was synced: every file before the first name."""
    events: list[tuple[str, str]] = []
    fsync, replace = os.fsync, os.replace

    def note_fsync(descriptor: int) -> None:
        events.append(("sync", os.readlink(f"/proc/self/fd/{descriptor}")))
        fsync(descriptor)

    def note_replace(source: Path, target: Path) -> None:
        events.append(("rename", str(source)))
        replace(source, target)

    monkeypatch.setattr(os, "fsync", note_fsync)
    monkeypatch.setattr(os, "replace", note_replace)
    run.write_logs({k: bytes([k]) * 1000 for k in range(count)})
    assert [kind for kind, _ in events] == ["sync"] * count + ["rename"] * count + ["sync"]
    synced, renamed = (
        sorted(path for _, path in part) for part in (events[:count], events[count:-1])
    )
    assert synced == renamed and len(set(synced)) == count, "each file itself"
    assert events[-1] == ("sync", str(run.replicates)), "then their names"
    assert all(run.log_path(k).read_bytes() == bytes([k]) * 1000 for k in range(count))


def test_the_lock_dies_with_its_process(run: RunDirectory, tmp_path: Path) -> None:
    with holder(tmp_path, CONDITION):
        with pytest.raises(Busy, match=f"run {CONDITION[:12]}"), run.lock():
            pass
    with run.lock(), run.lock():
        with pytest.raises(Busy), RunDirectory(tmp_path, CONDITION).lock():
            pass
    with RunDirectory(tmp_path, CONDITION).lock():
        pass


def test_lock_all_releases_what_it_took(tmp_path: Path) -> None:
    runs = [create(tmp_path, bytes([65 + k])) for k in range(4)]
    runs.sort(key=lambda run: run.condition_id)
    with holder(tmp_path, runs[2].condition_id):
        with pytest.raises(Busy, match=runs[2].hash12), lock_all(reversed(runs)):
            pass
        for run in (runs[0], runs[1], runs[3]):
            with RunDirectory(tmp_path, run.condition_id).lock():
                pass
    with lock_all([*runs, RunDirectory(tmp_path, runs[0].condition_id)]):
        with pytest.raises(Busy), RunDirectory(tmp_path, runs[3].condition_id).lock():
            pass


def test_another_condition_with_the_same_twelve_digits(run: RunDirectory, tmp_path: Path) -> None:
    other = RunDirectory(tmp_path, CONDITION[:12] + "0" * 52)
    with pytest.raises(StoreError, match=f"{CONDITION}, which shares"):
        other.check()
    with pytest.raises(UnknownHash):
        resolve(tmp_path, CONDITION[:12] + ("0" if CONDITION[12] != "0" else "1"))


def test_prefixes(tmp_path: Path) -> None:
    runs = [create(tmp_path, str(number).encode()) for number in range(20)]
    (tmp_path / "runs" / ("0" * 12)).mkdir()  # killed before it had a configuration
    (tmp_path / "runs" / "notes").mkdir()
    ids = sorted(run.condition_id for run in runs)
    assert [run.condition_id for run in find_runs(tmp_path)] == ids
    for condition_id in ids:
        for length in (12, 13, 64):
            prefix = condition_id[:length].upper()
            assert resolve(tmp_path, prefix).condition_id == condition_id
    digits = [condition_id[0] for condition_id in ids]
    shared = next(digit for digit in digits if digits.count(digit) > 1)
    alone = next(digit for digit in digits if digits.count(digit) == 1)
    assert resolve(tmp_path, alone).condition_id[0] == alone
    with pytest.raises(AmbiguousHash) as caught:
        resolve(tmp_path, shared)
    assert caught.value.candidates == [each[:12] for each in ids if each[0] == shared]


def test_unknown_prefixes_say_what_there_is(tmp_path: Path) -> None:
    with pytest.raises(UnknownHash, match="no run 'abc' among the 0"):
        resolve(tmp_path, "abc")
    run = create(tmp_path, b"one")
    wrong = run.hash12[:-1] + ("0" if run.hash12[-1] != "0" else "1")
    with pytest.raises(UnknownHash, match=f"among the 1 .* did you mean '{run.hash12}'"):
        resolve(tmp_path, wrong)
    for text in ("", "xyz", "abc ", "../..", "0" * 65):
        with pytest.raises(UnknownHash, match="hexadecimal"):
            resolve(tmp_path, text)


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
    path = tmp_path / "src" / "evoexp" / "store" / "identity.py"
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
