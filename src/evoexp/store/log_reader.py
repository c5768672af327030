"""Logs read back: whole and verified, or only the part that is asked for.

Every reader first checks all bytes, see `log_bounds`; only `read_log` also decodes every message
and compares the content digest.
"""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import orjson
import xxhash
from numpy.typing import NDArray

from evoexp.errors import CorruptLog, OtherVersion
from evoexp.input_files import read_bounded, read_npy
from evoexp.records import FloatArray, FrontRow, GenerationRow, ReplicateSummary, SolutionRow
from evoexp.store import log as written
from evoexp.store.digests import message_bytes
from evoexp.store.log_bounds import MAX_LOG, CheckedLog, check, unreadable_is_corrupt
from evoexp.store.messages import (
    NONFINITE,
    TERM,
    decode,
    decode_environment,
    decode_values,
    field_types,
    restore,
)

Source = str | PathLike[str] | bytes
Place = tuple[str, int]  # condition and replicate
DTYPES: dict[Any, Any] = {int: np.int64, float: np.float64, bool: np.bool_}
_RECORDS: dict[str, type[Any]] = {
    written.GENERATION_TOPIC: GenerationRow,
    written.SOLUTION_TOPIC: SolutionRow,
    written.FRONT_TOPIC: FrontRow,
}


class LogContents(NamedTuple):
    """Everything that a log holds."""

    condition_id: str  # 64 hex digits
    config_json: bytes
    replicate: int
    generations: list[GenerationRow]
    solutions: list[SolutionRow]
    fronts: list[FrontRow]
    summary: ReplicateSummary
    environment: dict[str, Any]
    attachments: dict[str, bytes]  # without the configuration
    content_digest: str  # 32 hex digits, over all messages
    # (generations,) [s] CPU time of the replicate when each was logged; NaN in logs of older code
    cpu_s: FloatArray

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the attached arrays by their names, in alphabetical order."""
        return {
            name.removesuffix(written.ARRAY): decode_array(data)
            for name, data in sorted(self.attachments.items())
            if name.endswith(written.ARRAY)
        }


@contextmanager
def _opened(source: Source) -> Iterator[CheckedLog]:
    """Check a log of a run and open it; a body that cannot be read is a damaged log."""
    name = "log" if isinstance(source, bytes) else str(source)
    try:
        content = source if isinstance(source, bytes) else read_bounded(Path(source), MAX_LOG)
    except OSError as error:
        if error.errno in (errno.EMFILE, errno.ENFILE, errno.ENOMEM):  # no fault of the file
            raise
        raise CorruptLog(f"{name}: cannot be read: {error.strerror or error}") from error
    log = check(content, name)
    with unreadable_is_corrupt(name):
        if written.RUN not in log.records:
            must = f"an MCAP without metadata record '{written.RUN}'"
            raise CorruptLog(f"{name}: not a log of evoexp: {must}")
        version = int(log.records[written.RUN]["schema_version"])
        if version != written.SCHEMA_VERSION:
            age = "a newer" if version > written.SCHEMA_VERSION else "an older"
            raise OtherVersion(
                f"{name}: written by {age} evoexp: schema version {version}, this one reads "
                f"{written.SCHEMA_VERSION}"
            )
        yield log


def _summary(log: CheckedLog, place: Place | None) -> ReplicateSummary:
    """Return the summary of a log, which must be of its own run, and of a place."""
    values, run = decode_values(log.metadata(written.SUMMARY)), log.records[written.RUN]
    summary = decode(ReplicateSummary, values)
    own = (summary.condition, summary.replicate)
    if own != (run["condition"], int(run["replicate"])):
        raise CorruptLog(f"{log.name}: altered: its summary is of another replicate")
    if place is not None and own != place:
        theirs = f"replicate {own[1]} of {own[0][:12]}"
        raise CorruptLog(f"{log.name}: holds {theirs}, which does not belong here")
    return summary


def read_log(source: Source, place: Place | None = None) -> LogContents:
    """Return everything that a log holds, verified.

    CorruptLog is raised where it is damaged, or does not belong to a place that is given.
    """
    with _opened(source) as log:
        rows: dict[str, list[Any]] = {topic: [] for topic in _RECORDS}
        digest, cpu_ns = xxhash.xxh3_128(), list[int]()
        for schema, channel, message in log.reader.iter_messages(log_time_order=False):
            name = schema.name if schema is not None else ""
            identity = (channel.topic, name, channel.message_encoding)
            whole = message_bytes(identity, message.log_time, message.sequence, message.data)
            digest.update(whole)
            if channel.topic in rows:
                row = decode(_RECORDS[channel.topic], orjson.loads(message.data))
                rows[channel.topic].append(row)
            if channel.topic == written.GENERATION_TOPIC:
                cpu_ns.append(message.publish_time)
        content_digest = digest.hexdigest()
        if content_digest != decode_values(log.metadata(written.SUMMARY))[written.CONTENT_DIGEST]:
            raise CorruptLog(
                f"{log.name}: altered: its messages do not give the content digest it carries"
            )
        run, summary = log.records[written.RUN], _summary(log, place)
        is_timed = run.get(written.PUBLISHED) == written.CPU_TIME
        return LogContents(
            condition_id=run["condition"],
            config_json=log.attachments.pop(written.CONFIG),
            replicate=summary.replicate,
            generations=rows[written.GENERATION_TOPIC],
            solutions=rows[written.SOLUTION_TOPIC],
            fronts=rows[written.FRONT_TOPIC],
            summary=summary,
            environment=decode_environment(log.metadata(written.ENVIRONMENT)),
            attachments=log.attachments,
            content_digest=content_digest,
            cpu_s=1e-9 * np.array(cpu_ns, np.float64) if is_timed else np.full(len(cpu_ns), np.nan),
        )


def read_summary(source: Source, place: Place | None = None) -> ReplicateSummary:
    """Return a log's summary, checked as `read_log` does but for the content digest."""
    with _opened(source) as log:
        return _summary(log, place)


def read_solution(source: Source) -> SolutionRow:
    """Return a log's last solution, the best of the replicate; only its chunk is decompressed."""
    with _opened(source) as log:
        for _, _, message in log.reader.iter_messages(written.SOLUTION_TOPIC, reverse=True):
            return decode(SolutionRow, orjson.loads(message.data))
        raise ValueError("no solution")


def generation_columns(source: Source) -> dict[str, NDArray[Any]]:
    """Return the records on /generation, without their chain, as arrays (generations,) by name.

    A term that a generation does not have is NaN there. The content digest is not compared.
    """
    with _opened(source) as log:
        messages = log.reader.iter_messages(written.GENERATION_TOPIC, log_time_order=False)
        rows = [orjson.loads(message.data) for _, _, message in messages]
        names = dict.fromkeys(name for row in rows for name in row if name.startswith(TERM))
        # rows that each have terms of their own: their table would be larger than any log
        if len(names) * len(rows) * 8 > MAX_LOG:
            raise ValueError(f"{len(rows)} generations with {len(names)} different terms")
        for row in rows:
            if NONFINITE in row:
                restore(row)
        fields = field_types(GenerationRow).items()
        columns = {
            name: np.array([row[name] for row in rows], dtype=DTYPES[kind])
            for name, kind in fields
            if name != "chain"
        }
        return columns | {
            name: np.array([row.get(name, np.nan) for row in rows], dtype=np.float64)
            for name in sorted(names)
        }


def decode_array(data: bytes) -> NDArray[Any]:
    """Return the array that a `.npy` attachment holds."""
    with unreadable_is_corrupt("attached array"):
        return read_npy(data)
