"""`evoexp plan`: what a run would start, without starting it."""

import json
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from command_samples import SERIAL, Evoexp, content

from evoexp.commands import plan
from evoexp.commands.plan import OTHER_SETTINGS, Times, bounds
from evoexp.store.run_directory import RunDirectory
from store_lookup import find_runs

PLANAR = ("experiment=rana_planar", *SERIAL)


def test_counts_of_a_stored_experiment(evoexp: Evoexp, stored: Path) -> None:
    first, second, *_ = find_runs(stored)
    first.log_path(1).write_bytes(b"cut")
    second.log_path(0).unlink()
    second.write_failure(0, "MemoryError", "Traceback")
    before = content(stored)
    said = evoexp("plan", *PLANAR, "--json")
    assert said.code == 0
    rows = {row["hash"]: row for row in json.loads(said.out)}
    cut, failed = rows[first.condition_id], rows[second.condition_id]
    assert (cut["planned"], cut["cached"], cut["missing"], cut["damaged"]) == (2, 1, 1, 1)
    assert (failed["cached"], failed["missing"], failed["failed"]) == (1, 0, 1)
    said = evoexp("plan", *PLANAR).out
    assert "1 replicate to run; " in said and "; 1 failed before, which start with --retry" in said
    assert cut["cpu_s_each"] > 0.0 and cut["cpu_s_from"] == "1 of its own"
    after = {path: data for path, data in content(stored).items() if path.suffix != ".parquet"}
    assert after == {path: data for path, data in before.items() if path.suffix != ".parquet"}


def test_times_come_from_other_runs_of_the_scene(evoexp: Evoexp, stored: Path) -> None:
    longer = [word.replace("num_generations=2", "num_generations=8") for word in PLANAR]
    said = evoexp("plan", *longer, "--json")
    rows = json.loads(said.out)
    assert all("1 other runs of the scene" in row["cpu_s_from"] for row in rows)
    assert all(row["cpu_s_least"] < row["cpu_s_each"] < row["cpu_s_most"] for row in rows)
    assert " to " in evoexp("plan", *longer).out
    known = json.loads(evoexp("plan", *PLANAR, "--json").out)
    for row, own in zip(rows, known, strict=True):
        assert row["cached"] == 0 and row["cpu_s_each"] > own["cpu_s_each"] > 0.0


def test_every_stored_run_is_read_once_for_any_number_of_conditions(
    evoexp: Evoexp, stored: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[str] = []
    table = plan.summary_table

    def counted(run: RunDirectory) -> Any:
        read.append(run.hash12)
        return table(run)

    monkeypatch.setattr(plan, "summary_table", counted)
    said = evoexp("plan", "-m", *PLANAR, "seed=range(1,9)", "--json")
    assert len(json.loads(said.out)) == 24
    assert sorted(read) == sorted(run.hash12 for run in find_runs(stored))


@pytest.mark.parametrize(
    ("stored", "wanted", "least", "most"),
    [
        ([(1.0, 100)], 100, 1.0, 1.0),
        ([(1.0, 100)], 1000, 1.0, 10.0),  # a part of the time is the same for any number
        ([(1.0, 100)], 10, 0.1, 1.0),
        ([(1.0, 100), (5.0, 1000)], 1000, 5.0, 5.0),  # the nearest number of evaluations
        ([(1.0, 100), (5.0, 1000)], 2000, 5.0, 10.0),
    ],
)
def test_a_guess_is_a_range(
    stored: list[tuple[float, int]], wanted: int, least: float, most: float
) -> None:
    times = [Times([seconds], [count], False) for seconds, count in stored]
    found = bounds(times, wanted)
    assert found == pytest.approx((least / OTHER_SETTINGS, most * OTHER_SETTINGS))
    early = [each._replace(stopped_early=True) for each in times]
    assert bounds(early, wanted)[0] <= found[0] and bounds(early, wanted)[1] == found[1]


def test_nothing_is_known_where_nothing_is_stored(evoexp: Evoexp, outputs: Path) -> None:
    said = evoexp("plan", *PLANAR)
    assert said.code == 0 and not outputs.exists()
    assert "6 replicates to run; of unknown length; at most " in said.out


def test_runs_of_other_revisions_are_named(evoexp: Evoexp, stored: Path) -> None:
    run = find_runs(stored)[0]
    text = (run.path / "config.json").read_bytes().replace(b'"revision":1', b'"revision":0')
    name = sha256(text).hexdigest()[:12]
    (stored / "runs" / name).mkdir()
    (stored / "runs" / name / "config.json").write_bytes(text)
    rows = {row["hash"]: row for row in json.loads(evoexp("plan", *PLANAR, "--json").out)}
    assert rows[run.condition_id]["other_revision"] == [name]
    assert sum(len(row["other_revision"]) for row in rows.values()) == 1
    found = json.loads(evoexp("clean", "old_revision", "--json").out)
    assert [Path(each["path"]).name for each in found] == [name]


def test_a_typo_is_refused(evoexp: Evoexp) -> None:
    said = evoexp("plan", "experiment=rana_planr")
    assert said.code == 2 and "did you mean 'rana_planar'" in said.err
