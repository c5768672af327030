"""Logs read back: whole and verified, or only the requested part.

A log may come from anybody, and right checksums do not make it safe: every reader first checks all
bytes, before mcap's reader sees them. Whatever sizes a file claims, reading takes memory in
proportion to `MAX_LOG` and `MAX_MESSAGE`. Only `read_log` also decodes every message and compares
the content digest.
"""

import errno
import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from os import PathLike
from pathlib import Path
from sys import intern
from typing import Any, NamedTuple, TypeVar

import numpy as np
import orjson
import xxhash
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Attachment, Metadata
from mcap.writer import MCAP0_MAGIC as MAGIC
from numpy.typing import NDArray

from evoexp.errors import CorruptLog, EvoexpError, OtherVersion
from evoexp.input_files import MEGABYTE, read_bounded, read_npy
from evoexp.records import FloatArray, FrontRow, GenerationRow, ReplicateSummary, SolutionRow
from evoexp.store import log as written
from evoexp.store.log import MAX_LOG, NONFINITE, TERM, field_types, message_bytes

# One solution or front: 300,000 numbers. The largest of a shipped experiment takes 60 kB.
MAX_MESSAGE = 8 * MEGABYTE
MAX_CHUNK = MAX_MESSAGE + 64 * 1024  # a chunk ends with the message that passes 56 KiB
MAX_METADATA = MEGABYTE  # [B] of a record of metadata
MAX_SUMMARY = 8 * MEGABYTE  # [B] of the summary section
MAX_ATTACHMENTS = 1000  # records of metadata included
_HEAD = struct.Struct("<BQ")  # opcode, length
_CHUNK = struct.Struct("<16xQ4xI4sQ")  # size, bytes of the compression's name, name, bytes of data
_FOOTER = struct.Struct("<BQQQI")  # opcode, length, summary start, summary offset start, CRC
_DATA_END = struct.Struct("<BQI")  # opcode, length, CRC
_TAIL = _FOOTER.size + len(MAGIC)
Source = str | PathLike[str] | bytes
Place = tuple[str, int]  # condition and replicate
Row = TypeVar("Row", GenerationRow, SolutionRow, FrontRow, ReplicateSummary)
_NUMBER = (int, float)
# what JSON may hold for a field of each type; true and false are ints to Python only
_TAKEN: dict[Any, Any] = {int: _NUMBER, float: _NUMBER, bool: bool, str: str, FloatArray: list}
_TAKEN |= {kind | None: (*_NUMBER, type(None)) for kind in _NUMBER} | {bool | None: bool | None}
_TRUTHS = (bool, bool | None)
DTYPES: dict[Any, Any] = {int: np.int64, float: np.float64, bool: np.bool_}
_RECORDS: dict[str, type[Any]] = {
    written.GENERATION_TOPIC: GenerationRow,
    written.SOLUTION_TOPIC: SolutionRow,
    written.FRONT_TOPIC: FrontRow,
}


class CheckedLog(NamedTuple):
    """A log that is checked."""

    name: str
    reader: SeekingReader  # of mcap, for its messages
    records: dict[str, dict[str, str]]  # of metadata, by name
    attachments: dict[str, bytes]  # by name

    def metadata(self, record: str) -> dict[str, str]:
        """Return a record of metadata."""
        if record not in self.records:
            raise CorruptLog(f"{self.name}: incomplete: no metadata record '{record}'")
        return self.records[record]


@contextmanager
def unreadable_is_corrupt(name: str) -> Iterator[None]:
    """Turn any error of decoding damaged or foreign bytes into one line that names the log."""
    try:
        yield
    except EvoexpError:
        raise
    except Exception as error:
        raise CorruptLog(
            f"{name}: unreadable: {type(error).__name__}: {' '.join(str(error).split())}"
        ) from error


def check_sums(content: bytes, name: str) -> int:
    """Check magic, footer and both checksums; return where the summary section starts [B]."""
    if not content:
        raise CorruptLog(f"{name}: empty file")
    if len(content) > MAX_LOG:
        raise CorruptLog(f"{name}: too large: {_too_large(len(content))}")
    if content[: len(MAGIC)] != MAGIC[: len(content)]:
        raise CorruptLog(f"{name}: not an MCAP file")
    smallest = len(MAGIC) + _DATA_END.size + _TAIL
    if len(content) < smallest or content[-len(MAGIC) :] != MAGIC:
        raise CorruptLog(
            f"{name}: cut or overwritten: {len(content)} bytes that do not end as an MCAP ends"
        )
    opcode, length, summary_start, _, summary_crc = _FOOTER.unpack_from(
        content, len(content) - _TAIL
    )
    if (opcode, length, summary_start) == (Opcode.FOOTER, 20, 0):
        raise CorruptLog(f"{name}: not a log of evoexp: an MCAP of another program")
    data_end = summary_start - _DATA_END.size
    if (opcode, length) != (Opcode.FOOTER, 20) or not len(MAGIC) <= data_end <= len(
        content
    ) - smallest + len(MAGIC):
        raise CorruptLog(f"{name}: altered: its footer is damaged")
    view = memoryview(content)
    opcode, length, data_crc = _DATA_END.unpack_from(content, data_end)
    if not (data_crc and summary_crc) and (opcode, length) == (Opcode.DATA_END, 4):
        raise CorruptLog(f"{name}: not a log of evoexp: an MCAP of another program")
    if zlib.crc32(view[summary_start : -len(MAGIC) - 4]) != summary_crc:
        raise CorruptLog(f"{name}: altered: the checksum of its summary section is wrong")
    if (opcode, length) != (Opcode.DATA_END, 4) or zlib.crc32(view[:data_end]) != data_crc:
        raise CorruptLog(f"{name}: altered: the checksum of its data section is wrong")
    return int(summary_start)


def _places(content: bytes, data_end: int, log: CheckedLog) -> list[list[int]]:
    """Check the data section; return places of chunks, metadata and attachments, and keep these."""
    chunks, metadata, attachments = list[int](), list[int](), list[int]()
    size, start, view = 0, len(MAGIC), memoryview(content)
    while start < data_end:
        opcode, length = _HEAD.unpack_from(content, start)
        body, stop = start + _HEAD.size, start + _HEAD.size + length
        if stop > data_end:
            raise ValueError(f"a record ends at byte {stop}, beyond {data_end}")
        if opcode == Opcode.CHUNK:
            chunks.append(start)
            content_size, name_length, compression, num_compressed = _CHUNK.unpack_from(
                content, body
            )
            frame = view[body + _CHUNK.size : stop]
            if (name_length, compression, num_compressed) != (4, b"zstd", len(frame)):
                raise ValueError("a chunk is not compressed by zstd")
            if content_size > MAX_CHUNK:
                raise ValueError(f"a chunk of {content_size} bytes; at most {MAX_CHUNK} are read")
            if zstandard.get_frame_parameters(frame).content_size != content_size:
                raise ValueError("a chunk does not have the size that it states")
            size += content_size
            if size > MAX_LOG:
                raise ValueError(f"too large: {_too_large(size)}")
        elif opcode == Opcode.METADATA:
            if length > MAX_METADATA:
                raise ValueError(f"{length} bytes in a record of at most {MAX_METADATA}")
            metadata.append(start)
            record = Metadata.read(ReadDataStream(BytesIO(view[body:stop])))
            log.records[record.name] = record.metadata
        elif opcode == Opcode.ATTACHMENT:
            attachments.append(start)
            file = Attachment.read(ReadDataStream(BytesIO(view[body:stop])))
            log.attachments[file.name] = file.data
        elif opcode not in (Opcode.HEADER, Opcode.MESSAGE_INDEX):
            raise ValueError(f"a record of kind {opcode} among the data")
        if len(metadata) + len(attachments) > MAX_ATTACHMENTS:
            raise ValueError(f"more than {MAX_ATTACHMENTS} attachments and records of metadata")
        start = stop
    if len(log.records) + len(log.attachments) < len(metadata) + len(attachments):
        raise CorruptLog(f"{log.name}: altered: it holds records of the same name")
    return [chunks, metadata, attachments]


def _too_large(size: int) -> str:
    return f"{size / MEGABYTE:.0f} MB; logs of up to {MAX_LOG // MEGABYTE} MB are read"


class LogContents(NamedTuple):
    """Everything that a log holds."""

    condition_id: str  # 64 hex digits
    config_json: bytes  # canonical form of the condition
    replicate: int  # its index
    generations: list[GenerationRow]  # in order
    solutions: list[SolutionRow]  # every improvement, the last one is the best
    fronts: list[FrontRow]  # of generations whose front is recorded
    summary: ReplicateSummary  # of the replicate
    environment: dict[str, Any]  # versions and machine that it was run with
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
    summary_start = check_sums(content, name)
    with unreadable_is_corrupt(name):
        # the sizes of its records, and its index
        if len(content) - summary_start > MAX_SUMMARY:
            raise ValueError(f"a summary section of more than {MAX_SUMMARY} bytes")
        log = CheckedLog(name, SeekingReader(BytesIO(content), validate_crcs=True), {}, {})
        summary: Any = log.reader.get_summary()
        told = [
            [each.chunk_start_offset for each in summary.chunk_indexes],
            [each.offset for each in summary.metadata_indexes],
            [each.offset for each in summary.attachment_indexes],
        ]
        if told != _places(content, summary_start - _DATA_END.size, log):
            raise CorruptLog(f"{name}: altered: its index does not list the records that it holds")
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
    """Return everything that a log holds, verified: `read_log("0007.mcap").generations[-1]`.

    Its source is a path, or the content. CorruptLog is raised where a log is damaged, or is not
    that of the condition and replicate given as its place.
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
        generations = log.reader.iter_messages(written.GENERATION_TOPIC, log_time_order=False)
        rows = [orjson.loads(message.data) for _, _, message in generations]
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


def decode_values(metadata: Mapping[str, str]) -> dict[str, Any]:
    """Undo `encode_values`."""
    return {name: orjson.loads(text) for name, text in metadata.items()}


def decode_environment(metadata: Mapping[str, str]) -> dict[str, Any]:
    """Undo `encode_values` of an environment, whose sections are mappings."""
    environment = decode_values(metadata)
    for section in ("versions", "platform", "cpu", "components"):
        if not isinstance(environment.get(section, {}), dict):
            raise ValueError(f"{section} is {str(environment[section])[:40]!r}")
    return environment


def decode(record: type[Row], row: dict[str, Any]) -> Row:
    """Build a record from the decoded JSON of its message, or raise an error if it is none.

    Keys that are no field of the record are left out.
    """
    if NONFINITE in row:
        restore(row)
    fields: dict[str, Any] = {}
    kinds: Any = record
    for name, kind in field_types(kinds).items():
        value = row[name] if name in row else record._field_defaults[name]
        if not isinstance(value, _TAKEN[kind]) or (value is True or value is False) is not (
            kind in _TRUTHS and value is not None
        ):
            raise ValueError(f"{name} is {str(value)[:40]!r}")
        if kind is float or kind is int:
            value = kind(value)
        elif kind == FloatArray:
            value = np.array(value, dtype=np.float64)
            if value.ndim != 1:
                raise ValueError(f"{name} is no list of numbers")
        fields[name] = value
    if "terms" in record._fields:
        fields["terms"] = {
            intern(name[5:]): float(value) for name, value in row.items() if name[:5] == TERM
        }
    if record is FrontRow:  # a matrix travels flat
        fields["criteria"] = fields["criteria"].reshape(-1, row["num_criteria"])
    return record(**fields)


def restore(row: dict[str, Any]) -> None:
    """Put the non-finite numbers of a decoded row that has the flag back in place."""
    for name, flag in row[NONFINITE].items():
        if isinstance(flag, str):
            row[name] = float(flag)
        else:
            for index, element in flag.items():
                row[name][int(index)] = float(element)
