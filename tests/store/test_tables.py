"""Tables: rebuilt from logs alone they are the same, and no row is read twice."""

import math
import os
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from store_samples import CONDITION, generations, write

from evoexp.errors import DamagedStore
from evoexp.records import ReplicateSummary
from evoexp.store import summaries
from evoexp.store.log import Finished
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import read_generations, read_summaries, whole_logs, write_summary

Add = Callable[..., Finished]
CONTEXT = ["planner", "seed"]  # of the sample's configuration


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the replicates whose summary or generations were read since."""
    replicates: list[int] = []

    def noted(module: object, name: str) -> None:
        read = getattr(module, name)
        note = lambda path, *own: replicates.append(int(path.stem)) or read(path, *own)  # noqa: E731
        monkeypatch.setattr(module, name, note)

    noted(summaries, "read_summary")
    noted(summaries, "generation_columns")
    return replicates


def rows(table: pa.Table) -> list[str]:
    return [repr(row) for row in table.to_pylist()]


def test_done_and_failed_rows(run: RunDirectory, add: Add) -> None:
    add(1, best_cost=math.nan, first_feasible_generation=4, solved=True)
    add(0, terms={"length": -math.inf})
    run.write_failure(2, "ValueError: no", "Traceback …")
    write_summary(run)
    table = pq.read_table(run.summary_path)
    fields = [name for name in ReplicateSummary._fields if name != "terms"]
    terms = ["term_clearance", "term_length", "term_torque"]
    assert table.column_names == [*fields, *terms, *CONTEXT]
    first, second, failed = table.to_pylist()
    some = {"replicate": 0, "status": "done", "best_cost": math.inf, "term_torque": None}
    assert some.items() <= first.items()
    assert (first["term_length"], first["first_feasible_generation"]) == (-math.inf, None)
    assert math.isnan(second["best_cost"]) and math.isnan(second["term_torque"])
    assert second["solved"] is True
    plain = {k: v for k, v in failed.items() if v is not None and k not in CONTEXT}
    row = {"condition": CONDITION, "replicate": 2, "status": "failed"}
    assert plain == {**row, "stop_reason": "ValueError: no"}
    kinds = {field.name: str(field.type) for field in table.schema}
    assert kinds["best_cost"] == kinds["term_torque"] == "double"
    assert kinds["evaluations"] == kinds["first_feasible_generation"] == "int64"
    assert (kinds["solved"], kinds["digest"]) == ("bool", "string")
    assert pq.ParquetFile(run.summary_path).metadata.row_group(0).column(0).compression == "SNAPPY"
    frame = read_summaries(run)  # where infinite, NaN and missing are three things, too
    assert frame["best_cost"].isna().tolist() == [False, False, True]
    assert frame["best_cost"][0] == math.inf and math.isnan(frame["best_cost"][1])
    assert frame["best_cost"].to_numpy().dtype == np.float64
    assert frame["solved"].tolist()[:2] == [False, True] and frame["solved"][2] is pd.NA
    assert frame["status"].tolist() == ["done", "done", "failed"]


def test_a_damaged_log_alone_is_read_again(run: RunDirectory, add: Add, reads: list[int]) -> None:
    for replicate in (0, 1, 2):
        add(replicate)
    write_summary(run)
    write_summary(run)
    assert reads == [0, 1, 2]
    run.log_path(2).write_bytes(b"")
    with pytest.warns(DamagedStore):
        read_summaries(run)
    reads.clear()
    assert whole_logs(run) == {0, 1}
    assert set(reads) == {2}, "the damaged one alone: it may have been repaired"
    add(2)
    assert whole_logs(run) == set(range(3))


def test_a_table_of_old_and_new_rows_is_that_of_all(
    run: RunDirectory, add: Add, reads: list[int]
) -> None:
    for k in (0, 2, 3, 7, 8, 11):
        add(k, terms={f"term{k % 3}": float(k)})
    run.write_failure(5, "x", "")
    write_summary(run)
    reads.clear()
    add(4, terms={"other": 1.0})  # between rows that are there
    add(5)  # repaired
    add(3, best_cost=5.0)  # written again
    run.write_failure(1, "y", "")
    written = {
        6: add(6, best_cost=math.nan, solved=True).summary,
        12: add(12, terms={"term0": -math.inf}).summary,
    }
    mixed = write_summary(run, written)
    assert reads == [3, 4, 5], "what was just written is not read again"
    run.summary_path.unlink()
    assert rows(write_summary(run)) == rows(mixed)
    found = {row["replicate"]: row["status"] for row in mixed.to_pylist()}
    assert found == dict.fromkeys([*range(9), 11, 12], "done") | {1: "failed"}


def test_a_table_of_another_version_is_rebuilt(
    run: RunDirectory, add: Add, reads: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    add(0)
    with monkeypatch.context() as patch:
        patch.setattr(summaries, "_VERSION", summaries._VERSION - 1)
        expected = rows(write_summary(run))
    assert rows(write_summary(run)) == expected
    assert reads == [0, 0]


REPLACED = {
    "empty": lambda path: path.write_bytes(b""),
    "a head": lambda path: path.write_bytes(b"PAR1"),
    "rubbish": lambda path: path.write_bytes(b"rubbish" * 100),
    "a directory": lambda path: (path.unlink(), path.mkdir()),
    "a pipe": lambda path: (path.unlink(), os.mkfifo(path)),
    "no table": lambda path: path.unlink(),
    "without a column": lambda path: pq.write_table(
        pq.read_table(path).drop_columns("solved"), path
    ),
}


@pytest.mark.parametrize("damage", REPLACED.values(), ids=REPLACED)
def test_a_damaged_table_is_rebuilt(
    run: RunDirectory, add: Add, reads: list[int], damage: Callable[[Path], object]
) -> None:
    add(0)
    expected = read_summaries(run)
    damage(run.summary_path)
    pd.testing.assert_frame_equal(read_summaries(run), expected)
    assert run.summary_path.is_file() and reads == [0, 0]
    assert (run.path / "summary.parquet.damaged").is_dir() == (damage is REPLACED["a directory"])


def test_any_flipped_byte_of_the_table_changes_no_row(run: RunDirectory, add: Add) -> None:
    add(0)
    expected = read_summaries(run)
    content, rng = run.summary_path.read_bytes(), np.random.default_rng(0)
    for position in rng.integers(len(content), size=60).tolist():
        damaged = bytearray(content)
        damaged[position] ^= 0x40
        run.summary_path.write_bytes(bytes(damaged))
        pd.testing.assert_frame_equal(read_summaries(run), expected)


def test_read_summaries_rebuilds_what_is_stale_and_only_if_nobody_writes(
    run: RunDirectory, add: Add, reads: list[int], tmp_path: Path
) -> None:
    add(0)
    with RunDirectory(tmp_path, CONDITION).lock():
        assert len(read_summaries(run)) == 1
        assert not run.summary_path.exists()
    reads.clear()
    read_summaries(run)
    add(1)
    assert list(read_summaries([run, run])["replicate"]) == [0, 1]
    run.log_path(0).unlink()
    assert list(read_summaries(run)["replicate"]) == [1]
    assert reads == [0, 1]
    other = RunDirectory(tmp_path, "f" * 64)
    other.create(b"other", {})
    other.summary_path.write_bytes(run.summary_path.read_bytes())
    assert len(read_summaries(other)) == 0, "the table of another run is not taken"


def test_no_replicates(run: RunDirectory, tmp_path: Path) -> None:
    absent = RunDirectory(tmp_path, "0" * 64)
    nothing: list[RunDirectory] = []
    for runs in (nothing, run, absent):
        for read in (read_summaries, read_generations):
            assert len(read(runs)) == 0 and "best_cost" in read(runs)
    assert not absent.path.exists()


def test_damaged_logs_have_no_row_and_are_named(run: RunDirectory, add: Add) -> None:
    add(0)
    os.link(run.log_path(0), run.log_path(1))
    assert write_summary(run)["replicate"].to_pylist() == [0]
    run.log_path(2).write_bytes(b"")
    with pytest.warns(DamagedStore, match=r"0001.mcap \(holds replicate 0 of .*0002.mcap \(empty"):
        assert read_summaries(run)["replicate"].tolist() == [0]
    assert read_generations(run)["replicate"].unique().tolist() == [0]


def test_read_generations(run: RunDirectory, add: Add, reads: list[int]) -> None:
    for replicate in (1, 0):
        add(replicate)
    other = [g._replace(terms={"other": float(g.index)}) for g in generations(4, seed=2)]
    run.write_logs({2: write(other, 2).content})
    frame = read_generations([run])
    assert frame.columns[:3].tolist() == ["condition", "replicate", "index"]
    terms = [f"term_{name}" for name in ("clearance", "length", "other", "torque")]
    assert frame.columns[-4:].tolist() == terms
    assert frame["replicate"].tolist() == [0] * 6 + [1] * 6 + [2] * 4
    assert frame["condition"].astype(str).unique().tolist() == [CONDITION]
    expected = [g.best_cost for k in (0, 1) for g in generations(6, seed=k)]
    assert frame["best_cost"].tolist()[:12] == expected
    assert frame["term_other"].tolist()[12:] == [0.0, 1.0, 2.0, 3.0]
    assert frame["term_other"][:12].isna().all()
    assert frame["solved"].tolist()[:6] == [False] * 3 + [True] * 3
    kinds = {"solved": np.bool_, "evaluations": np.int64, "mean_cost": np.float64}
    assert all(frame.dtypes[name] == kind for name, kind in kinds.items())
    reads.clear()
    assert read_generations(run, [2, 1, 9])["replicate"].unique().tolist() == [1, 2]
    assert reads == [1, 2], "only those asked for"


def test_reading_generations_takes_the_memory_of_their_table(run: RunDirectory) -> None:
    """Logs are looked at one by one, and no column is there twice."""
    rows_of_all = generations(60)
    for replicate in range(200):
        run.log_path(replicate).write_bytes(write(rows_of_all, replicate).content)
    read_generations(run, [0])
    tracemalloc.start()
    frame = read_generations(run)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    table = int(frame.memory_usage(index=False).sum())
    assert len(frame) == 200 * 60 and table > 1_000_000
    assert peak < 1.5 * table + 500_000, "besides it one column, one log, an object per array"
