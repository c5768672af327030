"""Logs read back: whole and verified, or only the part that is asked for.

Every reader first checks all bytes against their checksums; only `read_log` also decodes every
message and compares the content digest. Limits of size and memory stand in `container`.
"""

import errno
import operator
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import orjson
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Metadata,
    MetadataIndex,
    Schema,
)
from numpy.typing import NDArray

from evoexp.errors import CorruptLog, OtherVersion
from evoexp.input_files import read_bounded, read_npy
from evoexp.records import FrontRow, GenerationRow, ReplicateSummary, SolutionRow
from evoexp.store import log as written
from evoexp.store.container import (
    MAX_ATTACHMENTS,
    MAX_LOG,
    MAX_MESSAGE,
    MAX_METADATA,
    Container,
    Message,
    check,
    chunk_messages,
    parse,
    too_large,
    uncompressed_size,
    unreadable_is_corrupt,
)
from evoexp.store.messages import (
    NONFINITE,
    TERM,
    decode_environment,
    decode_front,
    decode_generation,
    decode_solution,
    decode_summary,
    decode_values,
    field_types,
    restore,
)

DTYPES: dict[Any, Any] = {int: np.int64, float: np.float64, bool: np.bool_}  # of generation_columns
Source = str | PathLike[str] | bytes


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

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the attached arrays by their names, in alphabetical order.

        Raises:
            CorruptLog: If one of them is none.
        """
        return {
            name.removesuffix(written.ARRAY): decode_array(data)
            for name, data in sorted(self.attachments.items())
            if name.endswith(written.ARRAY)
        }


class _Index(NamedTuple):
    """The summary section of a log: where everything is."""

    metadata: dict[str, int]  # name → offset
    channels: dict[str, Channel]  # by topic
    schemas: dict[int, str]  # id → name
    chunks: list[ChunkIndex]
    attachments: dict[str, int]  # name → offset


def read_log(source: Source) -> LogContents:
    """Return everything that a log holds, verified.

    Args:
        source: Path of a log, or its bytes.

    Raises:
        CorruptLog: The log is empty, cut, altered, foreign, of a newer schema version, or cannot be
            opened.
    """
    container, name = _open(source)
    with unreadable_is_corrupt(name):
        index = _index(container)
        run = _run(container, index, name)
        attachments = {a.name: a.data for a in _bodies(container, Opcode.ATTACHMENT, Attachment)}
        messages, content_digest = _messages(container, index)
        metadata = _metadata(container, index, written.SUMMARY, name)
        if content_digest != decode_values(metadata)[written.CONTENT_DIGEST]:
            raise CorruptLog(
                f"{name}: altered: its messages do not give the content digest it carries"
            )
        summary = _summary(metadata, run, name)
        return LogContents(
            condition_id=run["condition"],
            config_json=attachments.pop(written.CONFIG),
            replicate=summary.replicate,
            generations=[
                decode_generation(data) for data in messages.get(written.GENERATION_TOPIC, ())
            ],
            solutions=[decode_solution(data) for data in messages.get(written.SOLUTION_TOPIC, ())],
            fronts=[decode_front(data) for data in messages.get(written.FRONT_TOPIC, ())],
            summary=summary,
            environment=decode_environment(_metadata(container, index, written.ENVIRONMENT, name)),
            attachments=attachments,
            content_digest=content_digest,
        )


def read_summary(source: Source) -> ReplicateSummary:
    """Return a log's summary; no message is decoded.

    Raises:
        CorruptLog: As `read_log`, except that the content digest is not compared.
    """
    container, name = _open(source)
    with unreadable_is_corrupt(name):
        index = _index(container)
        run = _run(container, index, name)
        return _summary(_metadata(container, index, written.SUMMARY, name), run, name)


@contextmanager
def _indexed(source: Source) -> Iterator[tuple[Container, "_Index"]]:
    """Open a log of a run by its index; a body that cannot be read is a damaged log."""
    container, name = _open(source)
    with unreadable_is_corrupt(name):
        index = _index(container)
        _run(container, index, name)
        yield container, index


def read_solution(source: Source) -> SolutionRow:
    """Return a log's last solution, the best of the replicate; only its chunk is decompressed.

    Raises:
        CorruptLog: As `read_log`, except that the content digest is not compared.
    """
    with _indexed(source) as (container, index):
        channel_id = index.channels[written.SOLUTION_TOPIC].id
        last = [chunk for chunk in index.chunks if channel_id in chunk.message_index_offsets][-1]
        solutions = [
            data for channel, _, _, data in container.messages_at(last) if channel == channel_id
        ]
        return decode_solution(solutions[-1])


def array_names(source: Source) -> list[str]:
    """Return the names of the arrays that are attached to a log, in alphabetical order.

    Raises:
        CorruptLog: As `read_log`, except that the content digest is not compared.
    """
    with _indexed(source) as (_, index):
        return sorted(
            n.removesuffix(written.ARRAY) for n in index.attachments if n.endswith(written.ARRAY)
        )


def read_array(source: Source, array: str) -> NDArray[Any]:
    """Return one of the arrays that are attached to a log; nothing else is decoded.

    Args:
        source: Path of a log, or its bytes.
        array: Its name, without `.npy`.

    Raises:
        KeyError: There is none of this name.
        CorruptLog: As `read_log`, except that the content digest is not compared.
    """
    with _indexed(source) as (container, index):
        offset = index.attachments.get(array + written.ARRAY)
        if offset is not None:
            return decode_array(parse(Attachment, container.record_at(offset)).data)
    raise KeyError(array)


def decode_array(data: bytes) -> NDArray[Any]:
    """Return the array that a `.npy` attachment holds.

    Raises:
        CorruptLog: If it is none.
    """
    with unreadable_is_corrupt("attached array"):
        return read_npy(data)


def generation_columns(source: Source) -> dict[str, NDArray[Any]]:
    """Return the records on /generation, without their chain, as arrays (generations,) by name.

    A term that a generation does not have is NaN there.

    Raises:
        CorruptLog: As `read_log`, except that the content digest is not compared.
    """
    with _indexed(source) as (container, index):
        channel_id = index.channels[written.GENERATION_TOPIC].id
        messages = (m[3] for m in _all_messages(container) if m[0] == channel_id)
        parts = [_columns(orjson.loads(text)) for text in _joined(messages)]
        return parts[0] if len(parts) == 1 else _one_below_another(parts)


def _joined(messages: Iterable[bytes]) -> Iterator[bytes]:
    """Yield messages as JSON lists of about `MAX_MESSAGE` bytes, one list at least.

    Decoded, they take many times that: never all of them together.
    """
    size, found = 0, list[bytes]()
    for data in messages:
        if size > MAX_MESSAGE:
            yield b"[" + b",".join(found) + b"]"
            size, found = 0, []
        size += len(data)
        found.append(data)
    yield b"[" + b",".join(found) + b"]"


def _one_below_another(parts: list[dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    """Return the columns of all parts, NaN where a part does not have one."""
    lengths = [len(part["index"]) for part in parts]
    own = list(_own_columns())
    names = own + sorted({name for part in parts for name in part} - set(own))
    _refuse_wide(names, sum(lengths))
    return {
        name: np.concatenate(
            [
                part[name] if name in part else np.full(length, np.nan)
                for part, length in zip(parts, lengths, strict=True)
            ]
        )
        for name in names
    }


def _own_columns() -> dict[str, Any]:
    """Return the columns that every generation has, and their kinds."""
    fields = field_types(GenerationRow).items()
    return {name: DTYPES[kind] for name, kind in fields if name != "chain"}


def _refuse_wide(names: Collection[str], num_rows: int) -> None:
    """Refuse rows that each have terms of their own: their table would be larger than any log."""
    if len(names) * num_rows * 8 > MAX_LOG:
        raise ValueError(f"{num_rows} generations with {len(names)} different terms")


def _columns(rows: list[dict[str, Any]]) -> dict[str, NDArray[Any]]:
    kinds = _own_columns()
    for row in rows:
        if NONFINITE in row:
            restore(row)
            del row[NONFINITE]
    names = rows[0].keys() if rows else set()
    if not all(row.keys() == names for row in rows):
        names = {name for row in rows for name in row}
        _refuse_wide(names, len(rows))
        absent = dict.fromkeys((name for name in names if name.startswith(TERM)), np.nan)
        rows = [absent | row for row in rows]
    kinds |= dict.fromkeys(sorted(name for name in names if name.startswith(TERM)), np.float64)
    values = (
        zip(*map(operator.itemgetter(*kinds), rows), strict=True) if rows else [()] * len(kinds)
    )
    return {
        name: np.array(column, dtype=kinds[name])
        for name, column in zip(kinds, values, strict=True)
    }


def _open(source: Source) -> tuple[Container, str]:
    if isinstance(source, bytes):
        return check(source, "log"), "log"
    try:
        return check(read_bounded(Path(source), MAX_LOG), str(source)), str(source)
    except OSError as error:
        if error.errno in (errno.EMFILE, errno.ENFILE, errno.ENOMEM):  # no fault of the file
            raise
        raise CorruptLog(f"{source}: cannot be read: {error.strerror or error}") from error


def _index(container: Container) -> _Index:
    index = _Index({}, {}, {}, [], {})
    for opcode, body in container.summary_section():
        _refuse_long(body)
        if opcode == Opcode.METADATA_INDEX:
            entry = parse(MetadataIndex, body)
            index.metadata[entry.name] = entry.offset
        elif opcode == Opcode.CHANNEL:
            channel = parse(Channel, body)
            index.channels[channel.topic] = channel
        elif opcode == Opcode.SCHEMA:
            schema = parse(Schema, body)
            index.schemas[schema.id] = schema.name
        elif opcode == Opcode.CHUNK_INDEX:
            index.chunks.append(parse(ChunkIndex, body))
        elif opcode == Opcode.ATTACHMENT_INDEX:
            attachment = parse(AttachmentIndex, body)
            index.attachments[attachment.name] = attachment.offset
    if len(index.attachments) > MAX_ATTACHMENTS:
        raise ValueError(f"{len(index.attachments)} attachments; {MAX_ATTACHMENTS} are read")
    return index


def _refuse_long(body: bytes) -> None:
    if len(body) > MAX_METADATA:
        raise ValueError(f"{len(body)} bytes in a record of at most {MAX_METADATA}")


def _metadata(container: Container, index: _Index, record: str, name: str) -> dict[str, str]:
    if record not in index.metadata:
        raise CorruptLog(f"{name}: incomplete: no metadata record '{record}'")
    body = container.record_at(index.metadata[record])
    _refuse_long(body)
    metadata: dict[str, str] = parse(Metadata, body).metadata
    return metadata


def _run(container: Container, index: _Index, name: str) -> dict[str, str]:
    """Return the metadata of a log's condition and replicate.

    A log of another program or version is refused.
    """
    if written.RUN not in index.metadata:
        raise CorruptLog(
            f"{name}: not a log of evoexp: an MCAP without metadata record '{written.RUN}'"
        )
    run = _metadata(container, index, written.RUN, name)
    version = int(run["schema_version"])
    if version != written.SCHEMA_VERSION:
        age = "a newer" if version > written.SCHEMA_VERSION else "an older"
        raise OtherVersion(
            f"{name}: written by {age} evoexp: schema version {version}, this one reads "
            f"{written.SCHEMA_VERSION}"
        )
    return run


def _summary(metadata: dict[str, str], run: dict[str, str], name: str) -> ReplicateSummary:
    summary = decode_summary(metadata)
    if (summary.condition, summary.replicate) != (run["condition"], int(run["replicate"])):
        raise CorruptLog(f"{name}: altered: its summary is of another replicate")
    return summary


def _bodies(container: Container, opcode: int, record: Any) -> Iterator[Any]:
    return (parse(record, body) for kind, body in container.data_section() if kind == opcode)


def _all_messages(container: Container) -> Iterator[Message]:
    """Yield all messages; no chunk is decompressed that would bring them above the limit."""
    size = 0
    for opcode, body in container.data_section():
        if opcode == Opcode.CHUNK:
            size += uncompressed_size(body)
            if size > MAX_LOG:
                raise ValueError(f"too large: {too_large(size)}")
            yield from chunk_messages(body)


def _messages(container: Container, index: _Index) -> tuple[dict[str, list[bytes]], str]:
    """Return the data of all messages by topic, and the content digest over them."""
    digest = written.ContentDigest()
    topics = {channel.id: topic for topic, channel in index.channels.items()}
    identities = {
        c.id: written.channel_identity(c.topic, index.schemas[c.schema_id], c.message_encoding)
        for c in index.channels.values()
    }
    messages: dict[str, list[bytes]] = {}
    for channel_id, sequence, log_time, data in _all_messages(container):
        digest.update(identities[channel_id], log_time, sequence, data)
        messages.setdefault(topics[channel_id], []).append(data)
    return messages, digest.hexdigest()
