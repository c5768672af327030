"""`summary.parquet`: one row per replicate, derived from the logs and always rebuildable."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from evoexp.errors import Busy, CorruptLog
from evoexp.records import ReplicateSummary, flatten
from evoexp.store.files import write_file
from evoexp.store.log_reader import read_summary
from evoexp.store.messages import field_types
from evoexp.store.run_directory import RunDirectory

Runs = RunDirectory | Iterable[RunDirectory]
Stamps = dict[str, list[int]]  # file name → size [B], modification time [ns]

_VERSION = 3  # of the table's columns; another one is rebuilt
_KEY = b"evoexp"
# tables that this process wrote or read
_KNOWN: dict[Path, tuple[tuple[int, int, int], pa.Table]] = {}
_PLAIN: dict[Any, pa.DataType] = {
    str: pa.string(),
    int: pa.int64(),
    float: pa.float64(),
    bool: pa.bool_(),
}
_ARROW = _PLAIN | {kind | None: arrow for kind, arrow in _PLAIN.items()}
_BASE = [pa.field(name, _ARROW[kind]) for name, kind in field_types(ReplicateSummary).items()]


def write_summary(
    run: RunDirectory, written: Mapping[int, ReplicateSummary] | None = None
) -> pa.Table:
    """Bring `summary.parquet` up to date with the logs and failures of a run.

    The caller must hold the run's lock.

    Rows of files that did not change since the table was written are taken from it.

    Args:
        run: Whose.
        written: Summaries of logs that the caller has just written, by replicate: those are not
            read again.

    Returns:
        One row per replicate, done or failed, in order; a failed one has condition, replicate,
        status and stop_reason, everything else is null.

    Raises:
        CorruptLog: A log is damaged or of another replicate.
    """
    stored = _stored(run)
    stamps = _stamps(run)
    if stored is not None and _stored_stamps(stored) == stamps:
        return stored
    rows = {
        run.log_path(replicate).name: flatten(summary)
        for replicate, summary in (written or {}).items()
    }
    table = _build(run, stored, stamps, rows)
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd", write_page_checksum=True)
    write_file(run.summary_path, sink.getvalue().to_pybytes())
    _KNOWN[run.summary_path] = _stamp(run.summary_path), table
    return table


def summary_table(runs: Runs) -> pa.Table:
    """Return the summaries of one or several runs, one row per replicate.

    A missing, damaged or stale `summary.parquet` is rebuilt, and written where nobody else holds
    the run.

    Returns:
        Columns as `ReplicateSummary`, `terms` as `term_<name>` in alphabetical order.

    Raises:
        CorruptLog: A log is damaged or of another replicate.
    """
    tables = [_current(run) for run in distinct(runs)]
    table = pa.concat_tables([_table([], pa.schema(_BASE)), *tables], promote_options="default")
    names = [field.name for field in _BASE]
    return table.select(
        names + sorted(set(table.column_names) - set(names))
    ).replace_schema_metadata(None)


def distinct(runs: Runs) -> list[RunDirectory]:
    """Return the runs in order, each once."""
    given = [runs] if isinstance(runs, RunDirectory) else runs
    return list({run.path: run for run in given}.values())


def _current(run: RunDirectory) -> pa.Table:
    stored, stamps = _stored(run), _stamps(run)
    if stored is not None and _stored_stamps(stored) == stamps:
        return stored
    if not stamps:
        return _table([], pa.schema(_BASE))
    try:
        with run.lock():
            return write_summary(run)
    except (Busy, OSError):
        # another process writes the run, or it may only be read: the rows are the same
        return _build(run, stored, stamps)


def _stamps(run: RunDirectory) -> Stamps:
    """Return size and time of the files behind the table, in the order of the replicates."""
    paths = {replicate: run.log_path(replicate) for replicate in run.completed()}
    paths |= {replicate: run.failure_path(replicate) for replicate in run.failed()}
    stamps: Stamps = {}
    for _, path in sorted(paths.items()):
        try:
            status = path.stat()
        except FileNotFoundError:  # a failure that another process has just replaced by a log
            continue
        stamps[path.name] = [status.st_size, status.st_mtime_ns]
    return stamps


def _stored(run: RunDirectory) -> pa.Table | None:
    """Return the table as it was written, or None where there is no valid one of this version.

    What this process has written or read is not read again, as long as the file is the same.
    """
    try:
        stamp = _stamp(run.summary_path)
        known = _KNOWN.get(run.summary_path)
        if known is not None and known[0] == stamp:
            return known[1]
        with pq.ParquetFile(run.summary_path, page_checksum_verification=True) as file:
            table = file.read()
        notes = json.loads(table.schema.metadata[_KEY])
        valid = notes["version"] == _VERSION and notes["condition"] == run.condition_id
        valid = valid and len(notes["files"]) == table.num_rows
        valid = valid and all(table.schema.field(field.name).equals(field) for field in _BASE)
    except (pa.ArrowException, OSError, ValueError, LookupError, TypeError):
        return None
    if not valid:
        return None
    _KNOWN[run.summary_path] = stamp, table
    return table


def _stamp(path: Path) -> tuple[int, int, int]:
    """Return the identity, size and time of a file, which change when it is written again."""
    status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns


def _stored_stamps(table: pa.Table) -> Stamps:
    stamps: Stamps = json.loads(table.schema.metadata[_KEY])["files"]
    return stamps


def _build(
    run: RunDirectory,
    stored: pa.Table | None,
    stamps: Stamps,
    written: Mapping[str, dict[str, Any]] | None = None,
) -> pa.Table:
    known: dict[str, dict[str, Any]] = {}
    if stored is not None:
        old = _stored_stamps(stored)
        rows = zip(old, stored.to_pylist(), strict=True)
        known = {name: row for name, row in rows if stamps.get(name) == old[name]}
    known |= written or {}
    rows_now = [known.get(name) or _row(run, run.replicates / name) for name in stamps]
    base = {field.name for field in _BASE}
    # A stored row has null for the terms that only its neighbours have.
    used = {name for row in rows_now for name, value in row.items() if value is not None} - base
    schema = pa.schema(_BASE + [pa.field(name, pa.float64()) for name in sorted(used)])
    notes = {"version": _VERSION, "condition": run.condition_id, "files": stamps}
    return _table(rows_now, schema.with_metadata({_KEY: json.dumps(notes).encode()}))


def _table(rows: Sequence[Mapping[str, Any]], schema: pa.Schema) -> pa.Table:
    columns = [_column([row.get(field.name) for row in rows], field.type) for field in schema]
    return pa.Table.from_arrays(columns, schema=schema)


def _column(values: list[Any], kind: pa.DataType) -> pa.Array:
    """Return values, None where there is none, as a column.

    `pa.array` would load pandas, which takes a third of a second.
    """
    given = np.array([value is not None for value in values], dtype=np.bool_)
    buffers = [None if given.all() else pa.py_buffer(np.packbits(given, bitorder="little"))]
    if kind == pa.string():
        texts = [(value or "").encode() for value in values]
        ends = np.cumsum([0, *map(len, texts)], dtype=np.int32)
        buffers += [pa.py_buffer(ends), pa.py_buffer(b"".join(texts))]
    else:
        numbers = np.array(
            [0 if value is None else value for value in values], dtype=kind.to_pandas_dtype()
        )
        buffers.append(
            pa.py_buffer(np.packbits(numbers, bitorder="little") if kind == pa.bool_() else numbers)
        )
    return pa.Array.from_buffers(kind, len(values), buffers)


def _row(run: RunDirectory, path: Path) -> dict[str, Any]:
    replicate = int(path.name.split(".")[0])
    if path.suffix == ".json":
        reason = run.failure(replicate)["reason"]
        return {
            "condition": run.condition_id,
            "replicate": replicate,
            "status": "failed",
            "stop_reason": reason,
        }
    summary = read_summary(path)
    if (summary.condition, summary.replicate) != (run.condition_id, replicate):
        theirs = f"replicate {summary.replicate} of {summary.condition[:12]}"
        raise CorruptLog(f"{path}: holds {theirs}, which does not belong here")
    return flatten(summary)
