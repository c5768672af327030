"""`summary.parquet`: one row per replicate, derived from the logs and always rebuildable.

It notes size and time of every log behind it, and which ones are damaged and have no row.
"""

import contextlib
import errno
import json
import os
import stat
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from evoexp.errors import Busy, CorruptLog, StoreError
from evoexp.records import ReplicateSummary, flatten
from evoexp.store.files import listed, reason, set_aside, warn, write_file
from evoexp.store.log_bounds import check_sums
from evoexp.store.log_reader import checked_summary
from evoexp.store.messages import field_types
from evoexp.store.run_context import ORIGIN, run_context, with_context
from evoexp.store.run_directory import RunDirectory

Runs = RunDirectory | Iterable[RunDirectory]
Stamps = dict[str, list[int]]  # file name → size [B], modification time [ns]


class _Summary(NamedTuple):
    """The table of a run, and what it notes of the files behind it."""

    table: pa.Table  # one row per file that can be used, and per failure
    files: Stamps  # stamps of all files, in the order of the replicates
    # name → what is wrong with it; a damaged log has no row, a damaged failure has one
    damaged: dict[str, str]
    settings: pa.Table | None = None  # the columns that `with_context` added, if read from a file

    @property
    def row_names(self) -> list[str]:
        """The file behind each row."""
        return [name for name in self.files if not (name in self.damaged and _is_log(name))]


_VERSION = 7  # of the table's columns and notes; another one is rebuilt
_KEY = b"evoexp"
_PLAIN = {str: pa.string(), int: pa.int64(), float: pa.float64(), bool: pa.bool_()}
_ARROW: dict[Any, pa.DataType] = _PLAIN | {kind | None: arrow for kind, arrow in _PLAIN.items()}
# the columns of all tables; those of the terms follow
BASE = [pa.field(name, _ARROW[kind]) for name, kind in field_types(ReplicateSummary).items()]


def write_summary(
    run: RunDirectory,
    written: Mapping[int, ReplicateSummary] | None = None,
    *,
    thorough: bool = False,
) -> pa.Table:
    """Bring `summary.parquet` up to date with the logs and failures of a run.

    The caller must hold the run's lock.

    Rows of files that did not change since the table was written are taken from it.

    Args:
        written: Summaries of logs that the caller has just written, by replicate: those are not
            read again.

    Returns:
        One row per replicate, done or failed, in order; a failed one has condition, replicate,
        status and stop_reason, everything else is null. A damaged log has no row.
    """
    known = {run.log_path(replicate).name: each for replicate, each in (written or {}).items()}
    return _written(run, known, thorough).table


def _written(
    run: RunDirectory, written: Mapping[str, ReplicateSummary], thorough: bool
) -> _Summary:
    """Bring `summary.parquet` up to date, see `write_summary`; return what it then holds."""
    stored, stamps = _stored(run), _stamps(run)
    if stored is not None and _is_current(run, stored, stamps, thorough):
        return stored
    summary = _build(run, stored, stamps, written, thorough)
    sink = pa.BufferOutputStream()
    context = run_context(run.path, run.condition_id, summary.table.column_names)
    table = with_context(summary.table, context)
    pq.write_table(table, sink, compression="snappy", write_page_checksum=True)
    if run.summary_path.is_dir():
        set_aside(run.summary_path)
    write_file(run.summary_path, sink.getvalue().to_pybytes())
    return summary


def summary_table(runs: Runs, *, thorough: bool = False) -> pa.Table:
    """Return the summaries of one or several runs, one row per replicate.

    A missing, damaged or stale `summary.parquet` is rebuilt, and written where nobody else holds
    the run. Damaged logs have no row, which is said in a line per run.

    Args:
        runs: One or several.
        thorough: Whether the checksums of all logs are looked at, not only of those whose size or
            time changed: for who reads the logs anyway.

    Returns:
        Columns as `ReplicateSummary`, `terms` as `term_<name>` in alphabetical order.
    """
    directories = distinct(runs)
    summaries = [_current(run, thorough) for run in directories]
    for run, summary in zip(directories, summaries, strict=True):
        _tell_damage(run, summary)
    tables = [pa.schema(BASE).empty_table(), *(summary.table for summary in summaries)]
    table = pa.concat_tables(tables, promote_options="default")
    names = [field.name for field in BASE]
    return table.select(
        names + sorted(set(table.column_names) - set(names))
    ).replace_schema_metadata(None)


def summary_rows(
    run: RunDirectory, names: Sequence[str]
) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """Return some columns of `summary_table` of one run, row by row, and its `damaged_logs`."""
    summary = _current(run)
    _tell_damage(run, summary)
    return summary.table.select(list(names)).to_pylist(), summary.damaged


def _tell_damage(run: RunDirectory, summary: _Summary) -> None:
    if summary.damaged:
        warn(
            f"run {run.hash12}: left out, damaged: {listed(summary.damaged)}; run again by: "
            f"{run.command}"
        )


def damaged_logs(run: RunDirectory) -> dict[str, str]:
    """Return name → what is wrong with it, of the damaged logs and failures of a run.

    Only those are read whose size or time is not the one that `summary.parquet` notes.
    """
    return _current(run).damaged


def whole_logs(run: RunDirectory, *, thorough: bool = False) -> set[int]:
    """Return the replicates whose log is there and whole."""
    names = _current(run, thorough).row_names
    return {replicate_of(name) for name in names if _is_log(name)}


def table_damage(run: RunDirectory) -> str:
    """Return the damage of `summary.parquet` in words; empty if it is whole or only outdated."""
    path = run.summary_path
    if not os.path.lexists(path) or _stored(run) is not None:
        return ""
    try:
        _refuse_no_file(path)
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            notes = json.loads(file.read().schema.metadata[_KEY])
        if notes["condition"] != run.condition_id:
            return f"is of run {str(notes['condition'])[:12]}, which does not belong here"
        return "" if notes["version"] != _VERSION else "damaged: its columns are others"
    except (pa.ArrowException, OSError, ValueError, LookupError, TypeError, AttributeError):
        return "damaged: it is derived from the logs and cannot be read"


def altered(run: RunDirectory, summaries: Mapping[str, ReplicateSummary]) -> str:
    """Return how `summary.parquet` contradicts logs or settings of a run; empty: it does not.

    Rows of logs that changed since the table was written are not looked at, nor is what the
    manifest says of the origin, which may have changed since.

    Args:
        summaries: The logs' own, by the names of their files.
    """
    stored, stamps = _stored(run), _stamps(run)
    if stored is None or stored.settings is None:  # damaged, or of another version
        return ""
    rows = dict(zip(stored.row_names, stored.table.to_pylist(), strict=True))
    names = [
        name
        for name, summary in summaries.items()
        if name in rows
        and stored.files[name] == stamps.get(name)
        and _given(rows[name]) != _given(flatten(summary))
    ]
    if names:
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        return f"altered: it does not repeat {names[0]}{more}"
    try:
        run.check()
    except StoreError:  # whose settings nothing tells
        return ""
    columns = stored.settings.to_pydict()
    for name, value in run_context(run.path, run.condition_id, stored.table.column_names).items():
        if name in columns and name not in ORIGIN and set(columns[name]) - {value}:
            return f"altered: {name} is not the setting"
    return ""


def _given(row: Mapping[str, Any]) -> str:
    """Return a row as text, so that NaN is equal to itself; without what it does not have."""
    return repr(sorted((name, value) for name, value in row.items() if value is not None))


def replicate_of(name: str) -> int:
    """Return the replicate of a log or a failure by the name of its file."""
    return int(name.split(".")[0])


def distinct(runs: Runs) -> list[RunDirectory]:
    """Return the runs in order, each once."""
    given = [runs] if isinstance(runs, RunDirectory) else runs
    return list({run.path: run for run in given}.values())


def _current(run: RunDirectory, thorough: bool = False) -> _Summary:
    stored, stamps = _stored(run), _stamps(run)
    if not stamps:
        return _table_of(run, {}, {}, {})
    if stored is not None and _is_current(run, stored, stamps, thorough):
        return stored
    try:
        with run.lock():
            return _written(run, {}, thorough)
    except (Busy, OSError):
        # another process writes the run, or it may only be read: the rows are the same
        return _build(run, stored, stamps, {}, thorough)


def _is_current(run: RunDirectory, stored: _Summary, stamps: Stamps, thorough: bool) -> bool:
    """Return whether the files are as a table notes them; damaged ones are looked at again."""
    if stored.files != stamps:
        return False
    again = {name: why for name in stored.damaged if (why := _row(run, name)[1])}
    return again == stored.damaged and (not thorough or all(_intact(run, stored).values()))


def _intact(run: RunDirectory, stored: _Summary) -> dict[str, bool]:
    """Return name → whether its checksums are right, of the logs behind the rows of a table."""
    folder, found = str(run.replicates), {}
    for name in filter(_is_log, stored.row_names):
        try:
            with open(f"{folder}/{name}", "rb") as file:
                check_sums(file.read(), name)
            found[name] = True
        except (CorruptLog, OSError):
            found[name] = False
    return found


def _is_log(name: str) -> bool:
    return name.endswith(".mcap")


def _stamps(run: RunDirectory) -> Stamps:
    """Return size and time of the files behind the table, in the order of the replicates."""
    found: dict[str, os.stat_result] = {}
    nothing = contextlib.suppress(FileNotFoundError, NotADirectoryError)
    with nothing, os.scandir(run.replicates) as entries:
        for entry in entries:
            if run.is_own(entry.name):
                # what is gone was a failure that another process has just replaced by a log
                with contextlib.suppress(FileNotFoundError):
                    found[entry.name] = _status(entry)
    done = {replicate_of(name) for name in found if _is_log(name)}
    names = [name for name in found if _is_log(name) or replicate_of(name) not in done]
    return {
        name: [found[name].st_size, found[name].st_mtime_ns]
        for name in sorted(names, key=replicate_of)
    }


def _status(entry: os.DirEntry[str]) -> os.stat_result:
    try:
        return entry.stat()
    except OSError:
        return entry.stat(follow_symlinks=False)  # of a link that leads nowhere


def _stored(run: RunDirectory) -> _Summary | None:
    """Return the table as it was written, or None where there is no valid one of this version."""
    try:
        _refuse_no_file(run.summary_path)
        with pq.ParquetFile(run.summary_path, page_checksum_verification=True) as file:
            whole = file.read(use_threads=False)  # starting them takes longer than most tables
        notes = json.loads(whole.schema.metadata[_KEY])
        table, settings = whole.select(notes["columns"]), whole.drop_columns(notes["columns"])
        valid = notes["version"] == _VERSION and notes["condition"] == run.condition_id
        valid = valid and all(table.schema.field(field.name).equals(field) for field in BASE)
        summary = _Summary(table, notes["files"], notes["damaged"], settings)
        valid = valid and len(summary.row_names) == table.num_rows
    except (pa.ArrowException, OSError, ValueError, LookupError, TypeError, AttributeError):
        return None
    return summary if valid else None


def _refuse_no_file(path: Path) -> None:
    """Raise an OSError unless a path is a regular file: a pipe would keep its reader for ever."""
    if not stat.S_ISREG(path.stat().st_mode):
        raise OSError(errno.EINVAL, "not a regular file", str(path))


def _build(
    run: RunDirectory,
    stored: _Summary | None,
    stamps: Stamps,
    written: Mapping[str, ReplicateSummary],
    thorough: bool,
) -> _Summary:
    """Build the table of a run; rows of files that did not change are taken from the stored one."""
    kept: dict[str, dict[str, Any]] = {}
    if stored is not None:
        intact = _intact(run, stored) if thorough else {}
        kept = {
            name: row
            for name, row in zip(stored.row_names, stored.table.to_pylist(), strict=True)
            if stamps.get(name) == stored.files[name]
            and name not in stored.damaged
            and intact.get(name, True)
        }
    rows, damaged = dict[str, dict[str, Any]](), dict[str, str]()
    for name in stamps:
        if name in written:
            rows[name] = flatten(written[name])
        elif name in kept:
            rows[name] = kept[name]
        else:
            row, why = _row(run, name)
            if row:
                rows[name] = row
            if why:
                damaged[name] = why
    return _table_of(run, rows, stamps, damaged)


def _table_of(
    run: RunDirectory, rows: Mapping[str, dict[str, Any]], stamps: Stamps, damaged: dict[str, str]
) -> _Summary:
    """Return rows as a table with its notes: version, columns, the files that it follows from."""
    known = {field.name for field in BASE}
    # a stored row has null for the terms that only its neighbours have
    terms = {
        key for row in rows.values() for key, value in row.items() if value is not None
    } - known
    schema = pa.schema(BASE + [pa.field(name, pa.float64()) for name in sorted(terms)])
    notes = {"version": _VERSION, "condition": run.condition_id}
    notes |= {"files": stamps, "damaged": damaged, "columns": schema.names}
    table = pa.Table.from_pylist(list(rows.values()), schema)
    table = table.replace_schema_metadata({_KEY: json.dumps(notes).encode()})
    return _Summary(table, stamps, damaged)


def _row(run: RunDirectory, name: str) -> tuple[dict[str, Any], str]:
    """Return the row of a file, empty for a damaged log, and what is wrong with the file."""
    replicate, path, why = replicate_of(name), run.replicates / name, ""
    if _is_log(name):
        try:
            return flatten(checked_summary(path, run.condition_id, replicate)), ""
        except CorruptLog as error:
            return {}, reason(path, error)
    try:
        text = run.failure(replicate)["reason"]
    except StoreError as error:
        why = reason(path, error)
        text = f"unknown: {name}: {why}"
    row = {"condition": run.condition_id, "replicate": replicate, "status": "failed"}
    return row | {"stop_reason": text}, why
