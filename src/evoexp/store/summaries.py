"""`summary.parquet`: one row per replicate, derived from the logs and always rebuildable.

It notes size and time of every log behind it, and which ones are damaged and have no row. Data
frames of summaries and generations are read from such tables and from the logs.
"""

import contextlib
import errno
import json
import os
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from evoexp.errors import Busy, CorruptLog, StoreError
from evoexp.records import GenerationRow, ReplicateSummary, flatten
from evoexp.store.files import first_of, listed, reason, set_aside, warn, write_file
from evoexp.store.identity import ORIGIN, run_context
from evoexp.store.log import field_types
from evoexp.store.log_reader import DTYPES, check_sums, generation_columns, read_summary
from evoexp.store.run_directory import RunDirectory

if TYPE_CHECKING:
    import pandas as pd

Runs = RunDirectory | Iterable[RunDirectory]
Stamps = dict[str, list[int]]  # file name → size [B], modification time [ns]


class _Summary(NamedTuple):
    """The table of a run, and what it notes of the files behind it."""

    table: pa.Table  # one row per file that can be used, and per failure
    files: Stamps  # stamps of all files, in the order of the replicates
    # name → what is wrong with it; a damaged log has no row, a damaged failure has one
    damaged: dict[str, str]
    settings: pa.Table | None = None  # the columns of `run_context`, if read from a file

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
    run: RunDirectory, written: Mapping[int, ReplicateSummary] | None = None
) -> pa.Table:
    """Bring `summary.parquet` up to date with the logs and failures of a run, whose lock is held.

    Summaries of logs that were just written are given by replicate, and not read again. Each
    replicate has a row, in order; a failed one has condition, replicate, status and stop_reason,
    everything else is null. A damaged log has no row.
    """
    known = {run.log_path(k).name: summary for k, summary in (written or {}).items()}
    summary = _up_to_date(run, known)
    if summary.settings is None:
        _write(run, summary)
    return summary.table


def _write(run: RunDirectory, summary: _Summary) -> None:
    table, sink = summary.table, pa.BufferOutputStream()
    for name, value in run_context(run.path, run.condition_id, table.column_names).items():
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        constant = pa.repeat(float(value) if is_number else value, table.num_rows)
        table = table.append_column(name, constant)
    pq.write_table(table, sink, compression="snappy", write_page_checksum=True)
    if run.summary_path.is_dir():
        set_aside(run.summary_path)
    write_file(run.summary_path, sink.getvalue().to_pybytes())


def summary_table(runs: Runs, *, thorough: bool = False) -> pa.Table:
    """Return the summaries of one or several runs, one row per replicate.

    A missing, damaged or stale `summary.parquet` is rebuilt, and written where nobody else holds
    the run. Damaged logs have no row, which is said in a line per run.

    Columns are those of `ReplicateSummary`, its terms `term_<name>` in alphabetical order.
    `thorough` compares the checksums of all logs, not only of changed ones.
    """
    tables = [pa.schema(BASE).empty_table()]
    tables += [_current(run, thorough, tell=True).table for run in distinct(runs)]
    table = pa.concat_tables(tables, promote_options="default")
    names = [field.name for field in BASE]
    names += sorted(set(table.column_names) - set(names))
    return table.select(names).replace_schema_metadata(None)


def damaged_logs(run: RunDirectory) -> dict[str, str]:
    """Return name → what is wrong with it, of the damaged logs and failures of a run."""
    return _current(run).damaged


def whole_logs(run: RunDirectory, *, thorough: bool = False) -> set[int]:
    """Return the replicates whose log is there and whole."""
    names = _current(run, thorough).row_names
    return {replicate_of(name) for name in names if _is_log(name)}


def table_damage(run: RunDirectory) -> str:
    """Return the damage of `summary.parquet` in words; empty if it is whole or only outdated."""
    return _stored(run)[1] if os.path.lexists(run.summary_path) else ""


def altered(run: RunDirectory, summaries: Mapping[str, ReplicateSummary]) -> str:
    """Return how `summary.parquet` contradicts logs or settings of a run; empty: it does not.

    Rows of logs that changed since the table was written are not looked at, nor is the origin,
    which may have changed since. The summaries are the logs' own, by the names of their files.
    """
    (stored, _), stamps = _stored(run), _stamps(run)
    if stored is None or stored.settings is None:
        return ""
    rows = dict(zip(stored.row_names, stored.table.to_pylist(), strict=True))
    others = [
        name
        for name, summary in summaries.items()
        if name in rows
        and stored.files[name] == stamps.get(name)
        and _as_text(rows[name]) != _as_text(flatten(summary))
    ]
    if others:
        return f"altered: it does not repeat {', '.join(first_of(others, 1))}"
    try:
        run.check()
    except StoreError:  # whose settings nothing tells
        return ""
    columns = stored.settings.to_pydict()
    for name, value in run_context(run.path, run.condition_id, stored.table.column_names).items():
        if name in columns and name not in ORIGIN and set(columns[name]) - {value}:
            return f"altered: {name} is not the setting"
    return ""


def _as_text(row: Mapping[str, Any]) -> str:
    """Return a row as text, so that NaN is equal to itself; without what it does not have."""
    return repr(sorted((name, value) for name, value in row.items() if value is not None))


def replicate_of(name: str) -> int:
    """Return the replicate of a log or a failure by the name of its file."""
    return int(name.split(".")[0])


def distinct(runs: Runs) -> list[RunDirectory]:
    """Return the runs in order, each once."""
    several = [runs] if isinstance(runs, RunDirectory) else runs
    return list({run.path: run for run in several}.values())


def _current(run: RunDirectory, thorough: bool = False, tell: bool = False) -> _Summary:
    """Return the table of a run as its files are, written if it is new and nobody holds the run."""
    summary = _up_to_date(run, {}, thorough)
    if summary.settings is None and summary.files:
        # another process writes the run, or it may only be read: the rows are the same
        with contextlib.suppress(Busy, OSError), run.lock():
            _write(run, summary)
    if tell and summary.damaged:
        names = listed(summary.damaged)
        warn(f"run {run.hash12}: left out, damaged: {names}; run again by: {run.command}")
    return summary


def _up_to_date(
    run: RunDirectory, written: Mapping[str, ReplicateSummary], thorough: bool = False
) -> _Summary:
    """Return the table of a run as its files are: the stored one, or a new one without settings.

    Damaged files are looked at again, with `thorough` the checksums of unchanged logs, too.
    """
    (stored, _), stamps = _stored(run), _stamps(run)
    unchanged = set[str]()
    if stored is not None:
        unchanged = {
            name
            for name, stamp in stored.files.items()
            if stamps.get(name) == stamp
            and name not in stored.damaged
            and not (thorough and _is_log(name) and not _is_intact(run.replicates / name))
        }
    rows, damaged = dict[str, dict[str, Any]](), dict[str, str]()
    for name in [name for name in stamps if name not in unchanged]:
        if name in written:
            rows[name] = flatten(written[name])
        else:
            row, why = _row(run, name)
            rows |= {name: row} if row else {}
            damaged |= {name: why} if why else {}
    if stored is not None and (stored.files, stored.damaged) == (stamps, damaged):
        return stored
    if stored is not None and unchanged:
        pairs = zip(stored.row_names, stored.table.to_pylist(), strict=True)
        rows |= {name: row for name, row in pairs if name in unchanged}

    # the columns of all tables, then the terms; a stored row has null for its neighbours' terms
    names = {key for row in rows.values() for key, value in row.items() if value is not None}
    terms = sorted(names - {field.name for field in BASE})
    schema = pa.schema(BASE + [pa.field(name, pa.float64()) for name in terms])
    damaged = {name: damaged[name] for name in stamps if name in damaged}
    notes = {"version": _VERSION, "condition": run.condition_id}
    notes |= {"files": stamps, "damaged": damaged, "columns": schema.names}
    table = pa.Table.from_pylist([rows[name] for name in stamps if name in rows], schema)
    table = table.replace_schema_metadata({_KEY: json.dumps(notes).encode()})
    return _Summary(table, stamps, damaged)


def _is_intact(log: Path) -> bool:
    try:
        check_sums(log.read_bytes(), log.name)
    except (CorruptLog, OSError):
        return False
    return True


def _is_log(name: str) -> bool:
    return name.endswith(".mcap")


def _stamps(run: RunDirectory) -> Stamps:
    """Return size and time of the files behind the table, in the order of the replicates."""
    statuses: dict[str, os.stat_result] = {}
    nothing = contextlib.suppress(FileNotFoundError, NotADirectoryError)
    with nothing, os.scandir(run.replicates) as entries:
        for entry in filter(lambda entry: run.is_own(entry.name), entries):
            # what is gone was a failure that another process has just replaced by a log
            with contextlib.suppress(FileNotFoundError):
                try:
                    statuses[entry.name] = entry.stat()
                except OSError:  # of a link that leads nowhere
                    statuses[entry.name] = entry.stat(follow_symlinks=False)
    done = {replicate_of(name) for name in statuses if _is_log(name)}
    names = [name for name in statuses if _is_log(name) or replicate_of(name) not in done]
    return {
        name: [statuses[name].st_size, statuses[name].st_mtime_ns]
        for name in sorted(names, key=replicate_of)
    }


def _stored(run: RunDirectory) -> tuple[_Summary | None, str]:
    """Return the table as it was written, None if of another version, and what is wrong with it."""
    path = run.summary_path
    try:
        if not path.is_file():  # a pipe would keep its reader for ever
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            whole = file.read(use_threads=False)  # starting them takes longer than most tables
        notes = json.loads(whole.schema.metadata[_KEY])
        if notes["condition"] != run.condition_id:
            theirs = str(notes["condition"])[:12]
            return None, f"is of run {theirs}, which does not belong here"
        if notes["version"] != _VERSION:
            return None, ""
        table, settings = whole.select(notes["columns"]), whole.drop_columns(notes["columns"])
        summary = _Summary(table, notes["files"], notes["damaged"], settings)
        is_valid = all(table.schema.field(field.name).equals(field) for field in BASE)
        if is_valid and len(summary.row_names) == table.num_rows:
            return summary, ""
        return None, "damaged: its columns are others"
    except (pa.ArrowException, OSError, ValueError, LookupError, TypeError, AttributeError):
        return None, "damaged: it is derived from the logs and cannot be read"


def _row(run: RunDirectory, name: str) -> tuple[dict[str, Any], str]:
    """Return the row of a file, empty for a damaged log, and what is wrong with the file."""
    replicate, path, why = replicate_of(name), run.replicates / name, ""
    if _is_log(name):
        try:
            return flatten(read_summary(path, (run.condition_id, replicate))), ""
        except CorruptLog as error:
            return {}, reason(path, error)
    try:
        text = run.failure(replicate)["reason"]
    except StoreError as error:
        why = reason(path, error)
        text = f"unknown: {name}: {why}"
    row = {"condition": run.condition_id, "replicate": replicate, "status": "failed"}
    return row | {"stop_reason": text}, why


def read_summaries(runs: Runs, *, thorough: bool = False) -> "pd.DataFrame":
    """Return the summaries of one or several runs, one row per replicate; see `summary_table`.

    Numbers and booleans are Arrow's (`double[pyarrow]`, …), in which ±inf, NaN and missing stay
    three things; text is pandas' own.
    """
    import pandas as pd  # takes long to load

    frame: pd.DataFrame = summary_table(runs, thorough=thorough).to_pandas(
        types_mapper=lambda kind: None if pa.types.is_string(kind) else pd.ArrowDtype(kind)
    )
    return frame


def read_generations(runs: Runs, replicates: Collection[int] | None = None) -> "pd.DataFrame":
    """Return the generations of completed replicates of one or several runs.

    Damaged logs are left out; `read_summaries` says so.

    Returns:
        Columns condition (categorical), replicate, those of `GenerationRow` without its chain, and
        `term_<name>` in alphabetical order, NaN where a generation lacks the term.
    """
    import pandas as pd

    directories = distinct(runs)
    codes, indices, parts = list[int](), list[int](), list[dict[str, NDArray[Any]]]()
    for code, run in enumerate(directories):
        done = whole_logs(run)
        for replicate in sorted(done if replicates is None else done.intersection(replicates)):
            parts.append(generation_columns(run.log_path(replicate)))
            codes.append(code)
            indices.append(replicate)
    heights = [len(part["index"]) for part in parts]
    categories = pd.Index([run.condition_id for run in directories], dtype="str")
    frame: dict[str, Any] = {
        "condition": pd.Categorical.from_codes(
            np.repeat(np.array(codes, dtype=np.int32), heights), categories
        ),
        "replicate": np.repeat(np.array(indices, dtype=np.int64), heights),
    }
    fields = field_types(GenerationRow).items()
    kinds = {name: DTYPES[kind] for name, kind in fields if name != "chain"}
    terms = {name for part in parts for name in part} - set(kinds)
    kinds |= dict.fromkeys(sorted(terms), np.float64)
    # a column leaves the parts when it is in the frame: nothing is there twice
    for name, kind in kinds.items():
        pieces = [
            part.pop(name) if name in part else np.full(height, np.nan)
            for part, height in zip(parts, heights, strict=True)
        ]
        frame[name] = np.concatenate([np.empty(0, dtype=kind), *pieces])
    return pd.DataFrame(frame, copy=False)
