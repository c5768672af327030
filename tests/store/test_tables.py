"""Tables: rebuilt from logs alone they are the same, and no row is read twice."""

import math
import os
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from store_samples import CONDITION, generations, write

from evoexp.errors import DamagedStore
from evoexp.records import ReplicateSummary
from evoexp.store import log_reader, summaries, tables
from evoexp.store.log import Finished
from evoexp.store.run_directory import RunDirectory
from evoexp.store.summaries import write_summary
from evoexp.store.tables import read_generations, read_summaries

Add = Callable[..., Finished]


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the logs whose summary was read since."""
    names: list[str] = []
    read = log_reader.read_summary

    def count(path: Path) -> ReplicateSummary:
        names.append(path.name)
        return read(path)

    monkeypatch.setattr(log_reader, "read_summary", count)
    return names


CONTEXT = ["planner", "seed"]  # of the sample's configuration


def rows(table: pa.Table) -> list[str]:
    return [repr(row) for row in table.to_pylist()]


def test_done_and_failed_rows(run: RunDirectory, add: Add) -> None:
    add(1, best_cost=math.nan, first_feasible_generation=4, solved=True)
    add(0, terms={"length": -math.inf})
    run.write_failure(2, "ValueError: no", "Traceback …")
    write_summary(run)
    table = pq.read_table(run.summary_path)
    assert table.column_names == [
        *(name for name in ReplicateSummary._fields if name != "terms"),
        "term_clearance",
        "term_length",
        "term_torque",
        *CONTEXT,
    ]
    first, second, failed = table.to_pylist()
    assert (first["replicate"], first["status"], first["best_cost"]) == (0, "done", math.inf)
    assert (first["term_length"], first["term_torque"], first["first_feasible_generation"]) == (
        -math.inf,
        None,
        None,
    )
    assert (
        math.isnan(second["best_cost"])
        and math.isnan(second["term_torque"])
        and second["solved"] is True
    )
    given = {name for name, value in failed.items() if value is not None}
    assert given == {"condition", "replicate", "status", "stop_reason", *CONTEXT}
    assert (failed["replicate"], failed["status"], failed["stop_reason"]) == (
        2,
        "failed",
        "ValueError: no",
    )
    kinds = {field.name: str(field.type) for field in table.schema}
    assert kinds["best_cost"] == kinds["term_torque"] == "double" and kinds["solved"] == "bool"
    assert (
        kinds["evaluations"] == kinds["first_feasible_generation"] == "int64"
        and kinds["digest"] == "string"
    )
    assert pq.ParquetFile(run.summary_path).metadata.row_group(0).column(0).compression == "SNAPPY"


def test_more_replicates_read_only_themselves(
    run: RunDirectory, add: Add, reads: list[str]
) -> None:
    for replicate in (0, 1, 2):
        add(replicate)
    run.write_failure(4, "x", "")
    write_summary(run)
    assert reads == ["0000.mcap", "0001.mcap", "0002.mcap"]
    write_summary(run)
    assert len(reads) == 3
    add(4)  # repaired
    add(3, terms={"new": 1.0})
    add(1, best_cost=5.0)  # written again
    incremental = write_summary(run)
    assert sorted(reads[3:]) == ["0001.mcap", "0003.mcap", "0004.mcap"]
    run.summary_path.unlink()
    assert rows(write_summary(run)) == rows(incremental)
    assert [row["status"] for row in incremental.to_pylist()] == ["done"] * 5


def test_what_was_just_written_is_not_read_again(
    run: RunDirectory, add: Add, reads: list[str]
) -> None:
    add(0)
    write_summary(run)
    written = {
        1: add(1, best_cost=math.nan, terms={"new": -math.inf}).summary,
        2: add(2, solved=True).summary,
    }
    table = write_summary(run, written)
    assert reads == ["0000.mcap"]
    run.summary_path.unlink()
    assert rows(write_summary(run)) == rows(table)


def test_a_table_of_old_and_new_rows_is_that_of_all(run: RunDirectory, add: Add) -> None:
    for k in (0, 2, 3, 7, 8, 11):
        add(k, terms={f"term{k % 3}": float(k)})
    run.write_failure(5, "x", "")
    write_summary(run)
    add(4, terms={"other": 1.0})  # between rows that are there
    run.write_failure(1, "y", "")
    written = {6: add(6).summary, 12: add(12, terms={"term0": 2.0}).summary}
    mixed = write_summary(run, written)
    run.summary_path.unlink()
    assert rows(write_summary(run)) == rows(mixed)
    assert [row["replicate"] for row in mixed.to_pylist()] == [*range(9), 11, 12]


def test_a_table_whose_files_are_all_others_now_is_built_anew(run: RunDirectory, add: Add) -> None:
    for k in range(3):
        add(k)
    write_summary(run)
    for k in range(3):
        add(k, best_cost=float(k))
    assert write_summary(run)["best_cost"].to_pylist() == [0.0, 1.0, 2.0]
    for k in range(3):
        run.log_path(k).unlink()
    run.write_failure(0, "x", "")
    assert write_summary(run)["status"].to_pylist() == ["failed"]


def test_a_term_that_no_row_has_any_more_is_dropped(run: RunDirectory, add: Add) -> None:
    add(0)
    add(1, terms={"old": 1.0})
    assert "term_old" in write_summary(run).column_names
    add(1)
    assert "term_old" not in write_summary(run).column_names


def test_a_table_with_other_columns_is_rebuilt(
    run: RunDirectory, add: Add, reads: list[str]
) -> None:
    add(0)
    expected = write_summary(run)
    pq.write_table(expected.drop_columns("solved"), run.summary_path)
    assert rows(write_summary(run)) == rows(expected)
    assert reads == ["0000.mcap"] * 2


def test_a_table_of_another_version_is_rebuilt(
    run: RunDirectory, add: Add, reads: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    add(0)
    with monkeypatch.context() as patch:
        patch.setattr(summaries, "_VERSION", summaries._VERSION - 1)
        expected = rows(write_summary(run))
    assert rows(write_summary(run)) == expected
    assert reads == ["0000.mcap"] * 2


@pytest.mark.parametrize("content", [b"", b"PAR1", b"rubbish" * 100])
def test_a_damaged_table_is_rebuilt(run: RunDirectory, add: Add, content: bytes) -> None:
    add(0)
    expected = rows(write_summary(run))
    run.summary_path.write_bytes(content)
    assert len(read_summaries(run)) == 1
    assert rows(pq.read_table(run.summary_path).drop_columns(CONTEXT)) == expected


def test_any_flipped_byte_of_the_table_changes_no_row(run: RunDirectory, add: Add) -> None:
    add(0)
    expected = read_summaries(run)
    content = run.summary_path.read_bytes()
    rng = np.random.default_rng(0)
    for position in rng.integers(len(content), size=60).tolist():
        damaged = bytearray(content)
        damaged[position] ^= 0x40
        run.summary_path.write_bytes(bytes(damaged))
        pd.testing.assert_frame_equal(read_summaries(run), expected)


def test_read_summaries_rebuilds_what_is_stale_or_missing(
    run: RunDirectory, add: Add, reads: list[str]
) -> None:
    add(0)
    assert list(read_summaries(run)["replicate"]) == [0]
    assert run.summary_path.exists()
    add(1)
    assert list(read_summaries([run, run])["replicate"]) == [0, 1]
    run.log_path(0).unlink()
    assert list(read_summaries(run)["replicate"]) == [1]
    assert reads == ["0000.mcap", "0001.mcap"]


def test_read_summaries_writes_nothing_where_another_writes(
    run: RunDirectory, add: Add, tmp_path: Path
) -> None:
    add(0)
    with RunDirectory(tmp_path, CONDITION).lock():
        assert len(read_summaries(run)) == 1
        assert not run.summary_path.exists()


def test_infinite_nan_and_missing_are_three_things(run: RunDirectory, add: Add) -> None:
    add(0)
    add(1, best_cost=math.nan)
    run.write_failure(2, "x", "")
    frame = read_summaries(run)
    assert frame["best_cost"].isna().tolist() == [False, False, True]
    assert frame["best_cost"][0] == math.inf and math.isnan(frame["best_cost"][1])
    assert frame["best_cost"].to_numpy().dtype == np.float64
    assert frame["solved"].tolist()[:2] == [False, False] and frame["solved"][2] is pd.NA
    assert frame["status"].tolist() == ["done", "done", "failed"]


def test_no_replicates(run: RunDirectory, tmp_path: Path) -> None:
    absent = RunDirectory(tmp_path, "0" * 64)
    nothing: list[RunDirectory] = []
    for runs in (nothing, run, absent):
        assert len(read_summaries(runs)) == 0 and "best_cost" in read_summaries(runs)
        assert len(read_generations(runs)) == 0 and "best_cost" in read_generations(runs)
    assert not absent.path.exists()


def test_damaged_logs_have_no_row_and_are_named(run: RunDirectory, add: Add) -> None:
    add(0)
    os.link(run.log_path(0), run.log_path(1))
    assert write_summary(run)["replicate"].to_pylist() == [0]
    run.log_path(2).write_bytes(b"")
    with pytest.warns(DamagedStore, match=r"0001.mcap \(holds replicate 0 of .*0002.mcap \(empty"):
        assert read_summaries(run)["replicate"].tolist() == [0]
    assert read_generations(run)["replicate"].unique().tolist() == [0]


def test_read_generations(run: RunDirectory, add: Add) -> None:
    for replicate in (1, 0):
        add(replicate)
    given = [g._replace(terms={"other": float(g.index)}) for g in generations(4, seed=2)]
    run.write_logs({2: write(given, 2).content})
    frame = read_generations([run])
    assert frame.columns[:3].tolist() == ["condition", "replicate", "index"]
    assert frame.columns[-4:].tolist() == [
        "term_clearance",
        "term_length",
        "term_other",
        "term_torque",
    ]
    assert frame["replicate"].tolist() == [0] * 6 + [1] * 6 + [2] * 4
    assert frame["condition"].astype(str).unique().tolist() == [CONDITION]
    expected: list[Any] = [g.best_cost for k in (0, 1) for g in generations(6, seed=k)]
    assert frame["best_cost"].tolist()[:12] == expected
    assert (
        frame["term_other"].tolist()[12:] == [0.0, 1.0, 2.0, 3.0]
        and frame["term_other"][:12].isna().all()
    )
    assert (
        frame["solved"].tolist()[:6] == [False] * 3 + [True] * 3
        and frame.dtypes["solved"] == np.bool_
    )
    assert frame.dtypes["evaluations"] == np.int64 and frame.dtypes["mean_cost"] == np.float64


def test_only_the_replicates_asked_for_are_read(
    run: RunDirectory, add: Add, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for replicate in range(4):
        add(replicate)
    names: list[str] = []
    read = tables.generation_columns
    monkeypatch.setattr(
        tables, "generation_columns", lambda path: names.append(path.name) or read(path)
    )  # type: ignore[func-returns-value]
    assert read_generations(run, [3, 1, 9])["replicate"].unique().tolist() == [1, 3]
    assert names == ["0001.mcap", "0003.mcap"]


def test_reading_generations_takes_the_memory_of_their_table(run: RunDirectory) -> None:
    """Logs are looked at one by one, and no column is there twice.

    Thousands need no more than their numbers.
    """
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
    assert peak < 1.5 * table + 500_000, (
        "besides the table one column, one log, and an object per array"
    )
